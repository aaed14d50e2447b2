//! Drives: laws of the motion and its torques, what sensors add, and refusals.

#![allow(clippy::unwrap_used)]

use nalgebra::{DVector, Matrix3, Point3, Vector3};
use palpate_model::{Dynamics, Inertial, Kinematics, LoadOptions, Payload, Robot, iiwa14};
use palpate_sim::{Drive, DriveMoment, DriveScenario, Push};

fn robot() -> Robot {
    iiwa14(&LoadOptions::default()).unwrap()
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

fn play(robot: &Robot, scenario: &DriveScenario) -> Vec<DriveMoment> {
    Drive::new(robot, scenario).unwrap().collect()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

#[test]
fn speeds_are_those_of_the_positions_within_limits_and_as_fast_as_asked() {
    let robot = robot();
    for (scenario, least, most) in [
        (DriveScenario::slow(1), 0.15, 0.25),
        (DriveScenario::fast(2), 0.9, 1.5),
    ] {
        let moments = play(&robot, &exact(scenario));
        assert_eq!(moments.len(), 60_000);
        let mut fastest = 0.0_f64;
        for triple in moments.windows(3).step_by(7) {
            let [before, now, after] = [0, 1, 2].map(|index| &triple[index].measured);
            assert_eq!(after.stamp_ns - now.stamp_ns, 1_000_000);
            for joint in 0..robot.dof() {
                let slope = (after.position[joint] - before.position[joint]) / 2e-3;
                assert!((now.velocity[joint] - slope).abs() < 1e-4);
                let limits = robot.joints[joint].limits.unwrap();
                assert!((limits.lower..=limits.upper).contains(&now.position[joint]));
            }
            fastest = fastest.max(largest(&now.velocity));
        }
        assert!((least..=most).contains(&fastest), "{fastest}");
    }
}

/// The power of motors and pushes, less friction, is the rate of the energy.
#[test]
fn torques_do_the_work_that_the_energy_gains() {
    let robot = robot();
    let payload = Payload {
        link: "lbr_link_7".to_owned(),
        inertial: Inertial {
            mass: 3.0,
            centre_in_link: Point3::new(0.05, 0.0, 0.1),
            inertia_in_link: Matrix3::from_diagonal_element(0.01),
        },
    };
    let scenario = DriveScenario {
        duration_secs: 2.0,
        payload: Some(payload.clone()),
        gravity: [9.81, 0.0, 0.0],
        viscous_friction: vec![0.5; 7],
        pushes: vec![Push::new("lbr_link_6", 40.0, 0.5)],
        ..exact(DriveScenario::fast(3))
    };
    let moments = play(&robot, &scenario);
    let dynamics = Dynamics::new(&robot, scenario.gravity.into(), Some(&payload)).unwrap();
    let mut workspace = dynamics.workspace();
    let mut kinematics = Kinematics::new(&robot);
    let mut energy = |moment: &DriveMoment| {
        let v = DVector::from_column_slice(&moment.measured.velocity);
        let mass = dynamics.mass_matrix(&mut workspace, &moment.position);
        kinematics.update(&robot, &moment.position);
        let mut sum = 0.5 * v.dot(&(mass * &v));
        let bodies = robot.links.iter().map(|link| link.inertial);
        let loads = [(
            robot.link_index(&payload.link).unwrap(),
            Some(payload.inertial),
        )];
        for (link, inertial) in bodies.enumerate().chain(loads) {
            let Some(inertial) = inertial else { continue };
            let centre = kinematics.root_from_link(link) * inertial.centre_in_link;
            sum -= inertial.mass * Vector3::from(scenario.gravity).dot(&centre.coords);
        }
        sum
    };
    let power = |moment: &DriveMoment| -> f64 {
        let measured = &moment.measured;
        (0..robot.dof())
            .map(|joint| {
                let friction = 0.5 * measured.velocity[joint];
                let torque = measured.torque[joint] + moment.external_torque[joint] - friction;
                torque * measured.velocity[joint]
            })
            .sum()
    };
    let at_first = energy(&moments[0]);
    let mut work = 0.0;
    let mut gained_most = 0.0_f64;
    for pair in moments.windows(2) {
        work += 0.5e-3 * (power(&pair[0]) + power(&pair[1]));
        let gained = energy(&pair[1]) - at_first;
        gained_most = gained_most.max(gained.abs());
        assert!((gained - work).abs() < 1e-3, "{gained} J and {work} J");
    }
    assert!(gained_most > 5.0, "{gained_most} J");
}

/// A push does the work of its force on the point that it pushes, and lasts as long as asked.
#[test]
fn a_push_acts_on_its_spot_against_the_surface_while_it_lasts() {
    let robot = robot();
    let scenario = DriveScenario {
        duration_secs: 2.0,
        pushes: vec![
            Push::new("lbr_link_4", 10.0, 0.5),
            Push::new("lbr_link_7", 5.0, 1.5),
        ],
        ..exact(DriveScenario::fast(4))
    };
    let moments = play(&robot, &scenario);
    let mut steady = 0;
    for pair in moments.windows(2) {
        let felt = largest(&pair[0].external_torque) > 0.0;
        assert_eq!(felt, pair[0].push.is_some());
        let secs = pair[0].measured.stamp_ns as f64 * 1e-9;
        let acts = secs > 0.5 && secs < 1.0 || secs > 1.5;
        let Some((push, then)) = pair[0].push.zip(pair[1].push) else {
            assert!(!acts || secs > 0.998, "{secs}");
            continue;
        };
        assert!(acts && push.index == usize::from(secs > 1.2), "{secs}");
        let force = push.force_in_root;
        let velocity = (then.point_in_root - push.point_in_root) / 1e-3;
        let power: f64 = (pair[0].external_torque.iter())
            .zip(&pair[0].measured.velocity)
            .map(|(torque, speed)| torque * speed)
            .sum();
        assert!((force.dot(&velocity) - power).abs() < 0.02, "{power}");
        let full = [10.0, 5.0][push.index];
        steady += usize::from((force.norm() - full).abs() < 1e-9);
    }
    assert!((950..1000).contains(&steady), "{steady}");
}

#[test]
fn a_push_is_what_the_motors_need_not_give() {
    let robot = robot();
    let still = DriveScenario {
        peak_speed: 0.0,
        duration_secs: 1.0,
        rate_hz: 100.0,
        pushes: vec![Push::new("lbr_link_5", 10.0, 0.2)],
        ..exact(DriveScenario::slow(5))
    };
    let dynamics = Dynamics::new(&robot, Dynamics::UPRIGHT, None).unwrap();
    let mut workspace = dynamics.workspace();
    let mut pushed = 0;
    for moment in play(&robot, &still) {
        let held = dynamics.gravity_torque(&mut workspace, &moment.position);
        for (joint, held) in held.iter().enumerate() {
            let sum = moment.measured.torque[joint] + moment.external_torque[joint];
            assert!((sum - held).abs() < 1e-9);
        }
        pushed += usize::from(largest(&moment.external_torque) > 0.3);
    }
    assert!((48..52).contains(&pushed), "{pushed}");
}

/// White noise shows in the differences of neighbours, the slow bias in the means of minutes.
#[test]
fn the_sensors_add_what_the_scenario_says_and_the_seed_decides() {
    let robot = robot();
    let scenario = DriveScenario {
        rate_hz: 100.0,
        duration_secs: 600.0,
        ..DriveScenario::slow(6)
    };
    let [noisy, clean] = [scenario.clone(), exact(scenario.clone())].map(|s| play(&robot, &s));
    let error = |index: usize| {
        let (noisy, clean) = (&noisy[index].measured, &clean[index].measured);
        (0..robot.dof()).map(|joint| noisy.torque[joint] - clean.torque[joint])
    };
    let rms = |values: &mut dyn Iterator<Item = f64>| {
        let squares: Vec<_> = values.map(|value| value * value).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let white = rms(&mut (1..noisy.len()).flat_map(|index| {
        error(index)
            .zip(error(index - 1))
            .map(|(now, before)| (now - before) / 2.0_f64.sqrt())
    }));
    assert!((white - 0.1).abs() < 0.001, "{white}");
    let means = (0..noisy.len()).step_by(500).flat_map(|start| {
        let mut sums = vec![0.0; robot.dof()];
        for index in start..start + 500 {
            for (sum, error) in sums.iter_mut().zip(error(index)) {
                *sum += error / 500.0;
            }
        }
        sums
    });
    let slow = rms(&mut means.into_iter());
    assert!((0.035..0.065).contains(&slow), "{slow}");
    assert_eq!(noisy[..100], play(&robot, &scenario)[..100]);
    let other = Drive::new(
        &robot,
        &DriveScenario {
            seed: 7,
            ..scenario
        },
    )
    .unwrap()
    .next();
    assert_ne!(other.unwrap().position, noisy[0].position);
}

#[test]
fn a_mass_error_and_a_friction_show_in_the_torques() {
    let robot = robot();
    let scenario = DriveScenario {
        duration_secs: 5.0,
        rate_hz: 100.0,
        ..exact(DriveScenario::slow(8))
    };
    let plain = play(&robot, &scenario);
    let heavy = play(
        &robot,
        &DriveScenario {
            mass_error: 0.1,
            ..scenario.clone()
        },
    );
    let rough = play(
        &robot,
        &DriveScenario {
            coulomb_friction: vec![1.0; 7],
            ..scenario
        },
    );
    let mut wrong = 0.0_f64;
    for ((plain, heavy), rough) in plain.iter().zip(&heavy).zip(&rough) {
        assert_eq!(plain.position, heavy.position);
        for joint in 0..robot.dof() {
            let plain_torque = plain.measured.torque[joint];
            wrong = wrong.max((heavy.measured.torque[joint] - plain_torque).abs());
            let speed = plain.measured.velocity[joint];
            if speed.abs() > 0.03 {
                let friction = rough.measured.torque[joint] - plain_torque;
                assert!((friction - speed.signum()).abs() < 1e-3);
            }
        }
    }
    assert!((0.3..20.0).contains(&wrong), "{wrong}");
}

#[test]
fn an_impossible_drive_is_refused_with_what_was_found() {
    let robot = robot();
    let say = |change: fn(&mut DriveScenario)| {
        let mut scenario = DriveScenario::slow(1);
        change(&mut scenario);
        Drive::new(&robot, &scenario).err().unwrap().to_string()
    };
    let said = say(|s| s.torque_noise = f64::NAN);
    assert!(
        said.contains("torque_noise") && said.contains("NaN"),
        "{said}"
    );
    let said = say(|s| s.coulomb_friction = vec![1.0; 3]);
    assert!(
        said.contains("coulomb_friction") && said.contains("3 values"),
        "{said}"
    );
    let said = say(|s| s.pushes = vec![Push::new("arm", 1.0, 0.0)]);
    assert!(said.contains("no link arm"), "{said}");
    let said = say(|s| s.pushes = vec![Push::new("lbr_link_0", 1.0, 0.0)]);
    assert!(said.contains("does not move"), "{said}");
    let said = say(|s| {
        let push = Push::new("lbr_link_3", 1.0, 0.0);
        s.pushes = vec![Push {
            least_lever: 5.0,
            ..push
        }];
    });
    assert!(said.contains("least_lever"), "{said}");
    let mut bare = robot.clone();
    bare.links[4].inertial = None;
    let said = Drive::new(&bare, &DriveScenario::slow(1)).err().unwrap();
    assert!(said.to_string().contains("link `lbr_link_4`"), "{said}");
}
