//! Decoding one message and picking the robot's joints out of it.

use palpate_model::{JointMap, ModelError, Robot};

use crate::bag::Bag;
use crate::definition::{Definition, short_name};
use crate::source::{JointReading, ReadJoints, readable_types, source_of};
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
}

/// Why a message gave nothing.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum Refusal {
    #[error("{0}")]
    Undecodable(String),
    #[error("{0}")]
    Names(String),
    #[error("{0} has {1} values, expected {2}, one a name")]
    Length(&'static str, usize, usize),
    #[error("{0} of {1} is {2}, expected a finite number")]
    NotFinite(&'static str, String, f64),
}

/// Decodes one topic's messages.
pub(crate) struct Decoder {
    definition: Definition,
    read: ReadJoints,
}

impl Decoder {
    pub(crate) fn new(bag: &Bag, topic: usize) -> Result<Self, BagError> {
        let topic = &bag.topics()[topic];
        let read = source_of(&short_name(&topic.type_name)).ok_or_else(|| BagError::TopicType {
            topic: topic.name.clone(),
            expected: readable_types(),
            found: topic.type_name.clone(),
        })?;
        let definition = topic.definition()?;
        Ok(Self { definition, read })
    }

    pub(crate) fn decode(&self, data: &[u8]) -> Result<JointReading, Refusal> {
        let value = cdr::decode(&self.definition, data)
            .map_err(|error| Refusal::Undecodable(error.to_string()))?;
        (self.read)(&value).ok_or_else(|| {
            Refusal::Undecodable("the definition lacks the fields of its type".to_owned())
        })
    }
}

/// The map for the names of the last message; names seldom change.
#[derive(Default)]
pub(crate) struct NameCache {
    names: Vec<String>,
    map: Option<Result<JointMap, String>>,
}

impl NameCache {
    fn map(&mut self, robot: &Robot, names: &[String]) -> Result<&JointMap, Refusal> {
        if self.names != names {
            self.map = None;
            self.names = names.to_vec();
        }
        self.map
            .get_or_insert_with(|| {
                JointMap::new(robot, names).map_err(|error: ModelError| error.to_string())
            })
            .as_ref()
            .map_err(|reason| Refusal::Names(reason.clone()))
    }
}

/// Picks the robot's joints out of a reading.
pub(crate) fn pick(
    robot: &Robot,
    cache: &mut NameCache,
    reading: &JointReading,
    quantity: Quantity,
) -> Result<Vec<f64>, Refusal> {
    let values = match quantity {
        Quantity::Position => &reading.position,
        Quantity::Effort => &reading.effort,
    };
    let map = cache.map(robot, &reading.names)?;
    let (found, expected) = (values.len(), reading.names.len());
    let wrong_length = || Refusal::Length(quantity.word(), found, expected);
    if found != expected {
        return Err(wrong_length());
    }
    let picked = map.pick(values).map_err(|_| wrong_length())?;
    for (joint, value) in robot.joints.iter().zip(&picked) {
        if !value.is_finite() {
            let name = joint.name.clone();
            return Err(Refusal::NotFinite(quantity.word(), name, *value));
        }
    }
    Ok(picked)
}
