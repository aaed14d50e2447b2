//! From a bag's messages to samples with measured torques.

use palpate_model::{MeasuredSample, Robot};

use crate::bag::Bag;
use crate::choice::{TopicChoice, choose_measured};
use crate::samples::Reader;
use crate::{BagError, TopicReport};

/// Measured samples of a bag, in the order of recording, and what became of the messages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredRecording {
    /// Positions, speeds where there are any, and measured torques in the robot's order. They need not be finite.
    pub samples: Vec<MeasuredSample>,
    /// The messages that they came from.
    pub topic: TopicReport,
}

/// Reads joint positions, speeds and measured torques of `robot` from one topic of `JointState`: its efforts, which hold
/// gravity and friction. Only a user who asks for it knows that they are what the joints drive with.
///
/// # Errors
/// If no topic has both positions and efforts, several have and `choice` names none by its positions, the named topic is
/// absent or of another type, torques are named on another topic, or no message could be read.
pub fn read_measured(
    bag: &Bag,
    robot: &Robot,
    choice: &TopicChoice,
) -> Result<MeasuredRecording, BagError> {
    let topic = choose_measured(bag, robot, choice)?;
    let mut reader = Reader::new(bag, robot, &choice.joint_names, topic)?;
    let messages = bag.messages(&[topic])?;
    let read = messages.iter().map(|message| reader.read_measured(message));
    let samples: Vec<_> = read.flatten().collect();
    let topic = reader.report;
    if samples.is_empty() {
        let reason = topic
            .unusable
            .first_reason
            .as_deref()
            .unwrap_or("none came");
        return Err(BagError::NoSample {
            reason: format!("{}: {reason}", topic.topic),
        });
    }
    Ok(MeasuredRecording { samples, topic })
}
