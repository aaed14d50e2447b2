//! `palpate evaluate` as a user runs it.

// Helpers of tests may fail as tests do.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::process::{Command, Output};

use tempfile::TempDir;

fn evaluate(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .arg("evaluate")
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

fn done(arguments: &[&str]) -> String {
    let output = evaluate(arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

/// A small evaluation: what it prints, and the folder with its files.
fn small(experiment: &str, more: &[&str]) -> (String, TempDir) {
    let folder = TempDir::new().unwrap();
    let out = folder.path().to_str().unwrap();
    let mut arguments = vec![
        experiment,
        "--trials",
        "2",
        "--links",
        "3,6",
        "--secs",
        "1",
        "--particles",
        "200",
        "--out",
        out,
    ];
    arguments.extend(more);
    (done(&arguments), folder)
}

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap()
}

/// Rows of a CSV by the names of its columns.
fn rows(csv: &str) -> Vec<Vec<(String, String)>> {
    let mut lines = csv.lines();
    let heads: Vec<_> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells: Vec<_> = line.split(',').collect();
        assert_eq!(cells.len(), heads.len(), "{line}");
        let pairs = heads.iter().zip(cells);
        pairs
            .map(|(head, cell)| ((*head).to_owned(), cell.to_owned()))
            .collect()
    };
    lines.map(row).collect()
}

fn number(row: &[(String, String)], column: &str) -> f64 {
    let (_, cell) = row.iter().find(|(head, _)| head == column).unwrap();
    cell.parse().unwrap()
}

#[test]
fn an_experiment_leaves_a_row_for_each_trial_and_each_cell() {
    let (said, folder) = small("noise", &[]);
    assert!(
        said.contains("link 3") && said.contains("palpate"),
        "{said}"
    );
    let trials = rows(&read(&folder, "trials.csv"));
    // Three conditions, two methods, two links, two trials.
    assert_eq!(trials.len(), 24);
    for row in &trials {
        assert!(number(row, "error_m") >= 0.0, "{row:?}");
        for share in [
            "right_link",
            "right_link_all",
            "without_estimate",
            "ambiguous",
            "in_50",
            "in_90",
        ] {
            assert!(
                (0.0..=1.0).contains(&number(row, share)),
                "{share}: {row:?}"
            );
        }
        assert!(number(row, "in_50") <= number(row, "in_90"));
    }
    let cells = rows(&read(&folder, "cells.csv"));
    assert_eq!(cells.len(), 12);
    assert!(cells.iter().all(|row| number(row, "trials") == 2.0));
    let report = read(&folder, "report.md");
    for told in [
        "version",
        "commit",
        "machine",
        "seed: 1",
        "wall time",
        "noise.svg",
        "hypotheses",
    ] {
        assert!(report.contains(told), "{told} is missing in {report}");
    }
    assert!(read(&folder, "noise.svg").ends_with("</svg>\n"));
}

#[test]
fn the_same_seed_gives_the_same_bytes_at_any_number_of_threads() {
    let run = |more: &[&str]| read(&small("models", more).1, "trials.csv");
    let one = run(&["--threads", "1"]);
    assert_eq!(one, run(&["--threads", "2"]));
    assert_ne!(one, run(&["--threads", "2", "--seed", "2"]));
}

#[test]
fn targets_stand_beside_what_was_measured() {
    let (said, folder) = small("targets", &[]);
    let heads = said
        .lines()
        .find(|line| line.starts_with("| where"))
        .unwrap();
    assert!(
        heads.contains("reach") && heads.contains("measured"),
        "{said}"
    );
    let verdicts = said
        .lines()
        .filter(|line| line.contains("| yes ") || line.contains("| no "));
    assert_eq!(verdicts.count(), 9, "{said}");
    assert!(rows(&read(&folder, "trials.csv")).len() >= 20);
}

#[test]
fn particles_are_shown_at_several_times() {
    let (_, folder) = small("progress", &["--methods", "curvature"]);
    let picture = read(&folder, "progress_link3_curvature.svg");
    assert!(picture.contains("distance to base") && picture.contains("after 0.50 s"));
    assert!(!folder.path().join("progress_link3_palpate.svg").exists());
}

#[test]
fn recorded_trials_are_scored_like_simulated_ones() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let scenario = "link: lbr_link_5\nduration_secs: 2\nrefine_levels: 0\nnoise_fraction: 0.02\n";
    fs::write(path("scenario.yaml"), scenario).unwrap();
    fs::create_dir(path("set")).unwrap();
    let simulated = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args([
            "simulate",
            &path("scenario.yaml"),
            "--out",
            &path("set/one"),
        ])
        .output()
        .unwrap();
    assert!(simulated.status.success());
    let urdf = concat!(env!("CARGO_MANIFEST_DIR"), "/../../urdf/iiwa14.urdf");
    let package = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let more = [
        "--package-dir",
        package,
        "--particles",
        "200",
        "--methods",
        "palpate",
    ];
    let (bags, out) = (path("set"), path("out"));
    let mut arguments = vec!["bags", "--bags", &bags, "--urdf", urdf, "--out", &out];
    arguments.extend(more);
    let said = done(&arguments);
    assert!(said.contains("| one"), "{said}");
    let scored = rows(&fs::read_to_string(path("out/bags.csv")).unwrap());
    assert_eq!(scored.len(), 1);
    assert_eq!(number(&scored[0], "link"), 5.0);
    // Stamps, links and frames agree: else nothing near this would come out.
    assert!(number(&scored[0], "error_m") < 0.05, "{scored:?}");
    assert_eq!(number(&scored[0], "right_link"), 1.0);

    fs::write(path("set/one/truth.csv"), "t,link_name\n0,lbr_link_5\n").unwrap();
    let output = evaluate(&arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("no column link_index"), "{said}");
}

#[test]
fn wrong_words_are_refused_with_what_there_is() {
    for (arguments, named) in [
        (vec!["bogus"], "noise, edge"),
        (
            vec!["noise", "--methods", "bogus"],
            "curvature, link, world, palpate",
        ),
        (vec!["noise", "--links", "9"], "[1, 2, 3, 4, 5, 6, 7]"),
        (vec!["bags"], "--bags DIR"),
        (vec!["noise", "--trials", "0"], "--trials"),
    ] {
        let output = evaluate(&arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(named), "{said}");
    }
    assert!(done(&["--list"]).contains("calibration"));
}

#[test]
fn detection_tells_false_alarms_and_what_became_of_pushes() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().to_str().unwrap();
    let arguments = [
        "detection",
        "--trials",
        "2",
        "--links",
        "6",
        "--free-secs",
        "12",
        "--out",
        out,
    ];
    let said = done(&arguments);
    assert!(
        said.contains("False alarms") && said.contains("operating"),
        "{said}"
    );
    let free = rows(&read(&folder, "free.csv"));
    // Two rates, seven situations, two sources.
    assert_eq!(free.len(), 28);
    let is_calm = |row: &&Vec<(String, String)>| row[1].1 == "rest" || row[1].1 == "slow";
    for row in free.iter().filter(is_calm) {
        assert_eq!(number(row, "false_alarms"), 0.0, "{row:?}");
        assert!(number(row, "secs") > 5.0, "{row:?}");
    }
    let pushes = rows(&read(&folder, "pushes.csv"));
    assert_eq!(pushes.len(), 2 * 5 * 2 * 5);
    for row in &pushes {
        assert_eq!((number(row, "link"), number(row, "pushes")), (6.0, 2.0));
        if row[1].1 == "slow" && row[2].1 == "momentum observer" && number(row, "force") >= 10.0 {
            assert_eq!(number(row, "noticed"), 2.0, "{row:?}");
            assert!(number(row, "most_delay_secs") < 0.1, "{row:?}");
        }
    }
    let report = read(&folder, "report.md");
    assert!(report.contains("false_alarms_per_hour: 0.1") && report.contains("](roc.svg)"));
    assert!(read(&folder, "detection.svg").starts_with("<svg"));
}
