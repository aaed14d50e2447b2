"""Drivers' messages: the topics, types, joint names and QoS of each, filled from joint positions and torques."""

import math
from dataclasses import dataclass
from typing import Callable

from control_msgs.msg import DynamicJointState, InterfaceValue
from franka_msgs.msg import FrankaRobotState
from lbr_fri_idl.msg import LBRState
from rclpy.qos import QoSProfile, qos_profile_sensor_data, qos_profile_system_default
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

NAN = [math.nan] * 7
# As drivers' joints hold gravity.
GRAVITY = [0.0, -30.0, 1.0, 12.0, 0.5, -1.0, 0.0]


@dataclass
class Driver:
    """A driver, as far as the node sees it."""

    preset: str
    joints: list[str]
    torque_topic: str
    qos: QoSProfile
    # What it publishes for itself and a sample: messages by topic, in this order.
    messages: Callable
    # Whether the torques' messages carry a stamp.
    is_stamped: bool = True
    # Where it is not the preset's.
    source: str | None = None
    # What the arm's URDF has besides.
    extra_urdf: str = ""


def stamped(message, stamp_ns, frame=""):
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    message.header.frame_id = frame
    return message


def joint_state(driver, sample):
    """As joint_state_broadcaster publishes: in any order, and with efforts that hold gravity."""
    message = JointState(name=driver.joints[::-1], position=sample.position[::-1], velocity=[0.0] * 7)
    message.effort = GRAVITY[::-1]
    return stamped(message, sample.stamp_ns)


def torque_joint_state(driver, sample):
    """As a broadcaster with nothing but external torques publishes: NaN elsewhere."""
    message = JointState(name=driver.joints, position=NAN, velocity=NAN, effort=sample.torque)
    return stamped(message, sample.stamp_ns)


def lbr_state(driver, sample):
    message = LBRState(sample_time=0.01, session_state=4, control_mode=1, tracking_performance=1.0)
    # The controller's clock has nothing to do with that of ROS 2.
    message.time_stamp_sec, message.time_stamp_nano_sec = 1_500_000_000, 5
    message.measured_joint_position = sample.position
    if hasattr(message, "commanded_joint_position"):
        message.commanded_joint_position = [9.0] * 7
    message.measured_torque, message.commanded_torque = GRAVITY, GRAVITY
    message.external_torque = sample.torque
    return message


def dynamic_joint_state(driver, sample):
    """As joint_state_broadcaster publishes what lbr_ros2_control offers: joints among sensors."""
    message = DynamicJointState(joint_names=["auxiliary_sensor", *driver.joints])
    message.interface_values = [InterfaceValue(interface_names=["sample_time"], values=[0.01])]
    for position, gravity, torque in zip(sample.position, GRAVITY, sample.torque):
        names = ["position", "effort", "external_torque"]
        message.interface_values.append(InterfaceValue(interface_names=names, values=[position, gravity, torque]))
    return stamped(message, sample.stamp_ns)


def franka_state(driver, sample):
    message = stamped(FrankaRobotState(robot_mode=1), sample.stamp_ns, "base")
    message.measured_joint_state = joint_state(driver, sample)
    message.desired_joint_state = joint_state(driver, sample)
    message.tau_ext_hat_filtered = stamped(JointState(name=driver.joints, effort=sample.torque), sample.stamp_ns)
    return message


LBR_JOINTS = [f"lbr_A{number}" for number in range(1, 8)]
FRANKA_JOINTS = [f"fr3_joint{number}" for number in range(1, 8)]
# Of whose joints neither message tells.
FRANKA_HAND = """
  <link name="fr3_leftfinger"/>
  <link name="fr3_rightfinger"/>
  <joint name="fr3_finger_joint1" type="prismatic">
    <parent link="lbr_link_ee"/><child link="fr3_leftfinger"/>
    <limit lower="0" upper="0.04" effort="100" velocity="0.2"/>
  </joint>
  <joint name="fr3_finger_joint2" type="prismatic">
    <parent link="lbr_link_ee"/><child link="fr3_rightfinger"/>
    <limit lower="0" upper="0.04" effort="100" velocity="0.2"/>
    <mimic joint="fr3_finger_joint1"/>
  </joint>
"""

DRIVERS = {
    "lbr_state": Driver(
        preset="lbr_fri_ros2_stack",
        joints=LBR_JOINTS,
        torque_topic="/lbr/state",
        qos=QoSProfile(depth=1),
        messages=lambda driver, sample: {"/lbr/state": lbr_state(driver, sample)},
        is_stamped=False,
    ),
    "lbr_dynamic": Driver(
        preset="lbr_fri_ros2_stack",
        joints=LBR_JOINTS,
        torque_topic="/lbr/dynamic_joint_states",
        qos=qos_profile_system_default,
        messages=lambda driver, sample: {"/lbr/dynamic_joint_states": dynamic_joint_state(driver, sample)},
        source="dynamic_joint_state",
    ),
    "kuka_drivers": Driver(
        preset="kuka_drivers",
        joints=[f"joint_{number}" for number in range(1, 8)],
        torque_topic="/external_torque_broadcaster/joint_states",
        qos=qos_profile_system_default,
        messages=lambda driver, sample: {
            "/joint_states": joint_state(driver, sample),
            "/external_torque_broadcaster/joint_states": torque_joint_state(driver, sample),
        },
    ),
    "iiwa_ros2": Driver(
        preset="iiwa_ros2",
        joints=[f"joint_a{number}" for number in range(1, 8)],
        torque_topic="/ets_state_broadcaster/external_torques",
        qos=qos_profile_system_default,
        messages=lambda driver, sample: {
            "/joint_states": joint_state(driver, sample),
            "/ets_state_broadcaster/external_torques": Float64MultiArray(data=sample.torque),
        },
        is_stamped=False,
    ),
    "franka_state": Driver(
        preset="franka_ros2",
        joints=FRANKA_JOINTS,
        torque_topic="/franka_robot_state_broadcaster/robot_state",
        qos=QoSProfile(depth=10),
        messages=lambda driver, sample: {
            "/franka_robot_state_broadcaster/robot_state": franka_state(driver, sample)
        },
        extra_urdf=FRANKA_HAND,
    ),
    "franka_torques": Driver(
        preset="franka_ros2",
        joints=FRANKA_JOINTS,
        torque_topic="/franka_robot_state_broadcaster/external_joint_torques",
        qos=qos_profile_sensor_data,
        messages=lambda driver, sample: {
            "/joint_states": joint_state(driver, sample),
            "/franka_robot_state_broadcaster/external_joint_torques": torque_joint_state(driver, sample),
        },
        extra_urdf=FRANKA_HAND,
        source="joint_state",
    ),
}
