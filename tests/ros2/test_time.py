"""Stamps, clocks and jumps in time."""

from diagnostic_msgs.msg import DiagnosticArray
from rosgraph_msgs.msg import Clock
from support import URDF, Arm


def test_time_that_starts_anew_is_followed(peer, node):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    arm.send_until(lambda: diagnostics and int(peer.counts(diagnostics)["samples used"]) > 0, "samples to be used")
    arm.offset_ns = -500_000_000_000
    arm.send_until(lambda: int(peer.counts(diagnostics)["time started anew"]) == 1, "the jump to be counted")
    used = int(peer.counts(diagnostics)["samples used"])
    arm.send_until(lambda: int(peer.counts(diagnostics)["samples used"]) > used, "samples to be used again")


def test_a_jump_is_refused_where_it_is_not_to_be_followed(peer, start):
    start(**{"robot.description_file": URDF, "input.reset_on_time_jump": "false"})
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    arm.send_until(lambda: diagnostics and int(peer.counts(diagnostics)["samples used"]) > 0, "samples to be used")
    arm.offset_ns = -500_000_000_000
    refused = lambda: int(peer.counts(diagnostics)["refused, stamp not after"]) > 0
    arm.send_until(refused, "old stamps to be refused")
    assert peer.counts(diagnostics)["time started anew"] == "0"


def test_simulated_time_is_followed(peer, start):
    start(**{"robot.description_file": URDF, "use_sim_time": "true"})
    clock = peer.node.create_publisher(Clock, "/clock", 10)
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    for start_secs in (1000, 50):
        ticks = iter(range(1_000_000))

        def sent():
            stamp_ns = start_secs * 1_000_000_000 + next(ticks) * 10_000_000
            now = Clock()
            now.clock.sec, now.clock.nanosec = divmod(stamp_ns, 1_000_000_000)
            clock.publish(now)
            arm.send(stamp_ns=stamp_ns)
            newest = diagnostics[-1] if diagnostics else None
            seen = newest and newest.status[0].message == "working"
            return seen and start_secs <= newest.header.stamp.sec < start_secs + 900
        peer.wait_until(sent, f"diagnostics stamped with the clock after {start_secs} s")
