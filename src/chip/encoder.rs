//! An encoder as a counter in microsteps: raw counts that wrap are unrolled and scaled by a prescaler
//! (manual sections 6.2 and 6.3).

/// Counts of the built-in sensOstep encoder in one turn.
pub const TURN: u16 = 1024;

/// Fractional part of the counter: 1/512 microstep, the prescaler's unit.
const FRACTION: i64 = 512;

/// A counter in microsteps fed by raw counts modulo `MODULUS` (a power of two).
#[derive(Clone, Copy, Debug, Default)]
pub struct Counter<const MODULUS: u32> {
    raw: Option<u32>,
    /// Position in 1/512 microsteps; its low 41 bits make the position wrap at 32 bits.
    scaled: i64,
}

impl<const MODULUS: u32> Counter<MODULUS> {
    /// A counter at zero.
    pub const fn new() -> Self {
        Counter { raw: None, scaled: 0 }
    }

    /// Takes a new raw count; `prescaler` is in 1/512 microsteps per count, function bits masked off. The
    /// motor may have moved less than half of `MODULUS` since the last call. The first call sets the start.
    pub fn update(&mut self, raw: u32, prescaler: i32, reverse: bool) {
        let raw = raw % MODULUS;
        if let Some(last) = self.raw.replace(raw) {
            let ahead = raw.wrapping_sub(last) % MODULUS;
            let half = MODULUS / 2;
            let counts = if ahead >= half { i64::from(ahead) - i64::from(MODULUS) } else { i64::from(ahead) };
            let counts = if reverse { -counts } else { counts };
            self.scaled = self.scaled.wrapping_add(counts.wrapping_mul(i64::from(prescaler)));
        }
    }

    /// Position in microsteps.
    pub const fn position(&self) -> i32 {
        self.scaled.div_euclid(FRACTION) as i32
    }

    /// Sets the position.
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
        counter.set(7);
        counter.update(999, 25_600, true);
        assert_eq!(counter.position(), 57);
    }
}
