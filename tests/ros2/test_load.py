"""At 1 kHz every sample is used, or counted with the cause of its loss. tests/soak.py does this for longer, and tells times."""

from diagnostic_msgs.msg import DiagnosticArray
from support import NODE, URDF

SAMPLES = 2000
SCENARIO = "{link: lbr_link_4, rate_hz: 1000, lead_in_secs: 0.5, duration_secs: 2, noise_floor: 0.02}"
LOST = ["samples lost, filter too slow", "torques without position"]


def test_what_a_driver_of_1_khz_sends_is_used_or_counted(peer, start, tmp_path):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text(SCENARIO)
    diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
    start(**{"robot.description_file": URDF, "filter.palpate.hypotheses": 100})
    driver = start(program=NODE.with_name("palpate_simulated_driver"), scenario=scenario, samples=SAMPLES)
    peer.wait_until(lambda: driver.process.poll() is not None, "the driver to have sent all")
    assert driver.process.returncode == 0
    # After a whole second more nothing waits.
    peer.counts(diagnostics)
    counts = peer.counts(diagnostics)
    received, used = int(counts["torque messages"]), int(counts["samples used"])
    assert 0 < used <= received <= SAMPLES
    assert used + sum(int(counts[cause]) for cause in LOST) == received, counts
    refused = {key: value for key, value in counts.items() if key.startswith("refused")}
    assert set(refused.values()) == {"0"}, refused
