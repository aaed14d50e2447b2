"""Stamps, clocks and jumps in time."""

from diagnostic_msgs.msg import DiagnosticArray
from lbr_fri_idl.msg import LBRState
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
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


def test_time_that_leaps_ahead_goes_on(peer, node):
    """As when a bag is sought forward."""
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    arm.send_until(lambda: diagnostics and int(peer.counts(diagnostics)["samples used"]) > 0, "samples to be used")
    arm.offset_ns = 500_000_000_000
    said = lambda: diagnostics[-1].status[0].message.startswith("stamps lie ahead")
    arm.send_until(said, "later samples to be used")
    counts = peer.counts(diagnostics)
    assert counts["time started anew"] == counts["refused, stamp not after"] == "0", counts


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


def test_what_has_no_stamp_takes_simulated_time(peer, start):
    node = start(**{"robot.description_file": URDF, "use_sim_time": "true", "input.source": "lbr_state"})
    clock = peer.node.create_publisher(Clock, "/clock", 10)
    states = peer.node.create_publisher(LBRState, "external_torque", 10)
    residuals = peer.listen(JointState, "palpate/residual", 1000)
    peer.wait_until(lambda: states.get_subscription_count() and clock.get_subscription_count(), "the node to subscribe")
    said = lambda: states.publish(LBRState()) or "nothing is on /clock" in node.log()
    peer.wait_until(said, "messages without any time to be refused")
    # Clocks often tick more slowly than messages come.
    ticks = iter(range(1_000_000))

    def sent():
        now = Clock()
        now.clock.sec, now.clock.nanosec = divmod(1_000_000_000_000 + next(ticks) * 50_000_000, 1_000_000_000)
        clock.publish(now)
        for _ in range(3):
            states.publish(LBRState())
        return len(residuals) > 20

    peer.wait_until(sent, "samples to be used")
    stamps = [message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec for message in residuals]
    assert stamps == sorted(set(stamps))
    assert all(1_000_000_000_000 <= stamp <= 1_000_000_000_000 + next(ticks) * 50_000_000 for stamp in stamps)


def test_clocks_that_differ_are_told(peer, node):
    arm = Arm(peer)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    arm.wait_until_heard()
    arm.offset_ns = 4_000_000_000
    no_pair = "no torque finds a position of its time"
    said = lambda: diagnostics and diagnostics[-1].status[0].message == no_pair
    arm.send_until(said, "the difference to be noticed", torque_ahead_ns=-4_300_000_000)
    values = {value.key: float(value.value) for value in diagnostics[-1].status[0].values if "stamps behind" in value.key}
    assert 4.2 < values["torque stamps behind positions', s"] < 4.6, values
    assert -4.1 < values["position stamps behind now, s"] < -3.0, values
    assert 0.2 < values["torque stamps behind now, s"] < 1.5, values
    assert peer.counts(diagnostics)["time started anew"] == "0"
    arm.send_until(lambda: diagnostics[-1].status[0].level == b"\1", "a warning of the clock alone")
