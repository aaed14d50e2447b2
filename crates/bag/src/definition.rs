//! Message definitions in the `ros2msg` text that bags carry: fields in order, nested types after separators.
//!
//! Format: <https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html> and
//! <https://mcap.dev/spec/registry#ros2msg>.

use std::collections::HashMap;

use crate::BagError;
use crate::standard::standard_definition;

/// A number or truth value of fixed size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Primitive {
    Bool,
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float32,
    Float64,
}

impl Primitive {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "bool" => Self::Bool,
            "byte" | "char" | "uint8" => Self::UInt8,
            "int8" => Self::Int8,
            "int16" => Self::Int16,
            "uint16" => Self::UInt16,
            "int32" => Self::Int32,
            "uint32" => Self::UInt32,
            "int64" => Self::Int64,
            "uint64" => Self::UInt64,
            "float32" => Self::Float32,
            "float64" => Self::Float64,
            _ => return None,
        })
    }
}

/// What one element of a field is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Element {
    Primitive(Primitive),
    Text,
    /// Index of the nested type in [`Definition::types`].
    Message(usize),
}

/// How many elements a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Count {
    One,
    Fixed(usize),
    /// As many as the message says; bounds are the writer's affair.
    Sequence,
}

/// One field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) element: Element,
    pub(crate) count: Count,
}

/// A message type with all types nested in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Definition {
    /// Fields of each type; the first type is the message itself.
    pub(crate) types: Vec<Vec<Field>>,
}

impl Definition {
    /// Reads the definition of `type_name` (`pkg/msg/Type` or `pkg/Type`). Constants and default values are ignored.
    /// A nested type whose definition `text` lacks is looked up among the standard ones.
    ///
    /// # Errors
    /// If a line is no field, or a type is neither built in nor defined.
    pub fn parse(type_name: &str, text: &str) -> Result<Self, BagError> {
        let wrong = |reason: String| BagError::Definition {
            type_name: type_name.to_owned(),
            reason,
        };
        let root = short_name(type_name);
        let sections = sections(&root, text).map_err(wrong)?;
        let mut definition = Self { types: Vec::new() };
        let mut names = vec![root];
        while let Some(name) = names.get(definition.types.len()).cloned() {
            let body = sections
                .get(name.as_str())
                .copied()
                .or_else(|| standard_definition(&name))
                .ok_or_else(|| wrong(format!("nested type {name} is not defined")))?;
            let fields = parse_fields(&name, body, &mut names).map_err(wrong)?;
            definition.types.push(fields);
        }
        Ok(definition)
    }
}

/// `pkg/Type` from `pkg/msg/Type`.
pub(crate) fn short_name(type_name: &str) -> String {
    match type_name.split_once('/') {
        Some((package, rest)) => {
            let name = rest.rsplit('/').next().unwrap_or(rest);
            format!("{package}/{name}")
        }
        None => type_name.to_owned(),
    }
}

/// The definition of a standard type by its short name with those of all types nested in it, as bags carry it.
///
/// # Errors
/// If it, or one of the nested types, is not among the standard ones.
pub(crate) fn full_definition(root: &str) -> Result<String, BagError> {
    let wrong = |reason: String| BagError::Definition {
        type_name: root.to_owned(),
        reason,
    };
    let mut text = String::new();
    let mut names = vec![root.to_owned()];
    let mut done = 0;
    while let Some(name) = names.get(done).cloned() {
        let body = standard_definition(&name)
            .ok_or_else(|| wrong(format!("{name} is not among the standard types")))?;
        parse_fields(&name, body, &mut names).map_err(wrong)?;
        if done > 0 {
            text += &format!("{}\nMSG: {name}\n", "=".repeat(80));
        }
        text += body;
        done += 1;
    }
    Ok(text)
}

/// Text of each type by its short name.
fn sections<'a>(root: &str, text: &'a str) -> Result<HashMap<String, &'a str>, String> {
    let mut sections = HashMap::new();
    let mut name = root.to_owned();
    let (mut start, mut at) = (0, 0);
    let mut after_separator = false;
    for line in text.split_inclusive('\n') {
        let line_start = at;
        at += line.len();
        let line = line.trim();
        if line.len() >= 3 && line.bytes().all(|byte| byte == b'=') {
            sections
                .entry(std::mem::take(&mut name))
                .or_insert(&text[start..line_start]);
            after_separator = true;
            start = at;
        } else if after_separator {
            after_separator = line.is_empty();
            if let Some(found) = line.strip_prefix("MSG:") {
                name = short_name(found.trim());
                start = at;
            } else if !line.is_empty() {
                return Err(format!(
                    "expected \"MSG: package/Type\" after a separator, found \"{line}\""
                ));
            }
        }
    }
    sections.entry(name).or_insert(&text[start..]);
    Ok(sections)
}

fn parse_fields(owner: &str, body: &str, names: &mut Vec<String>) -> Result<Vec<Field>, String> {
    let mut fields = Vec::new();
    for line in body.lines() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let unclear = || format!("expected \"type name\" in {owner}, found \"{line}\"");
        let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(unclear)?;
        let rest = rest.trim_start();
        let is_name = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let name_end = rest.find(|letter| !is_name(letter)).unwrap_or(rest.len());
        let (name, after) = rest.split_at(name_end);
        if name.is_empty() {
            return Err(unclear());
        }
        if after.trim_start().starts_with('=') {
            continue; // a constant
        }
        let (element, count) = parse_type(owner, kind, names)?;
        fields.push(Field {
            name: name.to_owned(),
            element,
            count,
        });
    }
    if fields.is_empty() {
        // Generators give an empty message one dummy byte.
        fields.push(Field {
            name: "structure_needs_at_least_one_member".to_owned(),
            element: Element::Primitive(Primitive::UInt8),
            count: Count::One,
        });
    }
    Ok(fields)
}

fn parse_type(
    owner: &str,
    kind: &str,
    names: &mut Vec<String>,
) -> Result<(Element, Count), String> {
    let (base, count) = match kind.strip_suffix(']').and_then(|kind| kind.split_once('[')) {
        None => (kind, Count::One),
        Some((base, "")) => (base, Count::Sequence),
        Some((base, size)) => match size.strip_prefix("<=") {
            Some(bound) => parse_size(kind, bound).map(|_| (base, Count::Sequence))?,
            None => (base, Count::Fixed(parse_size(kind, size)?)),
        },
    };
    let word = base.split_once("<=").map_or(base, |(word, _)| word);
    let element = match (word, Primitive::parse(word)) {
        (_, Some(primitive)) => Element::Primitive(primitive),
        ("string", None) => Element::Text,
        ("wstring", None) => return Err(format!("{owner} has a wstring, which is not supported")),
        (word, None) => Element::Message(index_of(full_name(owner, word), names)),
    };
    Ok((element, count))
}

fn parse_size(kind: &str, size: &str) -> Result<usize, String> {
    match size.trim().parse() {
        Ok(size) if size > 0 => Ok(size),
        _ => Err(format!(
            "expected an array size above zero, found \"{kind}\""
        )),
    }
}

/// A nested type's short name: without a package it is `owner`'s, and `Header` alone is std_msgs'.
fn full_name(owner: &str, word: &str) -> String {
    match owner.split_once('/') {
        _ if word == "Header" => "std_msgs/Header".to_owned(),
        Some((package, _)) if !word.contains('/') => format!("{package}/{word}"),
        _ => short_name(word),
    }
}

fn index_of(name: String, names: &mut Vec<String>) -> usize {
    names
        .iter()
        .position(|known| *known == name)
        .unwrap_or_else(|| {
            names.push(name);
            names.len() - 1
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Definition, String> {
        Definition::parse("pkg/msg/Root", text).map_err(|error| error.to_string())
    }

    fn field(name: &str, element: Element, count: Count) -> Field {
        Field {
            name: name.to_owned(),
            element,
            count,
        }
    }

    const F64: Element = Element::Primitive(Primitive::Float64);

    #[test]
    fn every_kind_of_line_is_understood() {
        let text = "# a comment\n\
            float64 plain\n\
            float64 with_default 1.5 # and a comment\n\
            float64[3] fixed [1.0, 2.0, 3.0]\n\
            \tfloat64[]   open\r\n\
            float64[<=5] bounded\n\
            string<=10[<=5] names\n\
            string greeting \"a = b # c\"\n\
            int32 A_CONSTANT=5\n\
            string ANOTHER = \"x\"\n";
        let expected = vec![
            field("plain", F64, Count::One),
            field("with_default", F64, Count::One),
            field("fixed", F64, Count::Fixed(3)),
            field("open", F64, Count::Sequence),
            field("bounded", F64, Count::Sequence),
            field("names", Element::Text, Count::Sequence),
            field("greeting", Element::Text, Count::One),
        ];
        assert_eq!(parse(text).unwrap().types, vec![expected]);
    }

    #[test]
    fn nested_types_are_found_by_every_way_of_naming_them() {
        let text = "Header header\nInner[] a\npkg/Inner b\npkg/msg/Inner c\ngeometry_msgs/Point d\n\
            =====\nMSG: pkg/Inner\nfloat64 x\n\
            ================\nMSG: geometry_msgs/Point\nfloat64 only_x\n";
        let types = parse(text).unwrap().types;
        let elements: Vec<_> = types[0].iter().map(|field| field.element).collect();
        let [header, inner, point] = [1, 2, 3].map(Element::Message);
        assert_eq!(elements, [header, inner, inner, inner, point]);
        assert_eq!(types[2], [field("x", F64, Count::One)]);
        // What the bag says goes before what is known here.
        assert_eq!(types[3], [field("only_x", F64, Count::One)]);
        assert_eq!(
            types[1][1].name, "frame_id",
            "the header came from the standard types"
        );
    }

    #[test]
    fn an_empty_message_has_one_byte() {
        let types = parse("# nothing\nint32 A=1\n").unwrap().types;
        assert_eq!(types[0].len(), 1);
        assert_eq!(types[0][0].element, Element::Primitive(Primitive::UInt8));
    }

    #[test]
    fn refusals_name_what_was_found() {
        for (text, reason) in [
            ("nonsense", "found \"nonsense\""),
            ("float64 ?", "found \"float64 ?\""),
            (
                "float64[x] a",
                "array size above zero, found \"float64[x]\"",
            ),
            (
                "float64[0] a",
                "array size above zero, found \"float64[0]\"",
            ),
            ("Other a", "nested type pkg/Other is not defined"),
            ("wstring a", "wstring, which is not supported"),
            ("float64 a\n====\nfloat64 b", "found \"float64 b\""),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(reason), "{text:?} gave {error}");
            assert!(error.contains("pkg/msg/Root"), "{error}");
        }
    }

    #[test]
    fn a_full_definition_parses_to_the_same_as_its_parts() {
        for name in ["visualization_msgs/MarkerArray", "sensor_msgs/JointState"] {
            let full = full_definition(name).unwrap();
            let from_parts = standard_definition(name).unwrap();
            assert_eq!(
                Definition::parse(name, &full).unwrap(),
                Definition::parse(name, from_parts).unwrap()
            );
            assert!(full.contains(&format!("{}\nMSG: std_msgs/Header\n", "=".repeat(80))));
        }
    }
}
