//! Interrupts of programs: when a handler runs, and which comes first (manual sections 3.6.6.2 and 3.7.32 to 3.7.35).

use crate::handlers::{HANDLERS, counts, idling, prepared, raise, set_up};
use common::program::{MEMORY, RUNNING, STOPPED};
use common::{Bench, NOT_AVAILABLE, OK, WRONG_TYPE};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm_sim::VirtualModule;

// ---- enables and vectors

/// Settings that the host has made act on the program that runs later.
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

/// Events that wait are cleared at once, not only when time goes by: the host may reset, set up and start again within
/// the same millisecond. Bank 3 stays.
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

/// Address 0 is no handler's unless VECT has said so: a timer without a vector calls nothing, and the program begins
/// once.
#[test]
fn an_interrupt_without_a_vector_calls_nothing() {
    for timer in 0..3 {
        let setup = [format!("SGP {timer}, 3, 5"), format!("EI {timer}"), "EI 255".into()];
        let begin = ["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2"].map(String::from);
        let program: Vec<String> =
            begin.into_iter().chain(setup).chain(["WAIT TICKS, 0, 20".into(), "JA 6".into()]).collect();
        let mut bench = Bench::with_program(&program.iter().map(String::as_str).collect::<Vec<_>>());
        bench.start(0);
        bench.run(SECOND);
        assert_eq!((bench.ok("GGP 0, 2"), bench.mode()), (1, RUNNING), "timer {timer}");
    }
}
