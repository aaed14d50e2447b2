//! Every parameter out of its range is refused by its name, with what was expected and what was found.

#![allow(clippy::unwrap_used)]

use palpate_filter::{Filter, PARAMETER_TABLE, Parameters, Settings, SettingsError};
use palpate_model::{LoadOptions, iiwa14};
use serde_yaml_ng::Value;

type Change = fn(&mut Parameters, f64);

/// A parameter's full name, its range as errors tell it, how to set it, and values outside its range.
type Case = (&'static str, &'static str, Change, &'static [f64]);

const NOT_POSITIVE: &[f64] = &[0.0, -1.0, f64::NAN, f64::INFINITY];
const NO_SHARE: &[f64] = &[-0.1, 1.1, f64::NAN, f64::INFINITY];

const CASES: &[Case] = &[
    (
        "particles",
        "100",
        |p, v| p.particles = v as usize,
        &[0.0, 99.0, 10_000_001.0],
    ),
    (
        "min_particles",
        "100",
        |p, v| p.min_particles = v as usize,
        &[0.0, 99.0, 10_000_001.0],
    ),
    (
        "located_probability",
        "0 … 1",
        |p, v| p.located_probability = v,
        NO_SHARE,
    ),
    (
        "tolerance",
        "0 … 0.1",
        |p, v| p.tolerance = v,
        &[-0.1, 0.2, f64::NAN],
    ),
    ("located_std", "> 0", |p, v| p.located_std = v, NOT_POSITIVE),
    (
        "detector.false_alarms_per_hour",
        "0.000001",
        |p, v| p.detector.false_alarms_per_hour = v,
        &[0.0, -1.0, 1001.0, f64::NAN],
    ),
    (
        "detector.least_torque",
        "0.001",
        |p, v| p.detector.least_torque = v,
        &[0.0, -1.0, 1001.0, f64::NAN],
    ),
    (
        "detector.min_secs",
        "0 … 1",
        |p, v| p.detector.min_secs = v,
        &[-0.1, 1.1, f64::NAN],
    ),
    (
        "detector.release_share",
        "0.1 … 1",
        |p, v| p.detector.release_share = v,
        &[0.0, 1.1, f64::NAN],
    ),
    (
        "detector.release_secs",
        "60",
        |p, v| p.detector.release_secs = v,
        &[-0.1, 61.0, f64::NAN],
    ),
    (
        "detector.bias_std",
        "0.001",
        |p, v| p.detector.bias_std = v,
        &[0.0, 101.0, f64::NAN],
    ),
    (
        "detector.bias_secs",
        "3600",
        |p, v| p.detector.bias_secs = v,
        &[0.0, 3601.0, f64::NAN],
    ),
    (
        "detector.bias_travel",
        "0.001",
        |p, v| p.detector.bias_travel = v,
        &[0.0, 11.0, f64::NAN],
    ),
    (
        "detector.motion_std",
        "0 … 100",
        |p, v| p.detector.motion_std = v,
        &[-0.1, 101.0, f64::NAN],
    ),
    (
        "palpate.hypotheses",
        "50",
        |p, v| p.palpate.hypotheses = v as usize,
        &[0.0, 49.0, 100_001.0],
    ),
    (
        "palpate.min_hypotheses",
        "50",
        |p, v| p.palpate.min_hypotheses = v as usize,
        &[0.0, 49.0, 100_001.0],
    ),
    (
        "palpate.rounds",
        "100",
        |p, v| p.palpate.rounds = v as usize,
        &[0.0, 101.0],
    ),
    (
        "paper.rate_hz",
        "10,000",
        |p, v| p.paper.rate_hz = v,
        &[0.0, -1.0, 10_001.0],
    ),
    (
        "paper.lambda",
        "> 0",
        |p, v| p.paper.lambda[0] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.lambda",
        "> 0",
        |p, v| p.paper.lambda[1] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.location_noise",
        "> 0",
        |p, v| p.paper.location_noise[0] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.location_noise",
        "> 0",
        |p, v| p.paper.location_noise[1] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.force_noise",
        "> 0",
        |p, v| p.paper.force_noise[0] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.force_noise",
        "> 0",
        |p, v| p.paper.force_noise[1] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.stiffness_noise",
        "> 0",
        |p, v| p.paper.stiffness_noise[0] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.stiffness_noise",
        "> 0",
        |p, v| p.paper.stiffness_noise[1] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.stiffness_range",
        "> 0",
        |p, v| p.paper.stiffness_range[0] = v,
        NOT_POSITIVE,
    ),
    (
        "paper.schedule_travel",
        "> 0",
        |p, v| p.paper.schedule_travel = v,
        NOT_POSITIVE,
    ),
    (
        "paper.force_max",
        "> 0",
        |p, v| p.paper.force_max = v,
        NOT_POSITIVE,
    ),
    (
        "paper.resample_below",
        "0 … 1",
        |p, v| p.paper.resample_below = v,
        NO_SHARE,
    ),
    (
        "paper.fresh_share",
        "0 … 1",
        |p, v| p.paper.fresh_share = v,
        NO_SHARE,
    ),
];

#[test]
fn a_parameter_out_of_range_is_named_with_its_range_and_what_was_found() {
    let robot = iiwa14(&LoadOptions::default()).unwrap();
    assert!(Filter::new(&robot, &Parameters::default(), 1).is_ok());
    for (name, range, change, values) in CASES {
        for &value in *values {
            let mut parameters = Parameters::default();
            change(&mut parameters, value);
            let refusal = Filter::new(&robot, &parameters, 1).err();
            let said = refusal.map_or(String::new(), |refusal| refusal.to_string());
            let told = format!("{name} is {value}, expected ");
            assert!(
                said.contains(&told) && said.contains(range),
                "{name} = {value}: {said}"
            );
        }
    }
}

#[test]
fn no_parameter_of_the_filter_is_without_a_range() {
    let choices = ["method", "paper.motion_model"];
    for (name, _) in Settings::default().to_flat() {
        let Some(name) = name.strip_prefix("filter.") else {
            continue;
        };
        let has_range = CASES.iter().any(|case| case.0 == name);
        assert!(has_range || choices.contains(&name), "{name}");
    }
}

#[test]
fn the_ends_of_a_range_are_within_it() {
    let ends: [Change; 6] = [
        |p, _| p.located_probability = 0.0,
        |p, _| p.located_probability = 1.0,
        |p, _| p.detector.release_share = 1.0,
        |p, _| p.detector.min_secs = 0.0,
        |p, _| p.detector.release_secs = 0.0,
        |p, _| p.paper.resample_below = 1.0,
    ];
    for change in ends {
        let mut parameters = Parameters::default();
        change(&mut parameters, 0.0);
        assert!(parameters.check().is_ok(), "{parameters:?}");
    }
}

/// Settings with one parameter changed; every entry of a list gets the same value.
fn with(name: &str, value: f64) -> Result<Settings, SettingsError> {
    let mut flat = Settings::default().to_flat();
    let entry = flat.iter_mut().find(|entry| entry.0 == name).unwrap();
    let like = |default: &Value| match default {
        Value::Number(number) if number.is_i64() || number.is_u64() => Value::from(value as i64),
        _ => value.into(),
    };
    entry.1 = match &entry.1 {
        Value::Sequence(defaults) => defaults.iter().map(like).collect::<Vec<_>>().into(),
        default => like(default),
    };
    Settings::from_flat(flat)
}

#[test]
fn the_bounds_in_the_table_are_those_that_are_checked() {
    for row in PARAMETER_TABLE {
        let Some([least, most]) = row.bounds else {
            continue;
        };
        let refused = |value| {
            let said = with(row.name, value).err().map(|error| error.to_string());
            said.is_some_and(|said| said.contains(row.name))
        };
        assert!(refused(least - 1.0), "{} below {least}", row.name);
        if most < f64::MAX {
            assert!(refused(most + 1.0), "{} above {most}", row.name);
            assert!(with(row.name, most).is_ok(), "{} = {most}", row.name);
        }
        let excluded = row.range.starts_with('>');
        assert_eq!(refused(least), excluded, "{} = {least}", row.name);
    }
}

#[test]
fn a_number_without_bounds_in_the_table_is_none() {
    for (row, (name, value)) in PARAMETER_TABLE.iter().zip(Settings::default().to_flat()) {
        assert_eq!(
            row.name, name,
            "the table is not in the order of the settings"
        );
        let is_number = |value: &Value| value.is_number();
        let numeric = is_number(&value)
            || value
                .as_sequence()
                .is_some_and(|list| list.iter().any(is_number));
        assert_eq!(row.bounds.is_some(), numeric, "{name}");
    }
}
