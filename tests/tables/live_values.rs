//! Parameters that show what the module does: positions, speeds, switches, currents, loads, flags and encoders.

use common::{Bench, INVALID_VALUE};
use hal_sim::clock::{MILLISECOND, SECOND};

/// Parameter 0 is a move, 8 tells that it has ended, 1 where the motor is.
#[test]
fn target_position_and_position_reached() {
    let mut bench = Bench::new();
    assert_eq!(bench.ok("GAP 8, 0"), 1);
    bench.ok("SAP 0, 0, 20000");
    assert_eq!((bench.ok("GAP 0, 0"), bench.ok("GAP 8, 0")), (20_000, 0));
    bench.run(SECOND / 2);
    let (before, position) = (bench.rotor(), bench.ok("GAP 1, 0"));
    assert!((before..=bench.rotor()).contains(&position.into()));
    bench.run_until(3 * SECOND, |b| b.ok("GAP 8, 0") == 1);
    assert_eq!((bench.ok("GAP 1, 0"), bench.rotor()), (20_000, 20_000));
}

/// Writing parameter 1 moves nothing: the target follows.
#[test]
fn actual_position_can_be_overwritten() {
    let mut bench = Bench::new();
    for position in [12_345, -1, 1 << 23, i32::MIN, i32::MAX, 0] {
        bench.ok(&format!("SAP 1, 0, {position}"));
        bench.run(20 * MILLISECOND);
        for (parameter, value) in [(1, position), (0, position), (8, 1), (3, 0)] {
            assert_eq!(bench.ok(&format!("GAP {parameter}, 0")), value, "{parameter} at {position}");
        }
        assert_eq!(bench.rotor(), 0);
    }
}

/// Parameter 2 rotates like ROR and ROL in velocity mode, 3 is the speed the motor has; 138 follows.
#[test]
fn target_speed_actual_speed_and_ramp_mode() {
    let mut bench = Bench::new();
    bench.ok("MST 0");
    for speed in [700, -2047, 0, 2047] {
        bench.ok(&format!("SAP 2, 0, {speed}"));
        assert_eq!((bench.ok("GAP 2, 0"), bench.ok("GAP 138, 0")), (speed, 2));
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 3, 0"), speed);
    }
    for (line, mode) in [("MVP REL, 0, 10", 0), ("ROL 0, 5", 2), ("MVP ABS, 0, 0", 0), ("MST 0", 2)] {
        bench.ok(line);
        assert_eq!(bench.ok("GAP 138, 0"), mode, "{line}");
    }
    // Soft mode stays through a positioning move.
    bench.ok("MVP ABS, 0, 100");
    bench.run_until(3 * SECOND, |b| b.ok("GAP 8, 0") == 1);
    bench.ok("SAP 138, 0, 1");
    bench.ok("MVP ABS, 0, 200");
    assert_eq!(bench.ok("GAP 138, 0"), 1);
}

/// In a positioning mode parameter 2 is checked and echoed, and that is all: nothing ends.
#[test]
fn target_speed_has_no_effect_while_positioning() {
    for mode in [0, 1] {
        let mut bench = Bench::new();
        bench.ok(&format!("SAP 138, 0, {mode}"));
        bench.ok("MVP ABS, 0, 40000");
        bench.run(SECOND / 4);
        bench.refused("SAP 2, 0, 2048", INVALID_VALUE);
        for speed in [0, 500, -2047] {
            assert_eq!(bench.ok(&format!("SAP 2, 0, {speed}")), speed);
        }
        assert_eq!(bench.ok("GAP 138, 0"), mode);
        bench.run_until(20 * SECOND, |b| b.ok("GAP 8, 0") == 1);
        assert_eq!((bench.rotor(), bench.ok("GAP 2, 0"), bench.ok("GAP 138, 0")), (40_000, 0, mode));
    }
}

/// Parameters 9, 10 and 11: parameter 79 turns the end switches round, and leaves the home switch as it is.
#[test]
fn switches() {
    const SWITCHES: [(&str, u8); 3] = [("home", 9), ("right", 10), ("left", 11)];
    for polarity in [0, 1] {
        let mut bench = Bench::new();
        bench.ok(&format!("SGP 79, 0, {polarity}"));
        for (pressed, _) in SWITCHES {
            bench.control(&format!("press {pressed}"));
            bench.run(5 * MILLISECOND);
            for (name, parameter) in SWITCHES {
                let turned = if name == "home" { 0 } else { polarity };
                let expected = i32::from(name == pressed) ^ turned;
                assert_eq!(bench.ok(&format!("GAP {parameter}, 0")), expected, "{name} with {pressed} pressed");
            }
            bench.control(&format!("release {pressed}"));
        }
    }
}

/// Parameter 135 is the acceleration while the speed changes, and zero at a steady one.
#[test]
fn actual_acceleration() {
    let mut bench = Bench::new();
    bench.ok("SAP 5, 0, 200");
    assert_eq!(bench.ok("GAP 135, 0"), 0);
    for line in ["ROR 0, 1500", "ROL 0, 1500"] {
        bench.ok(line);
        bench.run(SECOND / 5);
        assert!((150..=200).contains(&bench.ok("GAP 135, 0")), "{line}: {}", bench.ok("GAP 135, 0"));
        bench.run(2 * SECOND);
        assert_eq!(bench.ok("GAP 135, 0"), 0);
    }
}

/// Parameter 180 is the driver's current scale: parameter 6 or 7 divided by 8.
#[test]
fn smart_energy_actual_current() {
    let mut bench = Bench::new();
    for line in ["SAP 6, 0, 200", "SAP 7, 0, 80", "SAP 214, 0, 10", "ROR 0, 100"] {
        bench.ok(line);
    }
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 180, 0"), 25);
    bench.ok("MST 0");
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 180, 0"), 10);
}

/// Parameter 206 falls as the load grows.
#[test]
fn actual_load_value() {
    let mut bench = Bench::new();
    bench.ok("SAP 174, 0, 12");
    bench.ok("ROR 0, 1000");
    let mut readings = ["load 0", "load 0.3", "load 0.6"].map(|load| {
        bench.control(load);
        bench.run(SECOND);
        bench.ok("GAP 206, 0")
    });
    assert!(readings.is_sorted_by(|a, b| a > b), "{readings:?}");
    readings.sort_unstable();
    assert!(readings[0] >= 0 && readings[2] <= 1023);
}

/// Parameter 208: one bit a fault, and one for standstill.
#[test]
fn driver_error_flags() {
    const STANDSTILL: i32 = 1 << 7;
    for (fault, bits) in [
        ("overtemperature", 1 << 1 | 1 << 2),
        ("short-a", 1 << 3),
        ("short-b", 1 << 4),
        ("open-a", 1 << 5),
        ("open-b", 1 << 6),
    ] {
        let mut bench = Bench::new();
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 208, 0") & !1, STANDSTILL);
        bench.ok("ROR 0, 500");
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 208, 0") & !1, 0);
        bench.control(&format!("fault {fault} on"));
        bench.run(SECOND / 10);
        assert_eq!(bench.ok("GAP 208, 0") & 0b0111_1110, bits, "{fault}");
    }
}

/// Parameters 209 and 215: the built-in encoder, 1024 counts and with the default prescaler 51 200
/// microsteps a turn.
#[test]
fn built_in_encoder() {
    let mut bench = Bench::new();
    for (target, angle) in [(12_800, 256), (51_200 + 25_600, 512), (-12_800, 768)] {
        bench.ok(&format!("MVP ABS, 0, {target}"));
        bench.run_until(5 * SECOND, |b| b.ok("GAP 8, 0") == 1);
        bench.run(100 * MILLISECOND);
        assert_eq!((bench.ok("GAP 209, 0"), bench.ok("GAP 215, 0")), (target, angle));
    }
    bench.ok("SAP 209, 0, 1000000");
    assert_eq!((bench.ok("GAP 209, 0"), bench.ok("GAP 1, 0")), (1_000_000, -12_800));
    bench.ok("MVP REL, 0, 12800");
    bench.run(3 * SECOND);
    assert_eq!(bench.ok("GAP 209, 0"), 1_012_800);
}

/// Parameter 216: an ABN encoder of 1000 lines counts 4000 a turn; 6 553.6/512 microsteps a count.
#[test]
fn external_encoder() {
    let mut bench = Bench::in_world("[abn]\nlines = 1000\n");
    bench.ok("SAP 217, 0, 5120");
    bench.ok("MVP ABS, 0, 102400");
    bench.run(6 * SECOND);
    assert_eq!(bench.ok("GAP 216, 0"), 2 * 4000 * 10);
    bench.ok("SAP 216, 0, -5");
    assert_eq!(bench.ok("GAP 216, 0"), -5);
    bench.ok("MVP ABS, 0, 51200");
    bench.run(6 * SECOND);
    assert_eq!(bench.ok("GAP 216, 0"), -5 - 4000 * 10);
}

/// Parameters 210 (bit 2) and 217 (bits 2..4): function bits read back and do not scale.
#[test]
fn prescalers_carry_function_bits() {
    let mut bench = Bench::in_world("[abn]\nlines = 1024\nindex = -20000\n");
    let half = [(210, 25_600 | 4, 209, 25_600), (217, 512 | 16, 216, 2048)];
    for (parameter, value, _, _) in half {
        bench.ok(&format!("SAP {parameter}, 0, {value}"));
        assert_eq!(bench.ok(&format!("GAP {parameter}, 0")), value);
    }
    bench.ok("MVP ABS, 0, 25600");
    bench.run(4 * SECOND);
    for (_, _, position, expected) in half {
        assert_eq!(bench.ok(&format!("GAP {position}, 0")), expected, "parameter {position}");
    }
}
