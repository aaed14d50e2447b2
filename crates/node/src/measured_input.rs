//! Samples of messages that hold measured torques beside positions.

use std::collections::VecDeque;

use palpate_model::{BeyondLimit, ExternalTorque, JointSample, MeasuredSample, TorqueRefusal};

/// Makes samples with external torques, and keeps them until they are asked for.
#[derive(Debug)]
pub(crate) struct MeasuredInput {
    external: ExternalTorque,
    ready: VecDeque<JointSample>,
}

impl MeasuredInput {
    pub(crate) fn new(external: ExternalTorque) -> Self {
        Self {
            external,
            ready: VecDeque::new(),
        }
    }

    pub(crate) fn take(&mut self, measured: &MeasuredSample) -> Result<(), TorqueRefusal> {
        let sample = self.external.update(measured)?;
        self.ready.push_back(sample.clone());
        Ok(())
    }

    pub(crate) fn next_sample(&mut self) -> Option<JointSample> {
        self.ready.pop_front()
    }

    /// Starts anew, as time does.
    pub(crate) fn restart(&mut self) {
        self.external.restart();
        self.ready.clear();
    }

    pub(crate) fn beyond_limit(&self) -> (u64, Option<&BeyondLimit>) {
        let count = self.external.counts().beyond_limit;
        (count, self.external.beyond_limit())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use palpate_filter::{InputSettings, TorqueSettings, TorqueSource};
    use palpate_model::{JointReading, JointValues, LoadOptions, Robot, Source, iiwa14};

    use crate::JointInput;

    const MS: i64 = 1_000_000;

    fn robot() -> Arc<Robot> {
        Arc::new(iiwa14(&LoadOptions::default()).unwrap())
    }

    fn input(robot: &Arc<Robot>, settings: &InputSettings) -> JointInput {
        let torque = TorqueSettings {
            source: TorqueSource::Static,
            ..TorqueSettings::default()
        };
        let external = torque.external_torque(robot).unwrap().unwrap();
        JointInput::new(Arc::clone(robot), settings).with_measured_torques(external)
    }

    /// All seven joints at rest, in a driver's own order.
    fn reading(robot: &Robot, stamp_ns: i64, first_torque: f64) -> JointReading {
        let names: Vec<_> = robot
            .joints
            .iter()
            .rev()
            .map(|joint| joint.name.clone())
            .collect();
        let values = |values: Vec<f64>| JointValues::named(names.clone(), values);
        JointReading {
            stamp_ns: Some(stamp_ns),
            position: values(vec![0.0; 7]),
            velocity: values(vec![0.0; 7]),
            effort: values([vec![0.0; 6], vec![first_torque]].concat()),
            ..JointReading::default()
        }
    }

    #[test]
    fn one_message_makes_one_sample_whatever_the_source_of_external_torques() {
        let robot = robot();
        for source in [Source::JointState, Source::LbrState] {
            let settings = InputSettings {
                source,
                ..InputSettings::default()
            };
            let mut input = input(&robot, &settings);
            let mut found = Vec::new();
            for (step, torque) in (1..).zip([0.0, 2.5]) {
                let message = reading(&robot, step * MS, torque);
                input.position(Some(&message), None).unwrap();
                let timed = input.next_sample().unwrap();
                assert_eq!(timed.sample.stamp_ns, step * MS);
                assert_eq!(input.next_sample(), None);
                found.push(timed.sample.external_torque);
            }
            // What the first joint drives with, something outside holds.
            assert!((found[1][0] - found[0][0] + 2.5).abs() < 1e-12);
            assert_eq!(found[1][1..], found[0][1..]);
            assert_eq!((input.counts().positions, input.counts().torques), (2, 2));
        }
    }

    #[test]
    fn what_is_missing_is_refused_by_name_and_counted() {
        let robot = robot();
        let mut input = input(&robot, &InputSettings::default());
        let mut say = |spoil: fn(&mut JointReading)| {
            let mut message = reading(&robot, MS, 0.0);
            spoil(&mut message);
            input
                .position(Some(&message), None)
                .unwrap_err()
                .to_string()
        };
        let said = say(|message| message.velocity = JointValues::default());
        assert!(
            said.contains("joint_states") && said.contains("torque.velocity.source"),
            "{said}"
        );
        assert!(input.next_sample().is_none());
        let mut say = |stamp_ns, spoil: fn(&mut JointReading)| {
            let mut message = reading(&robot, stamp_ns, 0.0);
            spoil(&mut message);
            input
                .position(Some(&message), None)
                .unwrap_err()
                .to_string()
        };
        let said = say(2 * MS, |message| message.effort.values[6] = f64::NAN);
        assert!(
            said.contains("measured torque of joint lbr_A1 is NaN"),
            "{said}"
        );
        let said = say(3 * MS, |message| message.effort.values.clear());
        assert!(
            said.contains("effort") && said.contains("expected 7"),
            "{said}"
        );
        let counts = input.counts();
        assert_eq!((counts.unmeasured, counts.wrong_length), (2, 1));
        let good = reading(&robot, 4 * MS, 0.0);
        input.position(Some(&good), None).unwrap();
        assert!(input.next_sample().is_some());
    }

    #[test]
    fn time_that_starts_anew_and_torques_beyond_a_limit_are_told() {
        let robot = robot();
        let mut input = input(&robot, &InputSettings::default());
        let late = reading(&robot, 100_000 * MS, 0.0);
        input.position(Some(&late), None).unwrap();
        let early = reading(&robot, MS, 1e4);
        input.position(Some(&early), None).unwrap();
        // What waited is forgotten.
        let timed = input.next_sample().unwrap();
        assert_eq!((timed.sample.stamp_ns, timed.epoch), (MS, 1));
        assert_eq!(input.next_sample(), None);
        let (count, first) = input.beyond_limit();
        assert_eq!(count, 1);
        assert!(first.unwrap().to_string().contains("lbr_A1"));
    }
}
