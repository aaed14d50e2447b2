//! What the README says of parameters, files and tests is so.

// Helpers of tests may fail as tests do.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use palpate_filter::{PARAMETER_TABLE, Settings};
use serde_yaml_ng::Value;

const README: &str = include_str!("../../../README.md");

/// Cells of the parameter table's rows.
fn rows() -> Vec<Vec<&'static str>> {
    let (_, table) = README.split_once("| Parameter ").unwrap();
    let lines = table
        .lines()
        .skip(2)
        .take_while(|line| line.starts_with('|'));
    let cells = |line: &'static str| line.trim_matches('|').split('|').map(str::trim).collect();
    lines.map(cells).collect()
}

fn type_of(value: &Value) -> &'static str {
    match value {
        Value::Bool(_) => "bool",
        Value::Number(number) if number.is_f64() => "float",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Sequence(values) if values.first().is_some_and(Value::is_f64) => {
            match values.len() {
                2 => "two floats",
                _ => "floats",
            }
        }
        Value::Sequence(values) if values.first().is_some_and(Value::is_i64) => "integers",
        Value::Sequence(_) => "strings",
        other => panic!("no parameter is {other:?}"),
    }
}

#[test]
fn the_parameter_table_has_every_parameter_with_its_type_and_default() {
    let said = rows();
    let defaults: BTreeMap<_, _> = Settings::default().to_flat().into_iter().collect();
    let names: BTreeSet<_> = said.iter().map(|row| row[0].trim_matches('`')).collect();
    assert!(
        names.iter().eq(defaults.keys()) && said.len() == names.len(),
        "{said:#?}"
    );
    for (row, expected) in said.iter().zip(PARAMETER_TABLE) {
        let [name, kind, unit, default, range, live, meaning] = row[..] else {
            panic!("{row:?}");
        };
        assert_eq!(name.trim_matches('`'), expected.name);
        let value = &defaults[expected.name];
        let default: Value = serde_yaml_ng::from_str(default.trim_matches('`')).unwrap();
        assert_eq!((kind, &default), (type_of(value), value), "{name}");
        let live_word = if expected.live { "yes" } else { "no" };
        assert_eq!(
            [unit, range, live, meaning],
            [expected.unit, expected.range, live_word, expected.meaning],
            "{name}"
        );
    }
    assert_eq!(said.len(), PARAMETER_TABLE.len());
}

#[test]
fn links_lead_to_files_and_name_the_tests_in_them() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let mut tests = 0;
    for (before, after) in README
        .match_indices("](")
        .map(|(at, _)| README.split_at(at))
    {
        let target = after[2..].split([')', '#']).next().unwrap();
        if target.is_empty() || target.contains("://") {
            continue;
        }
        assert!(root.join(target).exists(), "{target}");
        let text = before.rsplit('[').next().unwrap().trim_matches('`');
        let is_name =
            |letter: char| letter.is_ascii_lowercase() || letter == '_' || letter.is_ascii_digit();
        if text.contains('_') && text.chars().all(is_name) {
            tests += 1;
            let file = std::fs::read_to_string(root.join(target)).unwrap();
            assert!(
                file.contains(&format!(" {text}(")),
                "{target} has no {text}"
            );
        }
    }
    assert!(tests > 0);
}
