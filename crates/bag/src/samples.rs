//! From a bag's messages to the robot's samples.

use palpate_model::{JointMap, JointSample, ModelError, Pairing, PairingLosses, Robot};

use crate::bag::{Bag, Message};
use crate::definition::{Definition, short_name};
use crate::source::{JointReading, ReadJoints, readable_types, source_of};
use crate::{BagError, cdr};

/// Which topics to read; where none is named, the one that fits is found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicChoice {
    /// Topic of the joint positions.
    pub positions: Option<String>,
    /// Topic of the external joint torques.
    pub torques: Option<String>,
}

/// Messages that gave nothing, by cause.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Unusable {
    /// The bytes are not what the definition tells.
    pub undecodable: u64,
    /// Joints of the robot are missing among the names.
    pub names_missing: u64,
    /// As many values as names were expected.
    pub wrong_length: u64,
    /// A value is NaN or infinite.
    pub not_finite: u64,
    /// The first refusal, in words.
    pub first_reason: Option<String>,
}

impl Unusable {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.undecodable + self.names_missing + self.wrong_length + self.not_finite
    }

    fn count(&mut self, refusal: &Refusal) {
        match refusal {
            Refusal::Undecodable(_) => self.undecodable += 1,
            Refusal::Names(_) => self.names_missing += 1,
            Refusal::Length(..) => self.wrong_length += 1,
            Refusal::NotFinite(..) => self.not_finite += 1,
        }
        self.first_reason.get_or_insert_with(|| refusal.to_string());
    }
}

/// What became of one topic's messages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TopicReport {
    /// The topic.
    pub topic: String,
    /// Its type.
    pub type_name: String,
    /// Number of messages read.
    pub messages: u64,
    /// Those that gave nothing.
    pub unusable: Unusable,
}

/// Samples of a bag, in the order of recording, and what became of the messages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Joint positions and external torques in the robot's order, all finite.
    pub samples: Vec<JointSample>,
    /// The messages that positions came from.
    pub positions: TopicReport,
    /// The messages that torques came from.
    pub torques: TopicReport,
    /// What found no partner.
    pub losses: PairingLosses,
}

/// Reads joint positions and external torques of `robot`, pairing stamps that differ by at most `tolerance_ns`.
///
/// Stamps come from the messages' headers; where there is none, or it is zero, from the time of recording. Efforts of
/// a topic that also has positions hold gravity with most drivers: they are taken as external torques only if
/// `choice` names that very topic.
///
/// # Errors
/// If no topic fits or several do, a named topic is absent or of a type without joints, or nothing could be paired.
pub fn read_samples(
    bag: &Bag,
    robot: &Robot,
    choice: &TopicChoice,
    tolerance_ns: i64,
) -> Result<Recording, BagError> {
    let (positions, torques) = choose(bag, robot, choice)?;
    let mut positions = Reader::new(bag, robot, positions, Quantity::Position)?;
    let mut torques = Reader::new(bag, robot, torques, Quantity::Effort)?;
    let mut pairing = Pairing::new(tolerance_ns.max(0));
    let mut samples = Vec::new();
    let mut last_torque_ns = None;
    for message in bag.messages(&[positions.topic, torques.topic])? {
        if let Some((stamp_ns, position)) = positions.read(&message) {
            pairing.push_position(stamp_ns, position);
        }
        if let Some((stamp_ns, torque)) = torques.read(&message) {
            last_torque_ns = last_torque_ns.max(Some(stamp_ns));
            pairing.push_torque(stamp_ns, torque);
        }
        samples.extend(std::iter::from_fn(|| pairing.next_sample()));
    }
    if let Some(last_ns) = last_torque_ns {
        // A position too late for any torque settles those that still wait for a later one.
        let late_ns = last_ns
            .saturating_add(tolerance_ns.max(0))
            .saturating_add(1);
        pairing.push_position(late_ns, Vec::new());
        samples.extend(std::iter::from_fn(|| pairing.next_sample()));
    }
    let recording = Recording {
        samples,
        positions: positions.report,
        torques: torques.report,
        losses: pairing.losses(),
    };
    if recording.samples.is_empty() {
        return Err(nothing_read(&recording));
    }
    Ok(recording)
}

fn nothing_read(recording: &Recording) -> BagError {
    let tell = |report: &TopicReport| {
        let reason = report.unusable.first_reason.as_deref();
        format!(
            "{} gave {} messages, {} unusable{}",
            report.topic,
            report.messages,
            report.unusable.total(),
            reason.map_or(String::new(), |reason| format!(" (the first: {reason})"))
        )
    };
    let unpaired = recording.losses.torque_without_position;
    BagError::NoSample {
        reason: format!(
            "{}; {}; {unpaired} torques found no position near in time",
            tell(&recording.positions),
            tell(&recording.torques)
        ),
    }
}

/// Which of a message's arrays is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
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

#[derive(Clone, Debug, thiserror::Error)]
enum Refusal {
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
struct Decoder {
    definition: Definition,
    read: ReadJoints,
}

impl Decoder {
    fn new(bag: &Bag, topic: usize) -> Result<Self, BagError> {
        let topic = &bag.topics()[topic];
        let read = source_of(&short_name(&topic.type_name)).ok_or_else(|| BagError::TopicType {
            topic: topic.name.clone(),
            expected: readable_types(),
            found: topic.type_name.clone(),
        })?;
        let definition = topic.definition()?;
        Ok(Self { definition, read })
    }

    fn decode(&self, data: &[u8]) -> Result<JointReading, Refusal> {
        let value = cdr::decode(&self.definition, data)
            .map_err(|error| Refusal::Undecodable(error.to_string()))?;
        (self.read)(&value).ok_or_else(|| {
            Refusal::Undecodable("the definition lacks the fields of its type".to_owned())
        })
    }
}

/// The map for the names of the last message; names seldom change.
#[derive(Default)]
struct NameCache {
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
fn pick(
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

/// Reads one quantity from one topic.
struct Reader<'a> {
    robot: &'a Robot,
    topic: usize,
    quantity: Quantity,
    decoder: Decoder,
    names: NameCache,
    report: TopicReport,
}

impl<'a> Reader<'a> {
    fn new(
        bag: &Bag,
        robot: &'a Robot,
        topic: usize,
        quantity: Quantity,
    ) -> Result<Self, BagError> {
        Ok(Self {
            robot,
            topic,
            quantity,
            decoder: Decoder::new(bag, topic)?,
            names: NameCache::default(),
            report: TopicReport {
                topic: bag.topics()[topic].name.clone(),
                type_name: bag.topics()[topic].type_name.clone(),
                ..TopicReport::default()
            },
        })
    }

    /// Stamp (ns) and values in the robot's order; none if the message is another topic's, or unusable.
    fn read(&mut self, message: &Message) -> Option<(i64, Vec<f64>)> {
        if message.topic != self.topic {
            return None;
        }
        self.report.messages += 1;
        let read = self.decoder.decode(&message.data).and_then(|reading| {
            let values = pick(self.robot, &mut self.names, &reading, self.quantity)?;
            Ok((reading.stamp_ns.unwrap_or(message.log_time_ns), values))
        });
        read.inspect_err(|refusal| self.report.unusable.count(refusal))
            .ok()
            .map(|(stamp_ns, values)| (stamp_ns.clamp(-STAMP_LIMIT_NS, STAMP_LIMIT_NS), values))
    }
}

/// Stamps further from the epoch (73 years) are cut, so that differences cannot overflow.
const STAMP_LIMIT_NS: i64 = i64::MAX / 4;

/// What a topic could serve as.
#[derive(Clone, Copy, Debug, Default)]
struct Fitness {
    positions: bool,
    efforts: bool,
}

fn choose(bag: &Bag, robot: &Robot, choice: &TopicChoice) -> Result<(usize, usize), BagError> {
    let named = |name: &Option<String>| name.as_deref().map(|name| bag.topic(name)).transpose();
    let (positions, torques) = (named(&choice.positions)?, named(&choice.torques)?);
    if let (Some(positions), Some(torques)) = (positions, torques) {
        return Ok((positions, torques));
    }
    let fitness = fitness(bag, robot)?;
    let fitting = |fits: &dyn Fn(usize, Fitness) -> bool| -> Vec<usize> {
        let all = fitness.iter().copied().enumerate();
        all.filter(|(topic, fitness)| fits(*topic, *fitness))
            .map(|(topic, _)| topic)
            .collect()
    };
    let positions = match positions {
        Some(topic) => topic,
        None => the_only(
            bag,
            "joint positions",
            "--positions",
            &fitting(&|_, fitness| fitness.positions),
        )?,
    };
    let torques = match torques {
        Some(topic) => topic,
        None => the_only(
            bag,
            "external joint torques",
            "--torques",
            // Efforts beside positions are a driver's joint torques, gravity included.
            &fitting(&|topic, fitness| topic != positions && fitness.efforts && !fitness.positions),
        )?,
    };
    Ok((positions, torques))
}

fn the_only(
    bag: &Bag,
    what: &'static str,
    option: &'static str,
    fitting: &[usize],
) -> Result<usize, BagError> {
    let names: Vec<_> = fitting
        .iter()
        .map(|&topic| bag.topics()[topic].name.as_str())
        .collect();
    match fitting {
        [topic] => Ok(*topic),
        _ => Err(BagError::Choice {
            what,
            option,
            fitting: match names.len() {
                0 => "no topic fits".to_owned(),
                count => format!("{count} topics fit ({})", names.join(", ")),
            },
            found: bag.topic_list(),
        }),
    }
}

/// What each topic could serve as: it does if one message has finite values for all of the robot's joints.
fn fitness(bag: &Bag, robot: &Robot) -> Result<Vec<Fitness>, BagError> {
    let decoders: Vec<_> = (0..bag.topics().len())
        .map(|topic| Decoder::new(bag, topic).ok())
        .collect();
    let readable: Vec<_> = (0..decoders.len())
        .filter(|&topic| decoders[topic].is_some())
        .collect();
    let mut fitness = vec![Fitness::default(); decoders.len()];
    let mut names = NameCache::default();
    for message in bag.messages(&readable)? {
        let fits = &mut fitness[message.topic];
        if fits.positions && fits.efforts {
            continue;
        }
        let decoder = decoders[message.topic].as_ref();
        if let Some(Ok(reading)) = decoder.map(|decoder| decoder.decode(&message.data)) {
            let mut has = |quantity| pick(robot, &mut names, &reading, quantity).is_ok();
            fits.positions |= has(Quantity::Position);
            fits.efforts |= has(Quantity::Effort);
        }
    }
    Ok(fitness)
}
