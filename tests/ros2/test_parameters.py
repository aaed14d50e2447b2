"""Parameters while the node runs, as `ros2 param` asks for them."""

import math

import pytest
import yaml
from rcl_interfaces.msg import Parameter, ParameterEvent, ParameterType
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter as Value
from rclpy.parameter import parameter_value_to_python
from sensor_msgs.msg import PointCloud2
from support import ROOT, URDF, Arm

SHIPPED = yaml.safe_load((ROOT / "config" / "palpate.yaml").read_text())["/**"]["ros__parameters"]


def flat(values, prefix=""):
    for name, value in values.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def parameter(name, value):
    return Value(name, value=value).to_parameter_msg()


def names(peer, **fields):
    return list(peer.call(ListParameters, "palpate/list_parameters", **fields).result.names)


def get(peer, *wanted):
    values = peer.call(GetParameters, "palpate/get_parameters", names=wanted).values
    return [parameter_value_to_python(value) for value in values]


def test_all_are_listed_with_the_defaults_of_the_shipped_file(peer, start):
    start()
    # Such files have no empty lists.
    shipped = {name: [] if value == [""] else value for name, value in flat(SHIPPED)}
    listed = names(peer)
    assert set(listed) == {*shipped, "robot_description"}
    assert dict(zip(shipped, get(peer, *shipped))) == shipped
    assert names(peer, prefixes=["filter.detector"]) == [name for name in listed if name.startswith("filter.detector.")]
    assert "seed" in names(peer, depth=1) and "viz.rate" not in names(peer, depth=1)
    assert get(peer, "no.such") == [None]


def test_they_are_described(peer, start):
    start()
    listed = names(peer)
    descriptors = peer.call(DescribeParameters, "palpate/describe_parameters", names=listed).descriptors
    assert [descriptor.name for descriptor in descriptors] == listed
    assert all(descriptor.description for descriptor in descriptors)
    types = peer.call(GetParameterTypes, "palpate/get_parameter_types", names=listed).types
    assert [descriptor.type for descriptor in descriptors] == list(types)
    by_name = {descriptor.name: descriptor for descriptor in descriptors}
    rate = by_name["viz.rate"]
    assert rate.type == ParameterType.PARAMETER_DOUBLE and not rate.read_only and "(Hz)" in rate.description
    assert (rate.floating_point_range[0].from_value, rate.floating_point_range[0].to_value) == (0.1, 1000.0)
    particles = by_name["filter.particles"]
    assert (particles.integer_range[0].from_value, particles.integer_range[0].to_value) == (100, 10_000_000)
    assert by_name["filter.method"].additional_constraints == "palpate, paper"
    assert by_name["seed"].read_only


def test_a_change_takes_effect_and_is_told(peer, start):
    start(**{"robot.description_file": URDF})
    events = peer.listen(ParameterEvent, "/parameter_events")
    wanted = [parameter("filter.located_std", 0.02), parameter("filter.paper.lambda", [2.0, 30.0]), parameter("viz.rate", 5)]
    results = peer.call(SetParameters, "palpate/set_parameters", parameters=wanted).results
    assert all(result.successful for result in results), results
    assert [list(value) if hasattr(value, "__len__") else value for value in get(peer, *(at.name for at in wanted))] == [
        0.02, [2.0, 30.0], 5.0,
    ]  # fmt: skip
    changed = lambda: [event for event in events if event.changed_parameters]
    peer.wait_until(changed, "the change to be told")
    assert changed()[0].node == "/palpate" and changed()[0].stamp.sec > 0
    assert [value.name for value in changed()[0].changed_parameters] == [at.name for at in wanted]


@pytest.mark.parametrize(
    "name, value, words",
    [
        ("viz.rate", -1.0, ["viz.rate is -1", "0.1 to 1000"]),
        ("viz.rate", math.nan, ["viz.rate is NaN"]),
        ("viz.rate", "fast", ["viz.rate", "expected f64"]),
        ("filter.particles", 5, ["filter.particles is 5", "100"]),
        ("filter.paper.stiffness_range", [9.0, 5.0], ["stiffness_range", "ascending"]),
        ("filter.particlez", 5, ["filter.particlez", "unknown"]),
        ("filter.method", "guess", ["filter.method", "guess"]),
        ("seed", 9, ["seed", "read at start only"]),
    ],
)
def test_a_wrong_change_is_refused_with_the_reason(peer, node, name, value, words):
    before = get(peer, name)
    wrong, right = parameter(name, value), parameter("filter.located_std", 0.01)
    results = peer.call(SetParameters, "palpate/set_parameters", parameters=[wrong, right]).results
    assert [result.successful for result in results] == [False, True]
    assert all(word in results[0].reason for word in words), results[0].reason
    assert get(peer, name) == before
    assert node.process.poll() is None
    together = [parameter("filter.located_std", 0.05), wrong]
    result = peer.call(SetParametersAtomically, "palpate/set_parameters_atomically", parameters=together).result
    assert not result.successful and result.reason == results[0].reason
    assert get(peer, "filter.located_std") == [0.01]


def test_a_dump_starts_a_node(peer, start, tmp_path):
    node = start(**{"robot.description_file": URDF, "seed": 7})
    listed = names(peer)
    values = [list(value) if hasattr(value, "tolist") else value for value in get(peer, *listed)]
    # An empty list has no type in such a file, and is left out.
    dumped = {name: value for name, value in zip(listed, values) if value != []}
    path = tmp_path / "dump.yaml"
    path.write_text(yaml.safe_dump({"/palpate": {"ros__parameters": dumped}}))
    assert node.end() == 0
    start("--ros-args", "--params-file", path)
    Arm(peer).wait_until_heard()
    assert get(peer, "seed", "robot.description_file") == [7, str(URDF)]


def test_pictures_come_at_the_rate_that_is_set(peer, node):
    arm = Arm(peer)
    clouds = peer.listen(PointCloud2, "palpate/particles")
    arm.wait_until_heard()
    touched = [0.0] * 3 + [5.0, 0.0, 1.0, 0.0]
    changed = peer.call(SetParameters, "palpate/set_parameters", parameters=[parameter("viz.rate", 2.0)])
    assert changed.results[0].successful
    # The first may have been waited for at the old rate.
    arm.send_until(lambda: len(clouds) >= 4, "clouds", torques=touched)
    stamps = [cloud.header.stamp.sec + 1e-9 * cloud.header.stamp.nanosec for cloud in clouds[1:]]
    assert all(later - earlier > 0.4 for earlier, later in zip(stamps, stamps[1:])), stamps
