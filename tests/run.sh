#!/usr/bin/env bash
# Runs every test: those of Rust, then those against a real ROS 2. Needs Rust, python3 with venv, a C and a C++
# compiler. A ROS 2 that is sourced is used; else one is installed into .ros2/ (see tests/ros2_env.sh). Arguments go
# to pytest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

step() {
    printf '\n== %s (after %d s)\n' "$1" "$SECONDS"
}

# Without ROS, as on most machines: the node is a library only.
step "Rust"
env -u AMENT_PREFIX_PATH -u ROS_DISTRO cargo test --workspace

step "ROS 2"
. tests/ros2_env.sh
tools=$PWD/.ros2/tools
wanted=$(cksum <tests/ros2-constraints.txt)
if [ "$(cat "$tools/stamp" 2>/dev/null)" != "$wanted" ]; then
    rm -rf "$tools"
    "${PYTHON:-python3}" -m venv --system-site-packages "$tools"
    "$tools/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
        --constraint tests/ros2-constraints.txt pytest rosbags \
        colcon-core colcon-cmake colcon-ros colcon-bash colcon-recursive-crawl cmake ninja
    printf '%s' "$wanted" >"$tools/stamp"
fi

step "the node"
# All packages, as above, so that what they share is not built a second time with other features.
cargo build --workspace --features palpate-node/ros2
target=$(cargo metadata --no-deps --format-version 1 | "$tools/bin/python" -c \
    'import json, sys; print(json.load(sys.stdin)["target_directory"])')
# colcon and what it calls.
export PATH=$tools/bin:$PATH
export PALPATE_NODE=$target/debug/palpate_node PALPATE=$target/debug/palpate
export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST

step "system tests"
"$tools/bin/python" -m pytest tests/ros2 -p no:cacheprovider --durations=5 "$@"

step "all tests passed"
