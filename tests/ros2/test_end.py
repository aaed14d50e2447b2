"""How the node ends."""

import signal

import pytest
from support import URDF, Arm


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_working_node_well(peer, node, by):
    Arm(peer).wait_until_heard()
    assert node.end(by) == 0


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_waiting_node_well(peer, start, by):
    node = start()
    peer.wait_until(lambda: "waiting" in node.log(), "the node to wait for a description")
    assert node.end(by) == 0


@pytest.mark.parametrize(
    "name, value, words",
    [
        ("filter.particlez", 5, ["filter.particlez", "unknown", "particles"]),
        ("filter.particles", 0, ["filter.particles", "0"]),
        ("viz.rate", -1.0, ["viz.rate", "-1"]),
        ("seed", "many", ["seed", "many"]),
        ("robot.description_file", "/nowhere/arm.urdf", ["robot.description_file", "/nowhere/arm.urdf"]),
        ("robot_description", "<robot", ["robot_description"]),
    ],
)
def test_a_bad_parameter_ends_it_with_a_sentence(start, name, value, words):
    node = start(**{name: value})
    assert node.wait() == 2
    said = node.log().splitlines()
    assert len(said) == 1 and all(word in said[0] for word in words), said


def test_a_missing_parameter_file_ends_it_with_a_sentence(start):
    node = start("--ros-args", "--params-file", "/nowhere/palpate.yaml", **{"robot.description_file": URDF})
    assert node.wait() == 2
    said = node.log().splitlines()
    assert len(said) == 1 and "/nowhere/palpate.yaml" in said[0], said


def test_an_unknown_key_in_a_parameter_file_ends_it_with_a_sentence(start, tmp_path):
    parameters = tmp_path / "parameters.yaml"
    parameters.write_text("/**:\n  ros__parameters:\n    filter:\n      particlez: 5\n")
    node = start("--ros-args", "--params-file", parameters, **{"robot.description_file": URDF})
    assert node.wait() == 2
    said = node.log().splitlines()
    assert len(said) == 1 and "filter.particlez" in said[0] and "unknown" in said[0], said
