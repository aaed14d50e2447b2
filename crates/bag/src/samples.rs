//! From a bag's messages to the robot's samples.

use palpate_model::{
    JointPicker, JointReading, JointSample, MeasuredSample, ModelError, Pairing, PairingLosses,
    Robot,
};

use crate::BagError;
use crate::bag::{Bag, Message};
use crate::choice::{Chosen, TopicChoice, choose};
use crate::reading::{Decoder, Quantity, Refusal, pick};

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
            Refusal::Joints(_, ModelError::JointsMissing { .. }) => self.names_missing += 1,
            Refusal::Joints(..) => self.wrong_length += 1,
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

/// Reads joint positions and external torques of `robot`, pairing stamps that differ by at most `tolerance_ns`; where
/// one topic's messages hold both, those of one message belong together.
///
/// Stamps come from the messages' headers; where there is none, or it is zero, from the time of recording. Efforts of
/// a `JointState` that also has positions hold gravity with most drivers: they are taken as external torques only if
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
    let chosen = choose(bag, robot, choice)?;
    let names = &choice.joint_names;
    let recording = if chosen.positions == chosen.torques {
        read_together(bag, robot, names, chosen.torques)?
    } else {
        read_apart(bag, robot, names, chosen, tolerance_ns.max(0))?
    };
    if recording.samples.is_empty() {
        return Err(nothing_read(&recording));
    }
    Ok(recording)
}

/// Reads one topic whose messages hold both.
fn read_together(
    bag: &Bag,
    robot: &Robot,
    joint_names: &[String],
    topic: usize,
) -> Result<Recording, BagError> {
    let mut reader = Reader::new(bag, robot, joint_names, topic)?;
    let both = [Quantity::Position, Quantity::Effort];
    let messages = bag.messages(&[topic])?;
    let samples = messages
        .iter()
        .filter_map(|message| reader.read(message, both))
        .map(|(stamp_ns, [position, external_torque])| JointSample {
            stamp_ns,
            position,
            external_torque,
        })
        .collect();
    Ok(Recording {
        samples,
        positions: reader.report.clone(),
        torques: reader.report,
        losses: PairingLosses::default(),
    })
}

/// Reads two topics and pairs their messages.
fn read_apart(
    bag: &Bag,
    robot: &Robot,
    joint_names: &[String],
    chosen: Chosen,
    tolerance_ns: i64,
) -> Result<Recording, BagError> {
    let mut positions = Reader::new(bag, robot, joint_names, chosen.positions)?;
    let mut torques = Reader::new(bag, robot, joint_names, chosen.torques)?;
    let mut pairing = Pairing::new(tolerance_ns);
    let mut samples = Vec::new();
    let mut last_torque_ns = None;
    for message in bag.messages(&[chosen.positions, chosen.torques])? {
        if let Some((stamp_ns, [position])) = positions.read(&message, [Quantity::Position]) {
            pairing.push_position(stamp_ns, position);
        }
        if let Some((stamp_ns, [torque])) = torques.read(&message, [Quantity::Effort]) {
            last_torque_ns = last_torque_ns.max(Some(stamp_ns));
            pairing.push_torque(stamp_ns, torque);
        }
        samples.extend(std::iter::from_fn(|| pairing.next_sample()));
    }
    if let Some(last_ns) = last_torque_ns {
        // A position too late for any torque settles those that still wait for a later one.
        let late_ns = last_ns.saturating_add(tolerance_ns).saturating_add(1);
        pairing.push_position(late_ns, Vec::new());
        samples.extend(std::iter::from_fn(|| pairing.next_sample()));
    }
    Ok(Recording {
        samples,
        positions: positions.report,
        torques: torques.report,
        losses: pairing.losses(),
    })
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

/// Reads one topic.
pub(crate) struct Reader<'a> {
    robot: &'a Robot,
    topic: usize,
    decoder: Decoder,
    picker: JointPicker,
    pub(crate) report: TopicReport,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(
        bag: &Bag,
        robot: &'a Robot,
        joint_names: &[String],
        topic: usize,
    ) -> Result<Self, BagError> {
        Ok(Self {
            robot,
            topic,
            decoder: Decoder::new(bag, topic)?,
            picker: JointPicker::new(robot, joint_names),
            report: TopicReport {
                topic: bag.topics()[topic].name.clone(),
                type_name: bag.topics()[topic].type_name.clone(),
                ..TopicReport::default()
            },
        })
    }

    /// Stamp (ns) and the wanted values in the robot's order; none if the message is another topic's, or unusable.
    fn read<const COUNT: usize>(
        &mut self,
        message: &Message,
        wanted: [Quantity; COUNT],
    ) -> Option<(i64, [Vec<f64>; COUNT])> {
        self.read_by(message, |reader, reading, stamp_ns| {
            Ok((stamp_ns, reader.pick(reading, wanted)?))
        })
    }

    /// Positions, speeds if there are any, and torques; none if the message is another topic's, or unusable.
    pub(crate) fn read_measured(&mut self, message: &Message) -> Option<MeasuredSample> {
        self.read_by(message, |reader, reading, stamp_ns| {
            reading
                .measured(reader.robot, &mut reader.picker, stamp_ns)
                .map_err(|(what, error)| Refusal::Joints(what, error))
        })
    }

    /// What `take` makes of the decoded message and its stamp (ns).
    fn read_by<T>(
        &mut self,
        message: &Message,
        take: impl FnOnce(&mut Self, &JointReading, i64) -> Result<T, Refusal>,
    ) -> Option<T> {
        if message.topic != self.topic {
            return None;
        }
        self.report.messages += 1;
        let read = self.decoder.decode(&message.data).and_then(|reading| {
            let stamp_ns = reading.stamp_ns.unwrap_or(message.log_time_ns);
            let stamp_ns = stamp_ns.clamp(-STAMP_LIMIT_NS, STAMP_LIMIT_NS);
            take(self, &reading, stamp_ns)
        });
        read.inspect_err(|refusal| self.report.unusable.count(refusal))
            .ok()
    }

    fn pick<const COUNT: usize>(
        &mut self,
        reading: &JointReading,
        wanted: [Quantity; COUNT],
    ) -> Result<[Vec<f64>; COUNT], Refusal> {
        let mut picked = [const { Vec::new() }; COUNT];
        for (values, quantity) in picked.iter_mut().zip(wanted) {
            *values = pick(self.robot, &mut self.picker, reading, quantity)?;
        }
        Ok(picked)
    }
}

/// Stamps further from the epoch (73 years) are cut, so that differences cannot overflow.
const STAMP_LIMIT_NS: i64 = i64::MAX / 4;
