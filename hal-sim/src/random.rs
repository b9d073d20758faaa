//! A small seeded generator of random numbers, so that every run with the same seed is the same run.

/// xorshift64*: enough to scatter noise and torn bytes, not for anything else.
#[derive(Clone, Debug)]
pub(crate) struct Random(u64);

impl Random {
    /// A generator that starts from `seed`; any value will do.
    pub(crate) fn new(seed: u64) -> Self {
        // The generator would stay at zero for ever; the constant spreads small seeds.
        Self(seed.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// The next number, evenly spread over 0..`below`; 0 when `below` is 0.
    pub(crate) fn below(&mut self, below: u32) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let high = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32;
        ((high * u64::from(below)) >> 32) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_numbers_within_bounds() {
        let (mut a, mut b) = (Random::new(7), Random::new(7));
        let mut seen = [0u32; 3];
        for _ in 0..3_000 {
            let number = a.below(3);
            assert_eq!(number, b.below(3));
            seen[number as usize] += 1;
        }
        assert!(seen.iter().all(|&n| (850..1150).contains(&n)), "{seen:?}");
        assert_eq!(a.below(0), 0);
    }
}
