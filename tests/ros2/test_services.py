"""Reset, tare and disable the node while it runs."""

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, Trigger
from support import LATCHED, URDF, Arm

TOUCHED = [0.0] * 3 + [5.0, 0.0, 1.0, 0.0]
OFFSET = [0.1, -0.1, 0.05, 0.1, 0.0, 0.02, 0.01]


@pytest.fixture
def quick(start):
    """A node whose tare is short."""
    values = {"robot.description_file": URDF, "filter.palpate.hypotheses": 100, "input.tare_secs": 0.5}
    return start(**values)


def call_meanwhile(arm, kind, name, torques, **fields):
    """What the service answers while the arm goes on to send."""
    answer = arm.peer.ask(kind, name, **fields)
    arm.send_until(answer.done, f"an answer from {name}", torques=torques)
    return answer.result()


def test_a_reset_forgets_the_contact(peer, quick):
    arm = Arm(peer)
    detected = peer.listen(Bool, "palpate/contact_detected", LATCHED)
    arm.wait_until_heard()
    arm.send_until(lambda: detected and detected[-1].data, "the contact", torques=TOUCHED)
    seen = len(detected)
    assert peer.call(Trigger, "palpate/reset").success
    peer.wait_until(lambda: len(detected) > seen, "the contact to be forgotten")
    assert not detected[seen].data
    arm.send_until(lambda: detected[-1].data, "the contact to be found anew", torques=TOUCHED)


def test_a_tare_takes_the_bias_out_until_it_is_cleared(peer, quick):
    arm = Arm(peer)
    residuals = peer.listen(JointState, "palpate/residual", 1000)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    answer = call_meanwhile(arm, Trigger, "palpate/tare", OFFSET)
    assert answer.success and "lbr_A1 0.100 Nm, lbr_A2 -0.100 Nm" in answer.message, answer
    largest = lambda: max(abs(torque) for torque in residuals[-1].effort)
    arm.send_until(lambda: residuals and largest() < 1e-6, "the bias to be taken out", torques=OFFSET)
    ages = lambda: [value.value for value in diagnostics[-1].status[0].values if value.key == "age of the tare, s"]
    arm.send_until(lambda: diagnostics and ages() not in ([], ["none"]), "the tare's age", torques=OFFSET)
    assert call_meanwhile(arm, Trigger, "palpate/clear_tare", OFFSET).success
    arm.send_until(lambda: ages() == ["none"], "the tare to be gone", torques=OFFSET)


def test_a_tare_is_refused_in_contact_and_ended_by_one(peer, start):
    start(**{"robot.description_file": URDF, "filter.palpate.hypotheses": 100, "input.tare_secs": 10.0})
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    # What touches since the beginning may as well be a bias.
    arm.send_until(lambda: len(diagnostics) > 1, "the node to see the arm free")
    answer = peer.ask(Trigger, "palpate/tare")
    seen = len(diagnostics)
    arm.send_until(lambda: len(diagnostics) > seen, "the tare to be under way")
    arm.send_until(answer.done, "the tare to end", torques=TOUCHED)
    assert not answer.result().success and "something touched" in answer.result().message, answer.result()
    answer = call_meanwhile(arm, Trigger, "palpate/tare", TOUCHED)
    assert not answer.success and "something touches since" in answer.message, answer


def test_a_disabled_node_says_nothing_until_it_is_enabled(peer, quick):
    arm = Arm(peer)
    detected = peer.listen(Bool, "palpate/contact_detected", LATCHED)
    poses = peer.listen(PoseWithCovarianceStamped, "palpate/contact_pose", 1000)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    arm.send_until(lambda: poses, "a pose", torques=TOUCHED)
    assert call_meanwhile(arm, SetBool, "palpate/set_enabled", TOUCHED, data=False).success
    said = lambda: diagnostics and diagnostics[-1].status[0].message
    arm.send_until(lambda: said() == "disabled", "the node to say so", torques=TOUCHED)
    assert not detected[-1].data
    poses.clear()
    used = peer.counts(diagnostics)["samples used"]
    seen = len(diagnostics)
    arm.send_until(lambda: len(diagnostics) > seen + 1, "diagnostics", torques=TOUCHED)
    assert not poses and peer.counts(diagnostics)["samples used"] == used
    answer = call_meanwhile(arm, Trigger, "palpate/tare", OFFSET)
    assert not answer.success and "disabled" in answer.message, answer
    assert call_meanwhile(arm, SetBool, "palpate/set_enabled", TOUCHED, data=True).success
    arm.send_until(lambda: poses and detected[-1].data, "poses again", torques=TOUCHED)


def test_without_a_robot_there_is_nothing_to_reset(peer, start):
    start()
    answer = peer.call(Trigger, "palpate/reset")
    assert not answer.success and "description" in answer.message, answer
