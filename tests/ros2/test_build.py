"""Without ROS, building the node ends in a sentence."""

import os
import subprocess

from support import ROOT


def test_the_node_without_ros_ends_in_a_sentence():
    without = {name: value for name, value in os.environ.items() if name not in ("AMENT_PREFIX_PATH", "ROS_DISTRO")}
    # In a folder of its own, as r2r would be built anew after a change of ROS; only checked, as nothing will run.
    options = ["--target-dir", ROOT / "target" / "without-ros"]
    command = ["cargo", "check", "--package", "palpate-node", "--features", "ros2", *options]
    built = subprocess.run(command, cwd=ROOT, env=without, capture_output=True, text=True)
    assert built.returncode != 0
    assert "The node's feature `ros2` needs a ROS 2: source its setup.bash" in built.stderr
    # A binding generator that finds no headers would say this.
    assert "fatal error" not in built.stderr and "Unable to generate bindings" not in built.stderr
