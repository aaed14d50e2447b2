"""Where a driver gives no external torque, the node tells it from the measured torque, if it is asked to."""

import json
import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool
from support import LATCHED, ROOT, URDF, joint_state

# What Pinocchio says that gravity needs, for the arm on the floor.
CASE = json.loads((ROOT / "crates/model/tests/dynamics/iiwa14.json").read_text())
JOINTS = CASE["joints"]
POSITION = CASE["cases"][0]["position"]
GRAVITY = CASE["cases"][0]["gravity_torque"]

ROBOT = {"robot.description_file": URDF}


def send(publisher, torque=GRAVITY, velocity=True):
    """The arm at rest, as most drivers report it."""
    state = joint_state(time.time_ns(), JOINTS)
    state.position = POSITION
    state.velocity = [0.0] * 7 if velocity else []
    state.effort = torque
    publisher.publish(state)
    time.sleep(0.005)


@pytest.mark.parametrize("source", ["static", "momentum_observer"])
def test_a_push_is_told_from_measured_torques(peer, start, source):
    node = start(**ROBOT, **{"torque.source": source, "filter.method": "paper", "filter.particles": 100})
    driver = peer.node.create_publisher(JointState, "joint_states", 10)
    detected = peer.listen(Bool, "palpate/contact_detected", LATCHED)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    peer.wait_until(driver.get_subscription_count, "the node to subscribe")

    def used():
        return int(peer.counts(diagnostics)["samples used"]) if diagnostics else 0

    def sent(torque, done):
        def step():
            send(driver, torque)
            return done()
        return step

    end = time.monotonic() + 3
    peer.wait_until(sent(GRAVITY, lambda: time.monotonic() > end), "rest")
    assert [message.data for message in detected] == [False]
    # The environment pushes joint 3 by 8 Nm, so that its motor need not.
    pushed = [torque - 8.0 * (name == "lbr_A3") for name, torque in zip(JOINTS, GRAVITY)]
    peer.wait_until(sent(pushed, lambda: detected[-1].data), "the push to be detected")
    assert used() > 0
    assert node.process.poll() is None


def test_missing_speeds_are_refused_with_the_way_out(peer, start):
    node = start(**ROBOT, **{"torque.source": "static"})
    driver = peer.node.create_publisher(JointState, "joint_states", 10)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")

    def refused():
        send(driver, velocity=False)
        return diagnostics and int(peer.counts(diagnostics)["refused, not measured"]) > 0

    peer.wait_until(refused, "messages without speeds to be counted")
    assert "torque.velocity.source" in node.log()


def test_a_robot_without_masses_is_refused_by_its_link(start, tmp_path):
    bare = tmp_path / "bare.urdf"
    head, tail = URDF.read_text().split('<link name="lbr_link_4">')
    bare.write_text(head + '<link name="lbr_link_4">' + tail.split("</inertial>", 1)[1])
    node = start(**{"robot.description_file": bare, "torque.source": "momentum_observer"})
    assert node.wait() == 2
    assert "lbr_link_4" in node.log()
