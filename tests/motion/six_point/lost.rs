//! A chip that is reset by its supply loses its registers and its position: it is noticed and set up again, and the
//! motor stands until it is told something. One that does not answer is given up, as on the sisters.

use super::bench;
use common::{NOT_AVAILABLE, OK};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::vm::ErrorFlag;

#[test]
fn a_chip_that_was_reset_is_set_up_again_with_the_motor_at_rest() {
    let mut bench = bench();
    bench.configure(&["SAP 6, 0, 200", "SAP 5, 0, 500000", "SAP 24, 0, 1", "SAP 12, 0, 1", "MVP ABS, 0, 500000"]);
    bench.run(2 * SECOND);
    let at = bench.ok("GAP 1, 0");
    for state in ["on", "off"] {
        bench.control(&format!("fault chip-supply {state}"));
    }
    bench.run(10 * MILLISECOND);
    let rests = bench.ok("GAP 1, 0");
    assert!((at..=at + 1_100).contains(&rests), "{at}, {rests}");
    assert_eq!(["GAP 3, 0", "GAP 8, 0", "GAP 2, 0", "GAP 6, 0"].map(|line| bench.ok(line)), [0, 0, 0, 200]);
    // The inverted switch is what its parameter says again.
    assert_eq!(bench.ok("GAP 10, 0"), 1);
    let rotor = bench.rotor();
    bench.run(2 * SECOND);
    assert_eq!((bench.rotor(), bench.ok("GAP 1, 0")), (rotor, rests), "the motor stands");
    bench.ok("MVP REL, 0, 10000");
    bench.run_until(3 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
    assert_eq!((bench.ok("GAP 1, 0"), bench.rotor()), (rests + 10_000, rotor + 10_000));
}

/// However long the supply of a chip is away, and whenever: the motor is where it was last known to be, and the module
/// goes on. Without supply the chip reads as zeros, which may be one microstep from where the motor is.
#[test]
fn a_failing_supply_of_a_chip_loses_no_position() {
    for position in [30_000, 300_000, 1, -1] {
        for time in [0, 1, 2, 3, 4, 5, 8, 20, 50, 500] {
            let mut bench = bench();
            bench.configure(&["SAP 5, 0, 5000000", "SAP 17, 0, 5000000", "SAP 4, 0, 500000"]);
            bench.ok(&format!("MVP ABS, 0, {position}"));
            bench.run(2 * SECOND + time * 137_000);
            bench.control("fault chip-supply on");
            bench.run(time * MILLISECOND);
            bench.control("fault chip-supply off");
            // Before the chip has been seen to answer again, its position cannot be read; but nothing wrong is read.
            let first = bench.ask("GAP 1, 0");
            assert!(first == (OK, position) || first.0 == NOT_AVAILABLE, "{time} ms: {first:?}");
            bench.run(20 * MILLISECOND);
            assert_eq!(bench.ok("GAP 1, 0"), position, "{time} ms");
            bench.ok("MVP REL, 0, 1000");
            bench.run(SECOND);
            assert_eq!((bench.ok("GAP 1, 0"), bench.ok("GAP 8, 0")), (position + 1_000, 1), "{time} ms");
        }
    }
}

/// The same with the supply of the module, in a move.
#[test]
fn dips_of_the_supply_lose_no_position() {
    for time in 0..40 {
        let mut bench = bench();
        bench.configure(&["SAP 5, 0, 500000", "MVP ABS, 0, 500000"]);
        bench.run(2 * SECOND + time * 37_000);
        let before = bench.ok("GAP 1, 0");
        bench.control("supply 0");
        bench.run(300_000 + time * 50_000);
        bench.control("supply 24");
        bench.run(20 * MILLISECOND);
        let after = bench.ok("GAP 1, 0");
        assert!((before..before + 500).contains(&after), "{time}: {before}, {after}");
        bench.ok("MVP REL, 0, 1000");
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 8, 0"), 1, "{time}");
    }
}

/// A reset of one chip is the matter of its axis alone.
#[test]
fn the_other_axes_turn_on() {
    let mut bench = bench();
    for axis in 0..3 {
        bench.ok(&format!("ROR {axis}, 30000"));
    }
    bench.run(2 * SECOND);
    for state in ["on", "off"] {
        bench.control(&format!("fault chip-supply {state} 1"));
    }
    bench.run(10 * MILLISECOND);
    assert_eq!([0, 1, 2].map(|axis| bench.ok(&format!("GAP 3, {axis}"))), [30_000, 0, 30_000]);
}

#[test]
fn a_search_ends_when_its_chip_is_reset() {
    let mut bench = bench();
    bench.configure(&["RFS START, 0"]);
    bench.run(500 * MILLISECOND);
    assert!(bench.ok("RFS STATUS, 0") > 0);
    for state in ["on", "off"] {
        bench.control(&format!("fault chip-supply {state}"));
    }
    bench.run(10 * MILLISECOND);
    assert_eq!((bench.ok("RFS STATUS, 0"), bench.ok("GAP 3, 0")), (0, 0));
}

#[test]
fn a_chip_that_does_not_answer_is_given_up() {
    let mut bench = bench();
    bench.ok("ROR 0, 30000");
    bench.run(SECOND);
    bench.control("fault tmc5160 on 2");
    bench.run(100 * MILLISECOND);
    assert_eq!(bench.ask("ROR 0, 30000").0, NOT_AVAILABLE);
    assert_eq!(bench.ok("GAP 3, 0"), 0);
}

/// A module that is started on USB power alone has chips without supply. When that comes they are set up.
#[test]
fn the_chips_are_set_up_when_their_supply_comes() {
    let mut bench = bench();
    bench.control("supply 0");
    bench.run(SECOND);
    assert_eq!(bench.ask("ROR 0, 30000").0, NOT_AVAILABLE);
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(bench.ask("ROR 0, 30000").0, NOT_AVAILABLE);
    bench.control("supply 24");
    bench.run(20 * MILLISECOND);
    bench.ok("ROR 0, 30000");
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 3, 0"), 30_000);
    assert!(bench.rotor() > 10_000);
}

/// A chip that did not answer from power-on is set up as soon as it does.
#[test]
fn a_chip_that_answers_late_is_set_up_then() {
    for axis in 0..3 {
        let mut bench = bench();
        bench.control(&format!("fault tmc5160 on {axis}"));
        bench.power_cycle();
        bench.run(SECOND);
        assert_eq!(bench.ask("ROR 0, 20000").0, NOT_AVAILABLE);
        bench.control(&format!("fault tmc5160 off {axis}"));
        bench.run(SECOND);
        for axis in 0..3 {
            bench.ok(&format!("ROR {axis}, 20000"));
        }
        bench.run(SECOND);
        assert_eq!([0, 1, 2].map(|axis| bench.ok(&format!("GAP 3, {axis}"))), [20_000; 3], "axis {axis}");
        assert!(bench.rotor() > 10_000);
    }
}

/// A move or a search that a reset of the chip has ended has ended before its end (EPO). A rotation has no end, and of
/// a motor that stands there is nothing to tell.
#[test]
fn a_reset_cuts_moves_and_searches_short() {
    for (command, cut_short) in
        [("MVP ABS, 0, 500000", true), ("RFS START, 0", true), ("ROR 0, 20000", false), ("MST 0", false)]
    {
        let mut bench = bench();
        bench.ok(command);
        bench.run(SECOND);
        for state in ["on", "off"] {
            bench.control(&format!("fault chip-supply {state}"));
        }
        bench.run(20 * MILLISECOND);
        let raised = bench.module.machine().unwrap().errors.raised(ErrorFlag::Position);
        assert_eq!((raised, bench.ok("GAP 3, 0")), (cut_short, 0), "{command}");
    }
}
