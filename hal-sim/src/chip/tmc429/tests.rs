//! Expected numbers come from the datasheet's formulas at f_CLK = 16 MHz, where a tick is 2 us.

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
}

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

#[test]
fn version_and_power_on_status() {
    let mut rig = Rig { chip: Tmc429::new(HZ), stage: Stage::default(), now: 0 };
    // All xEQt set, all switches open (6.2.2.2).
    assert_eq!(rig.datagram(VERSION | 1, 0), 0x1542_9101);
    assert_eq!(rig.read(GLOBAL), 0x0F00);
    assert_eq!(rig.read(PMUL_PDIV), 0x8000);
    for register in (0..0x60).step_by(2).filter(|register| register & 0x1F != PMUL_PDIV) {
        assert_eq!(rig.read(register), 0, "register {register:#x}");
    }
    assert_eq!(rig.chip.next_event(), None);
}

#[test]
fn register_masks() {
    // Written with all ones. hold_mode, so that V_TARGET is not computed; the interrupt flags stay 0.
    let axis = [
        (MODE, 0x00_0F03),
        (X_TARGET, 0xFF_FFFF),
        (X_ACTUAL, 0xFF_FFFF),
        (V_MIN, 0x7FF),
        (V_MAX, 0x7FF),
        (V_TARGET, 0xFFF),
        (V_ACTUAL, 0xFFF),
        (A_MAX, 0x7FF),
        (A_ACTUAL, 0),
        (0x10, 0x77_77FF),
        (PMUL_PDIV, 0xFF0F),
        (INTERRUPTS, 0xFF00),
        (DIVIDERS, 0xFF07),
        (TOLERANCE, 0xFFF),
        (LATCHED, 0),
        (USTEP, 0xFF),
    ];
    let mut rig = Rig::new();
    for motor in 0..3 {
        for (register, mask) in axis {
            rig.write(motor << 5 | register, 0xFF_FFFF);
            assert_eq!(rig.read(motor << 5 | register), mask, "register {register:#x} of motor {motor}");
        }
        // The dummy write has armed the latch.
        assert_eq!(rig.read(motor << 5 | MODE), 0x01_0F03);
        rig.write(motor << 5 | MODE, 0);
        assert_eq!(rig.read(motor << 5 | MODE), 0x01_0000);
        rig.write(motor << 5 | PMUL_PDIV, 0);
        assert_eq!(rig.read(motor << 5 | PMUL_PDIV), 0x8000);
        rig.write(motor << 5 | V_MAX, 0);
        rig.write(motor << 5 | V_ACTUAL, 0);
    }
    let common = [
        (0x60, 0),
        (0x62, 0),
        (COVER, 0xFF_FFFF),
        (IF_CONF, 0x1FF),
        (POS_COMP, 0xFF_FFFF),
        (POS_COMP_INT, 0x100),
        (0x6E, 0),
        (VERSION, 0x42_9101),
        (0x74, 0),
        (0x76, 0),
        (0x78, 0),
        (0x7A, 0),
        (GLOBAL, 0x31_FFFF),
    ];
    for (register, mask) in common {
        rig.write(register, 0xFF_FFFF);
        assert_eq!(rig.read(register), mask, "register {register:#x}");
    }
    // COVER_POS reads one higher than written (8.2.2); cw is set by the datagram above.
    rig.write(COVER_POS, 39 << 8 | 7);
    assert_eq!(rig.read(COVER_POS), 0x80_0000 | 40 << 8 | 7);
}

#[test]
fn ram() {
    let mut rig = Rig::new();
    // Power-on contents: positions 0 and 1 of the driver chain, 10 and 11; the sine table (11.4.2, 11.5).
    assert_eq!(rig.read(0x80), 0x0511);
    assert_eq!(rig.read(0x8A), 0x2E0A);
    assert_eq!(rig.read(0xC2), 0x0503);
    // The datasheet's example (6.2.3).
    assert_eq!(rig.datagram(0xFE, 0b10_0011_0010_0001) & 0xFF_FFFF, 0);
    assert_eq!(rig.read(0xFE), 0b10_0011_0010_0001);
    for address in (0x80..=0xFE).step_by(2) {
        rig.write(address, 0xFF_FFFF);
        assert_eq!(rig.read(address), 0x3F3F);
    }
}

#[test]
fn only_32_bits_act() {
    let mut rig = Rig::new();
    rig.write(V_MAX, 0x123);
    assert_eq!(rig.transfer([V_MAX]), [0x15]);
    assert_eq!(rig.transfer([V_MAX, 0, 7]), [0x15, 0, 0]);
    assert_eq!(rig.transfer([V_MAX, 0, 0, 7, 0]), [0x15, 0, 0, 0, 0]);
    assert_eq!(rig.transfer([]), [0_u8; 0]);
    assert_eq!(rig.transfer([V_MAX | 1, 0, 0]), [0x15, 0, 1]);
    assert_eq!(rig.datagram(V_MAX | 1, 0xFF_FFFF), 0x1500_0123);
    assert_eq!(rig.datagram(V_MAX, 0x124), 0x1500_0000);
    // A write acts when nSCS_C rises.
    rig.chip.select(0);
    let _ = [V_MAX, 0, 0, 1].map(|byte| rig.chip.byte(byte));
    assert_eq!(rig.chip.axes[0].read(axis_register::V_MAX), 0x124);
    rig.chip.deselect(0);
    assert_eq!(rig.read(V_MAX), 1);
}

#[test]
fn step_rate() {
    // R = f_CLK * v / (2^PULSE_DIV * 2048 * 32) (8.1.13.1)
    for (pulse_div, velocity, seconds, expected) in [
        (0, 2047, 2, 999_511),   // 499 755.859 Hz
        (3, 2047, 10, 624_694),  // 62 469.482 Hz
        (5, 1000, 10, 76_293),   // 7 629.395 Hz
        (13, 1, 1000, 29),       // 0.029 802 Hz
        (7, -300, 100, -57_220), // 572.205 Hz
    ] {
        let mut rig = Rig::with(HOLD, pulse_div, 0, 0);
        rig.write(V_ACTUAL, (velocity as u32) & 0xFFF);
        rig.run(seconds * SECOND);
        let position = rig.chip.position(0);
        assert!(position.abs_diff(expected) <= 1, "{position}, not {expected}");
        assert_eq!(rig.stage.position, position);
        assert_eq!(rig.chip.velocity(0), velocity);
    }
}

#[test]
fn steps_are_on_the_exact_grid() {
    // 11.0592 MHz: a tick has 2893.518 ns. v = 1024 steps every second pulse tick of 2^4 ticks: step n is at
    // tick 32 * n, 32 * 32 / 11.0592 MHz = 92.592592.. us each.
    let mut rig = Rig { chip: Tmc429::new(11_059_200), stage: Stage::default(), now: 0 };
    rig.write(IF_CONF, STEP_DIR);
    rig.write(DIVIDERS, 4 << 12);
    rig.write(MODE, NO_STOPS | HOLD);
    rig.write(V_ACTUAL, 1024);
    rig.run(100 * SECOND);
    for (n, (at, _, _)) in (1_u128..).zip(&rig.stage.steps) {
        assert_eq!(u128::from(*at), (n * 1024 * 1_000_000_000).div_ceil(11_059_200));
    }
    // 11 059 200 / 1024 = 10 800 per second.
    assert_eq!(rig.stage.steps.len(), 1_080_000);
}

#[test]
fn acceleration() {
    // dR = f^2 * A_MAX / 2^(PULSE_DIV + RAMP_DIV + 29): with 3, 7 and A_MAX = 100 it is 46 566.1 pps/s. To
    // v = 1000, i.e. 30 517.6 pps, that takes 655.36 ms and v^2 / 2a = 10 000 steps.
    let mut rig = Rig::with(VELOCITY, 3, 7, 100);
    rig.write(V_TARGET, 1000);
    rig.run(327_680 * MICROSECOND);
    assert_eq!(rig.chip.velocity(0), 500);
    assert_eq!(rig.read(A_ACTUAL), 100);
    // The pulse generator does not see the fraction, half a unit on average: 5 steps in 20 480 pulse ticks.
    // Half a ramp tick of lag makes another v * 8 / 2048, 2 steps.
    assert!(rig.chip.position(0).abs_diff(2500 - 7) <= 2);
    rig.run(327_680 * MICROSECOND - TICK);
    assert_eq!(rig.chip.velocity(0), 999);
    rig.run(TICK);
    assert_eq!(rig.chip.velocity(0), 1000);
    assert_eq!(rig.read(A_ACTUAL), 0);
    assert!(rig.chip.position(0).abs_diff(10_000 - 14) <= 2);
    // Through zero to -1000: twice as long; on the way the sign is cut towards zero, so 0 is held twice.
    rig.write(V_TARGET, 0xFFF & 1000_u32.wrapping_neg());
    rig.run(MILLISECOND);
    assert_eq!(rig.read(A_ACTUAL), 0xF9C);
    rig.run(1_310_720 * MICROSECOND - MILLISECOND);
    assert_eq!((rig.chip.velocity(0), rig.read(V_ACTUAL)), (-1000, 0xC18));
    // V_MAX is lowered in motion: it ramps down to it.
    rig.write(V_MAX, 500);
    rig.run(300 * MILLISECOND);
    assert!((-600..-500).contains(&rig.chip.velocity(0)));
    rig.run(30 * MILLISECOND);
    assert_eq!(rig.chip.velocity(0), -500);
    // A_MAX = 0 freezes the velocity (8.1.7).
    rig.write(A_MAX, 0);
    rig.write(V_TARGET, 0);
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(0), -500);
}

#[test]
fn tiny_acceleration_is_exact() {
    // A_MAX = 1 and RAMP_DIV = 0: 256 ramp ticks of 2 us for each unit of velocity.
    let mut rig = Rig::with(VELOCITY, 0, 0, 1);
    rig.write(V_TARGET, 2047);
    for unit in 1..=2047 {
        rig.run(511 * MICROSECOND);
        assert_eq!(rig.chip.velocity(0), unit - 1);
        rig.run(MICROSECOND);
        assert_eq!(rig.chip.velocity(0), unit);
    }
}

/// Pairs of (A_MAX, RAMP_DIV, PULSE_DIV) and PMUL, PDIV with p' / p = 0.99 by 8.1.10.2.2:
/// PMUL = 0.99 * A_MAX / (128 * 2^(RAMP_DIV - PULSE_DIV)) * 2^(3 + PDIV).
const GOOD: [(u32, u32, u32, u32, u32); 9] = [
    (500, 3, 2, 247, 4),
    (1000, 7, 3, 247, 6),
    (2047, 7, 3, 253, 5),
    (100, 7, 5, 198, 7),
    (1, 0, 0, 253, 12),
    (2047, 0, 0, 253, 1),
    (10, 5, 5, 158, 8),
    (300, 9, 6, 148, 6),
    (1000, 6, 6, 247, 2),
];

#[test]
fn positioning_arrives_without_overshoot() {
    for (a_max, ramp_div, pulse_div, pmul, pdiv) in GOOD {
        for distance in [1, 2, 3, 7, 50, 999, 12_345, 200_000] {
            for v_max in [30, 400, 2047] {
                let mut rig = Rig::with(RAMP, pulse_div, ramp_div, a_max);
                rig.write(V_MAX, v_max);
                rig.write(PMUL_PDIV, pmul << 8 | pdiv);
                rig.write(X_TARGET, distance);
                assert_eq!(rig.status() & 1, 0);
                let time = rig.settle();
                let case = (a_max, ramp_div, pulse_div, distance, v_max);
                assert_eq!(rig.chip.position(0), distance as i32, "{case:?}");
                assert_eq!(rig.stage.highest, distance as i32, "{case:?}");
                assert_eq!((rig.chip.velocity(0), rig.status() & 1), (0, 1), "{case:?}");
                // A trapezoid or triangle: with v in pps and a in pps/s the time is d/v + v/a, or 2 sqrt(d/a).
                let v = 16e6 * f64::from(v_max) / f64::from(65_536 << pulse_div);
                let a = 16e6 * 16e6 * f64::from(a_max) / 2_f64.powi((pulse_div + ramp_div + 29) as i32);
                let d = f64::from(distance);
                let ideal = if d > v * v / a { d / v + v / a } else { 2.0 * (d / a).sqrt() };
                let seconds = time as f64 / 1e9;
                if distance > 10 {
                    let ratio = seconds / ideal;
                    assert!((0.9..1.08).contains(&ratio), "{case:?}: {seconds} s for {ideal} s");
                }
            }
        }
    }
}

#[test]
fn braking_starts_where_p_says() {
    // A_MAX = 1000, RAMP_DIV = 7, PULSE_DIV = 3: p = 1000 / (128 * 16) = 0.488, S = 2048 / p = 4194 steps
    // from full speed, and as many with p' = 247 / 512 = 0.482: v = sqrt(2048 * 0.482 * d) < 2047 below
    // d = 2047^2 / 988 = 4241.1.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(X_TARGET, 20_000);
    while rig.chip.position(0) < 20_000 - 4242 {
        rig.run(TICK);
    }
    assert_eq!((rig.read(V_TARGET), rig.read(V_ACTUAL)), (2047, 2047));
    while rig.chip.position(0) < 20_000 - 4241 {
        rig.run(TICK);
    }
    assert_eq!(rig.read(V_TARGET), 2046);
    // At a quarter of the way half the velocity: sqrt(988 * 1060) = 1023.
    while rig.chip.position(0) < 20_000 - 1060 {
        rig.run(TICK);
    }
    assert_eq!(rig.read(V_TARGET), 1023);
    assert!(rig.chip.velocity(0).abs_diff(1023) <= 5);
}

#[test]
fn too_large_p_overshoots_and_comes_back() {
    // Twice the p of the acceleration: braking starts at half the way it needs, and v^2 at the target is
    // still half of the initial, 2047 / sqrt(2) = 1447. The way to rest is then half of S = 4194, i.e. 2097.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 5);
    rig.write(X_TARGET, 20_000);
    while rig.chip.position(0) < 20_000 {
        rig.run(10 * MICROSECOND);
    }
    assert!(rig.chip.velocity(0).abs_diff(1447) <= 20, "{}", rig.chip.velocity(0));
    rig.run(300 * MILLISECOND);
    assert!(rig.stage.highest.abs_diff(20_000 + 2097) <= 60, "{}", rig.stage.highest);
    // Each return passes the target again, with 0.7 times the velocity or so, until it is slow enough.
    let settled = rig.settle();
    assert!(settled > 100 * MILLISECOND, "{settled}");
    assert_eq!((rig.chip.position(0), rig.stage.position), (20_000, 20_000));
    let turns = rig.stage.steps.windows(2).filter(|pair| pair[0].2 != pair[1].2).count();
    assert!((4..40).contains(&turns), "{turns} turns");
}

#[test]
fn too_small_p_creeps() {
    // A sixteenth of the good p: braking takes v^2 / (2048 * p) = 2047^2 / (2048 * 0.0302) = 67 856 steps, at
    // half of 62 469 Hz on average 2.17 s; the ramp up still 2047^2 / 1000 = 4190 steps in 0.13 s; the rest of
    // the way, 127 954 steps, 2.05 s. With the good p the move would take 3.3 s.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 10);
    rig.write(X_TARGET, 200_000);
    let time = rig.settle();
    assert!(time.abs_diff(4_360 * MILLISECOND) < 100 * MILLISECOND, "{time}");
    assert_eq!(rig.stage.highest, 200_000);
}

#[test]
fn v_min_is_kept_up_to_the_target() {
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(V_MIN, 500);
    rig.write(X_TARGET, 20_000);
    while rig.chip.position(0) < 19_999 {
        rig.run(TICK);
    }
    assert_eq!(rig.chip.velocity(0), 500);
    rig.settle();
    assert_eq!((rig.stage.highest, rig.chip.velocity(0)), (20_000, 0));
}

#[test]
fn target_set_to_the_position_is_no_magic_stop() {
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(X_TARGET, 1_000_000);
    rig.run(SECOND);
    let here = rig.chip.position(0);
    rig.write(X_TARGET, here as u32);
    rig.settle();
    // S = 4194 steps to rest.
    assert!(rig.stage.highest.abs_diff(here + 4194) < 50);
    assert_eq!(rig.chip.position(0), here);
    // With A_MAX = 0 it runs through for good.
    rig.write(X_TARGET, (here + 10_000) as u32);
    rig.run(100 * MILLISECOND);
    rig.write(A_MAX, 0);
    rig.run(10 * SECOND);
    assert!(rig.chip.position(0) > here + 50_000);
}

#[test]
fn v_max_zero_holds() {
    let mut rig = Rig::with(RAMP, 0, 0, 1000);
    rig.write(V_MAX, 0);
    rig.write(X_TARGET, 1000);
    assert_eq!(rig.settle(), 0);
    assert_eq!((rig.chip.position(0), rig.status() & 1), (0, 0));
}

#[test]
fn soft_mode_decays_exponentially() {
    // v = p * d: the rest of the way halves every ln 2 * 2^PULSE_DIV * 65 536 / (f * p). PULSE_DIV = 3 and
    // p = 247 / 512 (A_MAX = 1000): 47.08 ms. From v = 500, reached at d = 1036.
    let mut rig = Rig::with(SOFT, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(V_MAX, 500);
    rig.write(X_TARGET, 5_000);
    while rig.chip.position(0) < 4_200 {
        rig.run(TICK);
    }
    for rest in [400, 200, 100, 50_i32] {
        rig.run(47_080 * MICROSECOND);
        let left = 5_000 - rig.chip.position(0);
        assert!(left.abs_diff(rest) <= 4, "{left} for {rest}");
        assert!(rig.chip.velocity(0).abs_diff(left * 247 / 512) <= 2);
    }
    rig.settle();
    assert_eq!((rig.chip.position(0), rig.stage.highest), (5_000, 5_000));
    // With V_MIN = 0 it does not get there: p * d < 1 for d = 2 (8.1.3).
    rig.write(V_MIN, 0);
    rig.write(X_TARGET, 6_000);
    rig.run(10 * SECOND);
    assert_eq!(rig.chip.position(0), 5_998);
}

#[test]
fn hold_mode_ignores_limits() {
    let mut rig = Rig::with(HOLD, 5, 5, 1);
    rig.write(V_MAX, 10);
    rig.write(V_ACTUAL, 2000);
    rig.run(SECOND);
    // 16 MHz * 2000 / (32 * 65 536) = 15 258.8
    assert_eq!((rig.chip.velocity(0), rig.chip.position(0)), (2000, 15_258));
    rig.write(V_ACTUAL, 0);
    assert_eq!((rig.chip.velocity(0), rig.chip.next_event()), (0, None));
}

#[test]
fn starts_with_a_written_velocity() {
    // 12.2, in ramp_mode.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(V_MIN, 300);
    rig.write(X_TARGET, 1000);
    rig.write(V_ACTUAL, 300);
    // 300 of 2048 each 16 us: the first step after 7 pulse ticks.
    rig.run(7 * 16 * MICROSECOND);
    assert_eq!(rig.chip.position(0), 1);
    rig.settle();
    assert_eq!(rig.stage.highest, 1000);
}

#[test]
fn positions_wrap_at_24_bits() {
    let mut rig = Rig::with(RAMP, 0, 0, 2047);
    rig.write(PMUL_PDIV, 253 << 8 | 1);
    rig.write(MODE, NO_STOPS | VELOCITY);
    rig.write(X_ACTUAL, 0x7F_FFF0);
    rig.write(X_TARGET, 0x80_0010);
    rig.write(MODE, NO_STOPS | RAMP);
    rig.settle();
    assert_eq!((rig.chip.position(0), rig.read(X_ACTUAL)), (-0x7F_FFF0, 0x80_0010));
    assert_eq!(rig.stage.position, 32);
    rig.write(X_TARGET, 0x7F_FFFF);
    rig.settle();
    assert_eq!((rig.chip.position(0), rig.stage.position), (0x7F_FFFF, 15));
    // A distance of 2^23 - 1 is the longest in the right direction.
    rig.write(X_TARGET, 0xFF_FFFE);
    rig.run(MILLISECOND);
    assert_eq!(rig.read(V_TARGET), 2047);
    rig.write(X_TARGET, 0x00_0200);
    rig.run(MILLISECOND);
    assert_eq!(rig.read(V_TARGET), 0x801);
}

/// Runs at v = 1000 (PULSE_DIV 3, RAMP_DIV 7, A_MAX 1000) to the right, with a right switch at 5000.
fn towards_a_switch(ref_conf: u32) -> Rig {
    let mut rig = Rig::with(VELOCITY, 3, 7, 1000);
    rig.write(MODE, ref_conf | VELOCITY);
    rig.write(INTERRUPTS, 0xFF00);
    rig.stage.right = Some((5000, 9000));
    rig.write(V_TARGET, 1000);
    rig
}

#[test]
fn hard_stop() {
    let mut rig = towards_a_switch(0);
    rig.run(SECOND);
    assert_eq!((rig.chip.position(0), rig.chip.velocity(0)), (5000, 0));
    // int_stop and int_stop_right_high.
    assert_eq!(rig.read(INTERRUPTS), 0xFF88);
    assert_eq!(rig.chip.next_event(), None);
    // The other direction is free, and so is the first when the switch opens.
    rig.write(V_TARGET, 0xFFF & 1000_u32.wrapping_neg());
    rig.run(10 * MILLISECOND);
    assert!(rig.chip.position(0) < 5000);
    rig.write(V_TARGET, 1000);
    rig.run(SECOND);
    assert_eq!((rig.chip.position(0), rig.chip.velocity(0)), (5000, 0));
    rig.stage.right = None;
    rig.pins();
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(0), 1000);
}

#[test]
fn hard_stop_resumes_a_positioning() {
    let mut rig = towards_a_switch(0);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(X_TARGET, 10_000);
    rig.write(MODE, RAMP);
    rig.run(SECOND);
    assert_eq!((rig.chip.position(0), rig.status() & 1), (5000, 0));
    rig.stage.right = None;
    rig.pins();
    rig.settle();
    assert_eq!((rig.chip.position(0), rig.status() & 1), (10_000, 1));
}

#[test]
fn left_switch_stops_only_to_the_left() {
    let mut rig = Rig::with(VELOCITY, 3, 7, 1000);
    rig.write(MODE, VELOCITY);
    rig.stage.left = Some((-9000, 6000));
    rig.pins();
    rig.run(TICK);
    rig.write(V_TARGET, 1000);
    rig.run(100 * MILLISECOND);
    assert_eq!(rig.chip.velocity(0), 1000);
    rig.run(300 * MILLISECOND);
    rig.write(V_TARGET, 0xFFF & 1000_u32.wrapping_neg());
    rig.run(SECOND);
    assert_eq!((rig.chip.position(0), rig.chip.velocity(0)), (6000, 0));
}

#[test]
fn soft_stop() {
    let mut rig = towards_a_switch(SOFT_STOP);
    rig.run(SECOND);
    // v^2 * 2^(RAMP_DIV - PULSE_DIV) / (16 * A_MAX) = 1000 steps of ramp.
    assert!(rig.chip.position(0).abs_diff(6000) <= 5, "{}", rig.chip.position(0));
    assert_eq!(rig.chip.velocity(0), 0);
    assert_eq!(rig.read(INTERRUPTS), 0xFF88);
}

#[test]
fn disabled_stops_do_not_stop() {
    let mut rig = towards_a_switch(0x200);
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(0), 1000);
    // int_stop_right_high and _low.
    assert_eq!(rig.read(INTERRUPTS), 0xFFA0);
}

#[test]
fn tolerance_lets_the_motor_pass_near_the_origin() {
    for (tolerance, rest) in [(0, 0), (99, 100), (200, 201)] {
        let mut rig = Rig::with(VELOCITY, 3, 7, 1000);
        rig.write(MODE, VELOCITY);
        rig.write(TOLERANCE, tolerance);
        rig.stage.left = Some((-1000, 0));
        rig.write(X_ACTUAL, 2000);
        rig.stage.position = 2000;
        rig.write(V_TARGET, 0xFFF & 500_u32.wrapping_neg());
        rig.run(SECOND);
        assert_eq!(rig.chip.position(0), -rest, "tolerance {tolerance}");
    }
}

#[test]
fn inactive_switch_inputs() {
    // en_refr = 0: right switches read inactive, whatever inv_ref says (8.2.4.5).
    let mut rig = Rig::new();
    rig.chip.set_reference_pins(0x3F);
    assert_eq!((rig.read(SWITCHES), rig.status()), (0x3F, 0x3F));
    rig.write(IF_CONF, STEP_DIR & !0x100);
    assert_eq!(rig.read(SWITCHES), 0x2A);
    rig.write(IF_CONF, STEP_DIR & !0x100 | 1);
    assert_eq!((rig.read(SWITCHES), rig.status()), (0, 0x15));
    rig.chip.set_reference_pins(0);
    assert_eq!(rig.read(SWITCHES), 0x2A);
    rig.write(IF_CONF, STEP_DIR | 1);
    assert_eq!(rig.read(SWITCHES), 0x3F);
    // mot1r: REF3 is the right switch of motor 1, motor 3 has none (9.1).
    rig.write(IF_CONF, 0x22);
    rig.write(GLOBAL, 1 << 21);
    rig.chip.set_reference_pins(0x20);
    assert_eq!(rig.read(SWITCHES), 0x01);
}

#[test]
fn latch() {
    let mut rig = towards_a_switch(NO_STOPS | RIGHT_NOT_LEFT);
    rig.stage.left = Some((2000, 2500));
    rig.write(LATCHED, 0);
    assert_eq!(rig.read(MODE) >> 16, 1);
    rig.run(250 * MILLISECOND);
    assert_eq!((rig.read(MODE) >> 16, rig.read(LATCHED)), (0, 5000));
    // The next edge is the end of the switch, at the first position beyond.
    rig.write(LATCHED, 0);
    rig.run(SECOND);
    assert_eq!((rig.read(MODE) >> 16, rig.read(LATCHED)), (0, 9001));
    // At rest nothing is latched.
    rig.write(V_TARGET, 0);
    rig.settle();
    rig.write(LATCHED, 0);
    rig.stage.right = Some((0, i32::MAX));
    rig.pins();
    rig.run(MILLISECOND);
    assert_eq!((rig.read(MODE) >> 16, rig.read(LATCHED)), (1, 9001));
}

#[test]
fn latch_with_a_stop() {
    let mut rig = towards_a_switch(RIGHT_NOT_LEFT);
    rig.write(LATCHED, 0);
    rig.run(SECOND);
    assert_eq!((rig.read(LATCHED), rig.chip.position(0)), (5000, 5000));
}

#[test]
fn interrupts() {
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(INTERRUPTS, 0x0100);
    assert!(!rig.chip.interrupt_pin());
    rig.write(X_TARGET, 100);
    rig.settle();
    assert_eq!((rig.read(INTERRUPTS), rig.status()), (0x0101, 0x95));
    assert!(rig.chip.interrupt_pin());
    // A 0 leaves the flag, a 1 clears it; the condition has to come again.
    rig.write(INTERRUPTS, 0x0100);
    assert_eq!(rig.read(INTERRUPTS), 0x0101);
    rig.write(INTERRUPTS, 0x0101);
    assert_eq!((rig.read(INTERRUPTS), rig.status()), (0x0100, 0x15));
    rig.run(SECOND);
    assert_eq!(rig.read(INTERRUPTS), 0x0100);
    // Without its mask a flag is 0.
    rig.write(X_TARGET, 0);
    rig.settle();
    assert_eq!(rig.read(INTERRUPTS), 0x0101);
    rig.write(INTERRUPTS, 0x0200);
    assert_eq!((rig.read(INTERRUPTS), rig.chip.interrupt_pin()), (0x0200, false));
}

#[test]
fn reference_interrupts() {
    let mut rig = Rig::with(VELOCITY, 3, 7, 1000);
    rig.write(TOLERANCE, 50);
    rig.write(INTERRUPTS, 0x0600);
    // The switch is closed from -40 to 40: neither wrong nor missed.
    rig.stage.left = Some((-40, 40));
    rig.write(X_ACTUAL, 0xFF_FF00);
    rig.stage.position = -256;
    rig.write(V_TARGET, 200);
    rig.run(SECOND);
    assert_eq!(rig.read(INTERRUPTS), 0x0600);
    // Closed up to 60: wrong when the position is 51.
    rig.stage.left = Some((-40, 60));
    rig.write(V_TARGET, 0xFFF & 200_u32.wrapping_neg());
    rig.run(2 * SECOND);
    assert_eq!(rig.read(INTERRUPTS), 0x0602);
    // Never closed: missed at 0.
    rig.stage.left = None;
    rig.write(INTERRUPTS, 0x0606);
    rig.write(V_TARGET, 200);
    rig.run(2 * SECOND);
    assert_eq!(rig.read(INTERRUPTS), 0x0604);
}

#[test]
fn switch_edges_interrupt() {
    let mut rig = Rig::new();
    rig.write(0x40 | INTERRUPTS, 0xF000);
    for (pins, flags) in [(0x20, 0x40), (0x30, 0x80), (0x10, 0x10), (0, 0x20)] {
        rig.chip.set_reference_pins(pins);
        assert_eq!(rig.chip.next_event(), Some(rig.now + TICK));
        rig.run(TICK);
        assert_eq!(rig.read(0x40 | INTERRUPTS), 0xF000 | flags);
        rig.write(0x40 | INTERRUPTS, 0xF0FF);
    }
    assert_eq!(rig.chip.next_event(), None);
}

#[test]
fn multiplexed_interrupt_pin() {
    let mut rig = Rig::new();
    rig.write(IF_CONF, 0x20);
    rig.write(INTERRUPTS, 0x0100);
    rig.write(X_TARGET, 5);
    rig.write(X_TARGET, 0);
    assert!(rig.chip.interrupt_pin());
    rig.chip.select(0);
    assert!(!rig.chip.interrupt_pin());
    rig.chip.deselect(0);
    rig.write(IF_CONF, 0x22);
    rig.chip.select(0);
    assert!(rig.chip.interrupt_pin());
}

#[test]
fn position_compare() {
    let mut rig = Rig::with(HOLD, 3, 7, 1000);
    assert!(rig.chip.position_compare_pin());
    rig.write(POS_COMP, 10);
    rig.write(POS_COMP_INT, 0x100);
    assert!(!rig.chip.position_compare_pin());
    rig.write(V_ACTUAL, 1024);
    // A step each 32 us.
    rig.run(10 * 32 * MICROSECOND);
    assert!(rig.chip.position_compare_pin() && rig.chip.interrupt_pin());
    rig.run(32 * MICROSECOND);
    assert!(!rig.chip.position_compare_pin());
    assert_eq!((rig.read(POS_COMP_INT), rig.status() & 0x80), (0x101, 0x80));
    rig.write(POS_COMP_INT, 0x101);
    assert_eq!((rig.read(POS_COMP_INT), rig.status() & 0x80), (0x100, 0));
    // Another motor.
    rig.write(IF_CONF, STEP_DIR | 1 << 6);
    rig.write(POS_COMP, 0);
    assert!(rig.chip.position_compare_pin());
}

#[test]
fn step_outputs() {
    // SPI mode: no pulses, but the counter runs.
    let mut rig = Rig::with(HOLD, 3, 7, 1000);
    rig.write(IF_CONF, 0);
    rig.write(V_ACTUAL, 1024);
    assert_eq!(rig.steps_in(320 * MICROSECOND), 0);
    assert_eq!(rig.chip.position(0), 10);
    // inv_dir.
    rig.write(IF_CONF, STEP_DIR | 0x10);
    assert_eq!(rig.steps_in(320 * MICROSECOND), 10);
    assert!(rig.stage.steps.iter().all(|(_, motor, up)| *motor == 0 && !up));
    // USTEP_COUNT: 64 for each full step (USRS = 0).
    assert_eq!(rig.read(USTEP), 20 * 64 % 256);
    rig.write(V_ACTUAL, 0);
    // Pulses of 16 us at v = 2047, PULSE_DIV = 1, i.e. a step each 4 us: one in four gets out.
    rig.write(MODE, NO_STOPS);
    rig.write(V_MAX, 0);
    rig.write(DIVIDERS, 0x1007);
    rig.write(MODE, NO_STOPS | HOLD);
    rig.write(GLOBAL, 0x0F00);
    rig.write(V_ACTUAL, 2047);
    let (steps, counted) = (rig.steps_in(SECOND), rig.chip.position(0) - 20);
    assert!(counted.abs_diff(249_878) <= 1);
    assert!(steps.abs_diff(249_878 / 4) < 300, "{steps}");
    // With step_half each edge is a step.
    rig.write(IF_CONF, STEP_DIR | 4);
    assert!(rig.steps_in(SECOND).abs_diff(249_878) <= 1);
}

#[test]
fn pulse_div_change_outside_ramp_mode_steps() {
    for (mode, stray) in [(HOLD, 1), (VELOCITY, 1), (RAMP, 0)] {
        let mut rig = Rig::with(HOLD, 0, 0, 0);
        rig.write(X_TARGET, 0);
        // Three quarters of a step.
        rig.write(V_ACTUAL, 512);
        rig.run(3 * TICK);
        rig.write(V_ACTUAL, 0);
        rig.write(V_MAX, 0);
        rig.write(MODE, NO_STOPS | mode);
        rig.write(DIVIDERS, 3 << 12);
        rig.run(SECOND);
        assert_eq!(rig.chip.position(0), stray);
        assert_eq!(rig.chip.next_event(), None);
    }
}

#[test]
fn power_down() {
    let mut rig = Rig::with(HOLD, 3, 7, 1000);
    rig.write(V_ACTUAL, 1024);
    rig.run(340 * MICROSECOND);
    rig.write(POWER_DOWN, 0);
    assert_eq!(rig.chip.next_event(), None);
    assert_eq!(rig.steps_in(SECOND + 7), 0);
    // nSCS_C falls: it goes on where it was, the next step 12 us later.
    assert_eq!(rig.status() & 1, 0);
    assert_eq!(rig.chip.next_event(), Some(rig.now + 12 * MICROSECOND));
    rig.run(12 * MICROSECOND);
    assert_eq!(rig.chip.position(0), 11);
}

#[test]
fn cover_datagram() {
    // SPI mode: sent at once; 36 bits for three drivers, 2 * 16 * (1 + 3 * 13 + 1) CLK = 82 us (8.2.5.3).
    let mut rig = Rig { chip: Tmc429::new(HZ), stage: Stage::default(), now: 0 };
    rig.write(GLOBAL, 0x0F02);
    rig.write(COVER, 0x123);
    assert_eq!((rig.status(), rig.read(COVER_POS)), (0x55, 0x80_0000));
    assert_eq!(rig.chip.next_event(), Some(82 * MICROSECOND));
    rig.run(82 * MICROSECOND);
    assert_eq!((rig.status(), rig.read(COVER_POS), rig.read(COVER)), (0x15, 0, 0x123));
    // A write to the words waits for a datagram, which a step needs.
    rig.write(0x60, 0);
    assert_eq!((rig.status(), rig.chip.next_event()), (0x55, None));
    rig.write(MODE, NO_STOPS | HOLD);
    rig.write(V_ACTUAL, 2047);
    rig.run(100 * MICROSECOND);
    assert_eq!(rig.status() & 0x40, 0);
    // In step/direction mode no datagram is ever sent.
    rig.write(IF_CONF, STEP_DIR);
    rig.write(COVER, 1);
    rig.run(SECOND);
    assert_eq!(rig.status() & 0x40, 0x40);
}

struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }
}

/// Three motors in different modes with bad and good parameters, registers rewritten in motion; time goes
/// on in pieces that `cut` chooses.
fn scenario(seed: u64, mut cut: impl FnMut(&mut Rig, Nanos)) -> (Vec<(Nanos, usize, bool)>, String) {
    let mut random = Random(seed);
    let mut rig = Rig::new();
    rig.stage.left = Some((-30_000, -3000));
    rig.stage.right = Some((3000, 30_000));
    for _ in 0..60 {
        for motor in 0..3 {
            let base = motor << 5;
            for register in [
                X_TARGET, V_MAX, V_TARGET, A_MAX, PMUL_PDIV, DIVIDERS, MODE, V_ACTUAL, V_MIN, INTERRUPTS, LATCHED,
                TOLERANCE,
            ] {
                if random.below(4) != 0 {
                    continue;
                }
                let data = match register {
                    X_TARGET => random.below(20_000) as u32,
                    DIVIDERS => (random.below(6) << 12 | random.below(9) << 8) as u32,
                    V_MIN => random.below(60) as u32,
                    _ => random.below(1 << 24) as u32,
                };
                rig.write(base | register, data);
            }
        }
        let span = random.below(50_000_000);
        cut(&mut rig, span);
    }
    (
        std::mem::take(&mut rig.stage.steps),
        format!(
            "{:?}",
            rig.chip.axes.map(|mut axis| {
                axis.sync(rig.chip.clock.tick_at(rig.now));
                axis
            })
        ),
    )
}

/// The same steps; shows the first difference only.
fn assert_same(seed: u64, one: &[(Nanos, usize, bool)], other: &[(Nanos, usize, bool)]) {
    let difference = one.iter().zip(other).enumerate().find(|(_, (a, b))| a != b);
    assert_eq!((one.len(), difference), (other.len(), None), "seed {seed}");
}

#[test]
fn pieces_of_time_do_not_matter() {
    for seed in 0..20 {
        let whole = scenario(seed, Rig::run);
        let mut random = Random(seed + 1000);
        let cut = scenario(seed, |rig, span| {
            let end = rig.now + span;
            while rig.now < end {
                let limit = if random.below(2) == 0 { 3_000 } else { 3_000_000 };
                let piece = (1 + random.below(limit)).min(end - rig.now);
                rig.run(piece);
            }
        });
        assert_same(seed, &whole.0, &cut.0);
        assert_eq!(whole.1, cut.1, "seed {seed}");
        assert!(whole.0.len() > 1000);
    }
}

#[test]
fn a_tick_at_a_time_is_the_same() {
    // Looking at the inputs forces each tick to be executed, so none is skipped as quiet.
    for seed in 0..5 {
        let jumping = scenario(seed, Rig::run);
        let ticking = scenario(seed, |rig, span| {
            let end = rig.now + span;
            while rig.now < end {
                let tick = rig.chip.clock.tick_at(rig.now);
                for axis in &mut rig.chip.axes {
                    axis.inputs_changed(tick);
                }
                rig.chip.reschedule();
                let step = (rig.chip.clock.time_of(tick + 1) - rig.now).min(end - rig.now);
                rig.run(step);
            }
        });
        assert_same(seed, &jumping.0, &ticking.0);
    }
}

#[test]
fn next_event_is_never_late() {
    for seed in 0..10 {
        let whole = scenario(seed, Rig::run);
        let watched = scenario(seed, |rig, span| {
            let end = rig.now + span;
            while let Some(next) = rig.chip.next_event().filter(|next| *next <= end) {
                assert!(next > rig.now);
                let seen = |rig: &mut Rig| {
                    [X_ACTUAL, V_ACTUAL, V_TARGET, INTERRUPTS, MODE, LATCHED].map(|register| rig.read(register))
                };
                let before = seen(rig);
                rig.run(next - 1 - rig.now);
                assert_eq!(before, seen(rig), "seed {seed}");
                rig.run(1);
            }
            rig.run(end - rig.now);
        });
        assert_same(seed, &whole.0, &watched.0);
    }
}

/// Switches that open and close with the steps.
struct Erratic(u8);

impl StepDir for Erratic {
    fn step(&mut self, _at: Nanos, _motor: usize, _dir_pin: bool) -> u8 {
        self.0 = self.0.wrapping_add(1);
        self.0 / 4
    }
}

#[test]
fn any_contents_are_survived() {
    // Overflow checks are on in tests.
    let mut random = Random(7);
    for hz in [1, 4_000_000, 11_059_200, 16_000_000, 32_000_000] {
        let mut rig = Rig { chip: Tmc429::new(hz), stage: Stage::default(), now: 0 };
        let mut load = Erratic(0);
        for _ in 0..4000 {
            rig.write(random.below(128) as u8 * 2, random.below(1 << 24) as u32);
            if random.below(4) == 0 {
                rig.chip.set_reference_pins(random.below(64) as u8);
            }
            assert!(rig.chip.next_event().is_none_or(|next| next > rig.now));
            let scale = random.below(24);
            rig.now += random.below(1 << scale);
            rig.chip.advance(rig.now, &mut load);
            rig.read(random.below(128) as u8 * 2);
        }
    }
}

/// Counts only.
#[derive(Default)]
struct Counter(u64);

impl StepDir for Counter {
    fn step(&mut self, _at: Nanos, _motor: usize, _dir_pin: bool) -> u8 {
        self.0 += 1;
        0
    }
}

#[test]
fn speed() {
    let measure = |what: &str, rig: &mut Rig, span: Nanos| {
        let mut load = Counter::default();
        let start = std::time::Instant::now();
        rig.now += span;
        rig.chip.advance(rig.now, &mut load);
        let spent = start.elapsed().as_secs_f64();
        println!(
            "{what}: {:.1} M steps/s, {:.0} times real time",
            load.0 as f64 / spent / 1e6,
            span as f64 / 1e9 / spent
        );
    };
    let mut rig = Rig::with(VELOCITY, 0, 0, 2047);
    rig.write(V_TARGET, 2047);
    measure("one motor, 500 kHz", &mut rig, 60 * SECOND);
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(X_TARGET, 8_000_000);
    measure("positioning, 62 kHz", &mut rig, 120 * SECOND);
    let mut rig = Rig::with(VELOCITY, 13, 13, 1);
    rig.write(V_TARGET, 2047);
    measure("slow ramp", &mut rig, 5000 * SECOND);
    measure("rest", &mut Rig::new(), 1_000_000 * SECOND);
}
