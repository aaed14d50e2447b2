//! Seeds that follow from what they are for.

/// One number from several, every bit of which depends on every bit of them (Steele, Lea and Flood 2014, SplitMix64).
pub fn mixed(parts: &[u64]) -> u64 {
    parts.iter().fold(0x9e37_79b9_7f4a_7c15, |state, part| {
        let mut z = (state ^ part).wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    })
}

/// A number in [0, 1) from several.
pub fn share(parts: &[u64]) -> f64 {
    (mixed(parts) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_have_different_seeds() {
        let mut seeds: Vec<_> = (0..8)
            .flat_map(|a| (0..100).map(move |b| mixed(&[a, b])))
            .collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len(), 800);
        assert_ne!(mixed(&[1, 2]), mixed(&[2, 1]));
    }
}
