"""colcon builds and installs the package, and what was installed works from there."""

import math
import subprocess
from pathlib import Path

import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped
from support import NODE, ROOT
from visualization_msgs.msg import MarkerArray

PROGRAMS = ["palpate", "palpate_node", "palpate_simulated_driver"]
# Met soon, and so slow that the node keeps up on a busy machine.
SCENARIO = "{link: lbr_link_4, rate_hz: 50, lead_in_secs: 2, duration_secs: 6, noise_floor: 0.01, refine_levels: 0}"


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """The environment after sourcing what colcon installed, from the build that there is already."""
    workspace = tmp_path_factory.mktemp("workspace")
    target = NODE.parents[1]
    command = ["colcon", "--log-base", "log", "build", "--base-paths", ROOT]
    command += ["--cmake-args", "-G", "Ninja", f"-DPALPATE_CARGO_TARGET={target}", "-DPALPATE_CARGO_PROFILE=dev"]
    built = subprocess.run(command, cwd=workspace, capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    print(built.stdout)
    listed = subprocess.run(
        ["bash", "-c", ". install/setup.bash && env -0"], cwd=workspace, capture_output=True, text=True, check=True
    )
    return dict(line.split("=", 1) for line in listed.stdout.split("\0") if line)


@pytest.fixture(scope="session")
def prefix(installed):
    """Where ROS 2 itself finds the package."""
    code = "from ament_index_python import get_package_prefix; print(get_package_prefix('palpate'))"
    asked = subprocess.run(["python3", "-c", code], env=installed, capture_output=True, text=True, check=True)
    return Path(asked.stdout.strip())


def test_all_that_belongs_to_it_is_installed(prefix):
    assert sorted(path.name for path in (prefix / "lib" / "palpate").iterdir()) == PROGRAMS
    for folder in ("config", "launch", "meshes", "urdf"):
        names = lambda path: {at.name for at in path.iterdir() if at.is_file()}
        assert names(prefix / "share" / "palpate" / folder) == names(ROOT / folder), folder


def test_the_installed_node_finds_what_the_installed_driver_touches(peer, start, installed, prefix, tmp_path):
    share, programs = prefix / "share" / "palpate", prefix / "lib" / "palpate"
    truths = peer.listen(MarkerArray, "simulated_driver/truth")
    poses = peer.listen(PoseWithCovarianceStamped, "palpate/contact_pose", 1000)
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(SCENARIO)
    node = start(
        "--ros-args", "--params-file", share / "config" / "palpate.yaml",
        program=programs / "palpate_node", environment=installed,
        **{"robot.description_file": share / "urdf" / "iiwa14.urdf", "filter.palpate.hypotheses": 100},
    )  # fmt: skip
    peer.wait_until(lambda: "triangles" in node.log(), "the node to read the robot")
    start(program=programs / "palpate_simulated_driver", environment=installed, scenario=scenario)
    true_points = {}

    def errors():
        """Distances of poses from the truth of the same sample, m."""
        for markers in truths:
            dots = [marker for marker in markers.markers if marker.ns == "true contact"]
            true_points.update({key(dot): dot.pose.position for dot in dots})
        found = {key(pose): pose.pose.pose.position for pose in poses}
        return [distance(found[stamp], true_points[stamp]) for stamp in found if stamp in true_points]

    peer.wait_until(lambda: len(errors()) > 20 and errors()[-1] < 0.03, "the contact to be located")


def test_a_wrong_scenario_ends_the_driver_with_a_sentence(start, installed, prefix, tmp_path):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text("{link: lbr_link_4, rate_hz: 2000}")
    program = prefix / "lib" / "palpate" / "palpate_simulated_driver"
    for given, words in [(scenario, ["rate_hz", "1000", "2000"]), ("/nowhere.yaml", ["scenario", "/nowhere.yaml"])]:
        driver = start(program=program, environment=installed, scenario=given)
        assert driver.wait() == 2
        said = driver.log().splitlines()
        assert len(said) == 1 and all(word in said[0] for word in words), said


def key(message):
    return message.header.stamp.sec, message.header.stamp.nanosec


def distance(a, b):
    return math.dist((a.x, a.y, a.z), (b.x, b.y, b.z))
