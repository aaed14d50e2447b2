//! From a bag's messages to the robot's samples.

use palpate_model::{JointSample, Pairing, PairingLosses, Robot};

use crate::BagError;
use crate::bag::{Bag, Message};
use crate::choice::{TopicChoice, choose};
use crate::reading::{Decoder, NameCache, Quantity, Refusal, pick};

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
