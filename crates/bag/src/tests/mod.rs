//! Tests across the files of this crate: bags are written into temporary folders and read again.

mod choice;
mod damage;
mod measured;
mod round_trip;
mod sources;
mod storage;

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Vector3};
use palpate_model::{Joint, JointKind, JointSample, Link, Robot};
use tempfile::TempDir;

use crate::message::{Header, JointState};
use crate::{Bag, BagError, BagWriter, Recording, TopicChoice, read_samples};

const TOLERANCE_NS: i64 = 5_000_000;

/// Two hinges in a row.
fn arm() -> Robot {
    let joint = |name: &str| Joint {
        name: name.to_owned(),
        kind: JointKind::Revolute,
        axis_in_joint: Vector3::z_axis(),
        limits: None,
    };
    let link = |index: usize, name: &str| Link {
        name: name.to_owned(),
        parent: index.checked_sub(1),
        parent_from_rest: Isometry3::translation(0.0, 0.1, 0.3),
        joint: index.checked_sub(1),
        path: (0..index).collect(),
        inertial: None,
        mesh: None,
    };
    Robot {
        name: "arm".to_owned(),
        joints: ["shoulder", "elbow"].map(joint).to_vec(),
        links: ["base", "upper", "lower"]
            .iter()
            .enumerate()
            .map(|(index, name)| link(index, name))
            .collect(),
    }
}

/// Ten samples, 10 ms apart, with values whose bits are easily lost.
fn samples() -> Vec<JointSample> {
    (0..10)
        .map(|step| JointSample {
            stamp_ns: 1_700_000_000_123_456_789 + 10_000_000 * step,
            position: vec![step as f64 / 3.0, -0.0],
            external_torque: vec![1e-310, -(step as f64) * 0.1],
        })
        .collect()
}

fn write_samples(path: &Path) {
    let mut bag = BagWriter::create(path).unwrap();
    for sample in samples() {
        bag.sample(&arm(), &sample).unwrap();
    }
    bag.finish().unwrap();
}

fn read(path: &Path) -> Result<Recording, BagError> {
    read_chosen(path, None, None)
}

fn read_chosen(
    path: &Path,
    positions: Option<&str>,
    torques: Option<&str>,
) -> Result<Recording, BagError> {
    let choice = TopicChoice {
        positions: positions.map(str::to_owned),
        torques: torques.map(str::to_owned),
        ..TopicChoice::default()
    };
    read_samples(&Bag::open(path)?, &arm(), &choice, TOLERANCE_NS)
}

/// A folder that vanishes, and a path in it.
fn place(name: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

fn state(stamp_ns: i64, names: &[&str], position: &[f64], effort: &[f64]) -> JointState {
    JointState {
        header: Header::new(stamp_ns, ""),
        name: names.iter().map(|&name| name.to_owned()).collect(),
        position: position.to_vec(),
        effort: effort.to_vec(),
        ..JointState::default()
    }
}

/// Numbers that look random and are the same each time (splitmix64).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) % bound as u64) as usize
    }
}
