//! State that the handler of an interrupt finds, and that it leaves behind: registers, flags, stack, and the wait that
//! it interrupts (manual section 3.6.6.2).

use crate::handlers::{HANDLERS, counts, idling, prepared, raise};
use common::Bench;
use common::program::{RUNNING, STACK};
use hal_sim::clock::{MILLISECOND, SECOND};

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
