"""The node beside a running driver, and RViz on request. Arguments only: values belong into a parameter file."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# The installed share folder has the layout of the repository.
SHARE = Path(__file__).resolve().parents[1]

ARGUMENTS = [
    ("namespace", "", "namespace of the driver, and so of the node"),
    ("params", str(SHARE / "config" / "palpate.yaml"), "parameter file"),
    ("joint_states", "joint_states", "topic with the joint positions (sensor_msgs/JointState)"),
    (
        "external_torque",
        "external_torque_broadcaster/joint_states",
        "topic whose effort is the external torque (sensor_msgs/JointState)",
    ),
    ("robot_description", "robot_description", "topic with the URDF (std_msgs/String)"),
    ("rviz", "false", "whether to start RViz"),
    ("rviz_config", str(SHARE / "config" / "palpate.rviz"), "RViz view"),
]


def generate_launch_description():
    node = Node(
        package="palpate",
        executable="palpate_node",
        name="palpate",
        namespace=LaunchConfiguration("namespace"),
        parameters=[LaunchConfiguration("params")],
        remappings=[
            (topic, LaunchConfiguration(topic))
            for topic in ("joint_states", "external_torque", "robot_description")
        ],
        output="screen",
    )
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        namespace=LaunchConfiguration("namespace"),
        arguments=["-d", LaunchConfiguration("rviz_config")],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, default, description in ARGUMENTS
    ]
    return LaunchDescription([*declared, node, rviz])
