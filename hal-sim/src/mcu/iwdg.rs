//! IWDG: the independent watchdog (RM0090 21.4), on its own oscillator of 32 kHz.
//!
//! New values of prescaler and reload register are there at once; on the chip they take a few of its clocks.

use super::peripheral::{Access, Cycles, NEVER, Peripheral, Refusal};

const KR: u32 = 0x00;
const PR: u32 = 0x04;
const RLR: u32 = 0x08;
const SR: u32 = 0x0C;

const RELOAD: u32 = 0xAAAA;
const UNLOCK: u32 = 0x5555;
const START: u32 = 0xCCCC;
const PR_MAX: u32 = 6;

/// The watchdog.
#[derive(Debug)]
pub(super) struct Iwdg {
    now: Cycles,
    divider: Cycles,
    pr: u32,
    rlr: u32,
    unlocked: bool,
    /// When it resets the chip; never before it is started.
    expires: Cycles,
}

impl Iwdg {
    pub(super) fn new() -> Self {
        Self { now: 0, divider: 1, pr: 0, rlr: 0xFFF, unlocked: false, expires: NEVER }
    }

    /// Whether it has been started.
    pub(super) fn is_running(&self) -> bool {
        self.expires != NEVER
    }

    /// Whether it has not been reloaded in time.
    pub(super) fn has_expired(&self) -> bool {
        self.expires <= self.now
    }

    fn count_from(&mut self, count: u32) {
        self.expires = self.now + self.divider * (4 << self.pr.min(PR_MAX)) * (Cycles::from(count) + 1);
    }
}

impl Peripheral for Iwdg {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            KR | SR => Ok(0),
            PR => Ok(self.pr),
            RLR => Ok(self.rlr),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            KR => {
                self.unlocked = value == UNLOCK;
                // Its first count is the longest, whatever is to be reloaded (RM0090 21.3.1).
                match value {
                    START if !self.is_running() => self.count_from(0xFFF),
                    RELOAD if self.is_running() => self.count_from(self.rlr),
                    _ => {}
                }
            }
            PR | RLR if !self.unlocked => return Err(Refusal::Use("written without its key")),
            PR => self.pr = value & 7,
            RLR => self.rlr = value & 0xFFF,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycles) {
        self.now = to;
    }

    fn next_event(&self) -> Cycles {
        // It bites once; the reset that follows stops it.
        if self.has_expired() { NEVER } else { self.expires }
    }

    /// Sets the divider of the clock, which is the watchdog's own: what is left of the time is left, in other cycles.
    fn set_divider(&mut self, divider: Cycles) {
        if self.is_running() {
            self.expires = self.now + self.expires.saturating_sub(self.now) / self.divider * divider;
        }
        self.divider = divider;
    }

    fn reset(&mut self) {
        *self = Self { now: self.now, divider: self.divider, ..Self::new() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_bites_when_it_is_not_fed() {
        let mut iwdg = Iwdg::new();
        iwdg.set_divider(5_250);
        assert!(iwdg.write(PR, 3).is_err());
        iwdg.write(KR, UNLOCK).unwrap();
        iwdg.write(PR, 3).unwrap();
        iwdg.write(RLR, 999).unwrap();
        iwdg.write(KR, RELOAD).unwrap();
        assert_eq!(iwdg.next_event(), NEVER);
        iwdg.write(KR, START).unwrap();
        // 32 kHz / 32: a millisecond.
        assert_eq!(iwdg.next_event(), 4_096 * 168_000);
        iwdg.write(KR, RELOAD).unwrap();
        assert_eq!(iwdg.next_event(), 168_000_000);
        iwdg.write(KR, START).unwrap();
        assert_eq!(iwdg.next_event(), 168_000_000);
        iwdg.advance(160_000_000);
        iwdg.write(KR, RELOAD).unwrap();
        assert!(!iwdg.has_expired() && iwdg.next_event() == 328_000_000);
        iwdg.advance(328_000_000);
        assert!(iwdg.has_expired() && iwdg.next_event() == NEVER);
    }
}
