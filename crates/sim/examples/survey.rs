//! Trials on the iiwa: force range, travel of the contact on the link and time taken, for each link and obstacle.
//!
//! `cargo run --release -p palpate-sim --example survey [seeds] [refine levels]`

use std::time::Instant;

use nalgebra::Point3;
use palpate_model::{LoadOptions, iiwa14};
use palpate_sim::{ObstacleKind, Scenario, Trial, simulate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(5), |text| text.parse())?;
    let refine_levels: u32 = std::env::args().nth(2).map_or(Ok(1), |text| text.parse())?;
    let robot = iiwa14(&LoadOptions::default())?;
    let obstacles = [
        ObstacleKind::Sphere { radius: 0.03 },
        ObstacleKind::Cylinder {
            radius: 0.05,
            half_length: 0.2,
            axis: None,
        },
        ObstacleKind::Box {
            half_extents: [0.05; 3],
            fillet: 0.005,
        },
        ObstacleKind::Plane {},
    ];
    println!(
        "link      obstacle seed   force N       travel mm  largest step mm  joint rad/s  seconds"
    );
    for link in robot
        .links
        .iter()
        .filter(|link| !link.path.is_empty() && link.mesh.is_some())
    {
        for obstacle in &obstacles {
            for seed in 1..=seeds {
                let scenario = Scenario {
                    seed,
                    refine_levels,
                    obstacle: obstacle.clone(),
                    ..Scenario::new(&link.name)
                };
                let start = Instant::now();
                let trial = simulate(&robot, &scenario);
                let secs = start.elapsed().as_secs_f64();
                let found = trial.map_or_else(|error| error.to_string(), |trial| row(&trial));
                println!(
                    "{:9} {:8} {seed:4}  {found}  {secs:7.3}",
                    link.name,
                    obstacle.name()
                );
            }
        }
    }
    Ok(())
}

fn row(trial: &Trial) -> String {
    let contacts: Vec<_> = trial.truth.iter().filter_map(|row| row.contact).collect();
    let forces = contacts.iter().map(|contact| contact.force_in_root.norm());
    let (least, most) = forces.fold((f64::MAX, 0.0_f64), |(least, most), force| {
        (least.min(force), most.max(force))
    });
    let points: Vec<Point3<f64>> = contacts
        .iter()
        .map(|contact| contact.point_in_link)
        .collect();
    let travel = |from: &Point3<f64>| {
        points
            .iter()
            .map(|to| (to - from).norm())
            .fold(0.0, f64::max)
    };
    let travel = points.iter().map(travel).fold(0.0, f64::max);
    let steps = points.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    let speeds = trial.samples.windows(2).flat_map(|pair| {
        let moved = pair[0].position.iter().zip(&pair[1].position);
        moved.map(|(a, b)| (b - a).abs() * trial.rate_hz)
    });
    format!(
        "{least:6.2} {most:6.2}  {:9.2}  {:15.2}  {:11.3}",
        1e3 * travel,
        1e3 * steps.fold(0.0, f64::max),
        speeds.fold(0.0, f64::max),
    )
}
