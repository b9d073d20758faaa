//! The objects that are parameters of the motor: each of them reaches the chips, when it is written and at the start.

use crate::driving::{DISABLE_VOLTAGE, PP, PV, SWITCH_ON_DISABLED};
use crate::rig::Rig;

const VALUE: u32 = 0x0609_0030;
const STATE: u32 = 0x0800_0022;

const DRVCTRL: usize = 0;
const CHOPCONF: usize = 1;
const SMARTEN: usize = 2;
const SGCSCONF: usize = 3;
const DRVCONF: usize = 4;

/// The bits of DRVCONF that change with each refresh.
const RDSEL: u32 = 0b11 << 4;

impl Rig {
    /// The registers of the driver, without what changes by itself.
    fn driver(&self) -> [u32; 5] {
        let r = self.board.borrow().tmc262(0).registers();
        [r.drvctrl, r.chopconf, r.smarten, r.sgcsconf, r.drvconf & !RDSEL]
    }

    /// The field CS of the driver, whether its bridges are on or not.
    fn current_scale(&self) -> u32 {
        self.driver()[SGCSCONF] & 0x1F
    }
}

/// Every object of the driver, the value it is set to, and the bits that must then stand in which register (bit
/// positions of the 20-bit words: AN016, table 4.1).
const FIELDS: &[(u16, i32, usize, u32, u32, u32)] = &[
    // object, value, register, lowest bit, width, field
    (0x2000, 4, DRVCTRL, 0, 4, 4),
    (0x2000, 0, DRVCTRL, 0, 4, 8),
    (0x2003, 255, SGCSCONF, 0, 5, 31),
    (0x2092, 3, CHOPCONF, 15, 2, 3),
    (0x2093, 1, CHOPCONF, 14, 1, 1),
    (0x2094, 3, CHOPCONF, 11, 2, 3),
    (0x2094, 1, CHOPCONF, 11, 2, 1),
    (0x2095, -3, CHOPCONF, 7, 4, 0),
    (0x2095, 5, CHOPCONF, 7, 4, 8),
    (0x2095, 12, CHOPCONF, 7, 4, 15),
    (0x2096, 6, CHOPCONF, 4, 3, 6),
    (0x2096, 8, CHOPCONF, 4, 3, 7),
    (0x2097, 11, CHOPCONF, 0, 4, 11),
    (0x2097, 0, CHOPCONF, 0, 4, 0),
    (0x2098, 1, SMARTEN, 15, 1, 1),
    (0x2099, 2, SMARTEN, 13, 2, 2),
    (0x209A, 13, SMARTEN, 8, 4, 13),
    (0x209B, 3, SMARTEN, 5, 2, 3),
    (0x209C, 7, SMARTEN, 0, 4, 7),
    (0x209D, 1, SGCSCONF, 16, 1, 1),
    (0x209E, -3, SGCSCONF, 8, 7, 0x7D),
    (0x209E, 63, SGCSCONF, 8, 7, 63),
    (0x20A1, 1, DRVCONF, 10, 1, 1),
];

/// The defaults are those of the objects, not of the TMCL firmware: TBL 2, HEND 3 for an end of 0, HSTRT 3, TOFF 5; no
/// filter and no threshold of stallGuard2; CS 16 for a current of 128.
#[test]
fn a_fresh_node_has_the_defaults_in_the_driver() {
    assert_eq!(Rig::new().driver(), [0x0_0000, 0x9_01B5, 0xA_0000, 0xC_0010, 0xE_F040]);
}

#[test]
fn every_object_of_the_driver_reaches_its_field_and_survives() {
    let fresh = Rig::new().driver();
    for &(object, value, register, lowest, width, field) in FIELDS {
        let mask = ((1 << width) - 1) << lowest;
        let mut expected = fresh;
        expected[register] = expected[register] & !mask | field << lowest;
        let place = format!("{object:04X}h = {value}");
        let mut rig = Rig::new();
        rig.set(object, 0, value as u32);
        rig.wait(2);
        assert_eq!(rig.driver(), expected, "{place}");
        assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
        rig.power_cycle();
        assert_eq!(rig.driver(), expected, "{place}, saved");
        rig.command(0x82);
        rig.wait(2);
        assert_eq!(rig.driver(), expected, "{place}, after a reset of communication");
        // Not saved: gone with the reset.
        rig.set(object, 0, if value == 0 { 2 } else { 0 });
        rig.wait(2);
        assert_ne!(rig.driver(), expected, "{place}");
        rig.command(0x81);
        rig.wait(20);
        assert_eq!(rig.driver(), expected, "{place}, after a reset");
        assert_eq!(rig.sign(0x1011, 1, b"load"), Ok(()));
        rig.wait(5);
        assert_eq!(rig.driver(), expected, "{place}, before the reset");
        rig.command(0x81);
        rig.wait(20);
        assert_eq!(rig.driver(), fresh, "{place}, restored");
    }
}

/// With constant off time bits 12 and 11 of CHOPCONF have another meaning.
#[test]
fn the_hysteresis_decrement_is_one_of_spread_cycle() {
    let mut rig = Rig::new();
    rig.set(0x2094, 0, 3);
    rig.set(0x2093, 0, 1);
    assert_eq!(rig.driver()[CHOPCONF] >> 11 & 0b11, 0);
    rig.set(0x2093, 0, 0);
    assert_eq!(rig.driver()[CHOPCONF] >> 11 & 0b11, 3);
}

/// The standby current (2004h) comes after the standby delay (2089h), with a delay of 0 at once.
#[test]
fn standby() {
    for saved in [false, true] {
        let mut rig = Rig::new();
        assert_eq!(rig.current_scale(), 16);
        rig.wait(1_990);
        assert_eq!(rig.current_scale(), 16);
        rig.wait(20);
        assert_eq!(rig.current_scale(), 1);
        rig.set(0x2004, 0, 80);
        rig.wait(2);
        assert_eq!(rig.current_scale(), 10);
        rig.set(0x2003, 0, 200);
        for (delay, milliseconds) in [(30, 300), (0, 0)] {
            rig.set(0x2089, 0, delay);
            if saved {
                assert_eq!(rig.sign(0x1010, 4, b"save"), Ok(()));
                rig.power_cycle();
            } else {
                rig.set(0x60FF, 0, 500);
                rig.set(0x6060, 0, PV);
                rig.set(0x2005, 0, 0b11);
                rig.enable();
                rig.wait(100);
                assert_eq!(rig.current_scale(), 25);
                rig.word(DISABLE_VOLTAGE);
                rig.wait(5);
                assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
            }
            if milliseconds != 0 {
                rig.wait(milliseconds - 20);
                assert_eq!(rig.current_scale(), 25, "{delay}, saved: {saved}");
            }
            rig.wait(30);
            assert_eq!(rig.current_scale(), 10, "{delay}, saved: {saved}");
        }
    }
}

/// Below the speed of 20A5h the motor has the current of 20A6h and no coolStep; from there on that of 2003h.
#[test]
fn the_current_below_the_threshold_speed() {
    for saved in [false, true] {
        let mut rig = Rig::operational();
        for (object, value) in [(0x2005, 0b11), (0x20A5, 500), (0x20A6, 40), (0x209C, 7)] {
            rig.set(object, 0, value);
        }
        if saved {
            assert_eq!(rig.sign(0x1010, 4, b"save"), Ok(()));
            rig.power_cycle();
            rig.command(1);
        }
        rig.set(0x6060, 0, PV);
        rig.enable();
        for (speed, scale, cool_step) in [(400, 5, 0), (600, 16, 7), (499, 5, 0), (500, 16, 7)] {
            rig.set(0x60FF, 0, speed);
            rig.wait(200);
            assert_eq!((rig.current_scale(), rig.driver()[SMARTEN] & 0xF), (scale, cool_step), "{speed}");
        }
    }
}

/// A stall stops the motor above the speed of 20A4h, which 0 switches off.
#[test]
fn stop_on_stall() {
    for (object, stops) in [(0, false), (1200, false), (900, true), (1, true)] {
        let mut rig = Rig::enabled(PV);
        rig.set(0x209E, 0, 1);
        rig.set(0x20A4, 0, object);
        rig.set(0x60FF, 0, 1000);
        rig.wait(1_000);
        assert_eq!(rig.read(0x606C, 0), 1000);
        rig.control("load 1");
        rig.wait(1_000);
        assert_eq!(rig.board.borrow().tmc429(0).velocity(0) == 0, stops, "20A4h = {object}");
    }
}

/// In internal units the divisors are 2085h and 2086h. A step of one of them halves accelerations, or velocities and
/// accelerations.
#[test]
fn the_divisors_of_internal_units() {
    for (ramp, pulse) in [(7, 3), (8, 3), (7, 4), (12, 2), (13, 13), (5, 0)] {
        for saved in [false, true] {
            let mut rig = Rig::operational();
            rig.set(0x2005, 0, 0b11);
            rig.set(0x2085, 0, ramp);
            rig.set(0x2086, 0, pulse);
            if saved {
                assert_eq!(rig.sign(0x1010, 4, b"save"), Ok(()));
                rig.power_cycle();
                rig.command(1);
            }
            rig.set(0x6060, 0, PV);
            rig.set(0x6083, 0, 2047);
            rig.set(0x60FF, 0, 500);
            rig.enable();
            rig.wait(3_000);
            let from = rig.rotor();
            rig.wait(1_000);
            let expected = 500.0 * 16e6 / f64::from(1_u32 << (16 + pulse));
            let way = (rig.rotor() - from) as f64;
            assert!((way - expected).abs() <= 1.0 + expected / 100.0, "{ramp}, {pulse}: {way}, {expected}");
        }
    }
}

/// Divisors with which the motion controller can go to no position are refused, whatever the unit.
#[test]
fn divisors_that_do_not_go_together() {
    for unit in [0, 164, 181] {
        let mut rig = Rig::new();
        rig.set(0x208C, 0, unit);
        rig.set(0x2086, 0, 0);
        assert_eq!(rig.write(0x2085, 0, 13), Err(VALUE));
        rig.set(0x2085, 0, 0);
        assert_eq!(rig.write(0x2086, 0, 13), Err(VALUE));
        assert_eq!((rig.read(0x2085, 0), rig.read(0x2086, 0)), (0, 0));
        rig.set(0x2086, 0, 12);
    }
}

/// Objects that the divisors depend on change in SWITCH ON DISABLED only. The divisors of rpm depend on the microsteps
/// in a turn, too.
#[test]
fn what_changes_divisors_is_refused_outside_switch_on_disabled() {
    for (unit, largest) in [(0, 2047), (164, 100), (181, 100_000)] {
        let mut rig = Rig::operational();
        rig.set(0x2005, 0, 0b11);
        rig.set(0x208C, 0, unit);
        rig.set(0x2087, 0, largest);
        rig.set(0x6060, 0, PP);
        rig.enable();
        let of_turns = if unit == 164 { Err(STATE) } else { Ok(()) };
        for (object, value, expected) in [
            (0x2085, 5, Err(STATE)),
            (0x2086, 5, Err(STATE)),
            (0x2087, largest, Err(STATE)),
            (0x2088, 2047, Err(STATE)),
            (0x208C, unit, Err(STATE)),
            (0x2000, 4, of_turns),
            (0x2001, 400, of_turns),
        ] {
            let before = rig.read(object, 0);
            assert_eq!(rig.write(object, 0, value), expected, "{object:04X}h in unit {unit}");
            assert_eq!(rig.read(object, 0), if expected.is_ok() { value } else { before });
        }
        rig.word(DISABLE_VOLTAGE);
        rig.wait(5);
        for (object, value) in [(0x2085, 5), (0x2087, largest), (0x208C, unit), (0x2000, 4), (0x2001, 400)] {
            rig.set(object, 0, value);
        }
        assert_eq!(rig.read(0x2107, 0), 4);
    }
}

/// 2101h is the load value of the driver, which falls with the load.
#[test]
fn the_load_is_shown() {
    let mut rig = Rig::enabled(PV);
    rig.set(0x209E, 0, 1);
    rig.set(0x60FF, 0, 1000);
    rig.wait(1_000);
    let free = rig.read(0x2101, 0);
    rig.control("load 0.5");
    rig.wait(500);
    let loaded = rig.read(0x2101, 0);
    assert!(loaded < free && free <= 1023, "{loaded}, {free}");
}

/// 2102h has the driver's flags, each in its bit, with which a fault shows while the motor turns. A driver that is too
/// hot has the pre-warning as well.
#[test]
fn the_errors_of_the_driver_are_shown() {
    for (fault, flags) in [("short-a", 1), ("short-b", 2), ("open-a", 4), ("open-b", 8), ("overtemperature", 0xC0)] {
        let mut rig = Rig::enabled(PV);
        rig.set(0x60FF, 0, 300);
        rig.wait(200);
        assert_eq!(rig.read(0x2102, 0), 0);
        rig.control(&format!("fault {fault} on"));
        let shown = (0..200).any(|_| {
            rig.wait(1);
            rig.read(0x2102, 0) == flags
        });
        assert!(shown, "{fault}: {:02X}h", rig.read(0x2102, 0));
    }
}
