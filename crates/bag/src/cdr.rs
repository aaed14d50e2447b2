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
    decoder.message(0, 0)
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
