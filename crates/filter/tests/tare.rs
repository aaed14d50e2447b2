//! A commanded tare takes each joint's bias out of the torques, and is refused while something touches.

#![allow(clippy::unwrap_used)]

use palpate_filter::{Filter, Intake, Method, Parameters, TareRefusal, TareState};
use palpate_model::{JointSample, LoadOptions, iiwa14};

/// Feeds torques, the same on every joint, at 100 Hz.
struct Arm {
    filter: Filter,
    intake: Intake,
    dof: usize,
    index: i64,
}

impl Arm {
    fn new() -> Self {
        let robot = iiwa14(&LoadOptions::default()).unwrap();
        let parameters = Parameters {
            method: Method::Paper,
            particles: 100,
            ..Parameters::default()
        };
        Self {
            filter: Filter::new(&robot, &parameters, 1).unwrap(),
            intake: Intake::new(robot.dof()),
            dof: robot.dof(),
            index: 0,
        }
    }

    /// Whether something seems to touch at the end.
    fn feed(&mut self, secs: f64, torque: f64) -> bool {
        for _ in 0..(secs * 100.0) as usize {
            self.index += 1;
            let sample = JointSample {
                stamp_ns: self.index * 10_000_000,
                position: vec![0.3; self.dof],
                external_torque: vec![torque; self.dof],
            };
            self.filter.update(self.intake.admit(&sample).unwrap());
        }
        self.filter.detection().in_contact
    }
}

#[test]
fn a_tare_takes_an_offset_out_and_clearing_puts_it_back() {
    let mut arm = Arm::new();
    assert!(!arm.feed(0.1, 0.2));
    assert_eq!(arm.filter.tare_state(), TareState::None);
    arm.filter.start_tare(0.5).unwrap();
    arm.feed(0.2, 0.2);
    let running = arm.filter.tare_state();
    assert!(
        matches!(running, TareState::Running { left_secs } if (0.3..0.32).contains(&left_secs)),
        "{running:?}"
    );
    arm.feed(0.4, 0.2);
    assert_eq!(arm.filter.tare_state(), TareState::Done);
    for bias in arm.filter.bias() {
        assert!((bias.mean - 0.2).abs() < 0.01, "{bias:?}");
    }
    arm.filter.clear_tare();
    assert_eq!(arm.filter.tare_state(), TareState::None);
    assert!(arm.filter.bias().iter().all(|bias| bias.mean == 0.0));
}

#[test]
fn a_tare_is_refused_in_contact_and_interrupted_by_one() {
    let mut arm = Arm::new();
    arm.feed(1.0, 0.0);
    arm.filter.start_tare(2.0).unwrap();
    assert!(arm.feed(0.5, 3.0));
    assert_eq!(arm.filter.tare_state(), TareState::Interrupted);
    let refusal = arm.filter.start_tare(1.0).unwrap_err();
    assert!(
        matches!(refusal, TareRefusal::InContact { .. }),
        "{refusal}"
    );
    assert!(!arm.feed(1.0, 0.0));
    arm.filter.start_tare(1.0).unwrap();
    assert!(!arm.feed(1.5, 0.0));
    assert_eq!(arm.filter.tare_state(), TareState::Done);
}
