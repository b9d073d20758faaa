//! FLASH: the interface to the flash memory (RM0090 3.9). Programming and erasing are not modelled: the image
//! never changes itself.

use super::accelerator::Setup;
use super::peripheral::{Access, Cycles, NEVER, Peripheral, Refusal, bit, field};

const ACR: u32 = 0x00;
const SR: u32 = 0x0C;
const CR: u32 = 0x10;
const OPTCR: u32 = 0x14;

/// LATENCY, PRFTEN, ICEN, DCEN, ICRST, DCRST.
const ACR_WRITABLE: u32 = 0x1F07;
const PRFTEN: u32 = 8;
const ICEN: u32 = 9;
const DCEN: u32 = 10;
const ICRST: u32 = 11;
const DCRST: u32 = 12;
const LOCK: u32 = 1 << 31;
const OPTCR_RESET: u32 = 0x0FFF_AAED;

/// At 2.7 V to 3.6 V a wait state is needed for every further 30 MHz (table 10).
const HZ_PER_WAIT_STATE: u64 = 30_000_000;
/// How long the core may run with wait states and without all that makes up for them: a part of a second.
const SETTING_UP: u64 = 10_000;

/// The flash interface.
#[derive(Debug)]
pub(super) struct Flash {
    acr: u32,
    /// How often the caches have been emptied: for instructions, for data.
    emptied: [u32; 2],
    /// The core clock, and until when that may have wait states that nothing makes up for.
    hz: u64,
    patient_until: Cycles,
    now: Cycles,
}

impl Flash {
    pub(super) fn new() -> Self {
        Self { acr: 0, emptied: [0; 2], hz: 0, patient_until: NEVER, now: 0 }
    }

    /// The core clock is `hz` from now on.
    pub(super) fn set_core_clock(&mut self, hz: u64) {
        self.hz = hz;
        self.be_patient();
    }

    /// Gives what has been set up.
    pub(super) fn setup(&self) -> Setup {
        Setup {
            wait_states: field(self.acr, 0, 3),
            prefetch: bit(self.acr, PRFTEN),
            instruction_cache: bit(self.acr, ICEN),
            data_cache: bit(self.acr, DCEN),
            emptied: self.emptied,
        }
    }

    /// Tells what is wrong with the set-up, if anything is.
    pub(super) fn complaint(&self) -> Option<&'static str> {
        let fast_enough = HZ_PER_WAIT_STATE * u64::from(field(self.acr, 0, 3) + 1);
        if self.hz > fast_enough {
            Some("too few wait states for the core clock")
        } else if self.now >= self.patient_until {
            Some("the core runs with wait states, and prefetch or a cache is off")
        } else {
            None
        }
    }

    /// Where the clock needs wait states, something is to make up for them, soon.
    fn be_patient(&mut self) {
        let all = 1 << PRFTEN | 1 << ICEN | 1 << DCEN;
        let slow = self.hz > HZ_PER_WAIT_STATE && self.acr & all != all;
        self.patient_until = match self.patient_until {
            NEVER if slow => self.now + self.hz / SETTING_UP,
            until if slow => until,
            _ => NEVER,
        };
    }
}

impl Peripheral for Flash {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            ACR => Ok(self.acr),
            SR => Ok(0),
            CR => Ok(LOCK),
            OPTCR => Ok(OPTCR_RESET),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            ACR if value & !ACR_WRITABLE != 0 => return Err(Refusal::Use("reserved bits of ACR")),
            ACR => {
                let pairs = [(ICRST, ICEN), (DCRST, DCEN)];
                if pairs.iter().any(|&(empty, on)| bit(value, empty) && bit(self.acr | value, on)) {
                    return Err(Refusal::Use("a cache is emptied while it is on"));
                }
                for (emptied, (empty, _)) in self.emptied.iter_mut().zip(pairs) {
                    *emptied += u32::from(bit(value, empty));
                }
                self.acr = value;
                self.be_patient();
            }
            CR | OPTCR => return Err(Refusal::Use("programming the flash is not modelled")),
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycles) {
        self.now = to;
    }

    fn next_event(&self) -> Cycles {
        if self.now < self.patient_until { self.patient_until } else { NEVER }
    }

    fn reset(&mut self) {
        *self = Self { hz: self.hz, now: self.now, ..Self::new() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: u32 = 5 | 1 << PRFTEN | 1 << ICEN | 1 << DCEN;

    #[test]
    fn the_clock_needs_wait_states_and_they_the_accelerator() {
        let mut flash = Flash::new();
        flash.set_core_clock(30_000_000);
        assert_eq!((flash.complaint(), flash.next_event()), (None, NEVER));
        flash.write(ACR, 4).unwrap();
        flash.set_core_clock(168_000_000);
        assert_eq!(flash.complaint(), Some("too few wait states for the core clock"));
        flash.write(ACR, 5).unwrap();
        assert_eq!((flash.complaint(), flash.next_event()), (None, 16_800));
        for missing in [PRFTEN, ICEN, DCEN] {
            flash.write(ACR, ALL).unwrap();
            assert_eq!(flash.next_event(), NEVER);
            flash.write(ACR, ALL & !(1 << missing)).unwrap();
            let due = flash.next_event();
            flash.advance(due - 1);
            assert_eq!(flash.complaint(), None);
            flash.advance(due);
            assert_eq!(flash.complaint(), Some("the core runs with wait states, and prefetch or a cache is off"));
            assert_eq!(flash.next_event(), NEVER);
        }
        flash.write(ACR, ALL).unwrap();
        assert_eq!(flash.complaint(), None);
    }

    #[test]
    fn a_cache_is_emptied_while_it_is_off() {
        let mut flash = Flash::new();
        flash.write(ACR, 1 << ICRST | 1 << DCEN).unwrap();
        flash.write(ACR, 0).unwrap();
        flash.write(ACR, 1 << DCRST | 1 << ICRST | 1 << PRFTEN).unwrap();
        assert_eq!(flash.setup(), Setup { prefetch: true, emptied: [2, 1], ..Setup::default() });
        let refused = Err(Refusal::Use("a cache is emptied while it is on"));
        assert_eq!(flash.write(ACR, 1 << ICRST | 1 << ICEN), refused);
        flash.write(ACR, 1 << DCEN).unwrap();
        assert_eq!(flash.write(ACR, 1 << DCRST), refused);
    }
}
