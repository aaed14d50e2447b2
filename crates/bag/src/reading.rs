//! Decoding one message and picking the robot's joints out of it.

use palpate_model::{JointPicker, JointReading, JointValues, ModelError, Robot, Source};

use crate::bag::Bag;
use crate::definition::Definition;
use crate::{BagError, cdr};

/// Which of a message's arrays is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Position,
    Effort,
}

impl Quantity {
    fn word(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Effort => "effort",
        }
    }

    fn of(self, reading: &JointReading) -> &JointValues {
        match self {
            Self::Position => &reading.position,
            Self::Effort => &reading.effort,
        }
    }
}

/// Why a message gave nothing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refusal {
    #[error("{0}")]
    Undecodable(String),
    #[error("{0}: {1}")]
    Joints(&'static str, ModelError),
    #[error("{0} of {1} is {2}, expected a finite number")]
    NotFinite(&'static str, String, f64),
}

/// Decodes one topic's messages.
pub(crate) struct Decoder {
    definitions: Vec<Definition>,
    pub(crate) source: Source,
}

impl Decoder {
    pub(crate) fn new(bag: &Bag, topic: usize) -> Result<Self, BagError> {
        let topic = &bag.topics()[topic];
        let source = Source::of_type(&topic.type_name).ok_or_else(|| BagError::TopicType {
            topic: topic.name.clone(),
            expected: Source::ALL.map(Source::type_name).join(", "),
            found: topic.type_name.clone(),
        })?;
        let definitions = topic.definitions()?;
        Ok(Self {
            definitions,
            source,
        })
    }

    pub(crate) fn decode(&self, data: &[u8]) -> Result<JointReading, Refusal> {
        let value = cdr::decode_any(&self.definitions, data)
            .map_err(|error| Refusal::Undecodable(error.to_string()))?;
        self.source.read(&value).ok_or_else(|| {
            Refusal::Undecodable("the definition lacks the fields of its type".to_owned())
        })
    }
}

/// Picks the robot's joints out of a reading; all of them are finite.
pub(crate) fn pick(
    robot: &Robot,
    picker: &mut JointPicker,
    reading: &JointReading,
    quantity: Quantity,
) -> Result<Vec<f64>, Refusal> {
    let picked = picker
        .pick(robot, quantity.of(reading))
        .map_err(|error| Refusal::Joints(quantity.word(), error))?;
    for (joint, value) in robot.joints.iter().zip(&picked) {
        if !value.is_finite() {
            let name = joint.name.clone();
            return Err(Refusal::NotFinite(quantity.word(), name, *value));
        }
    }
    Ok(picked)
}
