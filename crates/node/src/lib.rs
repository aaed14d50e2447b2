//! Topics: what the ROS 2 node is made of that needs no ROS. The node itself is the binary `palpate_node`; it and
//! `palpate_simulated_driver`, the modules `messages` and `process` are behind the feature `ros2`.

mod health;
mod joint_input;
mod measured_input;
#[cfg(feature = "ros2")]
pub mod messages;
mod newest;
mod pacing;
mod parameter_names;
#[cfg(feature = "ros2")]
pub mod process;
pub mod realtime;
mod throttle;
mod untyped;

pub use health::{Health, Level, Losses, Rates, judge};
pub use joint_input::{Delays, JointInput, MessageCounts, MessageError, TimedSample, nanoseconds};
pub use newest::Newest;
pub use pacing::Pacing;
pub use parameter_names::{as_listed, within_prefixes};
pub use throttle::Throttle;
pub use untyped::Untyped;
