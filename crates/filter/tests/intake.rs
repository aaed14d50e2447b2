//! The gate before the filter: what it refuses, how it says so, and what it counts.

#![allow(clippy::unwrap_used)]

use palpate_filter::{Intake, IntakeCounts, Refusal};
use palpate_model::JointSample;

fn sample(stamp_ns: i64, position: &[f64], external_torque: &[f64]) -> JointSample {
    JointSample {
        stamp_ns,
        position: position.to_vec(),
        external_torque: external_torque.to_vec(),
    }
}

fn refusal(intake: &mut Intake, sample: &JointSample) -> Refusal {
    intake.admit(sample).unwrap_err()
}

#[test]
fn an_admitted_sample_is_the_one_that_came() {
    let mut intake = Intake::new(2);
    let given = sample(-5, &[1.0, 1e9], &[f64::MIN_POSITIVE / 2.0, -0.0]);
    assert_eq!(intake.admit(&given).unwrap().sample(), &given);
}

#[test]
fn a_refusal_names_the_array_the_joint_the_expected_and_the_found() {
    let mut intake = Intake::new(2);
    let said = |intake: &mut Intake, sample: &JointSample| refusal(intake, sample).to_string();
    let short = said(&mut intake, &sample(1, &[1.0], &[0.0, 0.0]));
    assert_eq!(short, "position has 1 values, expected 2");
    let long = said(&mut intake, &sample(1, &[1.0, 2.0], &[0.0; 3]));
    assert_eq!(long, "external torque has 3 values, expected 2");
    let nan = said(&mut intake, &sample(1, &[1.0, f64::NAN], &[0.0, 0.0]));
    assert_eq!(nan, "position of joint 1 is NaN, expected a finite number");
    let endless = said(
        &mut intake,
        &sample(1, &[1.0, 2.0], &[f64::NEG_INFINITY, 0.0]),
    );
    assert_eq!(
        endless,
        "external torque of joint 0 is -inf, expected a finite number"
    );
    intake.admit(&sample(10, &[0.0; 2], &[0.0; 2])).unwrap();
    for found in [10, 9, i64::MIN] {
        let late = said(&mut intake, &sample(found, &[0.0; 2], &[0.0; 2]));
        assert_eq!(
            late,
            format!("stamp {found} ns is not after the last one, 10 ns")
        );
    }
}

#[test]
fn every_sample_is_counted_once() {
    let mut intake = Intake::new(1);
    for stamp_ns in [1, 2, 2, 1, 3] {
        let _ = intake.admit(&sample(stamp_ns, &[0.0], &[0.0]));
    }
    let _ = intake.admit(&sample(4, &[], &[0.0]));
    let _ = intake.admit(&sample(5, &[f64::NAN], &[0.0]));
    let _ = intake.admit(&sample(6, &[0.0], &[f64::INFINITY]));
    let _ = intake.admit(&sample(7, &[0.0], &[-1.1e9]));
    let expected = IntakeCounts {
        admitted: 3,
        wrong_length: 1,
        not_finite: 2,
        too_large: 1,
        stamp_not_after: 2,
    };
    assert_eq!(intake.counts(), expected);
}

#[test]
fn a_refused_sample_leaves_the_last_stamp_as_it_was() {
    let mut intake = Intake::new(1);
    intake.admit(&sample(1, &[0.0], &[0.0])).unwrap();
    refusal(&mut intake, &sample(100, &[f64::NAN], &[0.0]));
    refusal(&mut intake, &sample(100, &[], &[0.0]));
    assert!(intake.admit(&sample(2, &[0.0], &[0.0])).is_ok());
}

#[test]
fn after_a_restart_time_may_begin_anew_and_the_counts_stay() {
    let mut intake = Intake::new(1);
    intake.admit(&sample(100, &[0.0], &[0.0])).unwrap();
    refusal(&mut intake, &sample(7, &[0.0], &[0.0]));
    intake.restart();
    intake.admit(&sample(7, &[0.0], &[0.0])).unwrap();
    let late = refusal(&mut intake, &sample(7, &[0.0], &[0.0]));
    let expected = Refusal::StampNotAfter {
        last_ns: 7,
        found_ns: 7,
    };
    assert_eq!(late, expected);
    assert_eq!(
        (intake.counts().admitted, intake.counts().stamp_not_after),
        (2, 2)
    );
}

#[test]
fn a_robot_without_joints_has_samples_without_values() {
    assert!(Intake::new(0).admit(&sample(0, &[], &[])).is_ok());
}
