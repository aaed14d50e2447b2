"""Whatever a driver sends, the node keeps running, counts what it refuses and says why."""

import math

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from support import JOINTS, Arm

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


def test_a_silent_topic_is_an_error_that_names_it(peer, node):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    said = lambda: diagnostics and diagnostics[-1].status[0].message
    peer.wait_until(lambda: said() == "no messages on joint_states", "silence to be noticed")
    arm.send_until(lambda: said() == "working", "the node to work")


def test_time_that_starts_anew_is_followed(peer, node):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    arm.send_until(lambda: diagnostics and int(peer.counts(diagnostics)["samples used"]) > 0, "samples to be used")
    arm.offset_ns = -500_000_000_000
    arm.send_until(lambda: int(peer.counts(diagnostics)["time started anew"]) == 1, "the jump to be counted")
    used = int(peer.counts(diagnostics)["samples used"])
    arm.send_until(lambda: int(peer.counts(diagnostics)["samples used"]) > used, "samples to be used again")
