//! Velocities and accelerations in the three units of 208Ch, measured at the rotor.
//!
//! Expected is what the objects say in their unit, and for internal units what the datasheet's formulas say; measured
//! is the way of the rotor over time. The two agree within 1 % or half a step of the motion controller, whichever is
//! more.

use crate::driving::{DISABLE_VOLTAGE, ENABLE, PP, PV, START, SWITCH_ON_DISABLED, VL};
use crate::rig::Rig;

const INTERNAL: u32 = 0;
const RPM: u32 = 164;
const PPS: u32 = 181;

/// A motor, the unit, and what is set in it.
#[derive(Clone, Copy, Debug)]
struct Case {
    unit: u32,
    /// Full steps in a turn, and the microsteps of one as a power of two.
    motor: (u32, u32),
    /// 2087h and 2088h.
    largest: (u32, u32),
    velocity: u32,
    acceleration: u32,
}

const CASES: [Case; 12] = [
    case(INTERNAL, (200, 8), (2047, 2047), 1000, 200),
    case(INTERNAL, (200, 8), (2047, 2047), 2047, 77),
    case(INTERNAL, (400, 6), (2047, 2047), 333, 100),
    case(RPM, (200, 8), (120, 120), 90, 60),
    case(RPM, (200, 8), (120, 120), 120, 25),
    case(RPM, (200, 8), (585, 1000), 35, 1000),
    case(RPM, (400, 6), (60, 200), 59, 50),
    case(RPM, (48, 4), (200, 1000), 177, 100),
    case(PPS, (200, 8), (100_000, 100_000), 30_000, 50_000),
    case(PPS, (200, 8), (32_000, 20_000), 32_000, 20_000),
    case(PPS, (200, 8), (5_000, 5_000), 4_321, 2_345),
    case(PPS, (200, 5), (10_000, 100_000), 7_777, 9_999),
];

const fn case(unit: u32, motor: (u32, u32), largest: (u32, u32), velocity: u32, acceleration: u32) -> Case {
    Case { unit, motor, largest, velocity, acceleration }
}

impl Case {
    /// Microsteps a second in a velocity of 1.
    fn velocity_unit(&self, (_, pulse): (u32, u32)) -> f64 {
        match self.unit {
            INTERNAL => 16e6 / f64::from(1_u32 << (16 + pulse)),
            RPM => f64::from(self.motor.0 << self.motor.1) / 60.0,
            _ => 1.0,
        }
    }

    /// Microsteps a second a second in an acceleration of 1.
    fn acceleration_unit(&self, divisors: (u32, u32)) -> f64 {
        if self.unit == INTERNAL { acceleration_step(divisors) } else { self.velocity_unit(divisors) }
    }

    /// RAMP_DIV and PULSE_DIV: those of the defaults in internal units; otherwise the largest with which the largest
    /// values can be reached, but not 13 apart.
    fn divisors(&self) -> (u32, u32) {
        if self.unit == INTERNAL {
            return (7, 3);
        }
        let (velocity, acceleration) = (f64::from(self.largest.0), f64::from(self.largest.1));
        let unit = self.velocity_unit((0, 0));
        let pulse = (0..=13).rev().find(|pulse| velocity * unit <= 2047.0 * velocity_step((0, *pulse))).unwrap();
        let fits = |ramp: &u32| acceleration * unit <= 2047.0 * acceleration_step((*ramp, pulse));
        ((0..=13).rev().filter(|ramp: &u32| ramp.abs_diff(pulse) < 13).find(fits).unwrap(), pulse)
    }

    /// An operational node with this motor, in SWITCH ON DISABLED and this mode.
    fn rig(&self, mode: u32) -> Rig {
        let mut rig = Rig::operational();
        for (object, value) in
            [(0x2005, 0b11), (0x2001, self.motor.0), (0x2000, self.motor.1), (0x208C, self.unit), (0x6060, mode)]
        {
            rig.set(object, 0, value);
        }
        rig.set(0x2087, 0, self.largest.0);
        rig.set(0x2088, 0, self.largest.1);
        let (object, sub) = if mode == VL { (0x6048, 1) } else { (0x6083, 0) };
        rig.set(object, sub, self.acceleration);
        rig
    }

    /// Microsteps of the motor in which the rotor stands.
    fn position(&self, rig: &Rig) -> f64 {
        rig.rotor() as f64 / f64::from(256 >> self.motor.1)
    }

    /// The way in milliseconds.
    fn way(&self, rig: &mut Rig, milliseconds: u64) -> f64 {
        let from = self.position(rig);
        rig.wait(milliseconds);
        self.position(rig) - from
    }
}

/// An internal velocity of 1 in microsteps a second.
fn velocity_step((_, pulse): (u32, u32)) -> f64 {
    16e6 / f64::from(1_u32 << (16 + pulse))
}

/// An internal acceleration of 1 in microsteps a second a second.
fn acceleration_step((ramp, pulse): (u32, u32)) -> f64 {
    16e6 * 16e6 / 2_f64.powi((ramp + pulse + 29) as i32)
}

/// Asserts that two values agree within 1 %, half a step of the motion controller, or what can be measured.
fn agree(measured: f64, expected: f64, step: f64, resolution: f64, place: &str) {
    let bound = (expected.abs() / 100.0).max(step / 2.0) + resolution;
    assert!((measured - expected).abs() <= bound, "{place}: {measured} measured, {expected} expected, +-{bound}");
}

/// Sets the motor going: in a profile position mode to a distant target.
fn go(rig: &mut Rig, mode: u32, velocity: i32) {
    match mode {
        VL => rig.set(0x6042, 0, velocity as u32 & 0xFFFF),
        PV => rig.set(0x60FF, 0, velocity as u32),
        _ => {
            rig.set(0x6081, 0, velocity.unsigned_abs());
            rig.set(0x607A, 0, (velocity.signum() * 1_000_000_000) as u32);
            rig.word(START);
            rig.word(ENABLE);
        }
    }
}

#[test]
fn velocities_and_ramps_are_as_the_objects_say() {
    for case in CASES {
        let divisors = case.divisors();
        for (mode, direction) in [(PP, 1), (PP, -1), (VL, 1), (VL, -1), (PV, 1), (PV, -1)] {
            let place = format!("{case:?}, mode {mode}, direction {direction}");
            let mut rig = case.rig(mode);
            rig.enable();
            let velocity = f64::from(case.velocity) * case.velocity_unit(divisors) * f64::from(direction);
            let acceleration = f64::from(case.acceleration) * case.acceleration_unit(divisors) * f64::from(direction);
            // Two windows of a third of the ramp each, the first of which begins after a tenth of it.
            let ramp = (velocity / acceleration * 1000.0) as u64;
            go(&mut rig, mode, direction * case.velocity as i32);
            let slope = |rig: &mut Rig, expected: f64| {
                rig.wait(ramp / 10);
                let third = ramp / 3;
                let [first, second] = [(); 2].map(|()| case.way(rig, third));
                let square = (third as f64 / 1000.0).powi(2);
                let measured = (second - first) / square;
                agree(measured, expected, acceleration_step(divisors), 3.0 / square, &format!("{place}, ramp"));
                rig.wait(ramp / 2 + 50);
            };
            slope(&mut rig, acceleration);
            let measured = case.way(&mut rig, 2_000) / 2.0;
            agree(measured, velocity, velocity_step(divisors), 1.0, &place);
            // What is read is what the motor does, to half a unit.
            let read = f64::from(rig.signed(0x606C)) * case.velocity_unit(divisors);
            agree(read, measured, case.velocity_unit(divisors), 1.0, &format!("{place}, 606Ch"));
            let short = rig.signed(0x606C).clamp(-32_768, 32_767);
            assert_eq!(rig.read(0x6044, 0) as u16, short as u16, "{place}");
            if mode != PP {
                go(&mut rig, mode, 0);
                slope(&mut rig, -acceleration);
                assert_eq!(case.way(&mut rig, 100), 0.0, "{place}");
            }
        }
    }
}

/// More than 2087h works as 2087h.
#[test]
fn velocities_beyond_the_largest_work_as_that() {
    for (unit, largest, steepest, expected) in [(PPS, 20_000, 50_000, 20_000.0), (RPM, 30, 50, 25_600.0)] {
        let case = case(unit, (200, 8), (largest, steepest), largest, steepest);
        for mode in [PP, PV] {
            for velocity in [largest as i32, largest as i32 + 1, i32::MAX] {
                let mut rig = case.rig(mode);
                rig.enable();
                go(&mut rig, mode, velocity);
                rig.wait(2_000);
                agree(case.way(&mut rig, 1_000), expected, velocity_step(case.divisors()), 1.0, &format!("{velocity}"));
            }
        }
        let mut rig = case.rig(VL);
        assert_eq!((rig.read(0x6046, 1), rig.read(0x6046, 2)), (0, largest));
    }
}

/// In internal units 6042h has its limits, in others its 16 bits; 6043h shows the last one, 6044h what fits 16 bits.
#[test]
fn velocities_of_sixteen_bits() {
    let mut rig = Rig::operational();
    for (unit, value, expected) in [
        (INTERNAL, 2047, Ok(())),
        (INTERNAL, 2048, Err(0x0609_0031)),
        (INTERNAL, -2047, Ok(())),
        (INTERNAL, -2048, Err(0x0609_0032)),
        (PPS, 32_767, Ok(())),
        (PPS, -32_768, Ok(())),
        (RPM, 32_767, Ok(())),
    ] {
        rig.set(0x208C, 0, unit);
        let before = rig.read(0x6043, 0);
        assert_eq!(rig.write(0x6042, 0, value as u32 & 0xFFFF), expected, "{value} in unit {unit}");
        let shown = if expected.is_ok() { value as u32 & 0xFFFF } else { before };
        assert_eq!(rig.read(0x6043, 0) & 0xFFFF, shown);
    }
    for direction in [1, -1] {
        let mut rig = case(PPS, (200, 8), (100_000, 1_000_000), 1, 1_000_000).rig(PV);
        rig.enable();
        go(&mut rig, PV, 90_000 * direction);
        rig.wait(1_000);
        assert_eq!(rig.read(0x6044, 0) as u16 as i16, if direction > 0 { i16::MAX } else { i16::MIN });
    }
}

/// A change of the unit, and of what divisors depend on, makes no step and does not set the motor going.
#[test]
fn a_change_of_the_unit_makes_no_step() {
    for milliseconds in [103, 211, 307, 401, 503] {
        let mut rig = Rig::enabled(PV);
        rig.set(0x60FF, 0, 300);
        rig.wait(milliseconds);
        rig.word(DISABLE_VOLTAGE);
        rig.wait(50);
        assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
        rig.set(0x60FF, 0, 0);
        let (rotor, position) = (rig.rotor(), rig.signed(0x6064));
        assert_ne!(position, 0);
        let changes = [(0x208C, PPS), (0x2087, 500), (0x2087, 100_000), (0x2088, 500), (0x208C, RPM), (0x2087, 3)];
        for (object, value) in changes.into_iter().chain([(0x2001, 400), (0x2000, 8), (0x208C, 0), (0x2086, 9)]) {
            rig.set(object, 0, value);
            rig.wait(10);
            assert_eq!((rig.rotor(), rig.signed(0x6064)), (rotor, position), "{object:04X}h = {value}");
        }
        rig.enable();
        rig.wait(100);
        assert_eq!((rig.rotor(), rig.signed(0x6064)), (rotor, position));
    }
}

/// 20A5h and 20A4h follow the unit: 40000 are 40000 pps, and more than each rpm and each internal velocity.
#[test]
fn thresholds_follow_the_unit() {
    for saved in [false, true] {
        for (unit, largest, slow, fast) in [(PPS, 100_000, 39_000, Some(41_000)), (RPM, 100, 100, None)] {
            let mut rig = Rig::operational();
            for (object, value) in [(0x2005, 0b11), (0x20A5, 40_000), (0x20A6, 40), (0x208C, unit), (0x2087, largest)] {
                rig.set(object, 0, value);
            }
            rig.set(0x2088, 0, largest);
            rig.set(0x6083, 0, largest);
            if saved {
                assert_eq!(rig.sign(0x1010, 4, b"save"), Ok(()));
                rig.power_cycle();
                rig.command(1);
            }
            rig.set(0x6060, 0, PV);
            rig.enable();
            let scale = |rig: &Rig| rig.board.borrow().tmc262(0).registers().sgcsconf & 0x1F;
            rig.set(0x60FF, 0, slow);
            rig.wait(1_500);
            assert_eq!(scale(&rig), 5, "{unit}, saved: {saved}");
            if let Some(fast) = fast {
                rig.set(0x60FF, 0, fast);
                rig.wait(1_000);
                assert_eq!(scale(&rig), 16, "{unit}, saved: {saved}");
            }
        }
    }
}

/// 2087h and 2088h are the largest values of a new unit, and no more than these.
#[test]
fn the_largest_values_of_a_unit() {
    let mut rig = Rig::new();
    for (unit, dimension, velocity, acceleration) in
        [(PPS, 179, 499_755, 976_085_662), (RPM, 177, 585, 1_143_850), (INTERNAL, 0, 2047, 2047)]
    {
        rig.set(0x208C, 0, unit);
        assert_eq!(rig.read(0x208E, 0), dimension);
        assert_eq!((rig.read(0x2087, 0), rig.read(0x2088, 0)), (velocity, acceleration));
        assert_eq!(rig.read(0x6046, 2), velocity);
        assert_eq!(rig.write(0x2087, 0, velocity + 1), Err(if unit == INTERNAL { 0x0609_0030 } else { 0x0609_0031 }));
    }
}

/// In profile position mode the motion controller can only brake from accelerations that PULSE_DIV allows. These are
/// from (16 MHz)^2 / 2^(31 + 2 * PULSE_DIV) on. With PULSE_DIV 2 that is 7451 microsteps a second a second, to which
/// smaller ones are raised. With a lower 2087h the least acceleration is lower: with PULSE_DIV 4 it is 466.
#[test]
fn the_least_acceleration_of_positioning() {
    for (largest, velocity, acceleration, expected) in
        [(100_000, 30_000, 1_000, 7_451.0), (30_000, 15_000, 1_000, 1_000.0), (30_000, 15_000, 100, 465.7)]
    {
        let case = case(PPS, (200, 8), (largest, 20_000), velocity, acceleration);
        let mut rig = case.rig(PP);
        rig.enable();
        go(&mut rig, PP, velocity as i32);
        rig.wait(200);
        let [first, second] = [(); 2].map(|()| case.way(&mut rig, 1_500));
        let measured = (second - first) / 1.5_f64.powi(2);
        // What is raised is 1 / 0.988 of that, for the rounding of the braking parameter, and the step above.
        let (above, step) =
            if expected > f64::from(acceleration) { (0.0125, acceleration_step(case.divisors())) } else { (0.01, 0.0) };
        let bound = expected * above + step;
        assert!((measured - expected).abs() <= bound, "{acceleration} below {largest}: {measured}");
    }
}

/// A value that a silent motion controller does not take changes nothing. The object that was written stays as it was,
/// and so do those that follow from it, and the unit in which speeds are told.
#[test]
fn a_unit_that_the_motion_controller_does_not_take_stays_as_it_was() {
    const SCALE: [u16; 5] = [0x2085, 0x2086, 0x2087, 0x2088, 0x208C];
    for (unit, object, value) in [
        (INTERNAL, 0x2085, 5),
        (INTERNAL, 0x2086, 5),
        (INTERNAL, 0x208C, PPS),
        (INTERNAL, 0x208C, RPM),
        (PPS, 0x2087, 9),
        (PPS, 0x208C, INTERNAL),
    ] {
        let mut rig = Rig::operational();
        rig.set(0x208C, 0, unit);
        rig.wait(5);
        let scale = |rig: &mut Rig| SCALE.map(|object| rig.read(object, 0));
        let before = scale(&mut rig);
        rig.control("fault tmc429 on");
        assert_eq!(rig.write(object, 0, value), Err(0x0606_0000), "{object:X}h");
        assert_eq!(scale(&mut rig), before, "{object:X}h");
        rig.control("fault tmc429 off");
        rig.wait(5);
        let largest = before[2];
        assert!(rig.write(0x2087, 0, largest + 1).is_err() && rig.write(0x2087, 0, largest).is_ok(), "{object:X}h");
        assert_eq!((rig.write(object, 0, value), rig.read(object, 0)), (Ok(()), value));
    }
}
