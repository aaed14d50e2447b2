//! From drivers' messages to samples: names matched, stamps checked, positions and torques paired.

use std::sync::Arc;

use palpate_filter::InputSettings;
use palpate_model::{
    BeyondLimit, ExternalTorque, JointPicker, JointReading, JointSample, JointValues, ModelError,
    Pairing, PairingLosses, Robot, Source, TorqueRefusal,
};

use crate::measured_input::MeasuredInput;

/// Why a message was refused.
#[derive(Debug, thiserror::Error)]
pub enum MessageError {
    /// The message lacks a field that its type promises.
    #[error(
        "{topic}: expected the fields of {expected}, found another version of it or an undecodable message"
    )]
    Fields {
        /// The topic.
        topic: &'static str,
        /// The message type.
        expected: &'static str,
    },
    /// A joint is missing, or there is not one value a name.
    #[error("{topic}, {quantity}: {source}")]
    Joints {
        /// The topic.
        topic: &'static str,
        /// `position` or `torque`.
        quantity: &'static str,
        /// What is missing, and what there is instead.
        source: ModelError,
    },
    /// The message has no stamp, and there is no time to stamp it with.
    #[error("{topic}: the message has no stamp, and use_sim_time is set, but nothing is on /clock")]
    NoTime {
        /// The topic.
        topic: &'static str,
    },
    /// A measured torque, or what is needed to tell the external one from it, is missing or wrong.
    #[error("{topic}: {source}")]
    Measured {
        /// The topic.
        topic: &'static str,
        /// What is wrong.
        source: TorqueRefusal,
    },
    /// The stamp is not after the topic's last one.
    #[error("{topic}: expected a stamp after {last_ns} ns, found {found_ns} ns")]
    StampNotAfter {
        /// The topic.
        topic: &'static str,
        /// The last stamp.
        last_ns: i64,
        /// The refused stamp.
        found_ns: i64,
    },
}

/// What came in, and what of it was refused, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MessageCounts {
    /// Messages with positions.
    pub positions: u64,
    /// Messages with torques.
    pub torques: u64,
    /// Refused: a joint of the robot is missing.
    pub joints_missing: u64,
    /// Refused: not one value a name.
    pub wrong_length: u64,
    /// Refused: the stamp does not advance.
    pub stamp_not_after: u64,
    /// Refused: not the fields of its type, or without any time to stamp it with.
    pub unreadable: u64,
    /// Refused: a position, speed or measured torque is missing, or no number.
    pub unmeasured: u64,
    /// Times that time started anew.
    pub time_jumps: u64,
}

/// How far the times that the newest messages tell lie behind this node's clock, ns: their way here, and the difference
/// of the clocks. None where a message tells no time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Delays {
    /// Of the positions' stamp.
    pub position_ns: Option<i64>,
    /// Of the torques' stamp.
    pub torque_ns: Option<i64>,
    /// Of the robot controller's own clock.
    pub controller_ns: Option<i64>,
}

/// A sample, and how often time had started anew before it.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedSample {
    /// The sample.
    pub sample: JointSample,
    /// Samples of different epochs have nothing to do with each other.
    pub epoch: u64,
}

impl TimedSample {
    /// Whether this sample is older than `newest` by more than `age_ns`, or of another epoch.
    pub fn is_older(&self, newest: &Self, age_ns: i64) -> bool {
        let age = newest.sample.stamp_ns.saturating_sub(self.sample.stamp_ns);
        self.epoch != newest.epoch || age > age_ns
    }
}

/// One of the two topics.
#[derive(Debug)]
struct Topic {
    name: &'static str,
    picker: JointPicker,
    last_ns: Option<i64>,
}

/// Turns messages into samples, and counts what it refuses.
#[derive(Debug)]
pub struct JointInput {
    robot: Arc<Robot>,
    source: Source,
    position: Topic,
    torque: Topic,
    pairing: Pairing,
    /// None where torques come in as external ones.
    measured: Option<MeasuredInput>,
    jump_ns: Option<i64>,
    counts: MessageCounts,
    delays: Delays,
}

impl JointInput {
    /// Takes messages for `robot`.
    pub fn new(robot: Arc<Robot>, settings: &InputSettings) -> Self {
        let topic = |name| Topic {
            name,
            picker: JointPicker::new(&robot, &settings.unnamed_joints()),
            last_ns: None,
        };
        Self {
            source: settings.source,
            position: topic("joint_states"),
            torque: topic("external_torque"),
            robot,
            pairing: Pairing::new(nanoseconds(settings.pairing_tolerance_secs)),
            measured: None,
            jump_ns: jump_ns(settings),
            counts: MessageCounts::default(),
            delays: Delays::default(),
        }
    }

    /// Takes positions, speeds and measured torques together on `joint_states`, and tells the external torque by
    /// `external`. Nothing is expected on `external_torque` then.
    pub fn with_measured_torques(mut self, external: ExternalTorque) -> Self {
        self.measured = Some(MeasuredInput::new(external));
        self
    }

    /// Takes over the times of `settings`.
    pub fn set_times(&mut self, settings: &InputSettings) {
        self.pairing
            .set_tolerance(nanoseconds(settings.pairing_tolerance_secs));
        self.jump_ns = jump_ns(settings);
    }

    /// Takes what a message on `joint_states` tells (none if it could not be read), at the node's time `now_ns` (none if
    /// that is not known yet); then call [`JointInput::next_sample`] until it gives none.
    ///
    /// # Errors
    /// Names the joint, length or stamp that is wrong, with what was expected and found.
    pub fn position(
        &mut self,
        reading: Option<&JointReading>,
        now_ns: Option<i64>,
    ) -> Result<(), MessageError> {
        self.counts.positions += 1;
        self.counts.torques += u64::from(self.measured.is_some());
        let taken = self.take_position(reading, now_ns);
        self.count(taken)
    }

    /// Takes what a message on `external_torque` tells: torques, and positions too where the source has both.
    ///
    /// # Errors
    /// As [`JointInput::position`].
    pub fn torque(
        &mut self,
        reading: Option<&JointReading>,
        now_ns: Option<i64>,
    ) -> Result<(), MessageError> {
        self.counts.torques += 1;
        self.counts.positions += u64::from(self.source.has_both());
        let taken = self.take_torque(reading, now_ns);
        self.count(taken)
    }

    fn take_position(
        &mut self,
        reading: Option<&JointReading>,
        now_ns: Option<i64>,
    ) -> Result<(), MessageError> {
        let reading = self.position.read(reading, Source::JointState)?;
        self.delays.position_ns = delay(now_ns, reading.stamp_ns);
        let stamp_ns = self.position.stamp(reading, now_ns, self.jump_ns)?;
        self.watch_time(self.position.last_ns, stamp_ns);
        if self.measured.is_some() {
            return self.take_measured(reading, stamp_ns);
        }
        let position = self
            .position
            .pick(&self.robot, "position", &reading.position)?;
        self.position.advance(stamp_ns)?;
        self.pairing.push_position(stamp_ns, position);
        Ok(())
    }

    fn take_measured(&mut self, reading: &JointReading, stamp_ns: i64) -> Result<(), MessageError> {
        let topic = self.position.name;
        let sample = reading
            .measured(&self.robot, &mut self.position.picker, stamp_ns)
            .map_err(|(quantity, source)| MessageError::Joints {
                topic,
                quantity,
                source,
            })?;
        self.position.advance(stamp_ns)?;
        let taken = self
            .measured
            .as_mut()
            .map(|measured| measured.take(&sample));
        taken
            .unwrap_or(Ok(()))
            .map_err(|source| MessageError::Measured { topic, source })
    }

    fn take_torque(
        &mut self,
        reading: Option<&JointReading>,
        now_ns: Option<i64>,
    ) -> Result<(), MessageError> {
        let reading = self.torque.read(reading, self.source)?;
        self.delays.torque_ns = delay(now_ns, reading.stamp_ns);
        self.delays.controller_ns = delay(now_ns, reading.controller_ns);
        let stamp_ns = self.torque.stamp(reading, now_ns, self.jump_ns)?;
        self.watch_time(self.torque.last_ns, stamp_ns);
        let torque = self.torque.pick(&self.robot, "torque", &reading.effort)?;
        let position = match self.source.has_both() {
            true => Some(
                self.torque
                    .pick(&self.robot, "position", &reading.position)?,
            ),
            false => None,
        };
        self.torque.advance(stamp_ns)?;
        if let Some(position) = position {
            self.pairing.push_position(stamp_ns, position);
        }
        self.pairing.push_torque(stamp_ns, torque);
        Ok(())
    }

    /// The next sample that is complete.
    pub fn next_sample(&mut self) -> Option<TimedSample> {
        let sample = match &mut self.measured {
            Some(measured) => measured.next_sample()?,
            None => self.pairing.next_sample()?,
        };
        Some(TimedSample {
            sample,
            epoch: self.counts.time_jumps,
        })
    }

    /// What came in and what was refused so far.
    pub fn counts(&self) -> MessageCounts {
        self.counts
    }

    /// How far the times of the newest messages lie behind the node's.
    pub fn delays(&self) -> Delays {
        self.delays
    }

    /// How many samples had a measured torque beyond its joint's limit, and the first of these torques.
    pub fn beyond_limit(&self) -> (u64, Option<&BeyondLimit>) {
        let measured = self.measured.as_ref();
        measured.map_or((0, None), MeasuredInput::beyond_limit)
    }

    /// What found no partner so far.
    pub fn pairing_losses(&self) -> PairingLosses {
        self.pairing.losses()
    }

    /// Starts anew where a topic's time does, as when a bag is played again. That the two topics' clocks differ is no such
    /// jump.
    fn watch_time(&mut self, last_ns: Option<i64>, stamp_ns: i64) {
        let jumped = (last_ns.zip(self.jump_ns))
            .is_some_and(|(last_ns, jump_ns)| stamp_ns < last_ns.saturating_sub(jump_ns));
        if jumped {
            self.counts.time_jumps += 1;
            self.pairing.clear();
            if let Some(measured) = &mut self.measured {
                measured.restart();
            }
            self.position.last_ns = None;
            self.torque.last_ns = None;
        }
    }

    fn count<T>(&mut self, read: Result<T, MessageError>) -> Result<T, MessageError> {
        match &read {
            Ok(_) => {}
            Err(MessageError::Joints { source, .. }) => match source {
                ModelError::JointsMissing { .. } => self.counts.joints_missing += 1,
                _ => self.counts.wrong_length += 1,
            },
            Err(MessageError::StampNotAfter { .. }) => self.counts.stamp_not_after += 1,
            Err(MessageError::Measured { .. }) => self.counts.unmeasured += 1,
            Err(MessageError::Fields { .. } | MessageError::NoTime { .. }) => {
                self.counts.unreadable += 1;
            }
        }
        read
    }
}

impl Topic {
    fn read<'r>(
        &self,
        reading: Option<&'r JointReading>,
        source: Source,
    ) -> Result<&'r JointReading, MessageError> {
        reading.ok_or(MessageError::Fields {
            topic: self.name,
            expected: source.type_name(),
        })
    }

    /// The message's stamp; where it has none, the time now, and at least a nanosecond after the last: several messages
    /// may be taken at once, and simulated time stands still between its ticks.
    fn stamp(
        &self,
        reading: &JointReading,
        now_ns: Option<i64>,
        jump_ns: Option<i64>,
    ) -> Result<i64, MessageError> {
        if let Some(stamp_ns) = reading.stamp_ns {
            return Ok(stamp_ns);
        }
        let now_ns = now_ns.ok_or(MessageError::NoTime { topic: self.name })?;
        let after_ns = self.last_ns.map_or(now_ns, |ns| ns.saturating_add(1));
        let jumped = jump_ns.is_some_and(|jump_ns| now_ns < after_ns.saturating_sub(jump_ns));
        Ok(if jumped { now_ns } else { now_ns.max(after_ns) })
    }

    /// The values in the robot's order.
    fn pick(
        &mut self,
        robot: &Robot,
        quantity: &'static str,
        joints: &JointValues,
    ) -> Result<Vec<f64>, MessageError> {
        let topic = self.name;
        let picked = self.picker.pick(robot, joints);
        picked.map_err(|source| MessageError::Joints {
            topic,
            quantity,
            source,
        })
    }

    /// Remembers the stamp, which must be after the last one.
    fn advance(&mut self, stamp_ns: i64) -> Result<(), MessageError> {
        if let Some(last_ns) = self.last_ns.filter(|last_ns| stamp_ns <= *last_ns) {
            return Err(MessageError::StampNotAfter {
                topic: self.name,
                last_ns,
                found_ns: stamp_ns,
            });
        }
        self.last_ns = Some(stamp_ns);
        Ok(())
    }
}

fn delay(now_ns: Option<i64>, told_ns: Option<i64>) -> Option<i64> {
    now_ns?.checked_sub(told_ns?)
}

/// How far back a stamp must lie for time to start anew; none where that is not followed.
fn jump_ns(settings: &InputSettings) -> Option<i64> {
    (settings.reset_on_time_jump).then(|| nanoseconds(settings.time_jump_secs))
}

/// Nanoseconds of a setting. Saturates.
pub fn nanoseconds(secs: f64) -> i64 {
    (secs * 1e9) as i64
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};
    use palpate_model::{Joint, JointKind, Link};

    use super::*;

    const MS: i64 = 1_000_000;

    fn input_of(settings: &InputSettings) -> JointInput {
        let joint = |name: &str| Joint {
            name: name.to_owned(),
            kind: JointKind::Continuous,
            axis_in_joint: Vector3::z_axis(),
            limits: None,
        };
        let link = Link {
            name: "base".to_owned(),
            parent: None,
            parent_from_rest: Isometry3::identity(),
            joint: None,
            path: Vec::new(),
            inertial: None,
            mesh: None,
        };
        let robot = Robot {
            name: "two".to_owned(),
            joints: vec![joint("a"), joint("b")],
            links: vec![link],
        };
        JointInput::new(Arc::new(robot), settings)
    }

    fn input() -> JointInput {
        input_of(&InputSettings::default())
    }

    fn input_from(source: Source) -> JointInput {
        input_of(&InputSettings {
            source,
            ..InputSettings::default()
        })
    }

    fn samples(input: &mut JointInput) -> Vec<TimedSample> {
        std::iter::from_fn(|| input.next_sample()).collect()
    }

    /// A reading as of a `JointState` with both, or of a message with both.
    fn reading(stamp_ns: i64, names: &[&str], values: &[f64]) -> JointReading {
        let names = names.iter().map(|name| (*name).to_owned()).collect();
        let joints = JointValues::named(names, values.to_vec());
        JointReading {
            stamp_ns: Some(stamp_ns),
            position: joints.clone(),
            effort: joints,
            ..JointReading::default()
        }
    }

    /// A reading as of a message that has neither header nor names.
    fn bare(values: &[f64]) -> JointReading {
        JointReading {
            position: JointValues::unnamed(values.to_vec()),
            effort: JointValues::unnamed(values.to_vec()),
            ..JointReading::default()
        }
    }

    fn give(input: &mut JointInput, reading: &JointReading) -> Vec<TimedSample> {
        input.position(Some(reading), None).unwrap();
        input.torque(Some(reading), None).unwrap();
        samples(input)
    }

    #[test]
    fn values_follow_their_names_even_when_the_order_changes() {
        let mut input = input();
        let first = give(&mut input, &reading(MS, &["a", "b"], &[1.0, 2.0]));
        let names = ["gripper", "b", "a"];
        let second = give(&mut input, &reading(2 * MS, &names, &[3.0, 2.0, 1.0]));
        assert_eq!(first[0].sample.position, [1.0, 2.0]);
        assert_eq!(second[0].sample.position, [1.0, 2.0]);
        assert_eq!(second[0].sample.external_torque, [1.0, 2.0]);
    }

    #[test]
    fn wrong_messages_are_refused_by_name_and_counted() {
        let mut input = input();
        let both = ["a", "b"];
        give(&mut input, &reading(5 * MS, &both, &[1.0, 2.0]));
        let mut say = |reading: Option<&JointReading>| {
            let refusal = input.torque(reading, None).unwrap_err();
            refusal.to_string()
        };
        let said = say(Some(&reading(6 * MS, &["a"], &[1.0])));
        assert!(
            said.contains("external_torque, torque") && said.contains("needs b"),
            "{said}"
        );
        let said = say(Some(&reading(6 * MS, &both, &[1.0])));
        assert!(
            said.contains("expected 2 values") && said.contains("found 1"),
            "{said}"
        );
        let said = say(Some(&reading(5 * MS, &both, &[1.0, 2.0])));
        assert!(
            said.contains("after 5000000 ns") && said.contains("found 5000000 ns"),
            "{said}"
        );
        let said = say(None);
        assert!(said.contains("sensor_msgs/msg/JointState"), "{said}");
        let said = say(Some(&bare(&[1.0, 2.0])));
        assert!(said.contains("nothing is on /clock"), "{said}");
        let counts = input.counts();
        let expected = MessageCounts {
            positions: 1,
            torques: 6,
            joints_missing: 1,
            wrong_length: 1,
            stamp_not_after: 1,
            unreadable: 2,
            unmeasured: 0,
            time_jumps: 0,
        };
        assert_eq!(counts, expected);
        // None of this keeps the next good pair from coming through.
        let good = reading(7 * MS, &both, &[1.0, 2.0]);
        assert_eq!(give(&mut input, &good).len(), 1);
    }

    #[test]
    fn positions_and_torques_of_one_message_belong_together() {
        let mut input = input_from(Source::FrankaState);
        let mut both = reading(5 * MS, &["a", "b"], &[1.0, 2.0]);
        both.effort.values = vec![3.0, 4.0];
        input.torque(Some(&both), None).unwrap();
        let found = samples(&mut input);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].sample.position, [1.0, 2.0]);
        assert_eq!(found[0].sample.external_torque, [3.0, 4.0]);
        // Torques without their positions are not paired with earlier ones.
        let mut half = reading(6 * MS, &["a", "b"], &[1.0, 2.0]);
        half.position.values.pop();
        let refusal = input.torque(Some(&half), None).unwrap_err().to_string();
        assert!(refusal.contains("external_torque, position"), "{refusal}");
        assert!(samples(&mut input).is_empty());
        let counts = input.counts();
        assert_eq!((counts.positions, counts.torques), (2, 2));
    }

    #[test]
    fn messages_without_a_stamp_take_the_time_of_their_arrival() {
        let mut input = input_from(Source::LbrState);
        let mut stamp = |now_ns| {
            input
                .torque(Some(&bare(&[1.0, 2.0])), Some(now_ns))
                .unwrap();
            let found = samples(&mut input);
            assert_eq!(found.len(), 1);
            (found[0].sample.stamp_ns, found[0].epoch)
        };
        assert_eq!(stamp(100_000 * MS), (100_000 * MS, 0));
        // Taken at once, or between two ticks of a simulated clock.
        assert_eq!(stamp(100_000 * MS), (100_000 * MS + 1, 0));
        // A clock that is set back a little.
        assert_eq!(stamp(99_999 * MS), (100_000 * MS + 2, 0));
        assert_eq!(stamp(100_010 * MS), (100_010 * MS, 0));
        // A bag that is played again.
        assert_eq!(stamp(5 * MS), (5 * MS, 1));
    }

    #[test]
    fn bare_torques_are_paired_with_stamped_positions() {
        let mut input = input_from(Source::MultiArray);
        let torque = bare(&[3.0, 4.0]);
        for step in 1..=3 {
            let position = reading(step * 10 * MS, &["b", "a"], &[2.0, 1.0]);
            let now_ns = Some(step * 10 * MS + 2 * MS);
            input.position(Some(&position), now_ns).unwrap();
            input.torque(Some(&torque), now_ns).unwrap();
        }
        let found = samples(&mut input);
        assert_eq!(found.len(), 2, "the last waits for a later position");
        assert_eq!(found[0].sample.stamp_ns, 12 * MS);
        assert_eq!(found[0].sample.position, [1.0, 2.0]);
        assert_eq!(found[0].sample.external_torque, [3.0, 4.0]);
    }

    #[test]
    fn delays_tell_how_clocks_differ() {
        let mut input = input();
        let now_ns = Some(100 * MS);
        let ahead = reading(130 * MS, &["a", "b"], &[1.0, 2.0]);
        let mut behind = reading(60 * MS, &["a", "b"], &[1.0, 2.0]);
        behind.controller_ns = Some(i64::MIN);
        input.position(Some(&ahead), now_ns).unwrap();
        input.torque(Some(&behind), now_ns).unwrap();
        let expected = Delays {
            position_ns: Some(-30 * MS),
            torque_ns: Some(40 * MS),
            controller_ns: None,
        };
        assert_eq!(input.delays(), expected);
    }

    #[test]
    fn clocks_that_differ_are_no_jump() {
        let mut input = input();
        for step in 0..3 {
            let at = |stamp_ns| reading(stamp_ns, &["a", "b"], &[1.0, 2.0]);
            input.position(Some(&at(90_000 * MS + step)), None).unwrap();
            input.torque(Some(&at(step)), None).unwrap();
        }
        assert!(samples(&mut input).is_empty());
        assert_eq!(input.counts().time_jumps, 0);
        assert_eq!(input.pairing_losses().torque_without_position, 3);
    }

    #[test]
    fn times_can_change_while_it_runs() {
        let mut input = input();
        let mut settings = InputSettings {
            reset_on_time_jump: false,
            ..InputSettings::default()
        };
        let at = |stamp_ns| reading(stamp_ns, &["a", "b"], &[1.0, 2.0]);
        give(&mut input, &at(100_000 * MS));
        input.set_times(&settings);
        assert!(input.torque(Some(&at(MS)), None).is_err());
        settings.pairing_tolerance_secs = 0.0;
        input.set_times(&settings);
        for (stamp_ns, expected) in [(100_001 * MS, 0), (100_002 * MS, 1)] {
            input.torque(Some(&at(stamp_ns)), None).unwrap();
            let _ = input.position(Some(&at(100_002 * MS)), None);
            assert_eq!(samples(&mut input).len(), expected);
        }
    }

    #[test]
    fn time_that_starts_anew_starts_an_epoch() {
        let mut input = input();
        let before = give(&mut input, &reading(100_000 * MS, &["a", "b"], &[1.0, 2.0]));
        let after = give(&mut input, &reading(MS, &["a", "b"], &[1.0, 2.0]));
        assert_eq!((before[0].epoch, after[0].epoch), (0, 1));
        assert!(before[0].is_older(&after[0], i64::MAX));
        assert!(!after[0].is_older(&after[0], 0));
        assert_eq!(input.counts().stamp_not_after, 0);
    }
}
