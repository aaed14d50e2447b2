//! Trials on the iiwa that ships with the project.

use nalgebra::{Point3, Vector3};
use palpate_model::{Kinematics, LoadOptions, ModelError, Robot, TriangleMesh, iiwa14};
use palpate_sim::{
    ObstacleKind, Scenario, SimError, Trial, TrueContact, refine, simulate, write_truth_csv,
};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn robot() -> Result<Robot, ModelError> {
    iiwa14(&LoadOptions::default())
}

fn link_name(number: usize) -> String {
    format!("lbr_link_{number}")
}

fn short(number: usize, seed: u64) -> Scenario {
    Scenario {
        seed,
        duration_secs: 3.0,
        ..Scenario::new(&link_name(number))
    }
}

fn pole() -> ObstacleKind {
    ObstacleKind::Cylinder {
        radius: 0.05,
        half_length: 0.2,
        axis: None,
    }
}

fn cube() -> ObstacleKind {
    ObstacleKind::Box {
        half_extents: [0.05; 3],
        fillet: 0.005,
    }
}

fn obstacles() -> [ObstacleKind; 4] {
    let sphere = ObstacleKind::Sphere { radius: 0.03 };
    [sphere, pole(), cube(), ObstacleKind::Plane {}]
}

fn contacts(trial: &Trial) -> Vec<TrueContact> {
    trial.truth.iter().filter_map(|row| row.contact).collect()
}

/// Distance from a point to a mesh, by asking every triangle: to its plane where the foot is inside, else to its sides.
fn distance_to_mesh(mesh: &TriangleMesh, point: &Point3<f64>) -> f64 {
    let to_triangle = |triangle: usize| {
        let [a, b, c] = mesh.corners(triangle);
        let normal = (b - a).cross(&(c - a)).normalize();
        let sides = [(a, b), (b, c), (c, a)];
        if (sides.iter()).all(|(from, to)| (to - from).cross(&(point - from)).dot(&normal) >= 0.0) {
            return (point - a).dot(&normal).abs();
        }
        let to_side = |(from, to): (Point3<f64>, Point3<f64>)| {
            let along = to - from;
            let share = (point - from).dot(&along) / along.norm_squared();
            (point - from - along * share.clamp(0.0, 1.0)).norm()
        };
        sides.map(to_side).into_iter().fold(f64::MAX, f64::min)
    };
    (0..mesh.triangles.len())
        .map(to_triangle)
        .fold(f64::MAX, f64::min)
}

/// The mesh that a trial's obstacle touches.
fn touched_mesh(robot: &Robot, trial: &Trial) -> TriangleMesh {
    refine(&robot.links[trial.link].mesh.clone().unwrap_or_default(), 1)
}

/// How deep a sphere of 30 mm at rest is in the touched link, at another configuration.
fn sphere_depth(robot: &Robot, trial: &Trial, mesh: &TriangleMesh, position: &[f64]) -> f64 {
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, position);
    let centre = Point3::from(trial.obstacle.root_from_obstacle.translation.vector);
    let centre_in_link = kinematics.root_from_link(trial.link).inverse() * centre;
    0.03 - distance_to_mesh(mesh, &centre_in_link)
}

#[test]
fn every_link_meets_every_obstacle_within_the_commanded_force() -> Outcome {
    let robot = robot()?;
    for number in 1..=7 {
        for obstacle in obstacles() {
            let scenario = Scenario {
                obstacle: obstacle.clone(),
                ..short(number, 7)
            };
            let trial = simulate(&robot, &scenario)?;
            let what = format!("{} at link {number}", obstacle.name());
            assert_eq!(trial.samples.len(), 300, "{what}");
            let contacts = contacts(&trial);
            assert_eq!(contacts.len(), 300, "{what}");
            for contact in &contacts {
                let force = contact.force_in_root.norm();
                assert!((5.0..33.0).contains(&force), "{what}: {force} N");
                assert!(
                    (force - 8000.0 * contact.penetration).abs() < 1e-9,
                    "{what}"
                );
                assert!(contact.normal_in_root.dot(&contact.force_in_root) < -0.999_999 * force);
            }
            for pair in trial.samples.windows(2) {
                for joint in 0..robot.dof() {
                    let moved = (pair[1].position[joint] - pair[0].position[joint]).abs();
                    assert!(moved * 100.0 < 1.0, "{what}: {moved} rad in a sample");
                    assert!(
                        joint < number || moved == 0.0,
                        "{what}: joint {joint} moves"
                    );
                }
            }
        }
    }
    Ok(())
}

#[test]
fn the_contact_is_on_the_mesh_and_as_deep_in_the_obstacle_as_it_says() -> Outcome {
    let robot = robot()?;
    for obstacle in obstacles() {
        let scenario = Scenario {
            obstacle,
            ..short(4, 3)
        };
        let trial = simulate(&robot, &scenario)?;
        let mesh = touched_mesh(&robot, &trial);
        let mut kinematics = Kinematics::new(&robot);
        for (sample, row) in trial.samples.iter().zip(&trial.truth) {
            let contact = row.contact.ok_or("contact")?;
            kinematics.update(&robot, &sample.position);
            let root_from_link = kinematics.root_from_link(row.link);
            assert!(
                (root_from_link * contact.point_in_link - contact.point_in_root).norm() < 1e-12
            );
            assert!(distance_to_mesh(&mesh, &contact.point_in_link) < 1e-9);
            let in_obstacle = trial.obstacle.root_from_obstacle.inverse() * contact.point_in_root;
            let depth = depth_of_point(&trial.obstacle.kind, &in_obstacle);
            assert!(
                (depth - contact.penetration).abs() < 1e-9,
                "{depth} {contact:?}"
            );
        }
    }
    Ok(())
}

/// How deep a point is under the surface of an obstacle, in its frame.
fn depth_of_point(kind: &ObstacleKind, point: &Point3<f64>) -> f64 {
    let beyond = |half: Vector3<f64>| (point.coords.abs() - half).sup(&Vector3::zeros()).norm();
    match *kind {
        ObstacleKind::Sphere { radius } => radius - point.coords.norm(),
        ObstacleKind::Cylinder {
            radius,
            half_length,
            ..
        } => radius - beyond(Vector3::new(0.0, 0.0, half_length)),
        ObstacleKind::Box {
            half_extents,
            fillet,
        } => fillet - beyond(Vector3::from(half_extents).add_scalar(-fillet)),
        ObstacleKind::Plane {} => -point.z,
    }
}

/// τ = −∂/∂q ½ K δ², the contact's potential: by finite differences of distances that every triangle was asked for. In a groove between
/// two triangles the potential has a kink, and the torque is one of its two slopes or between them.
#[test]
fn frictionless_torque_is_minus_the_slope_of_the_contact_potential() -> Outcome {
    const STEP: f64 = 1e-6;
    const TOLERANCE: f64 = 5e-3;
    let robot = robot()?;
    let (mut slopes, mut kinks) = (0, 0);
    for (number, seed) in (1..=7).flat_map(|number| [11, 12, 13].map(|seed| (number, seed))) {
        let scenario = short(number, seed);
        let trial = simulate(&robot, &scenario)?;
        let mesh = touched_mesh(&robot, &trial);
        let potential = |position: &[f64]| {
            let depth = sphere_depth(&robot, &trial, &mesh, position);
            0.5 * scenario.stiffness * depth * depth
        };
        for index in (0..trial.samples.len()).step_by(43) {
            for joint in 0..number {
                let moved = |by: f64| {
                    let mut position = trial.samples[index].position.clone();
                    position[joint] += by;
                    potential(&position)
                };
                let before = -(moved(0.0) - moved(-STEP)) / STEP;
                let after = -(moved(STEP) - moved(0.0)) / STEP;
                let torque = trial.clean_torques[index][joint];
                let allowed = before.min(after) - TOLERANCE..=before.max(after) + TOLERANCE;
                assert!(
                    allowed.contains(&torque),
                    "link {number} seed {seed}: {torque}, {allowed:?}"
                );
                slopes += 1;
                kinks += usize::from((before - after).abs() > 2.0 * TOLERANCE);
            }
        }
    }
    assert!(kinks * 20 < slopes, "{kinks} kinks in {slopes} slopes");
    Ok(())
}

#[test]
fn friction_changes_the_force_and_takes_power_but_leaves_the_motion() -> Outcome {
    let robot = robot()?;
    let smooth = simulate(&robot, &short(5, 2))?;
    let rough_scenario = Scenario {
        friction: 0.3,
        ..short(5, 2)
    };
    let rough = simulate(&robot, &rough_scenario)?;
    let mut work = 0.0;
    for (index, (a, b)) in contacts(&smooth)
        .iter()
        .zip(contacts(&rough))
        .enumerate()
        .skip(1)
    {
        assert_eq!(
            smooth.samples[index].position,
            rough.samples[index].position
        );
        let friction = b.force_in_root - a.force_in_root;
        let ratio = friction.norm() / a.force_in_root.norm();
        assert!(
            friction.dot(&a.normal_in_root).abs() < 1e-9 && ratio < 0.3,
            "{ratio}"
        );
        let before = &rough.samples[index - 1].position;
        work += (0..robot.dof())
            .map(|joint| {
                let moved = rough.samples[index].position[joint] - before[joint];
                moved * (rough.clean_torques[index][joint] - smooth.clean_torques[index][joint])
            })
            .sum::<f64>();
    }
    assert!(work < -0.001, "friction does {work} J");
    Ok(())
}

#[test]
fn noise_and_bias_are_as_asked_and_leave_the_rest() -> Outcome {
    let robot = robot()?;
    let clean = simulate(&robot, &short(6, 9))?;
    let noisy_scenario = Scenario {
        noise_fraction: 0.1,
        bias: vec![0.2; 7],
        ..short(6, 9)
    };
    let noisy = simulate(&robot, &noisy_scenario)?;
    assert_eq!(
        (&clean.truth, &clean.clean_torques),
        (&noisy.truth, &noisy.clean_torques)
    );
    let count = clean.samples.len() as f64;
    for joint in 0..7 {
        let signal = clean.clean_torques.iter().map(|torques| torques[joint]);
        let rms = (signal.map(|x| x * x).sum::<f64>() / count).sqrt();
        let errors: Vec<_> = (noisy.samples.iter().zip(&clean.clean_torques))
            .map(|(sample, torques)| sample.external_torque[joint] - torques[joint])
            .collect();
        let mean = errors.iter().sum::<f64>() / count;
        let variance = errors.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / count;
        // 300 draws: the mean is known to 6 % of sigma and sigma to 4 %; four of those.
        assert!(
            (mean - 0.2).abs() <= 0.25 * 0.1 * rms + 1e-12,
            "joint {joint}: bias {mean}"
        );
        assert!(
            (variance.sqrt() - 0.1 * rms).abs() <= 0.16 * 0.1 * rms + 1e-12,
            "joint {joint}"
        );
    }
    assert!(
        clean
            .samples
            .iter()
            .all(|sample| sample.external_torque[6] == 0.0)
    );
    Ok(())
}

#[test]
fn noise_floor_reaches_joints_that_feel_nothing_and_a_walk_grows() -> Outcome {
    let robot = robot()?;
    let spread = |scenario: &Scenario, range: std::ops::Range<usize>| -> Result<f64, SimError> {
        let trial = simulate(&robot, scenario)?;
        let squares = trial.samples[range.clone()]
            .iter()
            .flat_map(|s| s.external_torque[2..].to_vec());
        Ok((squares.map(|x| x * x).sum::<f64>() / (5 * range.len()) as f64).sqrt())
    };
    let floor = Scenario {
        noise_floor: 0.1,
        ..short(2, 1)
    };
    assert!((spread(&floor, 0..300)? - 0.1).abs() < 0.01);
    let walk = Scenario {
        bias_walk: 0.1,
        ..short(2, 1)
    };
    assert!(spread(&walk, 0..10)? < 0.05 && spread(&walk, 290..300)? > 0.05);
    Ok(())
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_another_trial() -> Outcome {
    let robot = robot()?;
    let noisy = |seed| Scenario {
        noise_fraction: 0.05,
        bias_sigma: 0.2,
        obstacle: pole(),
        ..short(3, seed)
    };
    let first = simulate(&robot, &noisy(4))?;
    assert_eq!(first, simulate(&robot, &noisy(4))?);
    assert_ne!(first.samples, simulate(&robot, &noisy(5))?.samples);
    Ok(())
}

#[test]
fn a_lead_in_starts_free_and_ends_in_contact() -> Outcome {
    let robot = robot()?;
    let scenario = Scenario {
        lead_in_secs: 1.0,
        noise_floor: 0.01,
        ..short(4, 6)
    };
    let trial = simulate(&robot, &scenario)?;
    assert_eq!(trial.samples.len(), 400);
    let first = trial
        .truth
        .iter()
        .position(|row| row.contact.is_some())
        .ok_or("no contact")?;
    assert!((50..100).contains(&first), "contact from sample {first}");
    assert!(trial.truth[first..].iter().all(|row| row.contact.is_some()));
    assert!(
        trial.clean_torques[..first]
            .iter()
            .flatten()
            .all(|torque| *torque == 0.0)
    );
    Ok(())
}

#[test]
fn a_drifting_obstacle_is_followed() -> Outcome {
    let robot = robot()?;
    for number in 3..=7 {
        let scenario = Scenario {
            drift: [0.003, 0.0, 0.004],
            ..short(number, 1)
        };
        let trial = simulate(&robot, &scenario)?;
        let contacts = contacts(&trial);
        assert_eq!(contacts.len(), 300);
        // The centre of the sphere, seen from the contact, has moved with the drift.
        let centre = |contact: &TrueContact| {
            contact.point_in_root
                + contact.normal_in_root.into_inner() * (0.03 - contact.penetration)
        };
        let moved = centre(&contacts[299]) - centre(&contacts[0]);
        assert!(
            (moved - Vector3::new(0.003, 0.0, 0.004) * 2.99).norm() < 1e-9,
            "{moved}"
        );
    }
    Ok(())
}

#[test]
fn the_demo_is_an_upright_pole_at_link_3() -> Outcome {
    let robot = robot()?;
    let scenario = Scenario::demo(&robot)?;
    let trial = simulate(&robot, &scenario)?;
    assert_eq!(trial.samples.len(), 800);
    assert_eq!(robot.links[trial.link].name, "lbr_link_3");
    let axis = trial.obstacle.root_from_obstacle * Vector3::z();
    assert!((axis - Vector3::z()).norm() < 1e-12);
    Ok(())
}

#[test]
fn truth_has_the_columns_of_recorded_truth() -> Outcome {
    let scenario = Scenario {
        lead_in_secs: 0.5,
        ..short(4, 6)
    };
    let trial = simulate(&robot()?, &scenario)?;
    let mut bytes = Vec::new();
    write_truth_csv(&trial.truth, &mut bytes)?;
    let text = String::from_utf8(bytes)?;
    let mut lines = text.lines();
    let header = lines.next().ok_or("header")?;
    assert_eq!(
        header,
        "t,link_index,link_name,px,py,pz,lx,ly,lz,nx,ny,nz,fx,fy,fz,force_N"
    );
    let first = lines.next().ok_or("first row")?;
    assert!(first.starts_with("0.000000,4,lbr_link_4,0.0"), "{first}");
    let last = lines.next_back().ok_or("last row")?;
    let cells: Vec<_> = last.split(',').collect();
    assert_eq!((cells.len(), cells[0], cells[1]), (16, "3.490000", "4"));
    let force = contacts(&trial)
        .last()
        .ok_or("contact")?
        .force_in_root
        .norm();
    assert!((cells[15].parse::<f64>()? - force).abs() < 1e-8);
    assert_eq!(text.lines().count(), 351);
    Ok(())
}

#[test]
fn yaml_has_the_defaults_and_refuses_unknown_keys() -> Outcome {
    assert_eq!(
        Scenario::from_yaml("link: lbr_link_3")?,
        Scenario::new("lbr_link_3")
    );
    let text =
        "{link: a, obstacle: {kind: box, half_extents: [0.1, 0.2, 0.3]}, drift: [0.005, 0, 0]}";
    let read = Scenario::from_yaml(text)?;
    let expected = ObstacleKind::Box {
        half_extents: [0.1, 0.2, 0.3],
        fillet: 0.005,
    };
    assert_eq!((&read.obstacle, read.drift[0]), (&expected, 0.005));
    assert_eq!(
        Scenario::from_yaml(&serde_yaml_ng::to_string(&read)?)?,
        read
    );
    for (text, part) in [
        ("link: a\nstifness: 3", "stifness"),
        ("seed: 3", "link"),
        ("{link: a, obstacle: {kind: sphere, radios: 1}}", "radios"),
        ("{link: a, obstacle: {kind: plane, radius: 1}}", "radius"),
        ("{link: a, obstacle: {kind: cone}}", "cone"),
        ("- 1", "sequence"),
    ] {
        let error = Scenario::from_yaml(text).err().ok_or(text)?.to_string();
        assert!(error.contains(part), "{error}");
    }
    Ok(())
}

#[test]
fn what_cannot_be_simulated_is_refused_by_name() -> Outcome {
    let robot = robot()?;
    let good = short(3, 1);
    let cases = [
        (
            Scenario {
                link: "hand".into(),
                ..good.clone()
            },
            "no link hand; it has",
        ),
        (
            Scenario {
                link: "lbr_link_0".into(),
                ..good.clone()
            },
            "lbr_link_0 does not move",
        ),
        (
            Scenario {
                link: "lbr_link_ee".into(),
                ..good.clone()
            },
            "lbr_link_ee has no mesh",
        ),
        (
            Scenario {
                stiffness: f64::NAN,
                ..good.clone()
            },
            "stiffness must be 1 to 10000000 N/m, found NaN",
        ),
        (
            Scenario {
                rate_hz: 0.0,
                ..good.clone()
            },
            "rate_hz must be",
        ),
        (
            Scenario {
                rate_hz: 1e4,
                duration_secs: 3600.0,
                ..good.clone()
            },
            "rate_hz times all secs",
        ),
        (
            Scenario {
                drift: [0.0, 1.0, 0.0],
                ..good.clone()
            },
            "drift must be",
        ),
        (
            Scenario {
                friction: -0.1,
                ..good.clone()
            },
            "friction must be 0 to 2, found -0.1",
        ),
        (
            Scenario {
                bias: vec![0.0; 3],
                ..good.clone()
            },
            "bias must be empty or 7 values, found 3 values",
        ),
        (
            Scenario {
                stiffness: 500.0,
                ..good.clone()
            },
            "max_force / stiffness must be",
        ),
        (
            Scenario {
                refine_levels: 9,
                ..good.clone()
            },
            "refine_levels must be",
        ),
        (
            Scenario {
                obstacle: ObstacleKind::Sphere { radius: -1.0 },
                ..good.clone()
            },
            "radius must be",
        ),
        (
            Scenario {
                obstacle: ObstacleKind::Box {
                    half_extents: [0.1, 0.1, 0.004],
                    fillet: 0.005,
                },
                ..good.clone()
            },
            "half_extents must be 0.006",
        ),
        (
            // A turn about one axis cannot follow an obstacle for six metres.
            Scenario {
                drift: [0.1, 0.0, 0.0],
                duration_secs: 60.0,
                link: link_name(1),
                ..good.clone()
            },
            "no contact of a sphere with link lbr_link_1 in 2000 draws; refused: ",
        ),
    ];
    for (scenario, part) in cases {
        let error = simulate(&robot, &scenario).err().ok_or(part)?.to_string();
        assert!(error.contains(part), "{error}");
    }
    Ok(())
}
