//! The driver stage: currents over time, chopper settings, microsteps, stop on stall, and the traffic on the
//! motion bus. Seen at the TMC262's registers and at the rotor.

use common::Bench;
use hal_sim::board::Chip;
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use tmcm::module::Source;
use tmcm_sim::VirtualModule;

/// Full current of a parameter value: CS = value / 8, and (CS + 1)/32 of full scale.
fn scale(value: u32) -> u32 {
    value / 8 + 1
}

/// The ramp that ends a move is a change of speed as well.
#[test]
fn boost_current_while_a_move_brakes() {
    let mut bench = Bench::new();
    bench.configure(&["SAP 6, 0, 100", "SAP 200, 0, 255", "SAP 5, 0, 100", "MVP ABS, 0, 80000"]);
    bench.run(SECOND);
    assert_eq!(bench.current(), scale(100));
    bench.run_until(3 * SECOND, |b| b.ok("GAP 3, 0") < 900);
    assert_eq!(bench.current(), scale(255));
}

/// Chopper off time 0 (parameter 167) switches the bridges off, whatever else is set.
#[test]
fn without_a_chopper_off_time_there_is_no_current() {
    let mut bench = Bench::new();
    bench.ok("MVP ABS, 0, 3000");
    assert!(bench.current() > 0);
    bench.ok("SAP 167, 0, 0");
    assert_eq!(bench.current(), 0);
}

/// Every driver parameter, the value it is set to, and the bits that must then stand in which register
/// (bit positions of the 20-bit words: AN016, table 4.1).
#[test]
fn every_driver_parameter_reaches_its_field() {
    const DRVCTRL: usize = 0;
    const CHOPCONF: usize = 1;
    const SMARTEN: usize = 2;
    const SGCSCONF: usize = 3;
    const DRVCONF: usize = 4;
    let table: &[(u8, i32, usize, u32, u32, u32)] = &[
        // parameter, value, register, lowest bit, width, field
        (140, 4, DRVCTRL, 0, 4, 4),
        (140, 0, DRVCTRL, 0, 4, 8),
        (160, 1, DRVCTRL, 9, 1, 1),
        (161, 1, DRVCTRL, 8, 1, 1),
        (162, 3, CHOPCONF, 15, 2, 3),
        (163, 1, CHOPCONF, 14, 1, 1),
        (165, 9, CHOPCONF, 7, 4, 9),
        (166, 6, CHOPCONF, 4, 3, 6),
        (166, 8, CHOPCONF, 4, 3, 7),
        (167, 11, CHOPCONF, 0, 4, 11),
        (184, 1, CHOPCONF, 13, 1, 1),
        (168, 1, SMARTEN, 15, 1, 1),
        (169, 2, SMARTEN, 13, 2, 2),
        (170, 13, SMARTEN, 8, 4, 13),
        (171, 3, SMARTEN, 5, 2, 3),
        (172, 7, SMARTEN, 0, 4, 7),
        (173, 0, SGCSCONF, 16, 1, 0),
        (174, -3, SGCSCONF, 8, 7, 0x7D),
        (175, 1, DRVCONF, 14, 2, 1),
        (176, 2, DRVCONF, 12, 2, 2),
        (177, 1, DRVCONF, 10, 1, 1),
        (178, 3, DRVCONF, 8, 2, 3),
    ];
    for &(parameter, value, register, lowest, width, field) in table {
        let mut bench = Bench::new();
        bench.ok(&format!("SAP {parameter}, 0, {value}"));
        let r = bench.module.board().borrow().tmc262(0).registers();
        let word = [r.drvctrl, r.chopconf, r.smarten, r.sgcsconf, r.drvconf][register];
        assert_eq!(word >> lowest & ((1 << width) - 1), field, "parameter {parameter}: {word:05X}");
    }
    // VSENSE (parameter 179) is always set.
    let bench = Bench::new();
    assert_eq!(bench.module.board().borrow().tmc262(0).registers().drvconf >> 6 & 1, 1);
}

/// Changing the pulse divisor makes no stray step, in velocity mode either (datasheet section 8.1.13).
#[test]
fn the_pulse_divisor_changes_without_a_step() {
    for steps in 1..40 {
        let mut bench = Bench::new();
        bench.ok("ROR 0, 300");
        bench.run(steps * 7 * MILLISECOND);
        bench.ok("MST 0");
        bench.run(SECOND);
        let (rotor, position) = (bench.rotor(), bench.ok("GAP 1, 0"));
        for divisor in [4, 5, 6, 5, 4, 3, 2] {
            bench.ok(&format!("SAP 154, 0, {divisor}"));
            bench.run(10 * MILLISECOND);
            assert_eq!((bench.rotor(), bench.ok("GAP 1, 0")), (rotor, position), "after {steps}, divisor {divisor}");
        }
        assert_eq!(bench.ok("GAP 138, 0"), 2);
    }
}

/// The stop is a hard one: from full speed to none between two polls.
#[test]
fn stop_on_stall_is_immediate() {
    let mut bench = Bench::new();
    bench.configure(&["SAP 174, 0, 1", "ROR 0, 1000"]);
    bench.run(SECOND);
    bench.ok("SAP 181, 0, 500");
    bench.control("load 1");
    while bench.speed() == 1000 {
        bench.run(MILLISECOND);
    }
    assert_eq!(bench.speed(), 0);
}

/// The status LED is on for a second, then off for a second.
#[test]
fn the_led_blinks() {
    let mut bench = Bench::new();
    bench.run(SECOND / 2);
    for second in 0..6 {
        let lit = bench.module.board().borrow().world().outputs().leds[0];
        assert_eq!(lit, second % 2 == 0, "second {second}");
        bench.run(SECOND);
    }
}

/// Divisors that were stored one by one may not fit together: then both are the defaults, and the motor moves.
#[test]
fn stored_divisors_that_admit_no_ramp() {
    let mut bench = Bench::new();
    bench.configure(&["SAP 153, 0, 0", "STAP 153, 0", "SAP 153, 0, 13", "SAP 154, 0, 13", "STAP 154, 0"]);
    bench.power_cycle();
    assert_eq!((bench.ok("GAP 153, 0"), bench.ok("GAP 154, 0")), (7, 3));
    bench.ok("MVP ABS, 0, 1000");
    bench.run(SECOND);
    assert_eq!(bench.rotor(), 1000);
}

/// A driver that lost its supply for less than it takes to notice has its settings back within the eight turns of the
/// refresh, 4 ms each.
#[test]
fn the_driver_recovers_from_a_supply_dip() {
    let mut bench = Bench::new();
    bench.configure(&["SAP 140, 0, 6", "SAP 174, 0, -5", "SAP 172, 0, 3", "SAP 177, 0, 1", "ROR 0, 100"]);
    bench.run(SECOND);
    let before = bench.module.board().borrow().tmc262(0).registers();
    bench.control("supply 3");
    bench.run(1);
    bench.control("supply 24");
    assert_ne!(bench.module.board().borrow().tmc262(0).registers(), before);
    bench.run(33 * MILLISECOND);
    let after = bench.module.board().borrow().tmc262(0).registers();
    // RDSEL, bits 5 and 4 of DRVCONF, changes with every refresh.
    assert_eq!(after.drvconf & !0x30, before.drvconf & !0x30);
    assert_eq!((after.chopconf, after.sgcsconf), (before.chopconf, before.sgcsconf));
    assert_eq!((after.drvctrl, after.smarten), (before.drvctrl, before.smarten));
    assert_eq!(bench.ok("GAP 3, 0"), 100);
}

fn datagrams(bench: &mut Bench, act: impl FnOnce(&mut Bench)) -> (u64, u64) {
    let count = |bench: &Bench| {
        let board = bench.module.board().borrow();
        (board.datagrams(Chip::Tmc429(0)), board.datagrams(Chip::Tmc262(0)))
    };
    let before = count(bench);
    act(bench);
    let after = count(bench);
    (after.0 - before.0, after.1 - before.1)
}

/// The poll spends one datagram a millisecond on the rotating readings, every fourth time on the driver; and, while the
/// motor moves, one on its position.
#[test]
fn the_poll_keeps_to_its_datagrams() {
    const SPAN: Nanos = SECOND;
    let mut bench = Bench::new();
    bench.run(5 * SECOND);
    for (line, moving) in [("MST 0", 0), ("ROR 0, 1000", 1000), ("MVP ABS, 0, 2000000000", 1000)] {
        bench.ok(line);
        bench.run(SECOND);
        let (motion, driver) = datagrams(&mut bench, |b| b.run(SPAN));
        assert!((749 + moving..=753 + moving).contains(&motion), "{line}: {motion} datagrams to the TMC429");
        assert!((249..=251).contains(&driver), "{line}: {driver} datagrams to the TMC262");
    }
}

/// While the motor stands a millisecond has one poll, and while it moves two, half a millisecond apart: the first reads
/// the position, the second has the rotating reading. So nobody waits for two datagrams in a row.
#[test]
fn the_two_datagrams_of_a_moving_motor_are_half_a_millisecond_apart() {
    let mut bench = Bench::new();
    bench.module.skip(false);
    bench.run(5 * SECOND);
    for (line, polls) in [("MST 0", 1), ("ROR 0, 1000", 2)] {
        bench.ok(line);
        bench.run(SECOND);
        let mut times = Vec::new();
        for _ in 0..100 * polls {
            let begins = bench.module.begins_turn();
            let next = bench.module.next_event().unwrap();
            let sent = datagrams(&mut bench, |bench| bench.module.run_until(next));
            assert_eq!(sent.0 + sent.1, 1, "{line}");
            assert!(!begins || polls == 1 || sent.0 == 1, "{line}: the position is read first");
            times.push(next);
        }
        let period = MILLISECOND / polls;
        assert!(times.windows(2).all(|pair| pair[1] - pair[0] == period), "{line}: {times:?}");
    }
}

/// The cost of a command on the bus: nothing without the chips, nor for a target speed in a positioning mode. A
/// position costs one datagram, and so does a new target while positioning.
#[test]
fn commands_cost_few_datagrams() {
    let mut bench = Bench::new();
    bench.ok("MVP ABS, 0, 100000");
    bench.run(SECOND);
    for (line, expected) in [
        ("GAP 5, 0", 0),
        ("GGP 66, 0", 0),
        ("SAP 2, 0, 500", 0),
        ("SGP 132, 0, 5", 0),
        ("GAP 1, 0", 1),
        ("GAP 3, 0", 1),
        ("MVP ABS, 0, 90000", 1),
    ] {
        let (motion, driver) = datagrams(&mut bench, |b| b.post(Source::Usb, line));
        assert_eq!((motion, driver), (expected, 0), "{line}");
        bench.run(10 * MILLISECOND);
        while bench.module.sent().is_some() {}
    }
}
