//! What drivers' messages tell of the joints: one file a message type, whoever decoded the message.

mod dynamic_joint_state;
mod fields;
mod franka_state;
mod joint_state;
mod lbr_state;
mod multi_array;
mod reading;

pub use fields::Fields;
pub use reading::{JointPicker, JointReading, JointValues};
use serde::{Deserialize, Serialize};

/// A message type that external joint torques can be read from.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// `sensor_msgs/JointState`: its efforts, which only some topics fill with external torques.
    #[default]
    JointState,
    /// `std_msgs/Float64MultiArray`: torques without names and without a stamp.
    MultiArray,
    /// `lbr_fri_idl/LBRState` of lbr_fri_ros2_stack: positions and torques without names and without a header.
    LbrState,
    /// `franka_msgs/FrankaRobotState` of franka_ros2: positions and torques.
    FrankaState,
    /// `control_msgs/DynamicJointState` of ros2_control: the interfaces `position` and `external_torque`.
    DynamicJointState,
}

impl Source {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::JointState,
        Self::MultiArray,
        Self::LbrState,
        Self::FrankaState,
        Self::DynamicJointState,
    ];

    /// The source whose messages are of this type, as `pkg/msg/Type` or `pkg/Type`.
    pub fn of_type(type_name: &str) -> Option<Self> {
        let short = type_name.replacen("/msg/", "/", 1);
        let is_it = |source: &Self| source.type_name().replacen("/msg/", "/", 1) == short;
        Self::ALL.into_iter().find(is_it)
    }

    /// The message type, as `pkg/msg/Type`.
    pub fn type_name(self) -> &'static str {
        match self {
            Self::JointState => "sensor_msgs/msg/JointState",
            Self::MultiArray => "std_msgs/msg/Float64MultiArray",
            Self::LbrState => "lbr_fri_idl/msg/LBRState",
            Self::FrankaState => "franka_msgs/msg/FrankaRobotState",
            Self::DynamicJointState => "control_msgs/msg/DynamicJointState",
        }
    }

    /// The value of the parameter `input.source`.
    pub fn word(self) -> &'static str {
        match self {
            Self::JointState => "joint_state",
            Self::MultiArray => "multi_array",
            Self::LbrState => "lbr_state",
            Self::FrankaState => "franka_state",
            Self::DynamicJointState => "dynamic_joint_state",
        }
    }

    /// Whether each message holds external torques together with the positions of the same instant.
    pub fn has_both(self) -> bool {
        matches!(
            self,
            Self::LbrState | Self::FrankaState | Self::DynamicJointState
        )
    }

    /// Takes out of a decoded message what concerns the joints; none if it lacks a field that its type promises.
    pub fn read<F: Fields>(self, message: F) -> Option<JointReading> {
        match self {
            Self::JointState => joint_state::read(message),
            Self::MultiArray => multi_array::read(message),
            Self::LbrState => lbr_state::read(message),
            Self::FrankaState => franka_state::read(message),
            Self::DynamicJointState => dynamic_joint_state::read(message),
        }
    }
}
