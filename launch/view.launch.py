"""RViz with robot, particles, contact and truth. The other launch files include it."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# The installed share folder has the layout of the repository.
SHARE = Path(__file__).resolve().parents[1]

ARGUMENTS = [
    ("namespace", "", "namespace of the node whose topics are shown"),
    ("rviz_config", str(SHARE / "config" / "palpate.rviz"), "RViz view"),
    ("fixed_frame", "lbr_link_0", "frame that rests in the view: the URDF's root link"),
    ("use_sim_time", "false", "whether time is /clock"),
]


def generate_launch_description():
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        namespace=LaunchConfiguration("namespace"),
        arguments=["-d", LaunchConfiguration("rviz_config"), "-f", LaunchConfiguration("fixed_frame")],
        parameters=[{"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}],
    )
    declared = [DeclareLaunchArgument(name, default_value=value, description=told) for name, value, told in ARGUMENTS]
    return LaunchDescription([*declared, rviz])
