//! A guard of the palpate method's accuracy: a small part of `palpate evaluate`, whose failure means that the method has
//! become worse.
//!
//! Trials are shorter (6 s) and hypotheses fewer (200) than by default. The limits stand five to ten times above what
//! three seeds gave: another random stream does not reach them; a mode that is lost, a wrong link, or a bias or friction
//! that is no longer solved for, costs centimetres.

// Helpers of tests may fail as tests do.
#![allow(clippy::unwrap_used)]

use std::process::Command;

/// Errors in the last second, mm, sorted; of trials under a condition on these links. Fails where a link is wrong.
fn errors(experiment: &str, links: &str) -> Vec<f64> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args([
            "evaluate",
            experiment,
            "--methods",
            "palpate",
            "--links",
            links,
        ])
        .args([
            "--trials",
            "2",
            "--secs",
            "6",
            "--particles",
            "200",
            "--out",
            out,
        ])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let csv = std::fs::read_to_string(folder.path().join("trials.csv")).unwrap();
    let heads: Vec<_> = csv.lines().next().unwrap().split(',').collect();
    let column = |name: &str| heads.iter().position(|head| *head == name).unwrap();
    let mut errors = Vec::new();
    for row in csv.lines().skip(1) {
        let cells: Vec<_> = row.split(',').collect();
        let number = |name: &str| cells[column(name)].parse::<f64>().unwrap();
        assert!(number("right_link") > 0.9, "a wrong link: {row}");
        errors.push(1e3 * number("error_m"));
    }
    errors.sort_by(f64::total_cmp);
    errors
}

fn check(errors: &[f64], count: usize, median_below: f64, worst_below: f64) {
    assert_eq!(errors.len(), count);
    let (median, worst) = (errors[count / 2], errors[count - 1]);
    assert!(
        median < median_below && worst < worst_below,
        "mm: {errors:.2?}"
    );
}

#[test]
fn a_sphere_is_found_within_a_millimetre() {
    // Measured: medians 0.1 to 0.2 mm, worst 0.9 mm.
    check(&errors("models", "3,5,7"), 6, 1.0, 5.0);
}

#[test]
fn a_bias_is_solved_for() {
    // Known from before the contact, or not. Measured: medians 0.1 to 0.4 mm, worst 1.6 mm.
    check(&errors("bias", "5,7"), 8, 2.0, 10.0);
}

#[test]
fn friction_is_solved_for() {
    // Measured: medians 0.5 to 2 mm, worst 12.6 mm.
    check(&errors("friction", "5,7"), 4, 4.0, 20.0);
}

#[test]
fn an_obstacle_that_drifts_is_followed() {
    // Measured with six seeds: median 0.3 mm, worst 10.3 mm; as if it rested: centimetres. On link 7 one trial of twelve is
    // taken for one on link 6, 45 mm off, by whichever version.
    check(&errors("drift", "5,6"), 4, 8.0, 15.0);
}

#[test]
fn a_body_is_found_by_a_mesh_that_stands_for_it() {
    // Two kinds of body. Measured: median 0.7 mm, worst 2.5 mm; as if the body were the mesh: 3 and 50 mm.
    check(&errors("finer", "5,6"), 8, 2.5, 12.0);
}
