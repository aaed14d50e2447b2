"""Without hardware: a simulated driver, the node, and RViz with the true contact beside the estimate."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# The installed share folder has the layout of the repository.
SHARE = Path(__file__).resolve().parents[1]

ARGUMENTS = [
    ("namespace", "", "namespace of all nodes"),
    ("scenario", str(SHARE / "config" / "demo.yaml"), "what touches where, and how the driver reports it"),
    ("params", str(SHARE / "config" / "palpate.yaml"), "parameter file of the node"),
    ("rviz", "true", "whether to start RViz"),
    ("rviz_config", str(SHARE / "config" / "palpate.rviz"), "RViz view"),
]


def generate_launch_description():
    namespace = LaunchConfiguration("namespace")
    driver = Node(
        package="palpate",
        executable="palpate_simulated_driver",
        name="simulated_driver",
        namespace=namespace,
        parameters=[{"scenario": LaunchConfiguration("scenario")}],
        output="screen",
    )
    publisher = Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        namespace=namespace,
        parameters=[{"robot_description": (SHARE / "urdf" / "iiwa14.urdf").read_text()}],
    )
    node = Node(
        package="palpate",
        executable="palpate_node",
        name="palpate",
        namespace=namespace,
        # Not as a parameter, as a file that is missing would be left out; the node ends with a sentence.
        ros_arguments=["--params-file", LaunchConfiguration("params")],
        output="screen",
    )
    view = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(SHARE / "launch" / "view.launch.py")),
        launch_arguments=[("namespace", namespace), ("rviz_config", LaunchConfiguration("rviz_config"))],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    declared = [DeclareLaunchArgument(name, default_value=value, description=told) for name, value, told in ARGUMENTS]
    return LaunchDescription([*declared, driver, publisher, node, view])
