//! Laws of the dynamics: symmetry, the equation of motion, passivity, conservation of energy; and refusals.

#![allow(clippy::unwrap_used)]

use nalgebra::{DVector, Matrix3, Point3, Vector3};
use palpate_model::{
    Dynamics, EmbeddedMeshes, Inertial, Kinematics, LoadOptions, ModelError, Payload, Robot, iiwa14,
};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

const TREE: &str = include_str!("dynamics/tree.urdf");
const GANTRY: &str = include_str!("dynamics/gantry.urdf");

fn load(urdf: &str) -> Robot {
    let (robot, _) = Robot::from_urdf(urdf, &EmbeddedMeshes(&[]), &LoadOptions::default()).unwrap();
    robot
}

fn robots() -> [Robot; 3] {
    let iiwa = iiwa14(&LoadOptions::default()).unwrap();
    [iiwa, load(TREE), load(GANTRY)]
}

fn upright(robot: &Robot) -> Dynamics {
    Dynamics::new(robot, Dynamics::UPRIGHT, None).unwrap()
}

fn random_vector(random: &mut StdRng, count: usize, size: f64) -> DVector<f64> {
    DVector::from_fn(count, |_, _| random.random_range(-size..size))
}

fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(values)
}

#[test]
fn the_mass_matrix_is_symmetric_and_positive_definite() {
    let mut random = StdRng::seed_from_u64(1);
    for robot in robots() {
        let dynamics = upright(&robot);
        let mut workspace = dynamics.workspace();
        for _ in 0..50 {
            let q = random_vector(&mut random, robot.dof(), 2.0);
            let mass = dynamics.mass_matrix(&mut workspace, q.as_slice());
            assert_eq!(mass, &mass.transpose());
            assert!(mass.clone().cholesky().is_some(), "{}: {mass}", robot.name);
        }
    }
}

/// Composite bodies against Newton and Euler, two algorithms: M q̈ + C q̇ + g is the inverse dynamics.
#[test]
fn the_inverse_dynamics_is_the_sum_of_its_terms() {
    let mut random = StdRng::seed_from_u64(2);
    for robot in robots() {
        let dynamics = upright(&robot);
        let mut workspace = dynamics.workspace();
        for _ in 0..20 {
            let [q, v, a] = [2.0, 3.0, 5.0].map(|s| random_vector(&mut random, robot.dof(), s));
            let mass = dynamics.mass_matrix(&mut workspace, q.as_slice()).clone();
            let coriolis =
                vector(dynamics.coriolis_torque(&mut workspace, q.as_slice(), v.as_slice()));
            let gravity = vector(dynamics.gravity_torque(&mut workspace, q.as_slice()));
            let whole = vector(dynamics.inverse_dynamics(
                &mut workspace,
                q.as_slice(),
                v.as_slice(),
                a.as_slice(),
            ));
            let sum = &mass * &a + coriolis + gravity;
            assert!(
                (&sum - &whole).amax() < 1e-10 * whole.amax(),
                "{sum} {whole}"
            );
            let momentum = dynamics.momentum(&mut workspace, q.as_slice(), v.as_slice());
            let product = mass * v;
            let error = (vector(momentum.momentum) - &product).amax();
            assert!(error < 1e-12 * product.amax());
        }
    }
}

/// Ṁ q̇ = C q̇ + Cᵀ q̇, so that q̇ᵀ(Ṁ − 2C) q̇ = 0: the Coriolis forces do no work beyond what changes the inertia.
#[test]
fn the_mass_matrix_changes_by_both_coriolis_terms_and_is_passive() {
    const STEP: f64 = 1e-5;
    let mut random = StdRng::seed_from_u64(3);
    for robot in robots() {
        let dynamics = upright(&robot);
        let mut workspace = dynamics.workspace();
        for _ in 0..20 {
            let [q, v] = [2.0, 3.0].map(|size| random_vector(&mut random, robot.dof(), size));
            let mut mass_at = |secs: f64| {
                let q = &q + &v * secs;
                dynamics.mass_matrix(&mut workspace, q.as_slice()).clone()
            };
            let rate = (mass_at(STEP) - mass_at(-STEP)) / (2.0 * STEP) * &v;
            let coriolis =
                vector(dynamics.coriolis_torque(&mut workspace, q.as_slice(), v.as_slice()));
            let momentum = dynamics.momentum(&mut workspace, q.as_slice(), v.as_slice());
            let sum = &coriolis + vector(momentum.coriolis_transpose);
            assert!((&sum - &rate).amax() < 1e-7 * rate.amax(), "{sum} {rate}");
            let power = v.dot(&rate) - 2.0 * v.dot(&coriolis);
            assert!(power.abs() < 1e-7 * v.norm() * rate.norm(), "{power}");
        }
    }
}

/// Gravity's torques are the slope of the potential energy, which is reckoned link by link.
#[test]
fn gravity_is_the_slope_of_the_potential_energy() {
    const STEP: f64 = 1e-5;
    let field = Vector3::new(3.0, -2.0, -8.0);
    let mut random = StdRng::seed_from_u64(4);
    for robot in robots() {
        let dynamics = Dynamics::new(&robot, field, None).unwrap();
        let mut workspace = dynamics.workspace();
        let q = random_vector(&mut random, robot.dof(), 2.0);
        let torque = vector(dynamics.gravity_torque(&mut workspace, q.as_slice()));
        for joint in 0..robot.dof() {
            let potential = |by: f64| {
                let mut moved = q.clone();
                moved[joint] += by;
                potential_energy(&robot, &field, moved.as_slice())
            };
            let slope = (potential(STEP) - potential(-STEP)) / (2.0 * STEP);
            assert!((torque[joint] - slope).abs() < 1e-6 * torque.amax());
        }
    }
}

fn potential_energy(robot: &Robot, gravity: &Vector3<f64>, position: &[f64]) -> f64 {
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, position);
    let of_link = |(index, link): (usize, &palpate_model::Link)| {
        link.inertial.map_or(0.0, |inertial| {
            let centre = kinematics.root_from_link(index) * inertial.centre_in_link;
            -inertial.mass * gravity.dot(&centre.coords)
        })
    };
    robot.links.iter().enumerate().map(of_link).sum()
}

/// A robot that falls without friction keeps its energy. Integrated by Runge and Kutta's fourth order.
#[test]
fn a_falling_robot_keeps_its_energy() {
    const STEP: f64 = 5e-4;
    for robot in robots() {
        let dynamics = upright(&robot);
        let mut workspace = dynamics.workspace();
        let mut energy = |q: &DVector<f64>, v: &DVector<f64>| {
            let mass = dynamics.mass_matrix(&mut workspace, q.as_slice());
            let kinetic = 0.5 * v.dot(&(mass * v));
            (
                kinetic,
                kinetic + potential_energy(&robot, &Dynamics::UPRIGHT, q.as_slice()),
            )
        };
        let mut q = DVector::from_fn(robot.dof(), |joint, _| 0.4 + 0.1 * joint as f64);
        let mut v = DVector::zeros(robot.dof());
        let (_, at_first) = energy(&q, &v);
        let mut most_kinetic = 0.0_f64;
        for _ in 0..1000 {
            runge_kutta(&dynamics, &mut q, &mut v, STEP);
            let (kinetic, all) = energy(&q, &v);
            most_kinetic = most_kinetic.max(kinetic);
            let lost = (all - at_first).abs();
            assert!(lost < 1e-6 * most_kinetic, "{}: {lost} J", robot.name);
        }
        assert!(most_kinetic > 10.0, "{}: {most_kinetic} J", robot.name);
    }
}

fn runge_kutta(dynamics: &Dynamics, q: &mut DVector<f64>, v: &mut DVector<f64>, step: f64) {
    let mut workspace = dynamics.workspace();
    let none = vec![0.0; q.len()];
    let (q0, v0) = (q.clone(), v.clone());
    let mut slope = |secs: f64, (dq, dv): &(DVector<f64>, DVector<f64>)| {
        let (q, v) = (&q0 + dq * secs, &v0 + dv * secs);
        let held = dynamics.inverse_dynamics(&mut workspace, q.as_slice(), v.as_slice(), &none);
        let held = vector(held);
        let mass = dynamics.mass_matrix(&mut workspace, q.as_slice()).clone();
        (v, -mass.cholesky().unwrap().solve(&held))
    };
    let still = (DVector::zeros(q.len()), DVector::zeros(q.len()));
    let first = slope(0.0, &still);
    let second = slope(step / 2.0, &first);
    let third = slope(step / 2.0, &second);
    let fourth = slope(step, &third);
    *q += (first.0 + (second.0 + third.0) * 2.0 + fourth.0) * (step / 6.0);
    *v += (first.1 + (second.1 + third.1) * 2.0 + fourth.1) * (step / 6.0);
}

/// A point mass on a rod: m l² q̈ + m g l sin q, with the payload as the mass.
#[test]
fn a_payload_on_a_bare_rod_is_a_pendulum() {
    let urdf = r#"<robot name="p"><link name="base"/><link name="rod"/><link name="end"/>
        <joint name="swing" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/></joint>
        <joint name="tip" type="fixed"><parent link="rod"/><child link="end"/><origin xyz="0 0 -0.5"/></joint>
        </robot>"#;
    let (mass, length) = (3.0, 0.7);
    let payload = Payload {
        link: "end".to_owned(),
        inertial: Inertial {
            mass,
            centre_in_link: Point3::new(0.0, 0.0, -0.2),
            inertia_in_link: Matrix3::zeros(),
        },
    };
    let robot = load(urdf);
    let dynamics = Dynamics::new(&robot, Dynamics::UPRIGHT, Some(&payload)).unwrap();
    let mut workspace = dynamics.workspace();
    for (q, a) in [(0.3_f64, 2.0), (-1.2, -4.0), (3.0, 0.5)] {
        let torque = dynamics.inverse_dynamics(&mut workspace, &[q], &[1.3], &[a])[0];
        let expected = mass * length * length * a + mass * 9.81 * length * q.sin();
        assert!((torque - expected).abs() < 1e-12, "{torque} {expected}");
    }
    let half = Dynamics::new(&robot, Dynamics::UPRIGHT, Some(&payload.scaled(0.5))).unwrap();
    let light = half.inverse_dynamics(&mut workspace, &[0.3], &[0.0], &[2.0])[0];
    let heavy = dynamics.inverse_dynamics(&mut workspace, &[0.3], &[0.0], &[2.0])[0];
    assert!((light * 2.0 - heavy).abs() < 1e-12);
}

#[test]
fn a_robot_that_hangs_bears_its_weight_the_other_way() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let hanging = Dynamics::new(&robot, -Dynamics::UPRIGHT, None).unwrap();
    let standing = upright(&robot);
    let mut workspace = standing.workspace();
    let q = [0.1, 0.7, -0.3, -1.2, 0.4, 0.9, 0.0];
    let down = vector(standing.gravity_torque(&mut workspace, &q));
    let up = vector(hanging.gravity_torque(&mut workspace, &q));
    assert!(down.amax() > 10.0);
    assert!((down + up).amax() < 1e-12);
}

fn refusal(urdf: &str, payload: Option<&Payload>) -> ModelError {
    Dynamics::new(&load(urdf), Dynamics::UPRIGHT, payload).unwrap_err()
}

#[test]
fn a_link_without_mass_is_named() {
    let remove = |link: &str| {
        let (head, tail) = TREE.split_once(&format!("<link name=\"{link}\">")).unwrap();
        let (_, tail) = tail.split_once("</inertial>").unwrap();
        format!("{head}<link name=\"{link}\">{tail}")
    };
    // Its joint would move nothing.
    let said = refusal(&remove("camera"), None).to_string();
    assert!(said.contains("link `camera`"), "{said}");
    // What is fixed to another body and has no shape may be a mere frame, and the base does not move.
    for link in ["bracket", "base"] {
        let dynamics = Dynamics::new(&load(&remove(link)), Dynamics::UPRIGHT, None);
        assert!(dynamics.is_ok(), "{link}: {dynamics:?}");
    }
    // But what has a shape weighs something.
    let shape = r#"<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>"#;
    let shaped = TREE.replace(
        r#"<link name="tip"/>"#,
        &format!(r#"<link name="tip">{shape}</link>"#),
    );
    let said = refusal(&shaped, None).to_string();
    assert!(said.contains("link `tip`"), "{said}");
    let payload = |link: &str, mass: f64| Payload {
        link: link.to_owned(),
        inertial: Inertial {
            mass,
            centre_in_link: Point3::origin(),
            inertia_in_link: Matrix3::zeros(),
        },
    };
    let robot = load(&shaped);
    let known = Dynamics::new(&robot, Dynamics::UPRIGHT, Some(&payload("tip", 0.4)));
    assert!(known.is_ok(), "{known:?}");
    let said = refusal(TREE, Some(&payload("gripper", 1.0))).to_string();
    assert!(
        said.contains("`gripper`") && said.contains("camera_arm"),
        "{said}"
    );
    let said = refusal(TREE, Some(&payload("tip", -1.0))).to_string();
    assert!(
        said.contains("mass of the payload") && said.contains("-1"),
        "{said}"
    );
}

#[test]
fn a_wrong_mass_or_gravity_is_refused_with_what_was_found() {
    let said = refusal(
        &TREE.replace("mass value=\"2.4\"", "mass value=\"-2.4\""),
        None,
    );
    let said = said.to_string();
    assert!(
        said.contains("`camera_arm`") && said.contains("-2.4"),
        "{said}"
    );
    let negative = TREE.replace(r#"iyy="0.19""#, r#"iyy="-0.19""#);
    let said = refusal(&negative, None).to_string();
    assert!(said.contains("inertia of link `mast`"), "{said}");
    let endless = TREE.replace("mass value=\"2.4\"", "mass value=\"NaN\"");
    let loaded = Robot::from_urdf(&endless, &EmbeddedMeshes(&[]), &LoadOptions::default());
    let said = loaded.unwrap_err().to_string();
    assert!(
        said.contains("`camera_arm`") && said.contains("NaN"),
        "{said}"
    );
    let field = Vector3::new(0.0, f64::NAN, 0.0);
    let said = Dynamics::new(&load(TREE), field, None)
        .unwrap_err()
        .to_string();
    assert!(said.contains("gravity") && said.contains("NaN"), "{said}");
}
