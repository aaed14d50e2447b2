//! A decoded message, as a tree.

use palpate_model::Fields;

/// One value of a decoded message. Field names are borrowed from its definition.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'d> {
    /// A truth value.
    Bool(bool),
    /// A signed integer of any size.
    Int(i64),
    /// An unsigned integer of any size.
    UInt(u64),
    /// A float of either size.
    Float(f64),
    /// A string; wrong UTF-8 is replaced.
    Text(String),
    /// An array of bytes.
    Bytes(Vec<u8>),
    /// An array of anything else.
    List(Vec<Value<'d>>),
    /// Fields in order.
    Message(Vec<(&'d str, Value<'d>)>),
}

impl Value<'_> {
    /// The value at a path of field names with dots between, such as `header.stamp.sec`.
    pub fn get(&self, path: &str) -> Option<&Self> {
        path.split('.').try_fold(self, |value, name| match value {
            Self::Message(fields) => fields
                .iter()
                .find(|(field, _)| *field == name)
                .map(|(_, value)| value),
            _ => None,
        })
    }

    /// The number, if this is an integer that fits.
    pub fn as_i64(&self) -> Option<i64> {
        match self {
            Self::Int(value) => Some(*value),
            Self::UInt(value) => i64::try_from(*value).ok(),
            _ => None,
        }
    }

    /// The number, if this is one.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Float(value) => Some(*value),
            Self::Int(value) => Some(*value as f64),
            Self::UInt(value) => Some(*value as f64),
            _ => None,
        }
    }

    /// The text, if this is one.
    pub fn as_str(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The numbers, if this is an array of numbers.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        match self {
            Self::List(values) => values.iter().map(Self::as_f64).collect(),
            Self::Bytes(bytes) => Some(bytes.iter().map(|byte| f64::from(*byte)).collect()),
            _ => None,
        }
    }

    /// The texts, if this is an array of strings.
    pub fn texts(&self) -> Option<Vec<&str>> {
        match self {
            Self::List(values) => values.iter().map(Self::as_str).collect(),
            _ => None,
        }
    }
}

impl Fields for &Value<'_> {
    fn field(self, name: &str) -> Option<Self> {
        self.get(name)
    }

    fn integer(self) -> Option<i64> {
        self.as_i64()
    }

    fn numbers(self) -> Option<Vec<f64>> {
        Value::numbers(self)
    }

    fn texts(self) -> Option<Vec<String>> {
        let texts = Value::texts(self)?;
        Some(texts.into_iter().map(str::to_owned).collect())
    }

    fn messages(self) -> Option<Vec<Self>> {
        match self {
            Value::List(values) => Some(values.iter().collect()),
            _ => None,
        }
    }
}
