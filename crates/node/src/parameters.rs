//! The node's parameters, from the command line, launch files and parameter files.

use std::sync::PoisonError;

use palpate_filter::{Settings, SettingsError};
use r2r::ParameterValue;
use r2r::rcl_interfaces::msg::ParameterValue as ParameterMessage;
use serde_yaml_ng::Value;

/// The kinds of values, which r2r gives a type each.
pub mod kind {
    use r2r::rcl_interfaces::msg::ParameterType;

    pub const NOT_SET: u8 = ParameterType::PARAMETER_NOT_SET as u8;
    pub const BOOL: u8 = ParameterType::PARAMETER_BOOL as u8;
    pub const INTEGER: u8 = ParameterType::PARAMETER_INTEGER as u8;
    pub const DOUBLE: u8 = ParameterType::PARAMETER_DOUBLE as u8;
    pub const STRING: u8 = ParameterType::PARAMETER_STRING as u8;
    pub const BYTE_ARRAY: u8 = ParameterType::PARAMETER_BYTE_ARRAY as u8;
    pub const BOOL_ARRAY: u8 = ParameterType::PARAMETER_BOOL_ARRAY as u8;
    pub const INTEGER_ARRAY: u8 = ParameterType::PARAMETER_INTEGER_ARRAY as u8;
    pub const DOUBLE_ARRAY: u8 = ParameterType::PARAMETER_DOUBLE_ARRAY as u8;
    pub const STRING_ARRAY: u8 = ParameterType::PARAMETER_STRING_ARRAY as u8;
}

/// Reads what the node was given.
pub fn read(node: &r2r::Node) -> Result<Settings, SettingsError> {
    let given = node.params.lock().unwrap_or_else(PoisonError::into_inner);
    let given = given.iter();
    Settings::from_flat(given.map(|(name, parameter)| (name.clone(), to_yaml(&parameter.value))))
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

/// A parameter's value as a client sent it.
pub fn from_message(message: &ParameterMessage) -> Value {
    match message.type_ {
        kind::BOOL => message.bool_value.into(),
        kind::INTEGER => message.integer_value.into(),
        kind::DOUBLE => message.double_value.into(),
        kind::STRING => message.string_value.clone().into(),
        kind::BYTE_ARRAY => list(&message.byte_array_value),
        kind::BOOL_ARRAY => list(&message.bool_array_value),
        kind::INTEGER_ARRAY => list(&message.integer_array_value),
        kind::DOUBLE_ARRAY => list(&message.double_array_value),
        kind::STRING_ARRAY => list(&message.string_array_value),
        _ => Value::Null,
    }
}

/// A parameter's value for clients. Lists are of one type each, as ROS 2 has them; an empty one is taken for a list of
/// text.
pub fn to_message(value: &Value) -> ParameterMessage {
    let mut message = ParameterMessage::default();
    message.type_ = match value {
        Value::Bool(value) => {
            message.bool_value = *value;
            kind::BOOL
        }
        Value::Number(number) => match number.as_i64() {
            Some(number) => {
                message.integer_value = number;
                kind::INTEGER
            }
            None => {
                message.double_value = number.as_f64().unwrap_or(f64::NAN);
                kind::DOUBLE
            }
        },
        Value::String(value) => {
            message.string_value.clone_from(value);
            kind::STRING
        }
        Value::Sequence(values) if values.first().is_some_and(Value::is_i64) => {
            message.integer_array_value = values.iter().filter_map(Value::as_i64).collect();
            kind::INTEGER_ARRAY
        }
        Value::Sequence(values) if values.first().is_some_and(Value::is_number) => {
            message.double_array_value = values.iter().filter_map(Value::as_f64).collect();
            kind::DOUBLE_ARRAY
        }
        Value::Sequence(values) => {
            let text = values.iter().filter_map(Value::as_str);
            message.string_array_value = text.map(str::to_owned).collect();
            kind::STRING_ARRAY
        }
        _ => kind::NOT_SET,
    };
    message
}
