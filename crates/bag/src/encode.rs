//! Values to CDR: plain version 1, little-endian, as [`decode`](crate::decode) reads it.

/// Bytes of a message in the making. Starts with the four bytes of encapsulation; alignment counts from after them.
pub(crate) struct Encoder {
    data: Vec<u8>,
}

impl Encoder {
    const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

    /// The bytes of a whole message.
    pub(crate) fn message(message: &impl Encode) -> Vec<u8> {
        let mut encoder = Self {
            data: Self::ENCAPSULATION.to_vec(),
        };
        message.encode(&mut encoder);
        encoder.data
    }

    /// Adds a number's bytes after padding to a multiple of their count.
    fn number<const SIZE: usize>(&mut self, bytes: [u8; SIZE]) {
        let at = self.data.len() - Self::ENCAPSULATION.len();
        let padding = at.next_multiple_of(SIZE) - at;
        self.data.extend(std::iter::repeat_n(0, padding));
        self.data.extend_from_slice(&bytes);
    }

    /// Adds a count. No message of this crate comes near four thousand million elements.
    fn count(&mut self, count: usize) {
        u32::try_from(count).unwrap_or(u32::MAX).encode(self);
    }
}

/// What can be part of a message.
pub(crate) trait Encode {
    fn encode(&self, out: &mut Encoder);
}

macro_rules! encode_numbers {
    ($($number:ty),*) => {
        $(impl Encode for $number {
            fn encode(&self, out: &mut Encoder) {
                out.number(self.to_le_bytes());
            }
        })*
    };
}
encode_numbers!(u8, i32, u32, f32, f64);

impl Encode for bool {
    fn encode(&self, out: &mut Encoder) {
        u8::from(*self).encode(out);
    }
}

impl Encode for String {
    fn encode(&self, out: &mut Encoder) {
        out.count(self.len() + 1);
        out.data.extend_from_slice(self.as_bytes());
        out.data.push(0);
    }
}

impl<T: Encode> Encode for Vec<T> {
    fn encode(&self, out: &mut Encoder) {
        out.count(self.len());
        self.iter().for_each(|element| element.encode(out));
    }
}

impl<T: Encode, const COUNT: usize> Encode for [T; COUNT] {
    fn encode(&self, out: &mut Encoder) {
        self.iter().for_each(|element| element.encode(out));
    }
}
