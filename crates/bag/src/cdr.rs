//! Messages from and to CDR, the plain version 1 encoding that ROS 2 uses (OMG DDS-XTypes 1.3, 7.4.1).
//!
//! Four bytes of encapsulation come first; alignment counts from after them.

use crate::Value;
use crate::definition::{Count, Definition, Element, Primitive};

/// Why bytes are not the message that their definition tells.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// The four bytes before the message are not those of plain CDR.
    #[error("expected the encapsulation 00 00 or 00 01 of plain CDR, found {found:02x?}")]
    Encapsulation {
        /// The first bytes, at most four.
        found: Vec<u8>,
    },
    /// The message ends too early, or a length in it is wrong.
    #[error("{what} at byte {at} needs {expected} bytes, {found} are left")]
    TooShort {
        /// What was being read.
        what: String,
        /// Where, counted from after the encapsulation.
        at: usize,
        /// Least number of bytes needed.
        expected: usize,
        /// Number of bytes left.
        found: usize,
    },
    /// Of several definitions of the type, none is as long as the message.
    #[error(
        "expected a message as long as one of the {definitions} versions of its type that are known, found {found} bytes"
    )]
    NoVersion {
        /// Number of definitions.
        definitions: usize,
        /// Length of the message without its encapsulation, bytes.
        found: usize,
    },
    /// Types are nested without end.
    #[error("types are nested more than {limit} deep")]
    TooDeep {
        /// Number of levels allowed.
        limit: usize,
    },
}

/// Deepest nesting of types. Standard messages stay under ten.
const DEPTH: usize = 32;

/// Decodes a message by its definition.
///
/// # Errors
/// Says where the bytes are not what the definition tells. Bytes left over are not an error: writers pad.
pub fn decode<'d>(definition: &'d Definition, data: &[u8]) -> Result<Value<'d>, CdrError> {
    decode_counting(definition, data).map(|(value, _)| value)
}

/// Decodes a message by the one of several definitions that is as long as it. A single one need not be.
pub(crate) fn decode_any<'d>(
    definitions: &'d [Definition],
    data: &[u8],
) -> Result<Value<'d>, CdrError> {
    if let [definition] = definitions {
        return decode(definition, data);
    }
    let mut decoded = definitions
        .iter()
        .filter_map(|definition| decode_counting(definition, data).ok());
    let whole = decoded.find(|(_, left)| *left == 0);
    whole
        .map(|(value, _)| value)
        .ok_or_else(|| CdrError::NoVersion {
            definitions: definitions.len(),
            found: data.len().saturating_sub(4),
        })
}

/// The decoded message, and the number of bytes left over.
fn decode_counting<'d>(
    definition: &'d Definition,
    data: &[u8],
) -> Result<(Value<'d>, usize), CdrError> {
    let (little_endian, body) = match data {
        [0, 0, _, _, body @ ..] => (false, body),
        [0, 1, _, _, body @ ..] => (true, body),
        _ => {
            let found = data.iter().take(4).copied().collect();
            return Err(CdrError::Encapsulation { found });
        }
    };
    let mut decoder = Decoder {
        definition,
        body,
        at: 0,
        little_endian,
    };
    let value = decoder.message(0, 0)?;
    Ok((value, body.len() - decoder.at))
}

struct Decoder<'d, 'b> {
    definition: &'d Definition,
    body: &'b [u8],
    at: usize,
    little_endian: bool,
}

impl<'d> Decoder<'d, '_> {
    fn message(&mut self, index: usize, depth: usize) -> Result<Value<'d>, CdrError> {
        if depth == DEPTH {
            return Err(CdrError::TooDeep { limit: DEPTH });
        }
        let definition = self.definition;
        let fields = definition.types.get(index).map_or(&[][..], Vec::as_slice);
        let mut values = Vec::with_capacity(fields.len());
        for field in fields {
            let value = match field.count {
                Count::One => self.element(field.element, &field.name, depth)?,
                Count::Fixed(count) => self.list(field.element, count, &field.name, depth)?,
                Count::Sequence => {
                    let count = u32::from_ne_bytes(self.number(&field.name)?) as usize;
                    self.list(field.element, count, &field.name, depth)?
                }
            };
            values.push((field.name.as_str(), value));
        }
        Ok(Value::Message(values))
    }

    fn list(
        &mut self,
        element: Element,
        count: usize,
        what: &str,
        depth: usize,
    ) -> Result<Value<'d>, CdrError> {
        // Checked before anything is allocated: no element is smaller than this.
        let least = match element {
            Element::Primitive(primitive) => size(primitive),
            Element::Text => 4,
            Element::Message(_) => 1,
        };
        self.require(count.saturating_mul(least), what)?;
        if element == Element::Primitive(Primitive::UInt8) {
            return Ok(Value::Bytes(self.take(count, what)?.to_vec()));
        }
        (0..count)
            .map(|_| self.element(element, what, depth))
            .collect::<Result<_, _>>()
            .map(Value::List)
    }

    fn element(
        &mut self,
        element: Element,
        what: &str,
        depth: usize,
    ) -> Result<Value<'d>, CdrError> {
        match element {
            Element::Primitive(primitive) => self.primitive(primitive, what),
            Element::Text => self.text(what).map(Value::Text),
            Element::Message(index) => self.message(index, depth + 1),
        }
    }

    fn primitive(&mut self, primitive: Primitive, what: &str) -> Result<Value<'d>, CdrError> {
        Ok(match primitive {
            Primitive::Bool => Value::Bool(self.number::<1>(what)? != [0]),
            Primitive::Int8 => Value::Int(i8::from_ne_bytes(self.number(what)?).into()),
            Primitive::UInt8 => Value::UInt(u8::from_ne_bytes(self.number(what)?).into()),
            Primitive::Int16 => Value::Int(i16::from_ne_bytes(self.number(what)?).into()),
            Primitive::UInt16 => Value::UInt(u16::from_ne_bytes(self.number(what)?).into()),
            Primitive::Int32 => Value::Int(i32::from_ne_bytes(self.number(what)?).into()),
            Primitive::UInt32 => Value::UInt(u32::from_ne_bytes(self.number(what)?).into()),
            Primitive::Int64 => Value::Int(i64::from_ne_bytes(self.number(what)?)),
            Primitive::UInt64 => Value::UInt(u64::from_ne_bytes(self.number(what)?)),
            Primitive::Float32 => Value::Float(f32::from_ne_bytes(self.number(what)?).into()),
            Primitive::Float64 => Value::Float(f64::from_ne_bytes(self.number(what)?)),
        })
    }

    /// A string: its length with the final zero byte, then its bytes.
    fn text(&mut self, what: &str) -> Result<String, CdrError> {
        let length = u32::from_ne_bytes(self.number(what)?) as usize;
        let bytes = self.take(length, what)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }

    /// An aligned number's bytes in the machine's order.
    fn number<const SIZE: usize>(&mut self, what: &str) -> Result<[u8; SIZE], CdrError> {
        let padding = self.at.next_multiple_of(SIZE) - self.at;
        self.take(padding, what)?;
        let mut bytes = [0; SIZE];
        bytes.copy_from_slice(self.take(SIZE, what)?);
        if self.little_endian != cfg!(target_endian = "little") {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn take(&mut self, count: usize, what: &str) -> Result<&[u8], CdrError> {
        self.require(count, what)?;
        let start = self.at;
        self.at += count;
        Ok(&self.body[start..self.at])
    }

    fn require(&self, expected: usize, what: &str) -> Result<(), CdrError> {
        let found = self.body.len() - self.at;
        if expected <= found {
            return Ok(());
        }
        Err(CdrError::TooShort {
            what: what.to_owned(),
            at: self.at,
            expected,
            found,
        })
    }
}

/// Size of a primitive, bytes; also its alignment.
fn size(primitive: Primitive) -> usize {
    match primitive {
        Primitive::Bool | Primitive::Int8 | Primitive::UInt8 => 1,
        Primitive::Int16 | Primitive::UInt16 => 2,
        Primitive::Int32 | Primitive::UInt32 | Primitive::Float32 => 4,
        Primitive::Int64 | Primitive::UInt64 | Primitive::Float64 => 8,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn definition(text: &str) -> Definition {
        Definition::parse("pkg/msg/Root", text).unwrap()
    }

    fn value<'d>(fields: Vec<(&'d str, Value<'d>)>) -> Value<'d> {
        Value::Message(fields)
    }

    /// A byte, then a 4-byte number, a byte, an 8-byte number, a byte, a string, a 2-byte number.
    const ALIGNED: &str = "bool a\nint32 b\nint8 c\nfloat64 d\nuint8 e\nstring f\nuint16 g";

    fn aligned_bytes(little_endian: bool) -> Vec<u8> {
        let mut bytes = vec![0, u8::from(little_endian), 0, 0];
        let mut push = |number: &[u8]| {
            let mut number = number.to_vec();
            if !little_endian {
                number.reverse();
            }
            bytes.extend(number);
        };
        for part in [
            &[1][..],
            &[0xaa; 3],
            &(-7_i32).to_le_bytes(),
            &[0xff],
            &[0xaa; 7],
            &1.5_f64.to_le_bytes(),
            &[9],
            &[0xaa; 3],
            &3_u32.to_le_bytes(),
        ] {
            push(part);
        }
        bytes.extend(b"ab\0");
        bytes.push(0xaa);
        let last = 513_u16;
        bytes.extend(if little_endian {
            last.to_le_bytes()
        } else {
            last.to_be_bytes()
        });
        bytes
    }

    #[test]
    fn numbers_are_aligned_from_after_the_encapsulation_in_both_byte_orders() {
        let definition = definition(ALIGNED);
        let expected = value(vec![
            ("a", Value::Bool(true)),
            ("b", Value::Int(-7)),
            ("c", Value::Int(-1)),
            ("d", Value::Float(1.5)),
            ("e", Value::UInt(9)),
            ("f", Value::Text("ab".to_owned())),
            ("g", Value::UInt(513)),
        ]);
        for little_endian in [true, false] {
            let bytes = aligned_bytes(little_endian);
            assert_eq!(decode(&definition, &bytes).as_ref(), Ok(&expected));
        }
    }

    #[test]
    fn every_shorter_message_is_refused() {
        let definition = definition(ALIGNED);
        let bytes = aligned_bytes(true);
        for length in 0..bytes.len() {
            let refusal = decode(&definition, &bytes[..length]).unwrap_err();
            match refusal {
                CdrError::Encapsulation { found } => assert!(found.len() < 4),
                CdrError::TooShort {
                    at,
                    expected,
                    found,
                    ..
                } => assert!(expected > found && at + found == length - 4),
                other => panic!("{length}: {other}"),
            }
        }
    }

    #[test]
    fn arrays_and_nested_messages_follow_their_counts() {
        let definition = definition(
            "Pair[] pairs\nuint8[2] raw\nEmpty e\nstring[] s\n===\nMSG: pkg/Pair\nint8 x\nint16 y\n===\nMSG: pkg/Empty\n",
        );
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend([2, 0, 0, 0]);
        bytes.extend([1, 0, 2, 0]);
        bytes.extend([3, 0, 4, 0]);
        bytes.extend([7, 8]); // raw
        bytes.extend([0]); // the empty message's byte
        bytes.extend([0]); // padding
        bytes.extend([1, 0, 0, 0, 0, 0, 0, 0]); // one string without even its zero
        let pair = |x, y| value(vec![("x", Value::Int(x)), ("y", Value::Int(y))]);
        let decoded = decode(&definition, &bytes).unwrap();
        let pairs = Value::List(vec![pair(1, 2), pair(3, 4)]);
        assert_eq!(decoded.get("pairs"), Some(&pairs));
        assert_eq!(decoded.get("raw"), Some(&Value::Bytes(vec![7, 8])));
        assert_eq!(decoded.get("s").and_then(Value::texts), Some(vec![""]));
    }

    #[test]
    fn a_huge_count_is_refused_before_anything_is_allocated() {
        for text in ["float64[] a", "string[] a", "uint8[] a", "string a"] {
            let definition = definition(text);
            let bytes = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 1, 2, 3, 4];
            let refusal = decode(&definition, &bytes).unwrap_err();
            let CdrError::TooShort { expected, .. } = refusal else {
                panic!("{refusal}");
            };
            assert!(expected >= u32::MAX as usize, "{text}");
        }
    }

    #[test]
    fn endless_nesting_is_refused() {
        let definition = definition("Root again");
        let refusal = decode(&definition, &[0, 1, 0, 0, 0]);
        assert_eq!(refusal, Err(CdrError::TooDeep { limit: DEPTH }));
    }

    #[test]
    fn other_encodings_are_refused() {
        let refusal = decode(&definition("bool a"), &[0, 3, 0, 0, 1]).unwrap_err();
        assert_eq!(
            refusal.to_string(),
            "expected the encapsulation 00 00 or 00 01 of plain CDR, found [00, 03, 00, 00]"
        );
    }
}
