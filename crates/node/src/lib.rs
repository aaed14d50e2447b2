//! Topics: what the ROS 2 node is made of that needs no ROS. The node itself is the binary `palpate_node`, behind the
//! feature `ros2`.

mod health;
mod joint_input;
mod measured_input;
mod newest;
mod parameter_names;
mod throttle;
mod untyped;

pub use health::{Health, Level, Losses, Rates, judge};
pub use joint_input::{Delays, JointInput, MessageCounts, MessageError, TimedSample, nanoseconds};
pub use newest::Newest;
pub use parameter_names::{as_listed, within_prefixes};
pub use throttle::Throttle;
pub use untyped::Untyped;
