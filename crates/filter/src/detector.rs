//! Is anything touching? A threshold with hysteresis on the size of the external torque.

use serde::{Deserialize, Serialize};

use palpate_model::Robot;

use crate::{ContactChange, ContactEvent, Detection, ParameterError};

/// Parameters of the contact detector.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct DetectorParameters {
    /// Contact begins when the smoothed torque of some joint exceeds this, Nm. Default 0.3.
    pub on_torque: f64,
    /// Contact ends when the smoothed torque of every joint is below this, Nm. Default 0.2.
    pub off_torque: f64,
    /// Time constant of the smoothing, s. Default 0.02.
    pub smoothing_secs: f64,
    /// The torque must stay below `off_torque` for this long before contact ends, s. Default 0.2.
    pub release_secs: f64,
}

impl Default for DetectorParameters {
    fn default() -> Self {
        Self {
            on_torque: 0.3,
            off_torque: 0.2,
            smoothing_secs: 0.02,
            release_secs: 0.2,
        }
    }
}

impl DetectorParameters {
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        let check = ParameterError::check;
        check(
            "filter.detector.on_torque",
            "> 0",
            self.on_torque,
            self.on_torque > 0.0,
        )?;
        let below = (0.0..=self.on_torque).contains(&self.off_torque);
        check(
            "filter.detector.off_torque",
            "0 … on_torque",
            self.off_torque,
            below,
        )?;
        let smooth = (0.0..=10.0).contains(&self.smoothing_secs);
        check(
            "filter.detector.smoothing_secs",
            "0 … 10",
            self.smoothing_secs,
            smooth,
        )?;
        let release = (0.0..=60.0).contains(&self.release_secs);
        check(
            "filter.detector.release_secs",
            "0 … 60",
            self.release_secs,
            release,
        )
    }
}

/// Decides between contact and no contact.
#[derive(Clone, Debug)]
pub(crate) struct Detector {
    parameters: DetectorParameters,
    smoothed: Vec<f64>,
    last_ns: Option<i64>,
    quiet_secs: f64,
    /// The link that each joint moves.
    moved: Vec<usize>,
    /// How many joints move each joint's link: how far out it is.
    depth: Vec<usize>,
    detection: Detection,
}

impl Detector {
    pub(crate) fn new(robot: &Robot, parameters: DetectorParameters) -> Self {
        let moved: Vec<usize> = (0..robot.dof())
            .map(|joint| {
                let moves = |link: &palpate_model::Link| link.joint == Some(joint);
                robot.links.iter().position(moves).unwrap_or(0)
            })
            .collect();
        Self {
            parameters,
            smoothed: vec![0.0; robot.dof()],
            last_ns: None,
            quiet_secs: 0.0,
            depth: (moved.iter().map(|&link| robot.links[link].path.len())).collect(),
            moved,
            detection: Detection {
                joints: vec![false; robot.dof()],
                ..Detection::default()
            },
        }
    }

    /// What the last update found.
    pub(crate) fn detection(&self) -> &Detection {
        &self.detection
    }

    /// Takes the external torques of one sample, Nm, in.
    pub(crate) fn update(&mut self, stamp_ns: i64, external_torque: &[f64]) {
        let step_secs = self.last_ns.map_or(f64::INFINITY, |last| {
            stamp_ns.saturating_sub(last) as f64 * 1e-9
        });
        self.last_ns = Some(stamp_ns);
        let gain = 1.0 - (-step_secs / self.parameters.smoothing_secs.max(1e-9)).exp();
        for (smoothed, torque) in self.smoothed.iter_mut().zip(external_torque) {
            *smoothed += gain * (torque - *smoothed);
        }
        let largest = self
            .smoothed
            .iter()
            .fold(0.0_f64, |most, torque| most.max(torque.abs()));
        let quiet = largest < self.parameters.off_torque && step_secs.is_finite();
        self.quiet_secs = if quiet {
            self.quiet_secs + step_secs
        } else {
            0.0
        };
        self.detection.event = None;
        if !self.detection.in_contact && largest >= self.parameters.on_torque {
            self.change(ContactChange::Start, stamp_ns);
        }
        if self.detection.in_contact && self.quiet_secs > self.parameters.release_secs {
            self.change(ContactChange::End, stamp_ns);
        }
        self.note_joints();
    }

    fn change(&mut self, change: ContactChange, stamp_ns: i64) {
        let starts = change == ContactChange::Start;
        self.detection.in_contact = starts;
        self.detection.since_ns = starts.then_some(stamp_ns);
        self.detection.first_link = None;
        self.detection.confidence = f64::from(starts);
        self.detection.event = Some(ContactEvent {
            change,
            stamp_ns,
            noticed_ns: stamp_ns,
            confidence: 1.0,
        });
    }

    fn note_joints(&mut self) {
        let in_contact = self.detection.in_contact;
        for (feels, smoothed) in self.detection.joints.iter_mut().zip(&self.smoothed) {
            *feels = in_contact && smoothed.abs() >= self.parameters.on_torque;
        }
        let felt = (self.detection.joints.iter().enumerate()).filter(|(_, feels)| **feels);
        let last = felt
            .map(|(joint, _)| joint)
            .max_by_key(|&joint| self.depth[joint]);
        let known = self.detection.first_link;
        self.detection.first_link = last.map(|joint| self.moved[joint]).or(known);
    }

    pub(crate) fn reset(&mut self) {
        self.smoothed.fill(0.0);
        self.last_ns = None;
        self.quiet_secs = 0.0;
        self.detection.joints.fill(false);
        self.detection = Detection {
            joints: std::mem::take(&mut self.detection.joints),
            ..Detection::default()
        };
    }
}

#[cfg(test)]
mod tests {
    use palpate_model::{EmbeddedMeshes, LoadOptions};

    use super::*;

    const URDF: &str = r#"<robot name="two"><link name="base"/><link name="a"/><link name="b"/>
        <joint name="j1" type="continuous"><parent link="base"/><child link="a"/></joint>
        <joint name="j2" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"#;

    fn detector() -> Detector {
        let (robot, _) =
            Robot::from_urdf(URDF, &EmbeddedMeshes(&[]), &LoadOptions::default()).unwrap();
        Detector::new(&robot, DetectorParameters::default())
    }

    fn run(detector: &mut Detector, from_ms: i64, to_ms: i64, torque: f64) -> bool {
        for ms in from_ms..to_ms {
            detector.update(ms * 1_000_000, &[0.0, torque]);
        }
        detector.detection().in_contact
    }

    #[test]
    fn contact_begins_above_one_threshold_and_ends_below_another() {
        let mut detector = detector();
        assert!(!run(&mut detector, 0, 500, 0.25));
        assert!(run(&mut detector, 500, 1000, -0.4));
        assert!(
            run(&mut detector, 1000, 2000, 0.25),
            "between the thresholds it stays"
        );
        assert!(
            run(&mut detector, 2000, 2100, 0.1),
            "a short dip does not end it"
        );
        assert!(!run(&mut detector, 2100, 2500, 0.1));
    }
}
