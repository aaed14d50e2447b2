"""Bags that the command line writes open with an independent reader."""

import subprocess
import sys

from support import ROOT, URDF, palpate


def check(bag, *topics):
    command = [sys.executable, ROOT / "tests" / "check_bag.py", bag]
    checked = subprocess.run(command, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stderr
    for topic in topics:
        assert topic in checked.stdout, checked.stdout


def test_a_simulated_bag(bag):
    check(bag, "/joint_states", "/external_torques")


def test_a_replayed_bag(bag, parameters, tmp_path):
    out = tmp_path / "replayed.mcap"
    palpate("replay", bag, "--urdf", URDF, "--config", parameters, "--out", out)
    check(out, "/palpate/contact_pose", "/palpate/contact_wrench", "/palpate/particles", "/palpate/markers", "/tf")
