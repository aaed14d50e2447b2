//! External torque from measured torque, against the truth of simulated drives and pushes.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{Matrix3, Point3, Vector3};
use palpate_model::{
    Dynamics, EmbeddedMeshes, ExternalTorque, ExternalTorqueOptions, Inertial, JointFriction,
    LoadOptions, MeasuredSample, Payload, Robot, TorqueMethod, VelocitySource, iiwa14,
};
use palpate_sim::{Drive, DriveMoment, DriveScenario, Push};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

/// Gain of the observer in these tests and by default, 1/s: a bandwidth of 25/2π = 4 Hz.
const GAIN: f64 = 25.0;

fn robot() -> Robot {
    iiwa14(&LoadOptions::default()).unwrap()
}

fn observer(gain: f64) -> ExternalTorqueOptions {
    ExternalTorqueOptions {
        method: TorqueMethod::MomentumObserver {
            gain: vec![gain; 7],
        },
        gravity_in_root: Dynamics::UPRIGHT,
        payload: None,
        friction: vec![JointFriction::default(); 7],
        velocity: VelocitySource::Driver,
    }
}

fn statics() -> ExternalTorqueOptions {
    ExternalTorqueOptions {
        method: TorqueMethod::Static,
        ..observer(GAIN)
    }
}

/// Without anything that the sensors add.
fn exact(scenario: DriveScenario) -> DriveScenario {
    DriveScenario {
        torque_noise: 0.0,
        torque_drift: 0.0,
        velocity_noise: 0.0,
        ..scenario
    }
}

/// The moments of a drive with what is made of each.
fn play(
    robot: &Robot,
    scenario: &DriveScenario,
    options: &ExternalTorqueOptions,
) -> Vec<(DriveMoment, Vec<f64>)> {
    let mut external = ExternalTorque::new(robot, options).unwrap();
    let drive = Drive::new(robot, scenario).unwrap();
    let found = drive.map(|moment| {
        let sample = external.update(&moment.measured).unwrap();
        assert_eq!(sample.stamp_ns, moment.measured.stamp_ns);
        assert_eq!(sample.position, moment.measured.position);
        let torque = sample.external_torque.clone();
        (moment, torque)
    });
    found.collect()
}

/// Root mean square over some joints of the difference from the truth, Nm, after the first second.
fn rms(played: &[(DriveMoment, Vec<f64>)], joints: Range<usize>) -> f64 {
    let settled = (played.iter()).filter(|(moment, _)| moment.measured.stamp_ns > 1_000_000_000);
    let squares: Vec<f64> = settled
        .flat_map(|(moment, found)| {
            let truth = &moment.external_torque[joints.clone()];
            truth.iter().zip(&found[joints.clone()])
        })
        .map(|(truth, found)| (truth - found).powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// The number to reach: within 0.1 Nm rms of the true external torque in slow motion with 0.1 Nm noise, here on each joint
/// for a bandwidth of 4 Hz, at both rates, with speeds that are 0.3 mrad/s noisy besides.
#[test]
fn the_observer_is_within_a_tenth_of_a_newton_metre_in_slow_motion() {
    let robot = robot();
    for rate_hz in [1000.0, 100.0] {
        let free = DriveScenario {
            rate_hz,
            duration_secs: 30.0,
            torque_drift: 0.0,
            velocity_noise: 3e-4,
            ..DriveScenario::slow(11)
        };
        let played = play(&robot, &free, &observer(GAIN));
        for joint in 0..robot.dof() {
            let error = rms(&played, joint..joint + 1);
            assert!(error < 0.06, "{error} Nm on joint {joint} at {rate_hz} Hz");
        }
        // Pushes of 10 N, which the observer follows with a lag of 40 ms, and worse speeds.
        let pushes = (1..6).map(|number| Push {
            rise_secs: 1.0,
            duration_secs: 3.0,
            ..Push::new("lbr_link_5", 10.0, 4.0 * f64::from(number))
        });
        let pushed = DriveScenario {
            pushes: pushes.collect(),
            velocity_noise: 1e-3,
            ..free
        };
        let error = rms(&play(&robot, &pushed, &observer(GAIN)), 0..7);
        assert!(error < 0.1, "{error} Nm at {rate_hz} Hz");
    }
}

#[test]
fn in_fast_motion_the_static_formula_errs_and_the_observer_does_not() {
    let robot = robot();
    let scenario = DriveScenario {
        duration_secs: 10.0,
        ..exact(DriveScenario::fast(12))
    };
    let by_observer = rms(&play(&robot, &scenario, &observer(GAIN)), 0..7);
    let by_statics = rms(&play(&robot, &scenario, &statics()), 0..7);
    assert!(by_observer < 1e-3, "{by_observer} Nm");
    assert!(by_statics > 0.5, "{by_statics} Nm");
}

#[test]
fn a_push_on_a_still_arm_is_found_with_its_sign() {
    let robot = robot();
    for link in ["lbr_link_2", "lbr_link_4", "lbr_link_7"] {
        let scenario = DriveScenario {
            peak_speed: 0.0,
            duration_secs: 2.0,
            pushes: vec![Push {
                duration_secs: 1.4,
                ..Push::new(link, 20.0, 0.5)
            }],
            ..exact(DriveScenario::slow(13))
        };
        for options in [observer(GAIN), statics()] {
            let played = play(&robot, &scenario, &options);
            // Before the push nothing, and long after its begin all of it.
            let (_, before) = &played[400];
            assert!(
                before.iter().all(|torque| torque.abs() < 1e-9),
                "{before:?}"
            );
            let (moment, found) = &played[1800];
            let largest = (moment.external_torque.iter()).fold(0.0_f64, |a, b| a.max(b.abs()));
            assert!(largest > 0.5);
            for (truth, found) in moment.external_torque.iter().zip(found) {
                assert!(
                    (truth - found).abs() < 1e-6 * largest,
                    "{found} for {truth}"
                );
            }
        }
    }
}

/// ṙ = K (τ_ext − r): 1 − 1/e of a sudden push after 1/K, but for the half step in which nobody knows when it began.
#[test]
fn the_observer_follows_a_step_with_its_time_constant() {
    let robot = robot();
    for rate_hz in [1000.0, 200.0] {
        let step = DriveScenario {
            rate_hz,
            duration_secs: 0.6,
            pushes: vec![Push {
                rise_secs: 0.0,
                ..Push::new("lbr_link_6", 30.0, 0.1)
            }],
            ..exact(DriveScenario::slow(14))
        };
        for gain in [10.0, 50.0] {
            let played = play(&robot, &step, &observer(gain));
            let at = ((0.1 + 1.0 / gain) * rate_hz).round() as usize;
            let share = 1.0 - (-1.0 + 0.5 * gain / rate_hz).exp();
            let (moment, found) = &played[at];
            for (truth, found) in moment.external_torque.iter().zip(found) {
                let tolerance = 0.02 * truth.abs() + 0.02;
                assert!(
                    (found - share * truth).abs() < tolerance,
                    "{found} of {truth}"
                );
            }
        }
    }
}

#[test]
fn gravity_may_point_anywhere_and_the_wrong_one_shows() {
    let robot = robot();
    for gravity in [[9.81, 0.0, 0.0], [0.0, -9.81, 0.0], [0.0, 0.0, 9.81]] {
        let scenario = DriveScenario {
            gravity,
            duration_secs: 3.0,
            ..exact(DriveScenario::slow(15))
        };
        let right = ExternalTorqueOptions {
            gravity_in_root: Vector3::from(gravity),
            ..observer(GAIN)
        };
        assert!(rms(&play(&robot, &scenario, &right), 0..7) < 1e-3);
        assert!(rms(&play(&robot, &scenario, &observer(GAIN)), 0..7) > 5.0);
    }
}

#[test]
fn a_known_payload_is_no_external_torque_and_a_wrong_one_is() {
    let robot = robot();
    let payload = Payload {
        link: "lbr_link_7".to_owned(),
        inertial: Inertial {
            mass: 4.0,
            centre_in_link: Point3::new(0.0, 0.03, 0.1),
            inertia_in_link: Matrix3::from_diagonal_element(0.01),
        },
    };
    let scenario = DriveScenario {
        duration_secs: 5.0,
        payload: Some(payload.clone()),
        ..exact(DriveScenario::fast(16))
    };
    let error = |believed: Option<Payload>| {
        let options = ExternalTorqueOptions {
            payload: believed,
            ..observer(GAIN)
        };
        rms(&play(&robot, &scenario, &options), 0..7)
    };
    assert!(error(Some(payload.clone())) < 1e-3);
    let tenth = error(Some(payload.scaled(0.9)));
    let all = error(None);
    assert!((0.1..5.0).contains(&tenth), "{tenth}");
    assert!((all / tenth - 10.0).abs() < 0.01, "{all} {tenth}");
}

#[test]
fn known_friction_is_no_external_torque() {
    let robot = robot();
    let scenario = DriveScenario {
        duration_secs: 10.0,
        viscous_friction: vec![1.0; 7],
        coulomb_friction: vec![0.5; 7],
        ..exact(DriveScenario::slow(17))
    };
    let friction = |viscous, coulomb| ExternalTorqueOptions {
        friction: vec![JointFriction { viscous, coulomb }; 7],
        ..observer(GAIN)
    };
    let unknown = rms(&play(&robot, &scenario, &friction(0.0, 0.0)), 0..7);
    let known = rms(&play(&robot, &scenario, &friction(1.0, 0.5)), 0..7);
    assert!(unknown > 0.4, "{unknown}");
    // Where a joint turns back, the true friction is steeper than the model's.
    assert!(known < 0.2 * unknown, "{known} of {unknown}");
}

#[test]
fn speeds_that_are_differentiated_serve_as_well() {
    let robot = robot();
    let differentiated = |cutoff_hz| ExternalTorqueOptions {
        velocity: VelocitySource::Differentiated { cutoff_hz },
        ..observer(GAIN)
    };
    for (rate_hz, scenario, most) in [
        (1000.0, DriveScenario::slow(18), 0.03),
        (100.0, DriveScenario::slow(18), 0.05),
        (1000.0, DriveScenario::fast(18), 0.4),
    ] {
        let scenario = DriveScenario {
            rate_hz,
            duration_secs: 10.0,
            ..exact(scenario)
        };
        let mut external = ExternalTorque::new(&robot, &differentiated(20.0)).unwrap();
        let silent = Drive::new(&robot, &scenario).unwrap().map(|mut moment| {
            moment.measured.velocity.clear();
            let found = external.update(&moment.measured).unwrap();
            let torque = found.external_torque.clone();
            (moment, torque)
        });
        let error = rms(&silent.collect::<Vec<_>>(), 0..7);
        assert!(error < most, "{error} Nm at {rate_hz} Hz");
    }
}

/// Trees and slides: forces in N, torques in Nm.
#[test]
fn a_tree_with_a_slide_is_observed_as_well() {
    let urdf = include_str!("../../model/tests/dynamics/tree.urdf").replace(
        r#"<link name="tip"/>"#,
        r#"<link name="tip"><inertial><mass value="0.1"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>
           <collision><geometry><sphere radius="0.05"/></geometry></collision></link>"#,
    );
    let (robot, _) =
        Robot::from_urdf(&urdf, &EmbeddedMeshes(&[]), &LoadOptions::default()).unwrap();
    let dof = robot.dof();
    let scenario = DriveScenario {
        duration_secs: 5.0,
        pushes: vec![Push {
            rise_secs: 0.5,
            duration_secs: 3.0,
            ..Push::new("tip", 20.0, 1.0)
        }],
        ..exact(DriveScenario::slow(19))
    };
    let options = ExternalTorqueOptions {
        method: TorqueMethod::MomentumObserver {
            gain: vec![100.0; dof],
        },
        friction: vec![JointFriction::default(); dof],
        ..observer(GAIN)
    };
    let played = play(&robot, &scenario, &options);
    let error = rms(&played, 0..dof);
    assert!(error < 0.1, "{error}");
    let (moment, _) = &played[2500];
    assert!(
        moment
            .external_torque
            .iter()
            .any(|torque| torque.abs() > 2.0)
    );
}

fn sample(stamp_ns: i64) -> MeasuredSample {
    MeasuredSample {
        stamp_ns,
        position: vec![0.1; 7],
        velocity: vec![0.0; 7],
        torque: vec![1.0; 7],
    }
}

type Spoil = fn(&mut MeasuredSample);

#[test]
fn a_wrong_sample_is_refused_counted_and_leaves_no_trace() {
    let robot = robot();
    let spoiled: [(Spoil, &str); 8] = [
        (|s| s.velocity.clear(), "velocity of joint lbr_A1 is absent"),
        (
            |s| s.velocity[2] = f64::NAN,
            "velocity of joint lbr_A3 is NaN",
        ),
        (
            |s| s.torque[4] = f64::NAN,
            "measured torque of joint lbr_A5 is NaN",
        ),
        (|s| s.torque[4] = 1e200, "measured torque of joint lbr_A5"),
        (
            |s| s.position[6] = f64::INFINITY,
            "position of joint lbr_A7 is inf",
        ),
        (
            |s| s.position.truncate(6),
            "position has 6 values, expected 7",
        ),
        (
            |s| s.torque.clear(),
            "measured torque has 0 values, expected 7",
        ),
        (|s| s.stamp_ns = 0, "stamp 0 ns is not after the last one"),
    ];
    for options in [observer(GAIN), statics()] {
        let mut external = ExternalTorque::new(&robot, &options).unwrap();
        let mut spared = ExternalTorque::new(&robot, &options).unwrap();
        for (index, (spoil, expected)) in spoiled.iter().enumerate() {
            let stamp_ns = 1_000_000 * (1 + 2 * index as i64);
            let good = external.update(&sample(stamp_ns)).unwrap().clone();
            assert_eq!(&good, spared.update(&sample(stamp_ns)).unwrap());
            let mut wrong = sample(stamp_ns + 1_000_000);
            spoil(&mut wrong);
            let said = external.update(&wrong).unwrap_err().to_string();
            assert!(said.contains(expected), "{said}");
        }
        let counts = external.counts();
        assert_eq!((counts.used, counts.refused()), (8, 8));
        assert_eq!((counts.velocity_missing, counts.wrong_value), (2, 3));
        assert_eq!((counts.wrong_length, counts.stamp_not_after), (2, 1));
    }
    let differentiated = ExternalTorqueOptions {
        velocity: VelocitySource::Differentiated { cutoff_hz: 20.0 },
        ..observer(GAIN)
    };
    let mut external = ExternalTorque::new(&robot, &differentiated).unwrap();
    let mut silent = sample(1);
    silent.velocity = vec![f64::NAN; 7];
    assert!(external.update(&silent).is_ok());
}

#[test]
fn a_torque_beyond_its_limit_is_told_and_used() {
    let robot = robot();
    let limit = robot.joints[1].limits.unwrap().effort;
    let mut external = ExternalTorque::new(&robot, &statics()).unwrap();
    let untouched = external.update(&sample(1)).unwrap().external_torque.clone();
    assert!(external.beyond_limit().is_none());
    let mut hard = sample(2);
    hard.torque[1] = -(limit + 10.0);
    let found = external.update(&hard).unwrap().external_torque.clone();
    assert!((found[1] - untouched[1] - limit - 11.0).abs() < 1e-9);
    assert_eq!(external.counts().beyond_limit, 1);
    let said = external.beyond_limit().unwrap().to_string();
    assert!(
        said.contains("lbr_A2") && said.contains(&limit.to_string()),
        "{said}"
    );
}

/// Whatever a driver sends: what is made of it is finite, and the observer comes back.
#[test]
fn garbage_leaves_the_observer_finite_and_passes() {
    let robot = robot();
    let mut random = StdRng::seed_from_u64(21);
    for velocity in [
        VelocitySource::Driver,
        VelocitySource::Differentiated { cutoff_hz: 20.0 },
    ] {
        let options = ExternalTorqueOptions {
            velocity,
            ..observer(GAIN)
        };
        let mut external = ExternalTorque::new(&robot, &options).unwrap();
        let wild = [
            0.0,
            1e-300,
            3.0,
            -1e9,
            1e9,
            1e200,
            f64::NAN,
            f64::NEG_INFINITY,
        ];
        let mut used = 0;
        for index in 0..5000 {
            let mut garbage = sample(index);
            for values in [
                &mut garbage.position,
                &mut garbage.velocity,
                &mut garbage.torque,
            ] {
                let joint = random.random_range(0..7);
                values[joint] = wild[random.random_range(0..wild.len())];
            }
            if let Ok(found) = external.update(&garbage) {
                used += 1;
                assert!(
                    found
                        .external_torque
                        .iter()
                        .all(|torque| torque.is_finite())
                );
            }
        }
        assert!((500..4500).contains(&used), "{used}");
        let mut clean = ExternalTorque::new(&robot, &options).unwrap();
        for step in 1..10_000 {
            let good = sample(step * 1_000_000);
            let found = external.update(&good).unwrap().external_torque.clone();
            let expected = &clean.update(&good).unwrap().external_torque;
            if step == 9_999 {
                let worst = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
                assert!(worst.fold(0.0, f64::max) < 1e-3);
            }
        }
    }
}

#[test]
fn a_gap_and_a_restart_begin_anew() {
    let robot = robot();
    let mut external = ExternalTorque::new(&robot, &observer(GAIN)).unwrap();
    let mut pushed = sample(1_000_000_000);
    pushed.torque[0] += 5.0;
    let first = external.update(&sample(0)).unwrap().external_torque[0];
    // What happened in a second without samples nobody knows: the observer starts from the newest alone.
    let after_gap = external.update(&pushed).unwrap().external_torque[0];
    assert!((after_gap - first + 5.0).abs() < 1e-9);
    pushed.stamp_ns = 5;
    assert!(external.update(&pushed).is_err());
    external.restart();
    assert!(external.update(&pushed).is_ok());
    let next = MeasuredSample {
        stamp_ns: 10_000_005,
        ..sample(0)
    };
    let found = external.update(&next).unwrap().external_torque[0];
    // A step of 10 ms makes exp(−0.25) of the old value, and the mean of both ends for the rest.
    let kept = (-0.25_f64).exp();
    let expected = first - 5.0 * (kept + 0.5 * (1.0 - kept));
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}

#[test]
fn options_that_do_not_fit_the_robot_are_refused() {
    let robot = robot();
    let say = |options: ExternalTorqueOptions| {
        ExternalTorque::new(&robot, &options)
            .unwrap_err()
            .to_string()
    };
    let with_gain = |gain: Vec<f64>| ExternalTorqueOptions {
        method: TorqueMethod::MomentumObserver { gain },
        ..observer(GAIN)
    };
    let said = say(with_gain(vec![10.0; 3]));
    assert!(
        said.contains("gain") && said.contains("expected 7 values"),
        "{said}"
    );
    for gain in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let said = say(with_gain(vec![gain; 7]));
        assert!(
            said.contains("gain") && said.contains(&format!("found {gain}")),
            "{said}"
        );
    }
    let coulomb = -0.1;
    let said = say(ExternalTorqueOptions {
        friction: vec![
            JointFriction {
                viscous: 0.0,
                coulomb
            };
            7
        ],
        ..observer(GAIN)
    });
    assert!(said.contains("Coulomb") && said.contains("-0.1"), "{said}");
    let said = say(ExternalTorqueOptions {
        velocity: VelocitySource::Differentiated { cutoff_hz: 0.0 },
        ..observer(GAIN)
    });
    assert!(said.contains("cut-off"), "{said}");
    let mut bare = robot.clone();
    bare.links[3].inertial = None;
    let said = ExternalTorque::new(&bare, &statics())
        .unwrap_err()
        .to_string();
    assert!(said.contains("link `lbr_link_3`"), "{said}");
}

/// White torque noise σ through the low-pass leaves σ √(a / (2 − a)), with a = 1 − exp(−K · step).
#[test]
fn the_observer_leaves_of_the_noise_what_a_low_pass_does() {
    let robot = robot();
    let scenario = DriveScenario {
        peak_speed: 0.0,
        velocity_noise: 0.0,
        torque_drift: 0.0,
        ..DriveScenario::slow(20)
    };
    let left = rms(&play(&robot, &scenario, &observer(TAU * 10.0)), 0..7);
    let share = 1.0 - (-TAU * 0.01_f64).exp();
    let expected = 0.1 * (share / (2.0 - share)).sqrt();
    assert!((left / expected - 1.0).abs() < 0.05, "{left} {expected}");
}
