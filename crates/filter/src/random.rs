//! Random streams that do not depend on the number of threads.

use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

/// What a stream is for: equal seed, step and chunk give unrelated numbers for each purpose.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Spread = 1,
    Propagate = 2,
    Resample = 3,
    Fresh = 4,
    Hop = 5,
    Facet = 6,
}

/// The random stream of one chunk of particles at one step.
pub(crate) fn stream(seed: u64, step: u64, chunk: usize, purpose: Purpose) -> Xoshiro256PlusPlus {
    let mut key = mix(seed);
    for part in [step, chunk as u64, purpose as u64] {
        key = mix(key ^ part.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    }
    Xoshiro256PlusPlus::seed_from_u64(key)
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The finaliser of MurmurHash3 (Appleby 2008), which maps numbers one to one.
#[inline(always)]
fn mix_32(mut z: u32) -> u32 {
    z = (z ^ (z >> 16)).wrapping_mul(0x85eb_ca6b);
    z = (z ^ (z >> 13)).wrapping_mul(0xc2b2_ae35);
    z ^ (z >> 16)
}

/// Generators in one [`Bundle`]: enough that their loops stay loops, which compilers turn into vector instructions.
const LANES: usize = 32;

/// Many generators side by side, so that one vector instruction advances several: xoshiro128++ (Blackman and Vigna,
/// Scrambled Linear Pseudorandom Number Generators, 2021).
pub(crate) struct Bundle([[u32; LANES]; 4]);

impl Bundle {
    /// Generators with nothing in common: the words of their states are mixed from successive numbers.
    #[inline(always)]
    pub(crate) fn new(random: &mut impl Rng) -> Self {
        let mut states = [[0; LANES]; 4];
        for words in &mut states {
            let key = random.next_u32();
            for (lane, word) in words.iter_mut().enumerate() {
                *word = mix_32(key.wrapping_add(lane as u32));
            }
        }
        Self(states)
    }

    /// Fills a column with random bits.
    #[inline(always)]
    pub(crate) fn fill<const N: usize>(&mut self, column: &mut [u32; N]) {
        let [s0, s1, s2, s3] = &mut self.0;
        for bits in column.as_chunks_mut::<LANES>().0 {
            for (lane, bits) in bits.iter_mut().enumerate() {
                let sum = s0[lane].wrapping_add(s3[lane]);
                *bits = sum.rotate_left(7).wrapping_add(s0[lane]);
                let shifted = s1[lane] << 9;
                s2[lane] ^= s0[lane];
                s3[lane] ^= s1[lane];
                s1[lane] ^= s2[lane];
                s0[lane] ^= s3[lane];
                s2[lane] ^= shifted;
                s3[lane] = s3[lane].rotate_left(11);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first numbers of the reference implementation for the state 1, 2, 3, 4, in every lane.
    #[test]
    fn each_lane_is_a_xoshiro128_plus_plus() {
        let mut bundle = Bundle([1, 2, 3, 4].map(|state| [state; LANES]));
        let mut column = [0; 5 * LANES];
        bundle.fill(&mut column);
        let expected = [641, 1_573_767, 3_222_811_527, 3_517_856_514, 836_907_274];
        for (lanes, expected) in column.as_chunks::<LANES>().0.iter().zip(expected) {
            assert_eq!(*lanes, [expected; LANES]);
        }
    }
}
