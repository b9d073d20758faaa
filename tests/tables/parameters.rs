//! Parameters through telegrams: what every row of the tables promises, and what single parameters do.

use crate::common::table::{AXIS, GLOBAL, INTERRUPT, Table};
use crate::common::{Bench, INVALID_VALUE, OK, WRONG_TYPE};
use hal_sim::board::{Board, Chip, SharedBoard};
use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcm::chip::tmc429::Tmc429;
use tmcm::module::{Source, TMCM_1140};
use tmcm::motion::Axis;
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::param::{AxisParameter, Interrupt, Row};
use tmcm::tmcl::Command;

const TABLES: [Table; 3] = [AXIS, GLOBAL, INTERRUPT];

/// Parameters whose value is not simply what was written: the target speed, which counts in velocity mode alone, and in
/// bank 0 tick timer, random number, and the one that silences the reply to its own test. Each has a test of its own.
const PECULIAR: [u8; 4] = [2, 132, 133, 255];

#[test]
fn the_firmware_has_the_rows_of_the_manual() {
    fn check(expected: &Table, got: &[(u8, String, &Row)]) {
        assert_eq!(
            got.iter().map(|(number, ..)| *number).collect::<Vec<_>>(),
            expected.rows.iter().map(|row| row.number).collect::<Vec<_>>()
        );
        for (expected, (_, name, got)) in expected.rows.iter().zip(got) {
            assert_eq!(name, expected.name);
            assert_eq!(got.ranges, expected.ranges, "{}", got.name);
            assert_eq!(got.writable(), expected.is_writable(), "{}", got.name);
            assert_eq!(got.stored(), expected.is_stored(), "{}", got.name);
            assert!(expected.default().is_none_or(|default| got.default == default), "{}", got.name);
        }
    }
    let named = |row: &'static Row| (row.number, row.name.to_string(), row);
    check(&AXIS, &TMCM_1140.axis.rows.iter().map(|p| named(&p.row)).collect::<Vec<_>>());
    check(&GLOBAL, &TMCM_1140.global.rows.iter().map(|p| named(&p.row)).collect::<Vec<_>>());
    let interrupts = (0..=u8::MAX).filter_map(|number| {
        let (numbered, index) = Interrupt::find(number, TMCM_1140.axes, TMCM_1140.inputs)?;
        Some((number, numbered.parameter_name(index)?.to_string(), numbered.row.as_ref()?))
    });
    check(&INTERRUPT, &interrupts.collect::<Vec<_>>());
}

#[test]
fn a_fresh_module_has_the_defaults() {
    let mut bench = Bench::new();
    for table in &TABLES {
        for row in table.rows {
            let value = table.value(&mut bench, row);
            assert!(row.accepts(value), "{} is {value}", row.name);
            if let Some(default) = row.default().filter(|_| !PECULIAR.contains(&row.number)) {
                assert_eq!(value, default, "{}", row.name);
            }
        }
    }
    // The sense resistors' full scale is fixed.
    assert_eq!(bench.ok("GAP 179, 0"), 1);
}

#[test]
fn limits_are_accepted_and_read_back() {
    for table in &TABLES {
        for row in table.rows.iter().filter(|row| row.is_writable() && !PECULIAR.contains(&row.number)) {
            let mut bench = Bench::new();
            for value in row.limits().chain(row.default()) {
                table.set(&mut bench, row, value);
                assert_eq!(table.value(&mut bench, row), value, "{}", row.name);
            }
        }
    }
}

#[test]
fn beyond_the_limits_nothing_changes() {
    for table in &TABLES {
        for row in table.rows.iter().filter(|row| row.is_writable()) {
            let mut bench = Bench::new();
            if row.is_stored() {
                table.set(&mut bench, row, row.another());
            }
            let before = (table.value(&mut bench, row), table.settings(&mut bench), bench.eeprom());
            for value in row.beyond() {
                let status = table.write(&mut bench, row.number, value);
                assert_eq!(status, INVALID_VALUE, "{} = {value}", row.name);
            }
            let after = (table.value(&mut bench, row), table.settings(&mut bench), bench.eeprom());
            if !PECULIAR.contains(&row.number) {
                assert_eq!(after.0, before.0, "{}", row.name);
            }
            assert!(after.1 == before.1 && after.2 == before.2, "{} changed something else", row.name);
        }
    }
}

/// The type is looked at before the value: one far out of range makes no difference.
#[test]
fn read_only_parameters_refuse_any_value() {
    let mut bench = Bench::new();
    for table in &TABLES {
        for row in table.rows.iter().filter(|row| !row.is_writable()) {
            let before = table.value(&mut bench, row);
            for value in [0, 1, i32::MIN, i32::MAX] {
                assert_eq!(table.write(&mut bench, row.number, value), WRONG_TYPE, "{} = {value}", row.name);
            }
            assert_eq!(table.value(&mut bench, row), before, "{}", row.name);
        }
    }
}

#[test]
fn numbers_that_do_not_exist() {
    let mut bench = Bench::new();
    for table in &TABLES {
        for number in (0..=u8::MAX).filter(|number| table.row(*number).is_none()) {
            assert_eq!(table.read(&mut bench, number), (WRONG_TYPE, 0), "read {number}");
            assert_eq!(table.write(&mut bench, number, 1), WRONG_TYPE, "write {number}");
        }
    }
}

/// An axis that does not exist is status 4, whether the type does or not.
#[test]
fn the_axis_is_looked_at_before_the_type() {
    let mut bench = Bench::new();
    for number in 0..=u8::MAX {
        for (opcode, name) in [(5, "SAP"), (6, "GAP"), (7, "STAP"), (8, "RSAP"), (34, "AAP")] {
            let reply = bench.send(Command::new(opcode, number, 1, 0));
            assert_eq!(reply.status, INVALID_VALUE, "{name} {number}, 1");
        }
    }
    for axis in [2, 127, 255] {
        assert_eq!(bench.ask(&format!("GAP 1, {axis}")).0, INVALID_VALUE);
    }
}

/// Bank 1 and banks that do not exist are status 4, whatever the number.
#[test]
fn the_bank_is_looked_at_before_the_number() {
    let mut bench = Bench::new();
    for bank in (0..=u8::MAX).filter(|bank| ![0, 2, 3].contains(bank)) {
        for (opcode, name) in [(9, "SGP"), (10, "GGP"), (11, "STGP"), (12, "RSGP"), (35, "AGP")] {
            for number in [0, 66, 200] {
                let reply = bench.send(Command::new(opcode, number, bank, 0));
                assert_eq!(reply.status, INVALID_VALUE, "{name} {number}, {bank}");
            }
        }
    }
}

#[test]
fn user_variables_take_any_value() {
    let mut bench = Bench::new();
    let number = |n: i32| n.wrapping_mul(0x1357_9BDF);
    for n in 0..=255 {
        assert_eq!(bench.ok(&format!("GGP {n}, 2")), 0);
        for value in [i32::MIN, i32::MAX, number(n)] {
            assert_eq!(bench.ok(&format!("SGP {n}, 2, {value}")), value);
            assert_eq!(bench.ok(&format!("GGP {n}, 2")), value);
        }
    }
    for n in 0..=255 {
        assert_eq!(bench.ok(&format!("GGP {n}, 2")), number(n), "variable {n}");
    }
}

/// The accumulator forms write what SAP and SGP write, with the same refusals; their value field means
/// nothing and is echoed.
#[test]
fn aap_and_agp_write_the_accumulator() {
    let mut bench = Bench::new();
    bench.ok("CALC LOAD, 700");
    bench.ok("AAP 4, 0");
    bench.ok("AGP 68, 0");
    bench.ok("AGP 7, 2");
    bench.ok("AGP 1, 3");
    for line in ["GAP 4, 0", "GGP 68, 0", "GGP 7, 2", "GGP 1, 3"] {
        assert_eq!(bench.ok(line), 700, "{line}");
    }
    for line in ["AAP 6, 0", "AGP 77, 0", "AGP 27, 3"] {
        bench.refused(line, INVALID_VALUE);
    }
    for line in ["AAP 3, 0", "AAP 14, 0", "AGP 128, 0", "AGP 64, 0", "AGP 3, 3"] {
        bench.refused(line, WRONG_TYPE);
    }
    bench.ok("AAP 0, 0");
    bench.run_until(SECOND, |b| b.rotor() == 700);
    let reply = bench.send(Command::new(34, 5, 0, -3));
    assert_eq!((reply.status, reply.value, bench.ok("GAP 5, 0")), (OK, -3, 700));
}

// ---- live values

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
    bench.ok("SAP 174, 0, 20");
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

// ---- parameters with rules of their own

/// Parameter 193: modes 1..8, those that turn right (+64, for 1..4) and with an inverted home switch
/// (+128, for 5..8).
#[test]
fn reference_search_modes() {
    let mut bench = Bench::new();
    for mode in -1..=300 {
        let base = match mode {
            65..=68 => mode - 64,
            133..=136 => mode - 128,
            _ => mode,
        };
        let before = bench.ok("GAP 193, 0");
        let (expected, after) = if (1..=8).contains(&base) { (OK, mode) } else { (INVALID_VALUE, before) };
        assert_eq!(bench.ask(&format!("SAP 193, 0, {mode}")).0, expected, "mode {mode}");
        assert_eq!(bench.ok("GAP 193, 0"), after);
    }
}

/// Parameters 153 and 154: a divisor is taken if positioning has a PMUL/PDIV pair for some acceleration:
/// p = A / (128 * 2^(153 - 154)) must reach 128/2^16 (and a little more: it is reduced by 1.2 %) with
/// A up to 2047, and 255/2^3 with A from 1.
#[test]
fn divisors_need_a_braking_parameter() {
    for ramp in 0..=13 {
        for pulse in 0..=13 {
            let p = |a: i32| f64::from(a) / 128.0 / 2_f64.powi(ramp - pulse) * 0.988;
            let possible = p(2047) * 65_536.0 >= 128.0 && p(1) * 8.0 < 256.0;
            let mut bench = Bench::new();
            // By way of the middle, where there is always a pair.
            for (number, value) in [(153, 7), (154, 7), (153, ramp)] {
                bench.ok(&format!("SAP {number}, 0, {value}"));
            }
            let (status, _) = bench.ask(&format!("SAP 154, 0, {pulse}"));
            assert_eq!(status, if possible { OK } else { INVALID_VALUE }, "divisors {ramp} and {pulse}");
            assert_eq!(bench.ok("GAP 154, 0"), if possible { pulse } else { 7 });
            if !possible {
                // The other way round, too.
                for (number, value) in [(153, 7), (154, pulse)] {
                    bench.ok(&format!("SAP {number}, 0, {value}"));
                }
                bench.refused(&format!("SAP 153, 0, {ramp}"), INVALID_VALUE);
                assert_eq!(bench.ok("GAP 153, 0"), 7);
            }
        }
    }
}

/// Parameter 166: 8 is a value of the parameter, though not of the chip's field, which gets 7.
#[test]
fn hysteresis_start_8() {
    let mut bench = Bench::new();
    bench.ok("SAP 166, 0, 8");
    assert_eq!(bench.ok("GAP 166, 0"), 8);
    let chopconf = bench.module.board().borrow().tmc262(0).registers().chopconf;
    assert_eq!(chopconf >> 4 & 7, 7);
    bench.ok("STAP 166, 0");
    bench.power_cycle();
    assert_eq!(bench.ok("GAP 166, 0"), 8);
}

/// Parameter 5: every acceleration reads back as written, also where the chip gets another.
#[test]
fn acceleration_reads_back_what_was_written() {
    let mut bench = Bench::new();
    for value in 1..=2047 {
        bench.ok(&format!("SAP 5, 0, {value}"));
        assert_eq!(bench.ok("GAP 5, 0"), value);
    }
}

/// Bank 3, 0..2: periods above 2^31 ms are written and read as the same 32 bits.
#[test]
fn timer_periods_are_unsigned() {
    let mut bench = Bench::new();
    for timer in 0..=2 {
        for period in [0_u32, 1, 0x7FFF_FFFF, 0x8000_0000, 4_000_000_000, u32::MAX] {
            assert_eq!(bench.ok(&format!("SGP {timer}, 3, {period}")).cast_unsigned(), period);
            assert_eq!(bench.ok(&format!("GGP {timer}, 3")).cast_unsigned(), period);
        }
    }
}

/// Parameter 132 counts milliseconds from the start, or from what was written; 31 bits of them.
#[test]
fn tick_timer() {
    let mut bench = Bench::new();
    let before = bench.ok("GGP 132, 0");
    bench.run(500 * MILLISECOND);
    let passed = bench.ok("GGP 132, 0") - before;
    assert!((500..=502).contains(&passed), "{passed} ms");
    bench.ok("SGP 132, 0, 1000000");
    bench.run(100 * MILLISECOND);
    assert!((1_000_100..=1_000_102).contains(&bench.ok("GGP 132, 0")));
    bench.ok("SGP 132, 0, 2147483647");
    bench.run(100 * MILLISECOND);
    assert!((99..=101).contains(&bench.ok("GGP 132, 0")));
    bench.ok("SGP 132, 0, 0");
    assert!((0..=2).contains(&bench.ok("GGP 132, 0")));
    bench.run(100 * MILLISECOND);
    bench.power_cycle();
    assert!((0..=3).contains(&bench.ok("GGP 132, 0")));
}

/// Parameter 133: numbers of 31 bits; the same seed gives the same ones.
#[test]
fn random_number() {
    let mut bench = Bench::new();
    let mut series = |seed: Option<i32>| {
        if let Some(seed) = seed {
            bench.ok(&format!("SGP 133, 0, {seed}"));
        }
        (0..64).map(|_| bench.ok("GGP 133, 0")).collect::<Vec<_>>()
    };
    let runs = [None, None, Some(0), Some(77), Some(1234), Some(5)].map(&mut series);
    assert_eq!(series(Some(1234)), runs[4]);
    for (n, run) in runs.iter().enumerate() {
        assert!(run.iter().all(|number| *number >= 0));
        assert!(!runs[..n].contains(run), "run {n} repeats another");
        let (mut ones, mut zeros) = (0, i32::MAX);
        for number in run {
            ones |= number;
            zeros &= number;
        }
        assert_eq!((ones, zeros), (i32::MAX, 0), "a bit that never changes");
        let distinct: std::collections::HashSet<_> = run.iter().collect();
        assert_eq!(distinct.len(), run.len());
    }
}

/// Parameter 255 silences everything but GAP, GGP and GIO - errors, too.
#[test]
fn suppress_reply() {
    let mut bench = Bench::new();
    bench.ok("SGP 255, 0, 1");
    for source in [Source::Usb, Source::Rs485] {
        for line in ["SAP 4, 0, 500", "SAP 4, 0, 0", "SGP 77, 0, 1", "STAP 4, 0", "GCO 1, 0", "17, 0, 0, 0", "136, 1"] {
            assert_eq!(bench.ask_over(source, 1, line), None, "{line}");
        }
        for (line, status, value) in
            [("GAP 4, 0", OK, 500), ("GGP 77, 0", OK, 1), ("GIO 0, 2", OK, 0), ("GAP 14, 0", WRONG_TYPE, 0)]
        {
            let reply = bench.ask_over(source, 1, line).expect("reading is always answered");
            assert_eq!((reply.status, reply.value), (status, value), "{line}");
        }
    }
    assert_eq!(bench.ok("GGP 255, 0"), 1);
    // What was not answered was carried out all the same, and the silence itself is not stored.
    bench.power_cycle();
    assert_eq!((bench.ok("GGP 255, 0"), bench.ok("GGP 77, 0"), bench.ok("GAP 4, 0")), (0, 1, 500));
    bench.ok("SGP 255, 0, 1");
    assert_eq!(bench.ask_over(Source::Usb, 1, "SGP 255, 0, 0"), None);
    bench.ok("MST 0");
}

// ---- settings of the links

/// Module and host address under which a command over RS485 is answered, if it is.
fn rs485(bench: &mut Bench, address: u8, line: &str) -> Option<(u8, u8)> {
    bench.ask_over(Source::Rs485, address, line).map(|reply| (reply.host, reply.module))
}

/// Parameters 66 and 76 act after the reply to the command that sets them, which is still under the old
/// addresses.
#[test]
fn addresses_change_after_the_reply() {
    let mut bench = Bench::new();
    assert_eq!(rs485(&mut bench, 1, "SGP 66, 0, 7"), Some((2, 1)));
    assert_eq!(rs485(&mut bench, 1, "GAP 1, 0"), None);
    assert_eq!(rs485(&mut bench, 7, "GAP 1, 0"), Some((2, 7)));
    assert_eq!(rs485(&mut bench, 7, "SGP 76, 0, 99"), Some((2, 7)));
    assert_eq!(rs485(&mut bench, 7, "GAP 1, 0"), Some((99, 7)));
    // Set once more to what it is already: nothing to store, and the same addresses.
    assert_eq!(rs485(&mut bench, 7, "SGP 66, 0, 7"), Some((99, 7)));
    bench.power_cycle();
    assert_eq!((rs485(&mut bench, 1, "GAP 1, 0"), rs485(&mut bench, 7, "GAP 1, 0")), (None, Some((99, 7))));
}

/// Parameter 87: a second address on the bus; 0 is none, and answers to no one.
#[test]
fn secondary_address() {
    let mut bench = Bench::new();
    assert_eq!(rs485(&mut bench, 0, "GAP 1, 0"), None);
    assert_eq!(rs485(&mut bench, 1, "SGP 87, 0, 200"), Some((2, 1)));
    assert_eq!(rs485(&mut bench, 200, "GAP 1, 0"), Some((2, 1)));
    assert_eq!(rs485(&mut bench, 1, "GAP 1, 0"), Some((2, 1)));
    for other in [0, 2, 199, 201, 255] {
        assert_eq!(rs485(&mut bench, other, "SAP 4, 0, 3"), None);
    }
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
    assert_eq!(rs485(&mut bench, 200, "SGP 87, 0, 0"), Some((2, 1)));
    assert_eq!(rs485(&mut bench, 200, "GAP 1, 0"), None);
}

/// USB is point to point: any address is taken, the module answers with its own.
#[test]
fn usb_takes_any_address() {
    let mut bench = Bench::new();
    bench.ok("SGP 66, 0, 5");
    for address in 0..=u8::MAX {
        let reply = bench.ask_over(Source::Usb, address, "GAP 4, 0").unwrap();
        assert_eq!((reply.host, reply.module, reply.value), (2, 5, 1000), "address {address}");
    }
}

/// An event that nobody waits for comes under the new host address, too.
#[test]
fn a_later_event_goes_to_the_new_host_address() {
    let mut bench = Bench::new();
    for line in ["138, 0, 0, 1", "MVP ABS, 0, 20000", "SGP 76, 0, 50"] {
        bench.ok(line);
    }
    let events = bench.listen(3 * SECOND);
    assert_eq!(events.iter().map(|event| (event.host, event.status)).collect::<Vec<_>>(), [(50, 128)]);
}

/// An axis takes from the store what may stand there, and nothing else.
#[test]
fn stored_values_out_of_range_are_not_taken() {
    let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
    let mut chip = Tmc429::new(board.spi(Chip::Tmc429(0), 1_000_000));
    let [hardware] = Tmc429Tmc262::axes([board.spi(Chip::Tmc262(0), 1_000_000)]);
    let mut axis = Axis::new(hardware, TMCM_1140.axis);
    for (parameter, value, expected) in [
        (AxisParameter::MaximumSpeed, 500, 500),
        (AxisParameter::MaximumSpeed, 0, 500),
        (AxisParameter::MaximumSpeed, 2048, 500),
        (AxisParameter::ReferenceSearchMode, 9, 1),
        (AxisParameter::EndSwitchDistance, 5, 0),
    ] {
        let row = TMCM_1140.axis.rows.iter().find(|row| row.function == parameter).unwrap();
        axis.preset(row, value);
        assert_eq!(axis.on(&mut chip).read(parameter), Ok(expected), "{parameter:?} {value}");
    }
}
