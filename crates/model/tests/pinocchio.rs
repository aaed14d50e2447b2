//! Dynamics against Pinocchio's values, which tests/pinocchio_reference.py wrote.

#![allow(clippy::unwrap_used)]

use nalgebra::{Point3, Vector3};
use palpate_model::{
    Dynamics, EmbeddedMeshes, Inertial, JointMap, LoadOptions, Payload, Robot, iiwa14,
    inertia_matrix,
};
use serde::Deserialize;

/// Largest error, relative to the size of the vector or matrix.
const TOLERANCE: f64 = 1e-9;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Reference {
    #[serde(rename = "pinocchio")]
    _pinocchio: String,
    gravity: [f64; 3],
    payload: Option<Load>,
    joints: Vec<String>,
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Load {
    link: String,
    mass: f64,
    centre: [f64; 3],
    inertia: [f64; 6],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    mass_matrix: Vec<Vec<f64>>,
    gravity_torque: Vec<f64>,
    coriolis_torque: Vec<f64>,
    coriolis_transpose: Vec<f64>,
    momentum: Vec<f64>,
    inverse_dynamics: Vec<f64>,
}

fn own(urdf: &str) -> Robot {
    let (robot, _) = Robot::from_urdf(urdf, &EmbeddedMeshes(&[]), &LoadOptions::default()).unwrap();
    robot
}

fn check(name: &str, robot: &Robot, json: &str) {
    let reference: Reference = serde_yaml_ng::from_str(json).unwrap();
    let payload = reference.payload.map(|load| Payload {
        link: load.link,
        inertial: Inertial {
            mass: load.mass,
            centre_in_link: Point3::from(load.centre),
            inertia_in_link: inertia_matrix(load.inertia),
        },
    });
    let gravity = Vector3::from(reference.gravity);
    let dynamics = Dynamics::new(robot, gravity, payload.as_ref()).unwrap();
    let mut workspace = dynamics.workspace();
    let map = JointMap::new(robot, &reference.joints).unwrap();
    let own = |values: &[f64]| map.pick(values).unwrap();
    assert!(reference.cases.len() >= 4);
    for case in &reference.cases {
        let (q, v, a) = (
            own(&case.position),
            own(&case.velocity),
            own(&case.acceleration),
        );
        let near = |what: &str, found: &[f64], expected: &[f64]| {
            let size = expected.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() <= TOLERANCE * size,
                    "{name}, {what}: {found} instead of {expected}"
                );
            }
            assert_eq!(found.len(), expected.len());
        };
        let rows: Vec<_> = case.mass_matrix.iter().map(|row| own(row)).collect();
        let columns: Vec<Vec<f64>> = (0..robot.dof())
            .map(|column| own(&rows.iter().map(|row| row[column]).collect::<Vec<_>>()))
            .collect();
        near(
            "mass matrix",
            dynamics.mass_matrix(&mut workspace, &q).as_slice(),
            &columns.concat(),
        );
        let found = dynamics.inverse_dynamics(&mut workspace, &q, &v, &a);
        near("inverse dynamics", found, &own(&case.inverse_dynamics));
        let found = dynamics.gravity_torque(&mut workspace, &q);
        near("gravity torque", found, &own(&case.gravity_torque));
        let found = dynamics.coriolis_torque(&mut workspace, &q, &v);
        near("Coriolis torque", found, &own(&case.coriolis_torque));
        let found = dynamics.momentum(&mut workspace, &q, &v);
        near("momentum", found.momentum, &own(&case.momentum));
        near(
            "transposed Coriolis",
            found.coriolis_transpose,
            &own(&case.coriolis_transpose),
        );
    }
}

#[test]
fn the_iiwa_upright_and_on_a_wall_with_a_tool_is_as_pinocchio_says() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    check("upright", &robot, include_str!("dynamics/iiwa14.json"));
    let wall = include_str!("dynamics/iiwa14_on_the_wall.json");
    check("on the wall", &robot, wall);
}

#[test]
fn a_tree_with_slanting_axes_and_fixed_links_is_as_pinocchio_says() {
    let robot = own(include_str!("dynamics/tree.urdf"));
    check("tree", &robot, include_str!("dynamics/tree.json"));
    let loaded = include_str!("dynamics/tree_with_a_load.json");
    check("tree with a load", &robot, loaded);
}

#[test]
fn a_gantry_of_slides_is_as_pinocchio_says() {
    let robot = own(include_str!("dynamics/gantry.urdf"));
    check("gantry", &robot, include_str!("dynamics/gantry.json"));
}
