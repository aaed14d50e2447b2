"""Whatever a driver sends, the node keeps running, counts what it refuses and says why."""

import itertools
import math
import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from sensor_msgs.msg import JointState
from support import JOINTS, URDF, Arm, joint_state

ZEROS = [0.0] * 7
NAN = [math.nan] * 7


def send_nan(arm):
    arm.send(positions=NAN)
    arm.send(torques=[math.inf] + [0.0] * 6)


def send_without_a_joint(arm):
    arm.send(names=JOINTS[:-1])


def send_too_few_values(arm):
    arm.send(torques=ZEROS[:-1])


def send_too_many_values(arm):
    arm.send(positions=ZEROS + [0.0])


def send_nothing(arm):
    arm.send(names=[])


def send_an_earlier_stamp(arm):
    arm.send(stamp_ns=arm.stamp_ns - 1_000)


@pytest.mark.parametrize(
    "send, counted, said",
    [
        (send_nan, "refused, not finite", "expected a finite number"),
        (send_without_a_joint, "refused, joint missing", "lbr_A7"),
        (send_too_few_values, "refused, wrong length", "expected 7 values, one a name, found 6"),
        (send_too_many_values, "refused, wrong length", "expected 7 values, one a name, found 8"),
        (send_nothing, "refused, joint missing", "the message has none"),
        (send_an_earlier_stamp, "refused, stamp not after", "expected a stamp after"),
    ],
)
def test_it_is_refused_counted_and_survived(peer, node, send, counted, said):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    arm.send_until(lambda: diagnostics, "diagnostics")

    def counts():
        return {value.key: value.value for value in diagnostics[-1].status[0].values}

    def refused():
        arm.send()
        send(arm)
        arm.send()
        return int(counts()[counted]) >= 3

    peer.wait_until(refused, f"the count of '{counted}' to rise")
    assert said in node.log()
    used = int(counts()["samples used"])
    arm.send_until(lambda: int(counts()["samples used"]) > used, "good messages to be used again")
    assert node.process.poll() is None


def test_joints_are_followed_when_their_order_changes_between_messages(peer, node):
    arm = Arm(peer)
    residuals = peer.listen(JointState, "palpate/residual", 1000)
    arm.wait_until_heard()
    torques = [0.01 * number for number in range(7)]
    for _ in range(5):
        arm.send_until(lambda: residuals, "a residual", torques=torques)
        residuals.clear()
        swapped = dict(names=["gripper", *reversed(JOINTS)], positions=[9.0] + ZEROS, torques=[9.0, *reversed(torques)])
        arm.send_until(lambda: residuals, "a residual", **swapped)
        # Whatever the learned bias takes off, it takes off each in proportion.
        assert all(list(message.effort) == sorted(message.effort) for message in residuals), residuals
        residuals.clear()


@pytest.mark.parametrize("ahead_ns", [10_000_000, -10_000_000])
def test_torques_may_be_stamped_ahead_of_positions_or_behind(peer, node, ahead_ns):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    working = lambda: diagnostics and diagnostics[-1].status[0].message == "working"
    arm.send_until(working, "the node to work", torque_ahead_ns=ahead_ns)


@pytest.mark.parametrize("ahead_secs", [30, -30], ids=["ahead", "behind"])
def test_torques_stamped_far_from_positions_are_told_until_the_clocks_agree(peer, node, ahead_secs):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    status = lambda: diagnostics[-1].status[0] if diagnostics else None
    values = lambda: {value.key: value.value for value in status().values}

    def told():
        unpaired = status() and status().message == "no torque finds a position of its time"
        return unpaired and int(values()["torques without position"]) > 0

    arm.send_until(told, "torques without a position to be told", torque_ahead_ns=ahead_secs * 1_000_000_000)
    assert status().level == DiagnosticStatus.ERROR and values()["samples used"] == "0"
    behind_secs = float(values()["torque stamps behind positions', s"])
    assert abs(behind_secs + ahead_secs) < 1.0, behind_secs
    arm.send_until(lambda: status().message == "working", "the node to work")
    assert node.process.poll() is None


def test_positions_too_rare_for_the_tolerance_are_told(peer, node):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    stamps, values = itertools.count(time.time_ns(), 10_000_000), {}

    def sent():
        """Positions every 0.1 s, torques every 0.01 s: half of these are further off than 0.02 s."""
        for turn in range(10):
            stamp_ns = next(stamps)
            if turn == 0:
                state = joint_state(stamp_ns, JOINTS)
                state.position = ZEROS
                arm.positions.publish(state)
            effort = joint_state(stamp_ns, JOINTS)
            effort.effort = ZEROS
            arm.torques.publish(effort)
        status = diagnostics[-1].status[0] if diagnostics else None
        if status and status.message == "some torques find no position of their time":
            assert status.level == DiagnosticStatus.WARN
            values.update({value.key: int(value.value) for value in status.values if value.value.isdigit()})
        return values.get("torques without position", 0) > 100

    peer.wait_until(sent, "torques without a position to be told")
    unpaired, used = values["torques without position"], values["samples used"]
    assert 0.4 < used / (used + unpaired) < 0.6, values


@pytest.mark.parametrize("every", [(1, 4), (4, 1)], ids=["positions_faster", "torques_faster"])
def test_topics_may_come_at_different_rates(peer, start, every):
    # Pairs are as far apart as the slower topic's messages, on a busy machine.
    start(**{"robot.description_file": URDF, "input.pairing_tolerance_secs": 1.0})
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    zeros, rounds = [0.0] * 7, itertools.count()
    def sent():
        stamp_ns, turn = time.time_ns(), next(rounds)
        if turn % every[0] == 0:
            state = joint_state(stamp_ns, JOINTS)
            state.position = zeros
            arm.positions.publish(state)
        if turn % every[1] == 0:
            effort = joint_state(stamp_ns, JOINTS)
            effort.effort = zeros
            arm.torques.publish(effort)
        return diagnostics and diagnostics[-1].status[0].message == "working"
    peer.wait_until(sent, "the node to work")
    # Of the second in which messages came, not of the next.
    counts = {value.key: value.value for value in diagnostics[-1].status[0].values}
    assert float(counts["positions, Hz"]) > 0.0 and counts["torques without position"] == "0", counts


def test_clocks_that_differ_are_told(peer, node):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    for offset_ns, said in [(-30_000_000_000, "stamps are old"), (30_000_000_000, "stamps lie ahead")]:
        arm.offset_ns = offset_ns
        arm.send_until(lambda: diagnostics and diagnostics[-1].status[0].message.startswith(said), said)
        assert diagnostics[-1].status[0].level == DiagnosticStatus.WARN


def test_a_silent_topic_is_an_error_that_names_it(peer, node):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    said = lambda: diagnostics and diagnostics[-1].status[0].message
    peer.wait_until(lambda: said() == "no messages on joint_states", "silence to be noticed")
    arm.send_until(lambda: said() == "working", "the node to work")
