//! Eight numbers side by side, as plain loops: compilers make as few vector instructions of them as the processor that
//! they compile for allows. Loops, as what `map` and the like call is not always inlined.

use std::ops::{AddAssign, Mul, Sub};

use crate::cloud::Column;

#[derive(Clone, Copy)]
pub(crate) struct Eight(pub(crate) [f32; 8]);

impl Eight {
    pub(crate) const ZERO: Self = Self([0.0; 8]);

    /// Those of a column from 8 × `group` on.
    #[inline(always)]
    pub(crate) fn of(column: &Column, group: usize) -> Self {
        Self(column.as_chunks().0[group])
    }

    /// These where `pick` says so of the others, else zeros.
    #[inline(always)]
    pub(crate) fn only(self, others: Self, pick: impl Fn(f32) -> bool) -> Self {
        let mut only = Self::ZERO;
        for at in 0..8 {
            only.0[at] = if pick(others.0[at]) { self.0[at] } else { 0.0 };
        }
        only
    }

    #[inline(always)]
    pub(crate) fn is_zero(self) -> bool {
        let mut bits = 0;
        for value in self.0 {
            bits |= value.to_bits();
        }
        bits == 0
    }
}

impl AddAssign for Eight {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        for at in 0..8 {
            self.0[at] += other.0[at];
        }
    }
}

impl Mul for Eight {
    type Output = Self;

    #[inline(always)]
    fn mul(mut self, other: Self) -> Self {
        for at in 0..8 {
            self.0[at] *= other.0[at];
        }
        self
    }
}

impl Mul<f32> for Eight {
    type Output = Self;

    #[inline(always)]
    fn mul(mut self, factor: f32) -> Self {
        for at in 0..8 {
            self.0[at] *= factor;
        }
        self
    }
}

impl Sub<f32> for Eight {
    type Output = Self;

    #[inline(always)]
    fn sub(mut self, other: f32) -> Self {
        for at in 0..8 {
            self.0[at] -= other;
        }
        self
    }
}
