"""A bag in place of a driver: its joint states and torques are played with their own clock, and the robot is drawn."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription, OpaqueFunction
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# The installed share folder has the layout of the repository.
SHARE = Path(__file__).resolve().parents[1]

ARGUMENTS = [
    ("joint_states", "/joint_states", "the bag's topic of the joint positions"),
    ("external_torque", "/external_torques", "the bag's topic of the external torques"),
    ("urdf", str(SHARE / "urdf" / "iiwa14.urdf"), "the robot, as a plain URDF file"),
    ("params", str(SHARE / "config" / "palpate.yaml"), "parameter file of the node; a driver's for its messages"),
    ("rate", "1.0", "how fast to play"),
    ("loop", "false", "whether to play for ever"),
    ("rviz", "true", "whether to start RViz"),
    ("rviz_config", str(SHARE / "config" / "palpate.rviz"), "RViz view"),
    ("fixed_frame", "lbr_link_0", "frame that rests in RViz: the URDF's root link"),
]

# Simulated bags have it, and RViz shows it.
TRUTH = "/ground_truth/contact_point"
BY_THE_BAG = {"use_sim_time": True}


def start(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ("bag", *(entry[0] for entry in ARGUMENTS))}
    looped = ["--loop"] if given["loop"].lower() in ("true", "1") else []
    player = ExecuteProcess(
        cmd=["ros2", "bag", "play", given["bag"], "--clock", "--rate", given["rate"], *looped,
             "--topics", given["joint_states"], given["external_torque"], TRUTH],
        output="screen",
    )  # fmt: skip
    publisher = Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        parameters=[{"robot_description": Path(given["urdf"]).read_text()}, BY_THE_BAG],
        remappings=[("joint_states", given["joint_states"])],
    )
    node = Node(
        package="palpate",
        executable="palpate_node",
        name="palpate",
        # Not as a parameter, as a file that is missing would be left out; the node ends with a sentence.
        ros_arguments=["--params-file", given["params"]],
        parameters=[BY_THE_BAG],
        remappings=[(topic, given[topic]) for topic in ("joint_states", "external_torque")],
        output="screen",
    )
    view = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(SHARE / "launch" / "view.launch.py")),
        launch_arguments=[
            ("rviz_config", given["rviz_config"]),
            ("fixed_frame", given["fixed_frame"]),
            ("use_sim_time", "true"),
        ],
        condition=IfCondition(given["rviz"]),
    )
    return [publisher, node, view, player]


def generate_launch_description():
    bag = DeclareLaunchArgument("bag", description="folder or file of the bag")
    declared = [DeclareLaunchArgument(name, default_value=value, description=told) for name, value, told in ARGUMENTS]
    return LaunchDescription([bag, *declared, OpaqueFunction(function=start)])
