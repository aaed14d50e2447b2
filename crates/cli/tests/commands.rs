//! The commands as a user runs them, on data that they simulate themselves.

// Helpers of tests may fail as tests do.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use palpate_bag::{Bag, BagWriter, topics};
use tempfile::TempDir;

const URDF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/iiwa14.urdf");

fn palpate(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

/// Runs a command that must succeed; returns what it printed.
fn done(arguments: &[&str]) -> String {
    let output = palpate(arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs a command that must fail with `code`; returns the one line that it says.
fn refused(code: i32, arguments: &[&str]) -> String {
    let output = palpate(arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    if code != 2 {
        let errors = said.lines().filter(|line| line.starts_with("palpate: "));
        assert_eq!(errors.count(), 1, "{said}");
    }
    said
}

/// A folder with a simulated trial of one second and parameters that make the filter fast.
struct Trial {
    folder: TempDir,
}

impl Trial {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let trial = Self { folder };
        let scenario = "link: lbr_link_5\nduration_secs: 1\nrate_hz: 50\nnoise_fraction: 0.05\n";
        trial.write("scenario.yaml", scenario);
        trial.write(
            "fast.yaml",
            "/**: {ros__parameters: {filter: {particles: 400}}}\n",
        );
        let (scenario, out) = (trial.path("scenario.yaml"), trial.path("trial"));
        done(&["simulate", &scenario, "--out", &out]);
        trial
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Replays the bag with more arguments and reads the CSV.
    fn replay(&self, bag: &str, more: &[&str]) -> String {
        let (bag, fast, csv) = (self.path(bag), self.path("fast.yaml"), self.path("e.csv"));
        let arguments = [
            "replay",
            &bag,
            "--urdf",
            URDF,
            "--config",
            &fast,
            "--estimates",
            &csv,
        ];
        done(&[&arguments[..], more].concat());
        self.read("e.csv")
    }
}

const HEADER: &str = "stamp_ns,status,link,x,y,z,nx,ny,nz,force,stiffness,std,probability";

/// Fields of each row, after a look at the header.
fn rows(csv: &str) -> Vec<Vec<&str>> {
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some(HEADER));
    lines.map(|line| line.split(',').collect()).collect()
}

#[test]
fn a_simulated_contact_is_replayed_into_one_row_a_sample() {
    let trial = Trial::new();
    let csv = trial.replay("trial/bag", &[]);
    let rows = rows(&csv);
    let truth = trial.read("trial/truth.csv");
    assert_eq!(rows.len(), truth.lines().count() - 1);
    let stamp = |row: &Vec<&str>| row[0].parse::<i64>().unwrap();
    let stamps: Vec<_> = rows.iter().map(stamp).collect();
    // One sample alone is no contact, and the first look around the robot takes two.
    assert_eq!((rows[0][1], rows[1][1]), ("none", "ambiguous"));
    for row in &rows[2..] {
        assert_eq!(row.len(), 13, "{row:?}");
        assert!(["ambiguous", "located"].contains(&row[1]), "{row:?}");
        assert!(row[2].starts_with("lbr_link_"), "{row:?}");
        let numbers: Vec<f64> = row[3..]
            .iter()
            .map(|field| field.parse().unwrap())
            .collect();
        assert!(numbers.iter().all(|number| number.is_finite()), "{row:?}");
        let [nx, ny, nz] = [numbers[3], numbers[4], numbers[5]];
        assert!((nx * nx + ny * ny + nz * nz - 1.0).abs() < 1e-3, "{row:?}");
        assert!((0.0..=1.0).contains(&numbers[9]), "{row:?}");
    }
    assert!(
        stamps
            .windows(2)
            .all(|pair| pair[1] - pair[0] == 20_000_000)
    );
}

#[test]
fn the_seed_decides_and_the_number_of_threads_does_not() {
    let trial = Trial::new();
    let one = trial.replay("trial/bag", &["--seed", "7", "--threads", "1"]);
    let two = trial.replay("trial/bag", &["--seed", "7", "--threads", "2"]);
    let other = trial.replay("trial/bag", &["--seed", "8", "--threads", "2"]);
    assert_eq!(one, two);
    assert_ne!(one, other);
}

#[test]
fn a_recorded_replay_is_a_bag_that_replays_alike() {
    let trial = Trial::new();
    let first = trial.replay("trial/bag", &["--out", &trial.path("again.mcap")]);
    assert_eq!(first, trial.replay("again.mcap", &[]));
    let bag = Bag::open(Path::new(&trial.path("again.mcap"))).unwrap();
    for topic in [
        topics::CONTACT_POSE,
        topics::PARTICLES,
        topics::TF,
        topics::ROBOT_DESCRIPTION,
    ] {
        assert!(bag.topic(topic).is_ok(), "{topic}");
    }
}

#[test]
fn a_table_comes_unless_quiet_is_asked_for() {
    let trial = Trial::new();
    let (bag, fast) = (trial.path("trial/bag"), trial.path("fast.yaml"));
    let arguments = ["replay", &bag, "--urdf", URDF, "--config", &fast];
    let table = done(&arguments);
    for told in [
        "/joint_states, 50 messages",
        "50 used",
        "located",
        "× real time",
    ] {
        assert!(table.contains(told), "{told} is not in {table}");
    }
    assert_eq!(done(&[&arguments[..], &["--quiet"]].concat()), "");
}

#[test]
fn wrong_usage_ends_with_2() {
    refused(2, &[]);
    refused(2, &["replay", "bag", "--nonsense"]);
    let said = refused(2, &["replay", "bag"]);
    assert!(said.contains("--urdf"), "{said}");
    let said = refused(2, &["demo", "--link", "9"]);
    assert!(said.contains("lbr_link_7"), "{said}");
}

#[test]
fn wrong_data_ends_with_3_and_is_named() {
    let trial = Trial::new();
    let bag = trial.path("trial/bag");
    let said = refused(3, &["replay", "no-bag-here", "--urdf", URDF]);
    assert!(said.contains("no-bag-here"), "{said}");
    let said = refused(3, &["replay", &bag, "--urdf", "no.urdf"]);
    assert!(said.contains("no.urdf"), "{said}");
    trial.write("bad.urdf", "<robot name=\"r\"><link name=\"a\"");
    refused(3, &["inspect", "--urdf", &trial.path("bad.urdf")]);
    trial.write(
        "bad.yaml",
        "/**: {ros__parameters: {filter: {partikles: 4}}}",
    );
    let said = refused(
        3,
        &[
            "replay",
            &bag,
            "--urdf",
            URDF,
            "--config",
            &trial.path("bad.yaml"),
        ],
    );
    assert!(said.contains("filter.partikles"), "{said}");
    trial.write(
        "bad.yaml",
        "/**: {ros__parameters: {filter: {particles: 4}}}",
    );
    let said = refused(
        3,
        &[
            "replay",
            &bag,
            "--urdf",
            URDF,
            "--config",
            &trial.path("bad.yaml"),
        ],
    );
    assert!(said.contains("filter.particles is 4"), "{said}");
}

#[test]
fn wrong_scenarios_end_with_3_and_are_named() {
    let trial = Trial::new();
    let simulate = |scenario: &str| {
        trial.write("bad.yaml", scenario);
        let out = trial.path("other");
        refused(3, &["simulate", &trial.path("bad.yaml"), "--out", &out])
    };
    assert!(simulate("link: lbr_link_3\nnoice: 1\n").contains("noice"));
    assert!(simulate("link: elbow\n").contains("elbow"));
    assert!(simulate("link: lbr_link_3\nstiffness: -1\n").contains("stiffness"));
    assert!(!PathBuf::from(trial.path("other")).exists());
}

#[test]
fn nothing_is_overwritten_by_a_simulation() {
    let trial = Trial::new();
    let before = trial.read("trial/truth.csv");
    let (scenario, out) = (trial.path("scenario.yaml"), trial.path("trial"));
    let said = refused(1, &["simulate", &scenario, "--out", &out]);
    assert!(said.contains("not an empty folder"), "{said}");
    assert_eq!(trial.read("trial/truth.csv"), before);
}

#[test]
fn the_bag_that_is_read_is_not_written_over() {
    let trial = Trial::new();
    trial.replay("trial/bag", &["--out", &trial.path("bag.mcap")]);
    let before = fs::read(trial.path("bag.mcap")).unwrap();
    for option in ["--out", "--estimates"] {
        let bag = trial.path("bag.mcap");
        let said = refused(2, &["replay", &bag, "--urdf", URDF, option, &bag]);
        assert!(said.contains("bag.mcap"), "{said}");
    }
    assert_eq!(fs::read(trial.path("bag.mcap")).unwrap(), before);
}

#[test]
fn a_truncated_bag_is_read_as_far_as_it_goes_or_refused() {
    let trial = Trial::new();
    // Its clouds fill several chunks.
    trial.replay("trial/bag", &["--out", &trial.path("long.mcap")]);
    let whole = fs::read(trial.path("long.mcap")).unwrap();
    for keep in [0, 7, 100, whole.len() / 2] {
        fs::write(trial.path("cut.mcap"), &whole[..keep]).unwrap();
        let (cut, fast) = (trial.path("cut.mcap"), trial.path("fast.yaml"));
        let output = palpate(&["replay", &cut, "--urdf", URDF, "--config", &fast]);
        let said = String::from_utf8(output.stderr).unwrap();
        match output.status.code() {
            Some(0) => assert!(said.contains("cut.mcap"), "{keep}: no warning: {said}"),
            Some(3) => assert!(said.contains("cut.mcap"), "{keep}: {said}"),
            code => panic!("{keep} bytes: {code:?} {said}"),
        }
    }
}

#[test]
fn a_bag_without_the_topics_tells_which_it_has() {
    let trial = Trial::new();
    let path = trial.path("empty.mcap");
    let mut bag = BagWriter::create(Path::new(&path)).unwrap();
    bag.robot_description(1, "<robot/>").unwrap();
    bag.finish().unwrap();
    let said = refused(3, &["replay", &path, "--urdf", URDF]);
    assert!(said.contains(topics::ROBOT_DESCRIPTION), "{said}");
    let bag = trial.path("trial/bag");
    let said = refused(
        3,
        &["replay", &bag, "--urdf", URDF, "--torques", "/elsewhere"],
    );
    assert!(
        said.contains("/elsewhere") && said.contains("/external_torques"),
        "{said}"
    );
}

#[test]
fn the_demo_leaves_a_picture_a_bag_and_estimates() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    let told = done(&[
        "demo",
        "--link",
        "lbr_link_4",
        "--obstacle",
        "sphere",
        "--particles",
        "300",
        "--secs",
        "0.5",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(told.contains("ball touches lbr_link_4"), "{told}");
    assert!(told.contains("median error in the last second"), "{told}");
    let picture = fs::read_to_string(out.join("demo.svg")).unwrap();
    assert!(picture.starts_with("<svg ") && picture.ends_with("</svg>\n"));
    assert!(!picture.contains("NaN") && !picture.contains("inf"));
    assert!(picture.len() < 2_000_000, "{}", picture.len());
    assert_eq!(
        rows(&fs::read_to_string(out.join("estimates.csv")).unwrap()).len(),
        50
    );
    let bag = Bag::open(&out.join("demo.mcap")).unwrap();
    for topic in [
        topics::JOINT_STATES,
        topics::MARKERS,
        topics::TRUE_POINT,
        topics::TF,
    ] {
        assert!(bag.topic(topic).is_ok(), "{topic}");
    }
}

#[test]
fn inspect_lists_joints_and_links() {
    let table = done(&["inspect", "--urdf", URDF]);
    for name in [
        "lbr_A1",
        "lbr_A7",
        "lbr_link_0",
        "lbr_link_7",
        "lbr_link_ee",
    ] {
        assert!(table.contains(name), "{name} is not in {table}");
    }
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["inspect", "--urdf", URDF])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert!(output.stderr.is_empty(), "{output:?}");
}
