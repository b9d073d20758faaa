//! Interrupts of programs: when a handler runs, what it finds and what it leaves behind (manual sections 3.6.6.2 and
//! 3.7.32 to 3.7.35).
//!
//! The tests raise interrupts 39 to 41 by hand, at the inputs 0 to 2.

use crate::common::program::{MEMORY, RUNNING, STACK, STOPPED};
use crate::common::{Bench, NOT_AVAILABLE, OK, WRONG_TYPE};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm_sim::VirtualModule;

/// Where the handlers of interrupts 39, 40 and 41 are.
const HANDLERS: [i32; 3] = [100, 120, 140];

/// A module whose inputs raise interrupts with every rising edge; handler n counts in variable n. It is all set by
/// the host; only the program is missing.
fn prepared() -> Bench {
    let mut bench = Bench::new();
    for (input, address) in HANDLERS.into_iter().enumerate() {
        let [read, write] = [format!("GGP {input}, 2"), format!("AGP {input}, 2")];
        bench.download(address, &[&read, "CALC ADD, 1", &write, "RETI"]);
    }
    set_up(&mut bench);
    bench
}

fn set_up(bench: &mut Bench) {
    for (input, address) in HANDLERS.into_iter().enumerate() {
        let interrupt = 39 + input;
        bench.ok(&format!("SGP {interrupt}, 3, 1"));
        bench.ok(&format!("VECT {interrupt}, {address}"));
        bench.ok(&format!("EI {interrupt}"));
    }
    bench.ok("EI 255");
}

/// Starts a program that does nothing else.
fn idling(bench: &mut Bench) {
    bench.download(0, &["JA 0"]);
    bench.start(0);
    bench.run(5 * MILLISECOND);
}

/// A rising edge at each of these inputs, all at the same time.
fn raise(bench: &mut Bench, inputs: &[usize]) {
    for level in [0, 1] {
        for input in inputs {
            bench.control(&format!("input {input} {level}"));
        }
        bench.run(5 * MILLISECOND);
    }
}

fn counts(bench: &mut Bench) -> [i32; 3] {
    [0, 1, 2].map(|n| bench.variable(n))
}

// ---- enables and vectors

/// What the host has set acts on the program that runs later.
#[test]
fn the_host_sets_up_interrupts() {
    let mut bench = prepared();
    idling(&mut bench);
    for n in 1..=3 {
        raise(&mut bench, &[0, 1, 2]);
        assert_eq!(counts(&mut bench), [n; 3]);
    }
    // Also over an end and a start.
    bench.ok("128");
    bench.start(0);
    raise(&mut bench, &[1]);
    assert_eq!(counts(&mut bench), [3, 4, 3]);
}

#[test]
fn every_enable_counts() {
    for (line, again, expected) in [
        ("DI 39", "EI 39", [0, 1, 1]),
        ("DI 40", "EI 40", [1, 0, 1]),
        ("DI 41", "EI 41", [1, 1, 0]),
        ("SGP 40, 3, 0", "SGP 40, 3, 1", [1, 0, 1]),
    ] {
        let mut bench = prepared();
        idling(&mut bench);
        bench.ok(line);
        for n in 1..=2 {
            raise(&mut bench, &[0, 1, 2]);
            assert_eq!(counts(&mut bench), expected.map(|e| e * n), "{line}");
        }
        // What has happened while it was disabled is forgotten.
        bench.ok(again);
        bench.run(SECOND);
        assert_eq!(counts(&mut bench), expected.map(|e| e * 2), "{line}, {again}");
        raise(&mut bench, &[0, 1, 2]);
        assert_eq!(counts(&mut bench), expected.map(|e| e * 2 + 1), "{line}, {again}");
    }
}

/// The same commands in the program itself.
#[test]
fn a_program_enables_and_disables() {
    let mut bench = prepared();
    for line in ["DI 39", "DI 40", "DI 41", "DI 255", "SGP 39, 3, 0", "SGP 40, 3, 0"] {
        bench.ok(line);
    }
    let program =
        ["EI 255", "EI 39", "EI 40", "SGP 39, 3, 2", "CALC LOAD, 2", "AGP 40, 3", "WAIT TICKS, 0, 10", "DI 40", "JA 8"];
    bench.download(0, &program);
    for input in 0..3 {
        bench.control(&format!("input {input} 1"));
    }
    bench.start(0);
    bench.run(50 * MILLISECOND);
    for input in 0..3 {
        bench.control(&format!("input {input} 0"));
    }
    bench.run(5 * MILLISECOND);
    assert_eq!(counts(&mut bench), [1, 1, 0]);
    bench.run(100 * MILLISECOND);
    for level in [1, 0] {
        for input in 0..3 {
            bench.control(&format!("input {input} {level}"));
        }
        bench.run(5 * MILLISECOND);
    }
    assert_eq!(counts(&mut bench), [2, 1, 0]);
}

/// Globally disabled, an event waits: once, however often it has happened.
#[test]
fn an_event_waits_for_the_global_enable() {
    let mut bench = prepared();
    idling(&mut bench);
    bench.ok("DI 255");
    for _ in 0..3 {
        raise(&mut bench, &[0, 2]);
    }
    assert_eq!(counts(&mut bench), [0, 0, 0]);
    bench.ok("EI 255");
    bench.run(5 * MILLISECOND);
    assert_eq!(counts(&mut bench), [1, 0, 1]);
    bench.run(SECOND);
    assert_eq!(counts(&mut bench), [1, 0, 1]);
    // Disabling the interrupt itself forgets what waits.
    bench.ok("DI 255");
    raise(&mut bench, &[0, 2]);
    bench.ok("DI 39");
    bench.ok("EI 39");
    bench.ok("EI 255");
    bench.run(SECOND);
    assert_eq!(counts(&mut bench), [1, 0, 2]);
}

/// No program, no events: none is left over for the next start.
#[test]
fn events_without_a_program_are_dropped() {
    let mut bench = prepared();
    bench.download(0, &["JA 0"]);
    raise(&mut bench, &[0, 1, 2]);
    bench.start(0);
    bench.run(SECOND);
    assert_eq!(counts(&mut bench), [0; 3]);
    bench.ok("128");
    raise(&mut bench, &[0, 1, 2]);
    bench.ok("129, 0");
    bench.run(SECOND);
    assert_eq!(counts(&mut bench), [0; 3]);
    raise(&mut bench, &[0, 1, 2]);
    assert_eq!(counts(&mut bench), [1; 3]);
}

/// 131 clears enables, vectors and what waits.
#[test]
fn reset_clears_the_interrupts() {
    let mut bench = prepared();
    idling(&mut bench);
    bench.ok("DI 255");
    raise(&mut bench, &[0]);
    bench.ok("131");
    bench.ok("EI 255");
    bench.start(0);
    raise(&mut bench, &[0, 1, 2]);
    assert_eq!(counts(&mut bench), [0; 3], "own enables and events");
    for interrupt in 39..42 {
        bench.ok(&format!("EI {interrupt}"));
    }
    raise(&mut bench, &[0, 1, 2]);
    assert_eq!((counts(&mut bench), bench.mode()), ([0; 3], RUNNING), "without a vector nothing is called");
    bench.ok("131");
    set_up(&mut bench);
    bench.ok("DI 255");
    bench.ok("131");
    set_up(&mut bench);
    bench.start(0);
    raise(&mut bench, &[0, 1, 2]);
    assert_eq!(counts(&mut bench), [1; 3]);
    // The global enable is one of them.
    bench.ok("131");
    set_up(&mut bench);
    bench.ok("131");
    for (input, address) in HANDLERS.into_iter().enumerate() {
        bench.ok(&format!("VECT {}, {address}", 39 + input));
        bench.ok(&format!("EI {}", 39 + input));
    }
    bench.start(0);
    raise(&mut bench, &[0, 1, 2]);
    assert_eq!(counts(&mut bench), [1; 3]);
}

/// What waits is cleared at once, not only when time goes by: the host may reset, set up and start again within the
/// same millisecond. Bank 3 stays.
#[test]
fn a_reset_program_starts_without_old_events() {
    let mut bench = prepared();
    idling(&mut bench);
    bench.ok("DI 255");
    raise(&mut bench, &[0, 1, 2]);
    let now = bench.module.now();
    bench.ok_beside("131");
    for (input, address) in HANDLERS.into_iter().enumerate() {
        bench.ok_beside(&format!("VECT {}, {address}", 39 + input));
        bench.ok_beside(&format!("EI {}", 39 + input));
    }
    bench.ok_beside("EI 255");
    bench.ok_beside("129, 1");
    assert_eq!(bench.module.now(), now);
    bench.run(SECOND);
    assert_eq!(counts(&mut bench), [0; 3]);
    assert_eq!([39, 40, 41].map(|n| bench.ok(&format!("GGP {n}, 3"))), [1; 3]);
    raise(&mut bench, &[0, 1, 2]);
    assert_eq!(counts(&mut bench), [1; 3]);
}

/// The numbers of the table, and the global one where it makes sense.
#[test]
fn interrupts_that_do_not_exist_are_refused() {
    let mut bench = Bench::new();
    let known = [0, 1, 2, 3, 15, 21, 27, 28, 39, 40, 41, 42];
    for number in 0..=u8::MAX {
        for (line, global) in [("EI", true), ("DI", true), ("VECT", false)] {
            let address = if line == "VECT" { ", 50" } else { "" };
            let expected = if known.contains(&number) || number == 255 && global { OK } else { WRONG_TYPE };
            assert_eq!(bench.ask(&format!("{line} {number}{address}")).0, expected, "{line} {number}");
        }
    }
    bench.refused("RETI", NOT_AVAILABLE);
}

/// A vector outside program memory stops the program when it is followed, if it is accepted at all.
#[test]
fn a_vector_outside_program_memory() {
    for address in [MEMORY, 65_536, -1] {
        let mut bench = prepared();
        let accepted = bench.ask(&format!("VECT 40, {address}")).0 == OK;
        idling(&mut bench);
        raise(&mut bench, &[0]);
        assert_eq!(bench.mode(), RUNNING);
        raise(&mut bench, &[1]);
        assert_eq!(bench.mode(), if accepted { STOPPED } else { RUNNING }, "{address}");
    }
}

// ---- order

/// Several at once: the lowest number goes first, whatever the order in which they were enabled.
#[test]
fn the_lowest_number_goes_first() {
    let mut bench = prepared();
    // Each handler appends its digit to variable 9.
    for (address, digit) in HANDLERS.into_iter().zip(1..) {
        let append = format!("CALC ADD, {digit}");
        bench.download(address, &["GGP 9, 2", "CALC MUL, 10", &append, "AGP 9, 2", "RETI"]);
    }
    idling(&mut bench);
    for (inputs, order) in [(&[2, 1, 0][..], 123), (&[2, 0], 13), (&[2, 1], 23)] {
        for held in [false, true] {
            bench.ok("SGP 9, 2, 0");
            if held {
                bench.ok("DI 255");
                for input in inputs {
                    raise(&mut bench, &[*input]);
                }
                bench.ok("EI 255");
                bench.run(5 * MILLISECOND);
            } else {
                raise(&mut bench, inputs);
            }
            assert_eq!(bench.variable(9), order, "{inputs:?}, held back: {held}");
        }
    }
}

/// While a handler runs no other does, not even a more urgent one; then it gets its turn.
#[test]
fn handlers_do_not_nest() {
    let mut bench = prepared();
    bench.download(HANDLERS[1], &["SGP 1, 2, 1", "EI 255", "WAIT TICKS, 0, 20", "SGP 1, 2, 2", "RETI"]);
    idling(&mut bench);
    raise(&mut bench, &[1]);
    assert_eq!(counts(&mut bench), [0, 1, 0]);
    // Its own event counts as well, once; and the others' too.
    for _ in 0..3 {
        raise(&mut bench, &[0, 1, 2]);
        assert_eq!(counts(&mut bench), [0, 1, 0]);
    }
    bench.run(170 * MILLISECOND);
    assert_eq!(counts(&mut bench), [1, 1, 0], "the most urgent first, then the handler again");
    bench.run(SECOND);
    assert_eq!(counts(&mut bench), [1, 2, 1]);
}

/// RETI is the end of a handler; a jump out of it is not, and RETI outside a handler is ignored.
#[test]
fn only_reti_ends_a_handler() {
    let mut bench = prepared();
    bench.download(HANDLERS[0], &["JA 10"]);
    bench.download(10, &["SGP 5, 2, 1", "WAIT TICKS, 0, 10", "RSUB", "RETI"]);
    bench.download(0, &["RETI", "GGP 6, 2", "CALC ADD, 1", "AGP 6, 2", "JA 0"]);
    bench.start(0);
    bench.run(20 * MILLISECOND);
    assert!(bench.variable(6) > 0, "RETI in the program is ignored");
    raise(&mut bench, &[0]);
    assert_eq!(bench.variable(5), 1);
    raise(&mut bench, &[1]);
    assert_eq!(bench.variable(1), 0);
    bench.run(200 * MILLISECOND);
    assert_eq!(bench.variable(1), 1);
}

/// A program that stops inside a handler is out of it: the next start has interrupts again.
#[test]
fn an_end_inside_a_handler() {
    for end in ["STOP", "0, 0, 0, 0", "JA 5000"] {
        let mut bench = prepared();
        bench.download(HANDLERS[0], &["SGP 0, 2, 1", end]);
        idling(&mut bench);
        raise(&mut bench, &[0]);
        assert_eq!((bench.mode(), bench.variable(0)), (STOPPED, 1), "{end}");
        bench.start(0);
        raise(&mut bench, &[1]);
        assert_eq!((counts(&mut bench), bench.mode()), ([1, 1, 0], RUNNING), "{end}");
    }
}

/// A handler that is stopped by the host goes on in the handler, and returns.
#[test]
fn a_handler_is_stopped_and_sent_on() {
    let mut bench = prepared();
    bench.download(HANDLERS[0], &["WAIT TICKS, 0, 10", "SGP 0, 2, 1", "RETI"]);
    bench.download(0, &["GGP 9, 2", "CALC ADD, 1", "AGP 9, 2", "JA 0"]);
    bench.start(0);
    raise(&mut bench, &[0]);
    bench.ok("128");
    bench.run(SECOND);
    assert_eq!((bench.variable(0), bench.program_counter()), (0, HANDLERS[0]));
    let count = bench.variable(9);
    bench.ok("129, 0");
    bench.run(SECOND);
    assert_eq!(bench.variable(0), 1);
    assert!(bench.variable(9) > count);
}

// ---- context

/// A handler that changes everything, over a program that would notice anything: accumulator, X, flags, place.
#[test]
fn the_context_is_saved_and_restored() {
    for (accumulator, operand) in [(0, 0), (7, 7), (-3, 5), (5, -3)] {
        let mut bench = Bench::new();
        let load = format!("CALC LOAD, {accumulator}");
        let compare = format!("COMP {operand}");
        let (same, fresh) = (accumulator == operand, accumulator > operand);
        // The conditions that must not hold, and lead to the alarm at 40.
        let wrong: [&str; 3] = match (same, fresh) {
            (true, _) => ["JC NE, 40", "JC GT, 40", "JC LT, 40"],
            (false, true) => ["JC EQ, 40", "JC LE, 40", "JC LT, 40"],
            (false, false) => ["JC EQ, 40", "JC GE, 40", "JC GT, 40"],
        };
        let zero = if same { "JC NZ, 40" } else { "JC ZE, 40" };
        let mut program = vec!["VECT 0, 100", "EI 0", "EI 255", "CALC LOAD, 77", "CALCX LOAD", &*load, &*compare];
        program.extend([zero, wrong[0], wrong[1], wrong[2], zero, wrong[0], wrong[1], wrong[2]]);
        let check = format!("CALC SUB, {accumulator}");
        program.extend(["CALC ADD, 0", &*check, "JC NZ, 40", "CALCX SWAP", "CALC SUB, 77", "JC NZ, 40", "JA 3"]);
        bench.download(0, &program);
        bench.download(40, &["SGP 1, 2, 1", "STOP"]);
        // It leaves "less" or "greater" or "equal" in turns, and other registers.
        let handler = ["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "CALC MOD, 3", "CALCX LOAD", "COMP 1", "RETI"];
        bench.download(100, &handler);
        bench.ok("SGP 0, 3, 1");
        bench.start(0);
        bench.run(10 * SECOND);
        assert_eq!((bench.variable(1), bench.mode()), (0, RUNNING), "{accumulator} and {operand}");
        assert!(bench.variable(0) > 9_990);
    }
}

/// Error flags stay until they are cleared, and are no part of the context: a handler's time-out is seen by the
/// program, and what a handler clears is clear.
#[test]
fn error_flags_outlive_the_handler() {
    let mut bench = prepared();
    bench.download(0, &["JC ETO, 3", "SGP 9, 2, 1", "JA 0", "SGP 9, 2, 2", "JA 0"]);
    bench.download(HANDLERS[0], &["WAIT REFSW, 0, 1", "RETI"]);
    bench.download(HANDLERS[1], &["CLE ETO", "RETI"]);
    bench.start(0);
    for (input, seen) in [(1, 1), (0, 2), (2, 2), (1, 1)] {
        raise(&mut bench, &[input]);
        bench.run(20 * MILLISECOND);
        assert_eq!(bench.variable(9), seen);
    }
}

#[test]
fn subroutines_work_inside_and_around_handlers() {
    let mut bench = prepared();
    // The program is seven calls deep when the handler calls once more.
    bench.download(0, &["CALC LOAD, 0", "CSUB 4", "AGP 9, 2", "JA 0"]);
    let depth = STACK as i32 - 1;
    let at_the_bottom = format!("COMP {depth}");
    bench.download(4, &["CALC ADD, 1", &at_the_bottom, "JC GE, 9", "CSUB 4", "RSUB", "WAIT TICKS, 0, 5", "RSUB"]);
    bench.download(HANDLERS[0], &["CSUB 150", "GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "RETI"]);
    bench.download(150, &["GGP 8, 2", "CALC ADD, 1", "AGP 8, 2", "RSUB"]);
    bench.start(0);
    for n in 1..=20 {
        raise(&mut bench, &[0]);
        bench.run(n * 7 * MILLISECOND / 3);
        assert_eq!((bench.variable(0), bench.variable(8)), (n as i32, n as i32));
    }
    assert_eq!((bench.variable(9), bench.mode()), (depth, RUNNING));
}

// ---- waits

/// A wait is interrupted, and afterwards lasts as long as it would still have lasted.
#[test]
fn an_interrupted_wait_goes_on_with_the_time_it_had_left() {
    // 1 s; the handler takes 300 ms.
    for (wait, flag) in [("WAIT TICKS, 0, 100", 1), ("WAIT REFSW, 0, 100", 2), ("WAIT RFS, 0, 100", 1)] {
        for interruptions in 0..3 {
            let mut bench = prepared();
            let search = if wait.contains("RFS") { "RFS START, 0" } else { "CALC ADD, 0" };
            bench.download(0, &[search, "SGP 132, 0, 0", wait, "GGP 132, 0", "AGP 9, 2", "JC ETO, 8"]);
            bench.download(6, &["SGP 8, 2, 1", "STOP", "SGP 8, 2, 2", "STOP"]);
            bench.download(HANDLERS[0], &["WAIT TICKS, 0, 30", "RETI"]);
            bench.start(0);
            bench.run(200 * MILLISECOND);
            for _ in 0..interruptions {
                raise(&mut bench, &[0]);
                bench.run(400 * MILLISECOND);
            }
            let waiting = bench.status();
            assert_eq!((waiting.waiting, waiting.pointer), (true, 2), "{wait}");
            if wait.contains("RFS") {
                // Without a switch the search would go on: only the time-out ends it.
                assert_ne!(bench.ok("RFS STATUS, 0"), 0);
                bench.await_end();
                assert_eq!((bench.variable(9), bench.variable(8)), (1000 + 300 * interruptions, 2), "{wait}");
                continue;
            }
            bench.await_end();
            assert_eq!((bench.variable(9), bench.variable(8)), (1000 + 300 * interruptions, flag), "{wait}");
        }
    }
}

/// A handler's own wait has its own time, and leaves the program's accumulator for a -1 alone.
#[test]
fn a_handler_waits_in_its_own_time() {
    let mut bench = prepared();
    bench.download(0, &["CALC LOAD, 50", "SGP 132, 0, 0", "WAIT TICKS, 0, -1", "GGP 132, 0", "AGP 9, 2", "STOP"]);
    bench.download(HANDLERS[0], &["GGP 132, 0", "CALCX LOAD", "CALC LOAD, 7", "WAIT TICKS, 0, -1", "GGP 132, 0"]);
    bench.download(HANDLERS[0] + 5, &["CALCX SUB", "AGP 7, 2", "RETI"]);
    bench.start(0);
    bench.run(100 * MILLISECOND);
    raise(&mut bench, &[0]);
    bench.await_end();
    assert_eq!((bench.variable(7), bench.variable(9)), (70, 570));
}

/// An event that comes while the handler runs ends the wait after it, without the flag.
#[test]
fn what_happens_during_a_handler_ends_the_wait() {
    let mut bench = prepared();
    bench.download(
        0,
        &["MVP ABS, 0, 3000", "WAIT POS, 0, 200", "JC ETO, 5", "SGP 9, 2, 1", "STOP", "SGP 9, 2, 2", "STOP"],
    );
    bench.download(HANDLERS[0], &["WAIT TICKS, 0, 100", "RETI"]);
    bench.start(0);
    raise(&mut bench, &[0]);
    bench.await_end();
    assert_eq!((bench.variable(9), bench.rotor()), (1, 3000));
}

/// A handler that gives its own interrupt another vector, and disables it: both act at once.
#[test]
fn a_handler_changes_its_vector() {
    let mut bench = prepared();
    bench.download(HANDLERS[0], &["SGP 0, 2, 1", "VECT 39, 160", "RETI"]);
    bench.download(160, &["SGP 0, 2, 2", "VECT 39, 170", "RETI"]);
    bench.download(170, &["SGP 0, 2, 3", "DI 39", "RETI"]);
    idling(&mut bench);
    for n in [1, 2, 3] {
        raise(&mut bench, &[0]);
        assert_eq!(bench.variable(0), n);
    }
    bench.ok("SGP 0, 2, 0");
    raise(&mut bench, &[0]);
    assert_eq!(bench.variable(0), 0);
    // One that waits while the handler runs follows the new vector.
    let mut bench = prepared();
    bench.download(HANDLERS[0], &["WAIT TICKS, 0, 10", "VECT 39, 160", "RETI"]);
    bench.download(160, &["SGP 0, 2, 2", "RETI"]);
    idling(&mut bench);
    raise(&mut bench, &[0]);
    raise(&mut bench, &[0]);
    bench.run(200 * MILLISECOND);
    assert_eq!(bench.variable(0), 2);
}

/// A handler that ends the global enable: the others wait until it is back.
#[test]
fn a_handler_disables_all() {
    let mut bench = prepared();
    bench.download(HANDLERS[0], &["SGP 0, 2, 1", "DI 255", "RETI"]);
    idling(&mut bench);
    raise(&mut bench, &[0, 1]);
    raise(&mut bench, &[2]);
    assert_eq!(counts(&mut bench), [1, 0, 0]);
    bench.ok("EI 255");
    bench.run(5 * MILLISECOND);
    assert_eq!(counts(&mut bench), [1, 1, 1]);
}
