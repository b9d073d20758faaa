//! Causes that stop a motor on a TMC5160 at once or along the ramp: its stop switches, a stall, and the firmware.

use super::bench;
use super::ramps::{start_trace, take_trace};
use common::Bench;
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use tmcm::tmcl::Command;
use tmcm_sim::Product;

fn with_switches(toml: &str) -> Bench {
    Bench::of_in_world(Product::Tmcm3212, toml)
}

/// A hard stop is one without a ramp. The rotor is where the switch is, within what it turns in one tick of the ramp
/// generator, 512 clocks, or 2 microsteps at 50 000 pps.
#[test]
fn a_switch_stops_the_motor_at_once_and_a_positioning_goes_on_when_it_opens() {
    let mut bench = with_switches("[stage]\nleft = -50000\nright = 50000\n");
    bench.configure(&["SAP 5, 0, 500000", "ROR 0, 50000"]);
    bench.run(3 * SECOND);
    assert!((50_000..=50_002).contains(&bench.rotor()), "{}", bench.rotor());
    assert_eq!(["GAP 3, 0", "GAP 10, 0", "GAP 11, 0"].map(|line| bench.ok(line)), [0, 1, 0]);
    bench.ok("ROL 0, 50000");
    bench.run(4 * SECOND);
    assert!((-50_002..=-50_000).contains(&bench.rotor()), "{}", bench.rotor());
    // A switch that is disabled does not hold it.
    bench.configure(&["SAP 4, 0, 50000", "MVP ABS, 0, -90000"]);
    bench.run(100 * MILLISECOND);
    assert!((-50_002..=-50_000).contains(&bench.rotor()), "{}", bench.rotor());
    bench.ok("SAP 13, 0, 1");
    bench.run(500 * MILLISECOND);
    assert!(bench.rotor() < -52_000);
}

/// Along the ramp it goes on by v^2 / 2 DMAX: 50 000^2 / 500 000 = 5000 microsteps.
#[test]
fn a_soft_stop_is_along_the_ramp() {
    let mut bench = with_switches("[stage]\nright = 50000\n");
    bench.configure(&[
        "SAP 26, 0, 1",
        "SAP 5, 0, 500000",
        "SAP 17, 0, 250000",
        "SAP 4, 0, 50000",
        "MVP ABS, 0, 200000",
    ]);
    bench.run(3 * SECOND);
    assert!((54_800..=55_200).contains(&bench.rotor()), "{}", bench.rotor());
    assert_eq!((bench.ok("GAP 3, 0"), bench.ok("GAP 8, 0")), (0, 0));
}

/// Polarity and swap are parameters of the axis (24, 25 and 14).
#[test]
fn switches_can_be_inverted_and_swapped() {
    let mut bench = bench();
    bench.configure(&["SAP 24, 0, 1", "SAP 12, 0, 1"]);
    assert_eq!(["GAP 10, 0", "GAP 11, 0"].map(|line| bench.ok(line)), [1, 0]);
    bench.control("press left");
    bench.run(2 * MILLISECOND);
    assert_eq!(["GAP 10, 0", "GAP 11, 0"].map(|line| bench.ok(line)), [1, 1]);
    bench.configure(&["SAP 24, 0, 0", "SAP 14, 0, 1"]);
    assert_eq!(["GAP 10, 0", "GAP 11, 0"].map(|line| bench.ok(line)), [1, 0]);
}

/// The state of the switches is read from the chip when it is asked for, not in the next poll.
#[test]
fn switches_are_read_when_they_are_asked_for() {
    let mut bench = bench();
    bench.configure(&["SAP 12, 0, 1", "SAP 13, 0, 1"]);
    for (hand, closed) in [
        ("press left", [1, 0]),
        ("press right", [1, 1]),
        ("release left", [0, 1]),
        ("release right", [0, 0]),
        ("press right", [0, 1]),
    ] {
        bench.run(100 * MICROSECOND);
        bench.control(hand);
        let seen = [11, 10].map(|number| bench.module.read(Command::new(6, number, 0, 0)).unwrap());
        assert_eq!(seen, closed, "{hand}");
    }
}

/// The position of a closing switch is latched.
#[test]
fn the_position_of_a_switch_is_latched() {
    let mut bench = with_switches("[stage]\nright = 50000\n");
    bench.configure(&["SAP 12, 0, 1", "SAP 5, 0, 500000", "ROR 0, 40000"]);
    bench.run(3 * SECOND);
    let latched = bench.ok("GAP 198, 0");
    assert!((49_999..=50_002).contains(&latched), "{latched}");
}

/// A stall above the speed of parameter 181 stops the motor in the chip, at once; below it, nothing does. A motion
/// command lets the motor go again.
#[test]
fn a_stall_stops_the_motor_in_the_chip() {
    let mut bench = bench();
    bench.configure(&["SAP 174, 0, 1", "SAP 181, 0, 40000", "ROR 0, 50000"]);
    bench.run(2 * SECOND);
    assert_eq!(bench.ok("GAP 3, 0"), 50_000);
    bench.control("load 1");
    let from = bench.ok("GAP 1, 0");
    bench.run(SECOND);
    let way = bench.ok("GAP 1, 0") - from;
    // With the filter a measurement takes four full steps, and the next one is whole: 2048 microsteps at most, and a
    // few milliseconds at 50 000 pps.
    assert!(way < 2_600, "{way}");
    assert_eq!(["GAP 3, 0", "GAP 2, 0", "GAP 207, 0", "GAP 207, 0"].map(|line| bench.ok(line)), [0, 0, 1, 0]);
    bench.control("load 0");
    bench.ok("ROR 0, 50000");
    bench.run(2 * SECOND);
    assert_eq!(bench.ok("GAP 3, 0"), 50_000);
    // Below the speed it may stall as it likes.
    bench.ok("ROR 0, 30000");
    bench.run(2 * SECOND);
    bench.control("load 1");
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 3, 0"), 30_000);
}

/// A motor that is faster than the threshold by 1 pps is stopped by a stall, and by no stall at its very speed. The
/// chip's own hysteresis of 1/16 is not in the way. coolStep works from its speed on.
#[test]
fn a_threshold_is_passed_at_its_speed() {
    for (speed, stops) in [(10_000, true), (9_999, false)] {
        for (threshold, seen) in [("SAP 181, 0, 9999", "GAP 207, 0"), ("SAP 182, 0, 10000", "GAP 180, 0")] {
            let mut bench = bench();
            bench.configure(&["SAP 174, 0, 1", "SAP 172, 0, 5", "SAP 169, 0, 3", "SAP 182, 0, 7999774", threshold]);
            bench.ok(&format!("ROR 0, {speed}"));
            bench.run(2 * SECOND);
            if seen == "GAP 180, 0" {
                assert_eq!(bench.ok(seen) < 16, stops, "coolStep at {speed}");
                continue;
            }
            bench.control("load 1");
            bench.run(SECOND);
            assert_eq!((bench.ok("GAP 3, 0") == 0, bench.ok(seen) == 1), (stops, stops), "a stall at {speed}");
        }
    }
}

/// Both thresholds are in one register. With coolStep from 20 000 pps on, a stall at 30 000 still does not stop a motor
/// that may stall below 40 000; and the other way round.
#[test]
fn stall_and_cool_step_have_thresholds_of_their_own() {
    for (stall, cool, stops) in [(40_000, 20_000, false), (20_000, 40_000, true), (20_000, 0, true)] {
        let mut bench = bench();
        bench.configure(&["SAP 174, 0, 1", "SAP 172, 0, 5", "SAP 170, 0, 0"]);
        bench.configure(&[&format!("SAP 181, 0, {stall}"), &format!("SAP 182, 0, {cool}"), "ROR 0, 30000"]);
        bench.run(2 * SECOND);
        // Without load coolStep lowers the current to a half, but only above its speed.
        let current = bench.ok("GAP 180, 0");
        assert_eq!(current < 16, cool < 30_000, "{stall}, {cool}: {current}");
        bench.control("load 1");
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 3, 0") == 0, stops, "{stall}, {cool}");
    }
}

/// The chip allows stealthChop to be switched on at standstill only: a motor that turns gets it when it has stopped.
#[test]
fn stealth_chop_waits_for_the_motor_to_stand() {
    let mut bench = bench();
    bench.ok("ROR 0, 20000");
    bench.run(SECOND);
    bench.configure(&["SAP 186, 0, 100000", "SAP 187, 0, 15"]);
    bench.run(100 * MILLISECOND);
    assert_eq!(bench.ok("GAP 190, 0"), 0);
    bench.ok("MST 0");
    bench.run(SECOND);
    bench.ok("ROR 0, 20000");
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 190, 0"), 1);
    bench.ok("SAP 186, 0, 0");
    bench.run(10 * MILLISECOND);
    assert_eq!(bench.ok("GAP 190, 0"), 0);
}

/// A motor that a switch holds takes no more datagrams than one that turns: two in a millisecond.
#[test]
fn a_motor_at_a_switch_takes_no_more_datagrams() {
    use hal_sim::board::Chip;
    let mut bench = with_switches("[stage]\nright = 50000\n");
    bench.configure(&["SAP 5, 0, 500000", "ROR 0, 50000"]);
    bench.run(3 * SECOND);
    let datagrams = |bench: &Bench| bench.module.board().borrow().datagrams(Chip::Tmc5160(0));
    let before = datagrams(&bench);
    bench.run(SECOND);
    assert_eq!(datagrams(&bench) - before, 2_000);
}

/// A low supply stops the motor without a ramp, from 50 000 pps within a few milliseconds. By a ramp of 51 200 pps per
/// second it would go on for a second.
#[test]
fn the_firmware_stops_the_motor_without_a_ramp() {
    let mut bench = bench();
    bench.configure(&["ROR 0, 50000"]);
    bench.run(3 * SECOND);
    start_trace(&bench, 0);
    bench.control("supply 8");
    let from = bench.rotor();
    bench.run(SECOND);
    // 3 ms at 50 000 pps.
    assert!(bench.rotor() - from <= 150, "{}", bench.rotor() - from);
    drop(take_trace(&bench, 0));
    bench.control("supply 24");
    bench.run(10 * MILLISECOND);
    assert_eq!(["GAP 3, 0", "GAP 2, 0"].map(|line| bench.ok(line)), [0, 0]);
    let at = bench.rotor();
    bench.ok("MVP REL, 0, -10000");
    bench.run_until(5 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
    assert_eq!(bench.rotor(), at - 10_000);
}
