"""The node beside a running driver, and RViz on request. Arguments only: values belong into a parameter file."""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

# The installed share folder has the layout of the repository.
SHARE = Path(__file__).resolve().parents[1]

# Namespace that each driver starts in, topic of its torques there, and the frame that its robot stands in. The parameter
# file of a driver has its name.
DRIVERS = {
    "lbr_fri_ros2_stack": ("lbr", "state", "world"),
    "kuka_drivers": ("", "external_torque_broadcaster/joint_states", "world"),
    "iiwa_ros2": ("", "ets_state_broadcaster/external_torques", "world"),
    "franka_ros2": ("", "franka_robot_state_broadcaster/robot_state", "base"),
}
OF_THE_DRIVER = "auto"

ARGUMENTS = [
    ("namespace", OF_THE_DRIVER, "namespace of the node; auto: the driver's; /: none"),
    ("external_torque", OF_THE_DRIVER, "topic of the external torques; auto: the driver's"),
    ("joint_states", "joint_states", "topic of the joint positions, where that of the torques has none"),
    ("robot_description", "robot_description", "topic of the URDF"),
    ("params", "", "parameter file, in addition to the driver's"),
    ("use_sim_time", "false", "whether time is /clock, as with a simulated robot"),
    ("rviz", "false", "whether to start RViz"),
    ("rviz_config", str(SHARE / "config" / "palpate.rviz"), "RViz view"),
    ("fixed_frame", OF_THE_DRIVER, "frame that rests in RViz, the URDF's root link; auto: the driver's"),
]


def start(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ("driver", *(entry[0] for entry in ARGUMENTS))}
    namespace, torques, frame = DRIVERS[given["driver"]]
    for name, value in [("namespace", namespace), ("external_torque", torques), ("fixed_frame", frame)]:
        if given[name] == OF_THE_DRIVER:
            given[name] = value
    files = [str(SHARE / "config" / f"{given['driver']}.yaml"), *filter(None, [given["params"]])]
    node = Node(
        package="palpate",
        executable="palpate_node",
        name="palpate",
        namespace=given["namespace"],
        # Not as parameters, as a file that is missing would be left out; the node ends with a sentence.
        ros_arguments=[word for file in files for word in ("--params-file", file)],
        parameters=[{"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}],
        remappings=[(topic, given[topic]) for topic in ("joint_states", "external_torque", "robot_description")],
        output="screen",
    )
    view = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(SHARE / "launch" / "view.launch.py")),
        launch_arguments=[(name, given[name]) for name in ("namespace", "rviz_config", "fixed_frame", "use_sim_time")],
        condition=IfCondition(given["rviz"]),
    )
    return [node, view]


def generate_launch_description():
    driver = DeclareLaunchArgument(
        "driver", default_value="lbr_fri_ros2_stack", choices=list(DRIVERS), description="driver beside which to start"
    )
    declared = [DeclareLaunchArgument(name, default_value=value, description=told) for name, value, told in ARGUMENTS]
    return LaunchDescription([driver, *declared, OpaqueFunction(function=start)])
