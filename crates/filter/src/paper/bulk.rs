//! Elementary functions on whole columns, in single precision: plain loops without branches, which compilers turn into
//! vector instructions, and which give the same bits on every processor.

use std::f32::consts::{FRAC_PI_2, LN_2, LOG2_E};

/// Adding and taking this away rounds to a whole number, which then stands in the lowest bits of the sum.
const ROUND: f32 = 12_582_912.0;

/// eˣ to 3 × 10⁻⁷ of itself, for 2⁻⁶⁰ to 2⁶⁰; beyond, these.
#[inline(always)]
pub(super) fn exp(x: f32) -> f32 {
    let power = (x * LOG2_E).clamp(-60.0, 60.0);
    let rounded = power + ROUND;
    let rest = (power - (rounded - ROUND)) * LN_2;
    // Taylor's series for |rest| ≤ ln 2 / 2.
    let series = 1.0 / 6.0 + rest * (1.0 / 24.0 + rest * (1.0 / 120.0 + rest * (1.0 / 720.0)));
    let series = 1.0 + rest * (1.0 + rest * (0.5 + rest * series));
    let exponent = rounded.to_bits().wrapping_sub(ROUND.to_bits());
    f32::from_bits(series.to_bits().wrapping_add(exponent << 23))
}

/// ln x to 10⁻⁷ for positive x.
#[inline(always)]
fn ln(x: f32) -> f32 {
    // x = 2ᵉ m with m from √½ to √2.
    const ROOT_HALF: i32 = 0x3f35_04f3;
    let bits = x.to_bits() as i32;
    let exponent = (bits - ROOT_HALF) >> 23;
    let m = f32::from_bits((bits - (exponent << 23)) as u32);
    // ln m = 2 artanh s.
    let s = (m - 1.0) / (m + 1.0);
    let s2 = s * s;
    let series = s * (2.0 + s2 * (2.0 / 3.0 + s2 * (2.0 / 5.0 + s2 * (2.0 / 7.0))));
    exponent as f32 * LN_2 + series
}

/// Uniform in (0, 1] by the upper 24 bits.
#[inline(always)]
pub(super) fn uniform(bits: u32) -> f32 {
    ((bits >> 8) + 1) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// Two standard normal numbers (Box and Muller 1958).
#[inline(always)]
pub(super) fn normals(length_bits: u32, angle_bits: u32) -> (f32, f32) {
    let length = (ln(uniform(length_bits)) * -2.0).max(0.0).sqrt();
    // An angle within an eighth of a turn to both sides of an axis, then any of the four axes.
    let angle = (uniform(angle_bits) - 0.5) * FRAC_PI_2;
    let a2 = angle * angle;
    let sin = angle * (1.0 - a2 * (1.0 / 6.0 - a2 * (1.0 / 120.0 - a2 * (1.0 / 5040.0))));
    let cos = 1.0 - a2 * (0.5 - a2 * (1.0 / 24.0 - a2 * (1.0 / 720.0 - a2 * (1.0 / 40_320.0))));
    let sign = f32::from_bits(1.0_f32.to_bits() | (angle_bits << 31));
    let (first, second) = match angle_bits & 2 {
        0 => (sin, cos * sign),
        _ => (cos * sign, sin),
    };
    (length * first, length * second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_those_of_the_library() {
        for index in 0..20_000 {
            let x = (index as f32 - 10_000.0) * 0.004;
            let exact = f64::from(x).exp();
            assert!((f64::from(exp(x)) / exact - 1.0).abs() < 5e-6, "{x}");
            let x = (index as f32 + 1.0) / 20_000.0;
            assert!((f64::from(ln(x)) - f64::from(x).ln()).abs() < 1e-6, "{x}");
        }
        assert_eq!((exp(0.0), ln(1.0)), (1.0, 0.0));
        assert!(exp(-1e30) > 0.0 && exp(-1e30) < 1e-18 && exp(1e30).is_finite());
    }
}
