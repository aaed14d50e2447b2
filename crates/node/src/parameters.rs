//! The node's parameters, from the command line, launch files and parameter files.

use std::sync::PoisonError;

use anyhow::Context as _;
use palpate_filter::{Settings, SettingsError};
use r2r::{Parameter, ParameterValue};
use serde_yaml_ng::Value;

/// Looks at the parameter files among the arguments, as ROS 2 itself ends the process over one that is missing.
pub fn check_files(arguments: impl Iterator<Item = String>) -> anyhow::Result<()> {
    let arguments: Vec<_> = arguments.collect();
    for pair in arguments.windows(2) {
        if let [option, file] = pair
            && option == "--params-file"
        {
            std::fs::read(file)
                .with_context(|| format!("cannot read the parameter file {file}"))?;
        }
    }
    Ok(())
}

/// Reads what the node was given.
pub fn read(node: &r2r::Node) -> Result<Settings, SettingsError> {
    let given = node.params.lock().unwrap_or_else(PoisonError::into_inner);
    let given = given.iter();
    Settings::from_flat(given.map(|(name, parameter)| (name.clone(), to_yaml(&parameter.value))))
}

/// Puts the settings in effect where the node's parameters are kept.
pub fn declare(node: &r2r::Node, settings: &Settings) {
    let mut declared = node.params.lock().unwrap_or_else(PoisonError::into_inner);
    for (name, value) in settings.to_flat() {
        declared.insert(name, Parameter::new(from_yaml(&value)));
    }
}

fn to_yaml(value: &ParameterValue) -> Value {
    match value {
        ParameterValue::NotSet => Value::Null,
        ParameterValue::Bool(value) => (*value).into(),
        ParameterValue::Integer(value) => (*value).into(),
        ParameterValue::Double(value) => (*value).into(),
        ParameterValue::String(value) => value.clone().into(),
        ParameterValue::BoolArray(values) => list(values),
        ParameterValue::ByteArray(values) => list(values),
        ParameterValue::IntegerArray(values) => list(values),
        ParameterValue::DoubleArray(values) => list(values),
        ParameterValue::StringArray(values) => list(values),
    }
}

fn list<T: Clone + Into<Value>>(values: &[T]) -> Value {
    Value::Sequence(values.iter().cloned().map(Into::into).collect())
}

/// Lists of one type each, as ROS 2 has them; an empty one is taken for a list of text.
fn from_yaml(value: &Value) -> ParameterValue {
    match value {
        Value::Bool(value) => ParameterValue::Bool(*value),
        Value::Number(number) => match number.as_i64() {
            Some(number) => ParameterValue::Integer(number),
            None => number
                .as_f64()
                .map_or(ParameterValue::NotSet, ParameterValue::Double),
        },
        Value::String(value) => ParameterValue::String(value.clone()),
        Value::Sequence(values) => {
            let text: Option<Vec<_>> = values
                .iter()
                .map(|v| v.as_str().map(str::to_owned))
                .collect();
            let numbers: Option<Vec<_>> = values.iter().map(Value::as_f64).collect();
            match (text, numbers) {
                (Some(text), _) => ParameterValue::StringArray(text),
                (_, Some(numbers)) => ParameterValue::DoubleArray(numbers),
                _ => ParameterValue::NotSet,
            }
        }
        _ => ParameterValue::NotSet,
    }
}
