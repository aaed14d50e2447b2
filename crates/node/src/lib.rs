//! Topics: what the ROS 2 node is made of that needs no ROS. The node itself is the binary `palpate_node`, behind the
//! feature `ros2`.

mod joint_input;
mod newest;
mod throttle;

pub use joint_input::{
    JointInput, JointMessage, MessageCounts, MessageError, TimedSample, nanoseconds,
};
pub use newest::Newest;
pub use throttle::Throttle;
