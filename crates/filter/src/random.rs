//! Random streams that do not depend on the number of threads.

use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// What a stream is for: equal seed, step and chunk give unrelated numbers for each purpose.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Spread = 1,
    Propagate = 2,
    Resample = 3,
    Fresh = 4,
    Hop = 5,
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
