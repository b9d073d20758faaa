//! The position of an encoder in microsteps: raw counts that wrap are unrolled and scaled by a prescaler (manual
//! sections 6.2 and 6.3).

/// Counts of the built-in sensOstep encoder in one turn.
pub const TURN: u16 = 1024;

/// Parts of a microstep in which the position is kept: the prescaler's unit is 1/512 microstep per count.
const FRACTION: i64 = 512;

/// A position in microsteps that follows raw counts, which wrap at `MODULUS`, a power of two.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counter<const MODULUS: u32> {
    /// The last raw count; `None` before the first.
    raw: Option<u32>,
    /// Position in 1/512 microsteps, of which the low 41 bits count: so the position in microsteps wraps at 32 bits.
    scaled: i64,
}

impl<const MODULUS: u32> Counter<MODULUS> {
    /// A counter at position zero.
    pub const fn new() -> Self {
        Counter { raw: None, scaled: 0 }
    }

    /// Takes in a new raw count. `prescaler` is in 1/512 microsteps per count, without the function bits of the
    /// parameter; with `reverse` the position counts the other way. The encoder must have moved by less than half of
    /// `MODULUS` since the last call; the first call only notes where the raw counts begin. True if the raw count has
    /// passed zero, in either direction.
    pub fn update(&mut self, raw: u32, prescaler: i32, reverse: bool) -> bool {
        let raw = raw % MODULUS;
        if self.raw == Some(raw) {
            return false;
        }
        let Some(last) = self.raw.replace(raw) else { return false };
        let moved = Self::distance(last, raw);
        let counts = if reverse { -moved } else { moved };
        self.scaled = self.scaled.wrapping_add(counts.wrapping_mul(i64::from(prescaler)));
        // A raw count that has passed zero has wrapped: without wrapping it would be `sum`.
        let sum = i64::from(last) + moved;
        sum != i64::from(raw)
    }

    /// Makes the position zero at the raw count `count`, which the encoder passed less than half of `MODULUS` ago.
    pub fn zero_at(&mut self, count: u32, prescaler: i32, reverse: bool) {
        let beyond = Self::distance(count % MODULUS, self.raw.unwrap_or(count) % MODULUS);
        self.scaled = if reverse { -beyond } else { beyond } * i64::from(prescaler);
    }

    /// The shorter way from one raw count to another, in counts.
    fn distance(from: u32, to: u32) -> i64 {
        let ahead = i64::from(to.wrapping_sub(from) % MODULUS);
        if ahead >= i64::from(MODULUS / 2) { ahead - i64::from(MODULUS) } else { ahead }
    }

    /// Position in microsteps.
    pub const fn position(&self) -> i32 {
        self.scaled.div_euclid(FRACTION) as i32
    }

    /// Sets the position, in microsteps.
    pub const fn set(&mut self, position: i32) {
        self.scaled = position as i64 * FRACTION;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prescaler 25600 is 50 microsteps a count: a turn of 1024 counts is 51 200 microsteps.
    #[test]
    fn a_turn_is_51200_microsteps() {
        let mut counter = Counter::<1024>::new();
        for raw in (0..=1024).step_by(64) {
            counter.update(raw, 25_600, false);
        }
        assert_eq!(counter.position(), 51_200);
        counter.update(1000, 25_600, false);
        assert_eq!(counter.position(), 51_200 - 24 * 50);
        assert!(counter.update(10, 25_600, false));
        counter.zero_at(0, 25_600, false);
        assert_eq!(counter.position(), 10 * 50);
        assert!(!counter.update(30, 25_600, false));
        assert!(counter.update(1000, 25_600, false));
        counter.zero_at(0, 25_600, false);
        assert_eq!(counter.position(), -24 * 50);
        counter.set(7);
        counter.update(999, 25_600, true);
        assert_eq!(counter.position(), 57);
    }
}
