//! From the messages of two topics to samples: names matched, stamps checked and paired.

use std::sync::Arc;

use palpate_filter::InputSettings;
use palpate_model::{JointMap, JointSample, ModelError, Pairing, PairingLosses, Robot};

/// The part of a `sensor_msgs/JointState` that matters on one topic.
#[derive(Clone, Copy, Debug)]
pub struct JointMessage<'a> {
    /// Stamp, ns.
    pub stamp_ns: i64,
    /// Joint names, in the message's order.
    pub names: &'a [String],
    /// Positions or torques, in the order of the names.
    pub values: &'a [f64],
}

/// Why a message was refused.
#[derive(Debug, thiserror::Error)]
pub enum MessageError {
    /// A joint is missing.
    #[error("{topic}: {source}")]
    Joints {
        /// The topic.
        topic: &'static str,
        /// Which joints, and what there is instead.
        source: ModelError,
    },
    /// There is not one value a name.
    #[error("{topic}: expected {expected} values, one a name, found {found}")]
    Length {
        /// The topic.
        topic: &'static str,
        /// Number of names.
        expected: usize,
        /// Number of values.
        found: usize,
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
    /// Times that time started anew.
    pub time_jumps: u64,
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
struct Source {
    topic: &'static str,
    names: Vec<String>,
    map: Option<JointMap>,
    last_ns: Option<i64>,
}

/// Turns messages into samples, and counts what it refuses.
#[derive(Debug)]
pub struct JointInput {
    robot: Arc<Robot>,
    position: Source,
    torque: Source,
    pairing: Pairing,
    latest_ns: Option<i64>,
    jump_ns: Option<i64>,
    counts: MessageCounts,
}

impl JointInput {
    /// Takes messages for `robot`.
    pub fn new(robot: Arc<Robot>, settings: &InputSettings) -> Self {
        Self {
            robot,
            position: Source::new("joint_states"),
            torque: Source::new("external_torque"),
            pairing: Pairing::new(nanoseconds(settings.pairing_tolerance_secs)),
            latest_ns: None,
            jump_ns: jump_ns(settings),
            counts: MessageCounts::default(),
        }
    }

    /// Takes over the times of `settings`.
    pub fn set_times(&mut self, settings: &InputSettings) {
        self.pairing
            .set_tolerance(nanoseconds(settings.pairing_tolerance_secs));
        self.jump_ns = jump_ns(settings);
    }

    /// Takes positions; then call [`JointInput::next_sample`] until it gives none.
    ///
    /// # Errors
    /// Names the joint, length or stamp that is wrong, with what was expected and found.
    pub fn position(&mut self, message: JointMessage<'_>) -> Result<(), MessageError> {
        self.counts.positions += 1;
        self.watch_time(message.stamp_ns);
        let read = self.position.read(&self.robot, message);
        let position = self.count(read)?;
        self.pairing.push_position(message.stamp_ns, position);
        Ok(())
    }

    /// Takes external torques; then call [`JointInput::next_sample`] until it gives none.
    ///
    /// # Errors
    /// As [`JointInput::position`].
    pub fn torque(&mut self, message: JointMessage<'_>) -> Result<(), MessageError> {
        self.counts.torques += 1;
        self.watch_time(message.stamp_ns);
        let read = self.torque.read(&self.robot, message);
        let torque = self.count(read)?;
        self.pairing.push_torque(message.stamp_ns, torque);
        Ok(())
    }

    /// The next sample that is complete.
    pub fn next_sample(&mut self) -> Option<TimedSample> {
        let sample = self.pairing.next_sample()?;
        Some(TimedSample {
            sample,
            epoch: self.counts.time_jumps,
        })
    }

    /// What came in and what was refused so far.
    pub fn counts(&self) -> MessageCounts {
        self.counts
    }

    /// What found no partner so far.
    pub fn pairing_losses(&self) -> PairingLosses {
        self.pairing.losses()
    }

    /// Starts anew where time does, as when a bag is played again.
    fn watch_time(&mut self, stamp_ns: i64) {
        let jumped = (self.latest_ns.zip(self.jump_ns))
            .is_some_and(|(latest_ns, jump_ns)| stamp_ns < latest_ns.saturating_sub(jump_ns));
        if jumped {
            self.counts.time_jumps += 1;
            self.pairing.clear();
            self.position.last_ns = None;
            self.torque.last_ns = None;
        }
        if jumped || self.latest_ns.is_none_or(|latest_ns| stamp_ns > latest_ns) {
            self.latest_ns = Some(stamp_ns);
        }
    }

    fn count<T>(&mut self, read: Result<T, MessageError>) -> Result<T, MessageError> {
        match &read {
            Ok(_) => {}
            Err(MessageError::Joints { .. }) => self.counts.joints_missing += 1,
            Err(MessageError::Length { .. }) => self.counts.wrong_length += 1,
            Err(MessageError::StampNotAfter { .. }) => self.counts.stamp_not_after += 1,
        }
        read
    }
}

impl Source {
    fn new(topic: &'static str) -> Self {
        Self {
            topic,
            names: Vec::new(),
            map: None,
            last_ns: None,
        }
    }

    /// The message's values in the robot's order.
    fn read(&mut self, robot: &Robot, message: JointMessage<'_>) -> Result<Vec<f64>, MessageError> {
        let topic = self.topic;
        let joints = |source| MessageError::Joints { topic, source };
        // Names seldom change, but no driver promises that they do not.
        let map = match self.map.take() {
            Some(map) if self.names == message.names => map,
            _ => JointMap::new(robot, message.names).map_err(joints)?,
        };
        let map = self.map.insert(map);
        self.names.clear();
        self.names.extend_from_slice(message.names);
        if message.values.len() != message.names.len() {
            return Err(MessageError::Length {
                topic,
                expected: message.names.len(),
                found: message.values.len(),
            });
        }
        let values = map.pick(message.values).map_err(joints)?;
        match self.last_ns {
            Some(last_ns) if message.stamp_ns <= last_ns => Err(MessageError::StampNotAfter {
                topic,
                last_ns,
                found_ns: message.stamp_ns,
            }),
            _ => {
                self.last_ns = Some(message.stamp_ns);
                Ok(values)
            }
        }
    }
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

    fn input() -> JointInput {
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
        JointInput::new(Arc::new(robot), &InputSettings::default())
    }

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    fn give(
        input: &mut JointInput,
        stamp_ns: i64,
        names: &[String],
        values: &[f64],
    ) -> Vec<TimedSample> {
        let message = JointMessage {
            stamp_ns,
            names,
            values,
        };
        input.position(message).unwrap();
        input.torque(message).unwrap();
        std::iter::from_fn(|| input.next_sample()).collect()
    }

    #[test]
    fn values_follow_their_names_even_when_the_order_changes() {
        let mut input = input();
        let first = give(&mut input, MS, &names(&["a", "b"]), &[1.0, 2.0]);
        let second = give(
            &mut input,
            2 * MS,
            &names(&["gripper", "b", "a"]),
            &[3.0, 2.0, 1.0],
        );
        assert_eq!(first[0].sample.position, [1.0, 2.0]);
        assert_eq!(second[0].sample.position, [1.0, 2.0]);
        assert_eq!(second[0].sample.external_torque, [1.0, 2.0]);
    }

    #[test]
    fn wrong_messages_are_refused_by_name_and_counted() {
        let mut input = input();
        let both = names(&["a", "b"]);
        let one = names(&["a"]);
        give(&mut input, 5 * MS, &both, &[1.0, 2.0]);
        let mut say = |stamp_ns, names: &[String], values: &[f64]| {
            let message = JointMessage {
                stamp_ns,
                names,
                values,
            };
            input.torque(message).unwrap_err().to_string()
        };
        let said = say(6 * MS, &one, &[1.0]);
        assert!(
            said.contains("external_torque") && said.contains("needs b"),
            "{said}"
        );
        let said = say(6 * MS, &both, &[1.0]);
        assert!(
            said.contains("expected 2 values") && said.contains("found 1"),
            "{said}"
        );
        let said = say(5 * MS, &both, &[1.0, 2.0]);
        assert!(
            said.contains("after 5000000 ns") && said.contains("found 5000000 ns"),
            "{said}"
        );
        let counts = input.counts();
        assert_eq!(
            (
                counts.joints_missing,
                counts.wrong_length,
                counts.stamp_not_after,
                counts.torques
            ),
            (1, 1, 1, 4)
        );
        // None of this keeps the next good pair from coming through.
        assert_eq!(give(&mut input, 7 * MS, &both, &[1.0, 2.0]).len(), 1);
    }

    #[test]
    fn times_can_change_while_it_runs() {
        let mut input = input();
        let both = names(&["a", "b"]);
        let mut settings = InputSettings {
            reset_on_time_jump: false,
            ..InputSettings::default()
        };
        give(&mut input, 100_000 * MS, &both, &[1.0, 2.0]);
        input.set_times(&settings);
        let message = JointMessage {
            stamp_ns: MS,
            names: &both,
            values: &[1.0, 2.0],
        };
        assert!(input.torque(message).is_err());
        settings.pairing_tolerance_secs = 0.0;
        input.set_times(&settings);
        for (stamp_ns, expected) in [(100_001 * MS, 0), (100_002 * MS, 1)] {
            let late = JointMessage {
                stamp_ns,
                ..message
            };
            input.torque(late).unwrap();
            let position = JointMessage {
                stamp_ns: 100_002 * MS,
                ..message
            };
            let _ = input.position(position);
            let samples = std::iter::from_fn(|| input.next_sample()).count();
            assert_eq!(samples, expected);
        }
    }

    #[test]
    fn time_that_starts_anew_starts_an_epoch() {
        let mut input = input();
        let both = names(&["a", "b"]);
        let before = give(&mut input, 100_000 * MS, &both, &[1.0, 2.0]);
        let after = give(&mut input, MS, &both, &[1.0, 2.0]);
        assert_eq!((before[0].epoch, after[0].epoch), (0, 1));
        assert!(before[0].is_older(&after[0], i64::MAX));
        assert!(!after[0].is_older(&after[0], 0));
        assert_eq!(input.counts().stamp_not_after, 0);
    }
}
