//! Expected numbers come from the datasheet's formulas at f_CLK = 16 MHz, where a tick is 2 us.

mod invariants;
mod motion;
mod outputs;
mod registers;
mod switches;

use super::*;
use crate::clock::{MICROSECOND, MILLISECOND, SECOND};

const HZ: u32 = 16_000_000;
const TICK: Nanos = 2 * MICROSECOND;

// First bytes for motor 1: IDX << 1.
const X_TARGET: u8 = 0x00;
const X_ACTUAL: u8 = 0x02;
const V_MIN: u8 = 0x04;
const V_MAX: u8 = 0x06;
const V_TARGET: u8 = 0x08;
const V_ACTUAL: u8 = 0x0A;
const A_MAX: u8 = 0x0C;
const A_ACTUAL: u8 = 0x0E;
const PMUL_PDIV: u8 = 0x12;
const MODE: u8 = 0x14;
const INTERRUPTS: u8 = 0x16;
const DIVIDERS: u8 = 0x18;
const TOLERANCE: u8 = 0x1A;
const LATCHED: u8 = 0x1C;
const USTEP: u8 = 0x1E;
const COVER_POS: u8 = 0x64;
const COVER: u8 = 0x66;
const IF_CONF: u8 = 0x68;
const POS_COMP: u8 = 0x6A;
const POS_COMP_INT: u8 = 0x6C;
const POWER_DOWN: u8 = 0x70;
const VERSION: u8 = 0x72;
const SWITCHES: u8 = 0x7C;
const GLOBAL: u8 = 0x7E;

const NO_STOPS: u32 = 0x300;
const SOFT_STOP: u32 = 0x400;
const RIGHT_NOT_LEFT: u32 = 0x800;
const RAMP: u32 = 0;
const SOFT: u32 = 1;
const VELOCITY: u32 = 2;
const HOLD: u32 = 3;
/// en_refr, en_sd, sdo_int.
const STEP_DIR: u32 = 0x122;
const REFR1: u8 = 1;
const REFL1: u8 = 2;

/// A stage without motor: counts steps, and has switches at positions of motor 1.
#[derive(Debug, Default)]
struct Stage {
    steps: Vec<(Nanos, usize, bool)>,
    position: i32,
    highest: i32,
    /// The switches are closed at positions in these ranges.
    left: Option<(i32, i32)>,
    right: Option<(i32, i32)>,
    /// Steps that leave the switches as they are need not be told one by one.
    skips: bool,
}

/// In the place of the time of a step that was not told.
const UNTOLD: Nanos = Nanos::MAX;

impl Stage {
    fn pins(&self) -> u8 {
        let closed = |range: Option<(i32, i32)>| range.is_some_and(|(a, b)| (a..=b).contains(&self.position));
        (if closed(self.right) { REFR1 } else { 0 }) | (if closed(self.left) { REFL1 } else { 0 })
    }
}

impl StepDir for Stage {
    fn step(&mut self, at: Nanos, motor: usize, dir_pin: bool) -> u8 {
        if motor == 0 {
            self.position += if dir_pin { 1 } else { -1 };
            self.highest = self.highest.max(self.position);
        }
        self.steps.push((at, motor, dir_pin));
        self.pins()
    }

    fn free_steps(&self, motor: usize, dir_pin: bool) -> u32 {
        if !self.skips || motor != 0 {
            return if self.skips { 40 } else { 0 };
        }
        let way = |edge: i32| if dir_pin { edge - self.position - 1 } else { self.position - edge };
        // Up the switch changes at these positions, down just below them.
        let edges = [self.left, self.right].into_iter().flatten().flat_map(|(first, last)| [first, last + 1]);
        edges.map(way).filter(|way| *way >= 0).min().map_or(1_000, |way| way as u32)
    }

    fn skip(&mut self, at: Nanos, motor: usize, dir_pin: bool, steps: u32) {
        if motor == 0 {
            self.position += if dir_pin { 1 } else { -1 } * steps as i32;
            self.highest = self.highest.max(self.position);
        }
        self.steps.extend((1..steps).map(|_| (UNTOLD, motor, dir_pin)));
        self.steps.push((at, motor, dir_pin));
    }
}

struct Rig {
    chip: Tmc429,
    stage: Stage,
    now: Nanos,
}

impl Rig {
    /// Step/direction mode, pulses of 1 us.
    fn new() -> Self {
        let mut rig = Self { chip: Tmc429::new(HZ), stage: Stage::default(), now: 0 };
        rig.write(IF_CONF, STEP_DIR);
        rig.write(GLOBAL, 0);
        rig
    }

    /// Motor 1 in a mode, without stop switches, with the dividers and A_MAX given; V_MIN 1, V_MAX 2047.
    fn with(mode: u32, pulse_div: u32, ramp_div: u32, a_max: u32) -> Self {
        let mut rig = Self::new();
        rig.write(DIVIDERS, pulse_div << 12 | ramp_div << 8);
        rig.write(V_MIN, 1);
        rig.write(V_MAX, 2047);
        rig.write(A_MAX, a_max);
        rig.write(MODE, NO_STOPS | mode);
        rig
    }

    fn transfer<const N: usize>(&mut self, bytes: [u8; N]) -> [u8; N] {
        self.chip.select(self.now);
        let reply = bytes.map(|byte| self.chip.byte(byte));
        self.chip.deselect(self.now);
        reply
    }

    fn datagram(&mut self, first: u8, data: u32) -> u32 {
        u32::from_be_bytes(self.transfer((u32::from(first) << 24 | data).to_be_bytes()))
    }

    fn write(&mut self, register: u8, data: u32) {
        self.datagram(register, data);
    }

    fn read(&mut self, register: u8) -> u32 {
        self.datagram(register | 1, 0) & 0xFF_FFFF
    }

    fn status(&mut self) -> u8 {
        self.transfer([0xFF])[0]
    }

    fn run(&mut self, span: Nanos) {
        self.now += span;
        self.chip.advance(self.now, &mut self.stage);
    }

    fn pins(&mut self) {
        self.chip.set_reference_pins(self.stage.pins());
    }

    /// Runs until nothing happens any more; returns the time that took.
    fn settle(&mut self) -> Nanos {
        let start = self.now;
        while let Some(next) = self.chip.next_event() {
            self.now = next;
            self.chip.advance(next, &mut self.stage);
            assert!(self.now - start < 3000 * SECOND, "does not come to rest");
        }
        self.now - start
    }

    /// Runs for `span` and returns the steps made in it.
    fn steps_in(&mut self, span: Nanos) -> usize {
        let before = self.stage.steps.len();
        self.run(span);
        self.stage.steps.len() - before
    }
}
