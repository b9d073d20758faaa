//! Expected numbers come from the datasheet's formulas. The clock is an external one of 16 MHz unless a test says so.

mod driver;
mod encoder;
mod invariants;
mod ramp;
mod spi;
mod switches;

use super::registers::address::*;
use super::switches::{Pair, mode};
use super::*;
use crate::chip::load::LoadRatio;
use crate::chip::{Mechanics, Sensed, SpiSlave};
use crate::clock::{MICROSECOND, MILLISECOND, SECOND};

const HZ: u32 = 16_000_000;
/// 512 periods of the clock.
const TICK: Nanos = 32 * MICROSECOND;

/// A stage without motor: it records the field, and has switches and an encoder at positions of the field.
#[derive(Debug, Default)]
struct Stage {
    turns: Vec<(Nanos, i64)>,
    field: i64,
    current: u32,
    load: LoadRatio,
    /// The switches are closed from these positions on, to the left and to the right.
    left: Option<i64>,
    right: Option<i64>,
    /// Units of the field in a count of the encoder; 0 is no encoder.
    units_per_count: i64,
    /// Counts in a turn of the encoder, whose null track is high for the count 0.
    counts_per_turn: i64,
    /// Counts by which the encoder is off the field.
    slipped: i64,
    /// The stage need not be told of steps that change nothing at its pins.
    skips: bool,
}

impl Stage {
    fn sensed(&self) -> Sensed {
        Sensed {
            left: self.left.is_some_and(|at| self.field <= at),
            right: self.right.is_some_and(|at| self.field >= at),
            count: self.field.checked_div_euclid(self.units_per_count).unwrap_or(0) + self.slipped,
        }
    }
}

impl Mechanics for Stage {
    fn turn(&mut self, at: Nanos, field: i64) -> Sensed {
        self.field = field;
        self.turns.push((at, field));
        self.sensed()
    }

    fn free_way(&self, up: bool) -> i64 {
        let (pins, way) = (self.sensed(), if up { 1 } else { -1 });
        let same = |field: i64| Stage { field, turns: Vec::new(), ..*self }.sensed() == pins;
        let free = |&distance: &i64| same(self.field + way * (distance + 1));
        if self.skips { (0..300).take_while(free).count() as i64 } else { 0 }
    }

    fn energise(&mut self, current: u32) {
        self.current = current;
    }

    fn load(&self) -> LoadRatio {
        self.load
    }

    fn tracks(&self, count: i64) -> Tracks {
        let phase = count.rem_euclid(4);
        let n = count.checked_rem_euclid(self.counts_per_turn) == Some(0);
        Tracks { a: phase == 1 || phase == 2, b: phase >= 2, n }
    }
}

/// A motor with much resistance in its coils: its reading is zero where it stalls at SGT 13.
const RESPONSE: Response = Response { zero: 13, span: 512, speed: 0, noise: 0 };

struct Rig {
    chip: Tmc5160,
    stage: Stage,
    now: Nanos,
}

impl Rig {
    /// A chip that has been reset, and whose reset flags have been cleared.
    fn new() -> Self {
        let mut rig = Self { chip: Tmc5160::new(RESPONSE, 0), stage: Stage::default(), now: 0 };
        rig.chip.set_external_clock(Some(HZ));
        rig.chip.set_disable_pin(false);
        rig.write(GSTAT, 7);
        rig.write(RAMP_STAT, u32::MAX);
        rig
    }

    /// A chip with these registers, and the driver on at full current.
    fn with(registers: &[(u8, u32)]) -> Self {
        let mut rig = Self::new();
        rig.write(CHOPCONF, 0x1000_00C3);
        rig.write(IHOLD_IRUN, 0x1F1F);
        for &(address, data) in registers {
            rig.write(address, data);
        }
        rig
    }

    /// Sends bytes with a clock of 5 MHz.
    fn transfer<const N: usize>(&mut self, bytes: [u8; N]) -> [u8; N] {
        self.run(MICROSECOND);
        self.chip.select(self.now);
        let answer = bytes.map(|byte| {
            self.run(1600);
            self.chip.byte(byte)
        });
        self.run(100);
        self.chip.deselect(self.now);
        answer
    }

    /// Sends a datagram; gives status and data.
    fn datagram(&mut self, first: u8, data: u32) -> (u8, u32) {
        let [a, b, c, d] = data.to_be_bytes();
        let [status, a, b, c, d] = self.transfer([first, a, b, c, d]);
        (status, u32::from_be_bytes([a, b, c, d]))
    }

    fn write(&mut self, register: u8, data: u32) {
        self.datagram(register | WRITE, data);
    }

    fn read(&mut self, register: u8) -> u32 {
        self.datagram(register, 0);
        self.datagram(register, 0).1
    }

    fn status(&mut self) -> u8 {
        self.datagram(IOIN, 0);
        self.datagram(IOIN, 0).0
    }

    fn position(&self) -> i32 {
        self.chip.position()
    }

    fn run(&mut self, span: Nanos) {
        self.now += span;
        self.chip.advance(self.now, &mut self.stage);
    }

    /// The inputs have changed without a step.
    fn sense(&mut self) {
        let stage = &self.stage;
        self.chip.sense(stage.sensed(), |count| stage.tracks(count));
    }

    /// Runs until the motor has nothing more to do; returns the time to the last step.
    fn settle(&mut self) -> Nanos {
        let start = self.now;
        while self.chip.ramp.next() != NEVER {
            self.run(MILLISECOND);
            assert!(self.now - start < 3000 * SECOND, "does not come to rest");
        }
        self.stage.turns.last().map_or(0, |(at, _)| at.saturating_sub(start))
    }

    /// Runs in pieces of `piece` until this is so.
    fn until(&mut self, piece: Nanos, is_so: impl Fn(&Self) -> bool) {
        let start = self.now;
        while !is_so(self) {
            self.run(piece);
            assert!(self.now - start < 100 * SECOND, "it never is so");
        }
    }

    /// Runs for `span`, and returns the highest speed that VACTUAL has had at its ticks.
    fn top_speed(&mut self, span: Nanos) -> i32 {
        let end = self.now + span;
        let mut top = 0;
        while self.now < end {
            self.run(TICK);
            top = top.max(self.chip.velocity().abs());
        }
        top
    }
}

/// Microsteps per second of a velocity (12.1).
fn hertz(velocity: u32) -> f64 {
    f64::from(velocity) * f64::from(HZ) / f64::from(1 << 24)
}

/// Microsteps per second squared of an acceleration (12.1).
fn hertz_per_second(acceleration: u32) -> f64 {
    let hz = f64::from(HZ);
    f64::from(acceleration) * hz * hz / (512.0 * 256.0) / f64::from(1 << 24)
}

/// The value is within 0.1 % or `slack` of what is expected.
fn near(value: f64, expected: f64, slack: f64) {
    assert!((value - expected).abs() <= (expected.abs() / 1000.0).max(slack), "{value}, not {expected}");
}
