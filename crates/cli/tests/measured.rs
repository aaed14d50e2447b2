//! Replays of bags that have measured torques beside positions, as most drivers report them.

// Helpers of tests may fail as tests do.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use palpate_bag::BagWriter;
use palpate_model::{LoadOptions, MeasuredSample, iiwa14};
use palpate_sim::{Drive, DriveScenario, Push};
use tempfile::TempDir;

const URDF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/iiwa14.urdf");

/// An arm in slow motion that is pushed with 25 N on link 5, from 1.5 s to 2.3 s.
fn record(folder: &Path, spoil: fn(&mut MeasuredSample)) -> String {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    let scenario = DriveScenario {
        rate_hz: 100.0,
        duration_secs: 3.0,
        torque_noise: 0.05,
        torque_drift: 0.0,
        velocity_noise: 3e-4,
        pushes: vec![Push {
            duration_secs: 0.8,
            ..Push::new("lbr_link_5", 25.0, 1.5)
        }],
        ..DriveScenario::slow(3)
    };
    let path = folder.join("measured.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    for moment in Drive::new(&robot, &scenario).unwrap() {
        let mut measured = moment.measured;
        // A stamp of zero counts as none.
        measured.stamp_ns += 1;
        spoil(&mut measured);
        bag.measured(&robot, &measured).unwrap();
    }
    bag.finish().unwrap();
    path.to_str().unwrap().to_owned()
}

struct Replayed {
    output: Output,
    /// Seconds and statuses.
    rows: Vec<(f64, String)>,
}

impl Replayed {
    fn said(&self) -> String {
        String::from_utf8_lossy(&self.output.stderr).into_owned()
    }

    /// Largest share of contact among the rows between two times, s.
    fn contact_share(&self, from: f64, to: f64) -> f64 {
        let within: Vec<_> = self
            .rows
            .iter()
            .filter(|row| (from..to).contains(&row.0))
            .collect();
        let touched = within.iter().filter(|row| row.1 != "none").count();
        touched as f64 / within.len() as f64
    }
}

fn replay(folder: &Path, bag: &str, urdf: &str, torque: &str) -> Replayed {
    let [config, csv] = ["config.yaml", "estimates.csv"].map(|name| folder.join(name));
    let settings = format!(
        "/**: {{ros__parameters: {{filter: {{method: paper, particles: 200}}, torque: {torque}}}}}"
    );
    fs::write(&config, settings).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["replay", bag, "--urdf", urdf, "--config"])
        .arg(&config)
        .arg("--estimates")
        .arg(&csv)
        .env_remove("RUST_LOG")
        .output()
        .unwrap();
    let text = fs::read_to_string(&csv).unwrap_or_default();
    let rows = text.lines().skip(1).map(|line| {
        let mut fields = line.split(',');
        let secs = fields.next().unwrap().parse::<f64>().unwrap() * 1e-9;
        (secs, fields.next().unwrap().to_owned())
    });
    Replayed {
        rows: rows.collect(),
        output,
    }
}

#[test]
fn a_push_is_found_in_measured_torques_by_either_formula() {
    let folder = TempDir::new().unwrap();
    let bag = record(folder.path(), |_| {});
    for source in ["static", "momentum_observer"] {
        let found = replay(folder.path(), &bag, URDF, &format!("{{source: {source}}}"));
        assert!(found.output.status.success(), "{}", found.said());
        assert_eq!(found.rows.len(), 300);
        let before = found.contact_share(0.5, 1.5);
        assert_eq!(before, 0.0, "{source}");
        let meanwhile = found.contact_share(1.65, 2.3);
        assert_eq!(meanwhile, 1.0, "{source}");
        let table = String::from_utf8_lossy(&found.output.stdout).into_owned();
        assert!(
            table.contains("measured torques") && table.contains("300 samples"),
            "{table}"
        );
        assert!(!table.contains("external torques"), "{table}");
    }
}

#[test]
fn efforts_beside_positions_are_never_taken_silently() {
    let folder = TempDir::new().unwrap();
    let bag = record(folder.path(), |_| {});
    let refused = replay(folder.path(), &bag, URDF, "{source: external}");
    assert_eq!(refused.output.status.code(), Some(3));
    assert!(
        refused.said().contains("external joint torques"),
        "{}",
        refused.said()
    );
}

#[test]
fn missing_speeds_are_told_with_the_way_out_and_the_way_out_works() {
    let folder = TempDir::new().unwrap();
    let bag = record(folder.path(), |measured| measured.velocity.clear());
    let refused = replay(folder.path(), &bag, URDF, "{source: momentum_observer}");
    assert_eq!(refused.output.status.code(), Some(3));
    let said = refused.said();
    assert!(
        said.contains("lbr_A1") && said.contains("torque.velocity.source"),
        "{said}"
    );
    let torque = "{source: momentum_observer, velocity: {source: differentiated}}";
    let found = replay(folder.path(), &bag, URDF, torque);
    assert!(found.output.status.success(), "{}", found.said());
    assert_eq!(found.contact_share(1.65, 2.3), 1.0);
}

#[test]
fn spoiled_samples_are_counted_and_the_rest_is_used() {
    let folder = TempDir::new().unwrap();
    let bag = record(folder.path(), |measured| {
        if measured.stamp_ns < 200_000_000 {
            measured.velocity[3] = f64::NAN;
        }
        if measured.stamp_ns > 2_900_000_000 {
            measured.torque[1] = 5000.0;
        }
    });
    let found = replay(folder.path(), &bag, URDF, "{source: static}");
    assert!(found.output.status.success(), "{}", found.said());
    assert_eq!(found.rows.len(), 280);
    let said = found.said();
    assert!(
        said.contains("20 measured samples refused") && said.contains("lbr_A4"),
        "{said}"
    );
    assert!(
        said.contains("beyond its limit") && said.contains("lbr_A2"),
        "{said}"
    );
}

#[test]
fn a_link_without_mass_is_refused_by_name() {
    let folder = TempDir::new().unwrap();
    let bag = record(folder.path(), |_| {});
    let whole = fs::read_to_string(URDF).unwrap();
    let (head, tail) = whole.split_once("<link name=\"lbr_link_4\">").unwrap();
    let (_, tail) = tail.split_once("</inertial>").unwrap();
    let bare = folder.path().join("bare.urdf");
    let meshes = concat!(env!("CARGO_MANIFEST_DIR"), "/../../meshes");
    let text = format!("{head}<link name=\"lbr_link_4\">{tail}");
    fs::write(&bare, text.replace("package://palpate/meshes", meshes)).unwrap();
    let bare = bare.to_str().unwrap();
    let refused = replay(folder.path(), &bag, bare, "{source: static}");
    assert_eq!(refused.output.status.code(), Some(3));
    assert!(
        refused.said().contains("link `lbr_link_4`"),
        "{}",
        refused.said()
    );
}
