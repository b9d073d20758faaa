//! TIM2 to TIM5: general-purpose timers (RM0090 18.4).
//!
//! Modelled are the up-counter with prescaler and its preload, update and compare flags and their interrupts, and
//! the encoder interface, which follows a count from outside. Outputs are not connected; captures, other slave
//! modes and DMA are refused.

use super::peripheral::{Access, Cycles, NEVER, Peripheral, Refusal, bit, field};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SMCR: u32 = 0x08;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCMR2: u32 = 0x1C;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const CCR1: u32 = 0x34;
const CCR4: u32 = 0x40;
const OR: u32 = 0x50;

const CEN: u32 = 0;
const UDIS: u32 = 1;
const URS: u32 = 2;
const OPM: u32 = 3;
const DIR: u32 = 4;
const ARPE: u32 = 7;
/// CEN, UDIS, URS, OPM, ARPE, CKD.
const CR1_MODELLED: u32 = 0x38F;
const UIF: u32 = 1;
/// CC1S and CC2S, as the encoder interface needs them; CC3S and CC4S, which would capture.
const CAPTURE: u32 = 0x0303;

/// A timer.
#[derive(Debug)]
pub(super) struct Timer {
    /// The largest count: 16 or 32 bits.
    max: u32,
    now: Cycles,
    divider: Cycles,
    cr1: u32,
    cr2: u32,
    smcr: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    psc: u32,
    arr: u32,
    ccr: [u32; 4],
    /// Prescaler and reload value in use.
    psc_shadow: u32,
    arr_shadow: u32,
    cnt: u32,
    /// The time at which the counter reached `cnt`.
    since: Cycles,
    /// The count from outside that the encoder interface has followed up to.
    followed: i64,
}

impl Timer {
    /// A timer whose counter has 32 or 16 bits.
    pub(super) fn new(wide: bool) -> Self {
        let max = if wide { u32::MAX } else { 0xFFFF };
        Self {
            max,
            now: 0,
            divider: 1,
            cr1: 0,
            cr2: 0,
            smcr: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            psc: 0,
            arr: max,
            ccr: [0; 4],
            psc_shadow: 0,
            arr_shadow: max,
            cnt: 0,
            since: 0,
            followed: 0,
        }
    }

    /// Whether it is an encoder interface that counts; then it wants to know the count before it is read.
    pub(super) fn follows_encoder(&self) -> bool {
        bit(self.cr1, CEN) && (1..=3).contains(&field(self.smcr, 0, 3))
    }

    /// The encoder has counted up to `count`, in edges of both tracks.
    pub(super) fn follow(&mut self, count: i64) {
        let moved = count - self.followed;
        self.followed = count;
        if !self.follows_encoder() || moved == 0 {
            return;
        }
        let modulus = i64::from(self.arr_shadow) + 1;
        // Both edges of both tracks count in mode 3 only; the others see half of them.
        let moved = if field(self.smcr, 0, 3) == 3 { moved } else { moved / 2 };
        // With one of the tracks inverted it counts the other way (CC1P, CC2P).
        let inverted = bit(self.ccer, 1) != bit(self.ccer, 5);
        let moved = if inverted { -moved } else { moved };
        let target = i64::from(self.cnt) + moved;
        if !(0..modulus).contains(&target) {
            self.sr |= UIF;
        }
        self.cnt = target.rem_euclid(modulus) as u32;
        self.cr1 = self.cr1 & !(1 << DIR) | u32::from(moved < 0) << DIR;
    }

    fn counts(&self) -> bool {
        bit(self.cr1, CEN) && !self.follows_encoder()
    }

    /// Core cycles from count to count.
    fn period(&self) -> Cycles {
        self.divider * (Cycles::from(self.psc_shadow) + 1)
    }

    /// Counts until the counter starts anew. Past its end already, as after a write, it goes on to its largest count.
    fn room(&self) -> u64 {
        let end = if self.cnt > self.arr_shadow { self.max } else { self.arr_shadow };
        u64::from(end - self.cnt) + 1
    }

    /// Counts on by `ticks`, which do not go beyond the next start anew.
    fn count(&mut self, ticks: u64) {
        let target = u64::from(self.cnt) + ticks;
        let anew = ticks == self.room();
        let overflow = anew && self.cnt <= self.arr_shadow;
        for (channel, &compare) in self.ccr.iter().enumerate() {
            let compare = u64::from(compare);
            // The counter matches at 0 when it starts anew.
            if u64::from(self.cnt) < compare && compare <= target && compare <= u64::from(self.arr_shadow)
                || anew && compare == 0
            {
                self.sr |= 2 << channel;
            }
        }
        if overflow {
            self.update(true);
        } else {
            self.cnt = if anew { 0 } else { target as u32 };
        }
    }

    /// An update event: by overflow, or by UG.
    fn update(&mut self, overflow: bool) {
        self.cnt = 0;
        if bit(self.cr1, UDIS) {
            return;
        }
        self.psc_shadow = self.psc;
        self.arr_shadow = self.arr;
        if overflow || !bit(self.cr1, URS) {
            self.sr |= UIF;
        }
        if overflow && bit(self.cr1, OPM) {
            self.cr1 &= !(1 << CEN);
        }
    }
}

impl Peripheral for Timer {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            CR1 => Ok(self.cr1),
            CR2 => Ok(self.cr2),
            SMCR => Ok(self.smcr),
            DIER => Ok(self.dier),
            SR => Ok(self.sr),
            EGR => Ok(0),
            CCMR1 => Ok(self.ccmr[0]),
            CCMR2 => Ok(self.ccmr[1]),
            CCER => Ok(self.ccer),
            CNT => Ok(self.cnt),
            PSC => Ok(self.psc),
            ARR => Ok(self.arr),
            CCR1..=CCR4 => Ok(self.ccr[(offset - CCR1) as usize / 4]),
            OR => Ok(0),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            CR1 if value & !CR1_MODELLED & !(1 << DIR) != 0 || bit(value, DIR) && field(self.smcr, 0, 3) == 0 => {
                return Err(Refusal::Use("only counting upwards is modelled"));
            }
            CR1 => {
                if !bit(self.cr1, CEN) {
                    self.since = self.now;
                }
                self.cr1 = value & !(1 << DIR) | self.cr1 & 1 << DIR;
            }
            CR2 => self.cr2 = value,
            SMCR if field(value, 0, 3) > 3 || bit(value, 14) => {
                return Err(Refusal::Use("of the slave modes only the encoder interface is modelled"));
            }
            SMCR => self.smcr = value,
            DIER if value & !0x1F != 0 => return Err(Refusal::Use("triggers and DMA of timers are not modelled")),
            DIER => self.dier = value,
            // Flags are cleared by writing zero.
            SR => self.sr &= value,
            EGR => {
                self.sr |= value & 0x1E;
                if bit(value, 0) {
                    self.update(false);
                    self.since = self.now;
                }
            }
            CCMR1 => self.ccmr[0] = value,
            CCMR2 if value & CAPTURE != 0 => return Err(Refusal::Use("captures are not modelled")),
            CCMR2 => self.ccmr[1] = value,
            CCER => self.ccer = value,
            CNT => {
                self.cnt = value & self.max;
                self.since = self.now;
            }
            PSC => self.psc = value & 0xFFFF,
            ARR => {
                self.arr = value & self.max;
                if !bit(self.cr1, ARPE) {
                    self.arr_shadow = self.arr;
                }
            }
            CCR1..=CCR4 => self.ccr[(offset - CCR1) as usize / 4] = value & self.max,
            _ => return Err(Refusal::Register),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycles) {
        self.now = to;
        while self.counts() {
            let ticks = (to - self.since) / self.period();
            if ticks == 0 {
                return;
            }
            let step = ticks.min(self.room());
            self.since += step * self.period();
            self.count(step);
        }
        self.since = to;
    }

    fn next_event(&self) -> Cycles {
        if !self.counts() {
            return NEVER;
        }
        let room = self.room();
        let awaited = self.dier & !self.sr;
        let mut ticks = NEVER;
        if bit(awaited, 0) {
            let past = if self.cnt > self.arr_shadow { u64::from(self.arr_shadow) + 1 } else { 0 };
            ticks = room + past;
        }
        for (channel, &compare) in self.ccr.iter().enumerate() {
            if bit(awaited, channel as u32 + 1) && compare <= self.arr_shadow {
                let distance = if compare > self.cnt { compare - self.cnt } else { compare };
                let wrapped = if compare > self.cnt { 0 } else { room };
                ticks = ticks.min(u64::from(distance) + wrapped);
            }
        }
        if ticks == NEVER { NEVER } else { self.since + ticks * self.period() }
    }

    fn interrupts(&self) -> u32 {
        u32::from(self.sr & self.dier & 0x1F != 0)
    }

    fn set_divider(&mut self, divider: Cycles) {
        self.divider = divider;
    }

    fn reset(&mut self) {
        *self = Self { now: self.now, since: self.now, divider: self.divider, ..Self::new(self.max == u32::MAX) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn running(prescaler: u32, reload: u32) -> Timer {
        let mut timer = Timer::new(false);
        timer.set_divider(2);
        timer.write(PSC, prescaler).unwrap();
        timer.write(ARR, reload).unwrap();
        timer.write(CR1, 1 << URS).unwrap();
        timer.write(EGR, 1).unwrap();
        timer.write(CR1, 1 << CEN).unwrap();
        timer
    }

    #[test]
    fn counts_at_the_rate_of_the_prescaler() {
        let mut timer = running(83, 0xFFFF);
        timer.advance(168 * 1_000 + 167);
        assert_eq!((timer.read(CNT), timer.read(SR)), (Ok(1_000), Ok(0)));
        timer.advance(168 * 65_536);
        // Nothing compares unequal to zero after an overflow: all four channels match there.
        assert_eq!((timer.read(CNT), timer.read(SR)), (Ok(0), Ok(0x1F)));
        timer.write(SR, !UIF).unwrap();
        assert_eq!(timer.read(SR), Ok(0x1E));
    }

    #[test]
    fn compare_interrupts_come_when_they_were_announced() {
        let mut timer = running(0, 999);
        timer.write(CCR1 + 4, 500).unwrap();
        timer.write(DIER, 4).unwrap();
        assert_eq!(timer.next_event(), 1_000);
        timer.advance(999);
        assert_eq!(timer.interrupts(), 0);
        timer.advance(1_000);
        assert_eq!((timer.interrupts(), timer.next_event()), (1, NEVER));
        timer.write(SR, 0).unwrap();
        assert_eq!(timer.next_event(), 3_000);
        timer.advance(3_000);
        assert_eq!(timer.interrupts(), 1);
    }

    #[test]
    fn a_counter_past_its_end_goes_on_to_its_largest_count() {
        let mut timer = running(0, 0xFFFF);
        timer.write(DIER, 1).unwrap();
        timer.advance(2 * 500);
        timer.write(ARR, 99).unwrap();
        assert_eq!(timer.next_event(), 2 * (65_536 + 100));
        timer.advance(2 * 65_536);
        assert_eq!((timer.read(CNT), timer.interrupts()), (Ok(0), 0));
        timer.advance(2 * (65_536 + 100));
        assert_eq!((timer.read(CNT), timer.interrupts()), (Ok(0), 1));
    }

    #[test]
    fn the_encoder_interface_follows() {
        let mut timer = running(0, 99);
        timer.write(SMCR, 3).unwrap();
        timer.follow(30);
        assert_eq!(timer.read(CNT), Ok(30));
        timer.follow(-5);
        assert_eq!((timer.read(CNT), timer.read(SR)), (Ok(95), Ok(1)));
        assert!(bit(timer.read(CR1).unwrap(), DIR));
        timer.advance(1_000_000);
        assert_eq!((timer.read(CNT), timer.next_event()), (Ok(95), NEVER));
        timer.write(CCER, 1 << 1).unwrap();
        timer.follow(0);
        assert_eq!(timer.read(CNT), Ok(90));
    }
}
