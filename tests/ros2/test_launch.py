"""What the launch files say agrees with drivers, files and the README. They are read here, not run: the wheels have no
`ros2 launch`."""

import ast

import pytest
from drivers import DRIVERS
from support import ROOT

LAUNCH = sorted((ROOT / "launch").iterdir())


def assigned(path, name):
    """What a launch file gives a name, unevaluated."""
    tree = ast.parse(path.read_text(), path)
    (value,) = [
        node.value for node in tree.body if isinstance(node, ast.Assign) and node.targets[0].id == name
    ]
    return value


def arguments(path):
    """Names of a launch file's arguments. Those without a default are declared one by one."""
    table = [ast.literal_eval(entry.elts[0]) for entry in assigned(path, "ARGUMENTS").elts]
    calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
    declared = [call.args[0] for call in calls if getattr(call.func, "id", "") == "DeclareLaunchArgument"]
    return {*table, *(name.value for name in declared if isinstance(name, ast.Constant))}


def rows(head):
    """The cells of the README's table that begins with such a cell, by the first of each row."""
    table = (ROOT / "README.md").read_text().split(f"| {head} |")[1].splitlines()[2:]
    lines = table[: [line.startswith("|") for line in table].index(False)]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return {first: others for first, *others in cells}


@pytest.fixture(scope="module")
def presets():
    """Namespace, topic of the torques and fixed frame, by preset."""
    return ast.literal_eval(assigned(ROOT / "launch" / "iiwa.launch.py", "DRIVERS"))


def test_each_driver_is_looked_for_where_it_publishes(presets):
    assert set(presets) == {driver.preset for driver in DRIVERS.values()}
    for driver in DRIVERS.values():
        if driver.source is None:
            namespace, topic, _ = presets[driver.preset]
            assert driver.torque_topic == "/".join(["", *filter(None, [namespace]), topic])
    for preset in presets:
        assert (ROOT / "config" / f"{preset}.yaml").is_file()


def test_the_readme_names_each_drivers_topic(presets):
    told = {name.split("[")[1].split("]")[0]: cells for name, cells in rows("`driver`").items()}
    assert set(told) == set(presets)
    for preset, (file, topic, _) in told.items():
        namespace, torques, _ = presets[preset]
        assert file == f"`config/{preset}.yaml`"
        assert topic.strip("`") == "/".join(["", *filter(None, [namespace]), torques])


def test_the_readme_names_each_launch_file_with_its_arguments():
    told = rows("launch file")
    assert {name.strip("`") for name in told} == {path.name for path in LAUNCH}
    for path in LAUNCH:
        named = {word.strip("`") for word in told[f"`{path.name}`"][1].replace(",", " ").replace(";", " ").split()}
        assert arguments(path) - {"params", "rviz", "rviz_config"} <= named, path.name
