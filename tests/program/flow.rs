//! The way of a program through its commands: jumps, subroutines, ends, and commands that fail (manual section 3.7).

use common::program::{MEMORY, STACK, STOPPED};
use common::{Bench, OK};
use hal_sim::clock::SECOND;

// ---- jumps and subroutines

#[test]
fn ja_jumps_forwards_and_backwards() {
    let mut bench = Bench::played(&["JA 3", "SGP 1, 2, 7", "STOP", "SGP 2, 2, 8", "JA 1"]);
    assert_eq!((bench.variable(1), bench.variable(2)), (7, 8));
}

/// A jump, call or vector outside program memory stops the program; the memory's last command is within.
#[test]
fn jumps_outside_program_memory_stop_the_program() {
    for jump in ["JA", "JC NZ,", "CSUB"] {
        for address in [MEMORY, MEMORY + 1, 65_536, -1, i32::MIN, i32::MAX] {
            let mut bench = Bench::with_program(&["CALC LOAD, 1", &format!("{jump} {address}"), "SGP 1, 2, 1", "STOP"]);
            bench.run_to_end(0);
            assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 0), "{jump} {address}");
        }
        let mut bench = Bench::with_program(&["CALC LOAD, 1", &format!("{jump} {}", MEMORY - 1)]);
        bench.download(MEMORY - 1, &["SGP 1, 2, 1"]);
        // And then it runs off the end.
        bench.run_to_end(0);
        assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 1), "{jump} to the last command");
    }
    let mut bench = Bench::played(&["VECT 40, 2047", "SGP 1, 2, 1", "VECT 40, 2048", "SGP 2, 2, 1", "STOP"]);
    assert_eq!((bench.mode(), bench.variable(1), bench.variable(2)), (STOPPED, 1, 0), "a vector");
    // A jump that is not taken is no jump.
    let mut bench = Bench::played(&["CALC LOAD, 1", "JC ZE, -1", "SGP 1, 2, 1", "STOP"]);
    assert_eq!(bench.variable(1), 1);
}

/// Subroutine n calls n + 1; the innermost notes that it was there, each notes its return.
#[test]
fn eight_levels_of_subroutines() {
    let level = STACK as i32;
    let mut bench = Bench::new();
    bench.download(0, &["CALC LOAD, 0", "CSUB 10", "AGP 1, 2", "STOP"]);
    for n in 1..=level {
        // Level n is at 10 * n; it adds 1 on the way in and 100 on the way out.
        let call = format!("CSUB {}", 10 * (n + 1));
        bench
            .download(10 * n, &["CALC ADD, 1", if n < level { &call } else { "CALC ADD, 0" }, "CALC ADD, 100", "RSUB"]);
    }
    bench.run_to_end(0);
    assert_eq!((bench.variable(1), bench.mode()), (808, STOPPED));
}

/// The ninth call is ignored: the program goes on behind it.
#[test]
fn a_call_with_a_full_stack_is_ignored() {
    // It calls itself without end and counts how often; a ninth call that is ignored falls through to AGP.
    let mut bench = Bench::with_program(&["CALC LOAD, 0", "CSUB 4", "AGP 2, 2", "STOP"]);
    bench.download(4, &["CALC ADD, 1", "CSUB 4", "AGP 1, 2", "CALC ADD, 100", "RSUB"]);
    bench.run_to_end(0);
    // Eight entries, the ninth call fell through; on each of the eight returns 100 is added.
    assert_eq!((bench.variable(2), bench.mode()), (808, STOPPED));
    // The last of the notes was taken with seven returns behind it.
    assert_eq!(bench.variable(1), 708);
}

#[test]
fn a_return_with_an_empty_stack_is_ignored() {
    let mut bench = Bench::played(&["RSUB", "CSUB 5", "RSUB", "SGP 1, 2, 1", "STOP", "SGP 2, 2, 1", "RSUB"]);
    assert_eq!((bench.variable(1), bench.variable(2)), (1, 1));
}

// ---- ends

#[test]
fn stop_ends_the_program_and_nothing_else() {
    let mut bench = Bench::played(&["CALC LOAD, 5", "CALCX LOAD", "ROR 0, 300", "STOP", "SGP 1, 2, 1"]);
    bench.run(SECOND);
    let registers = (bench.accumulator(), bench.x(), bench.variable(1), bench.ok("GAP 3, 0"));
    assert_eq!(registers, (5, 5, 0, 300));
    assert_eq!((bench.ok("GGP 128, 0"), bench.status().waiting), (STOPPED, false));
}

/// Fresh memory, and command number 0 with anything in its fields, end a program.
#[test]
fn command_0_ends_the_program() {
    for end in ["0, 0, 0, 0", "0, 1, 2, 3"] {
        let mut bench = Bench::played(&["SGP 1, 2, 1", end, "SGP 2, 2, 1", "STOP"]);
        assert_eq!((bench.mode(), bench.variable(1), bench.variable(2)), (STOPPED, 1, 0), "{end}");
    }
    let mut bench = Bench::new();
    bench.run_to_end(0);
    assert_eq!((bench.mode(), bench.program_counter()), (STOPPED, 0));
}

#[test]
fn running_off_the_end_of_memory_ends_the_program() {
    let mut bench = Bench::new();
    bench.download(0, &["SGP 2, 2, 1", "STOP"]);
    bench.download(MEMORY - 2, &["SGP 1, 2, 1", "SGP 3, 2, 1"]);
    bench.run_to_end(MEMORY - 2);
    let seen = [1, 2, 3].map(|n| bench.variable(n));
    assert_eq!((bench.mode(), seen), (STOPPED, [1, 0, 1]), "it does not begin again at 0");
}

// ---- commands that fail

/// A command that fails has no effect, and the program goes on with the next.
#[test]
fn commands_that_fail_are_ignored() {
    for line in [
        "SAP 4, 0, 2048",
        "SAP 3, 0, 1",
        "SAP 255, 0, 1",
        "SAP 4, 1, 1",
        "ROR 0, 2048",
        "ROR 1, 100",
        "MVP ABS, 1, 100",
        "MVP COORD, 0, 21",
        "MVP 3, 0, 0",
        "SGP 66, 0, 0",
        "SGP 1, 1, 1",
        "SGP 128, 0, 1",
        "STGP 56, 2",
        "STAP 0, 0",
        "SIO 3, 2, 1",
        "GIO 3, 1",
        "SCO 21, 0, 1",
        "CCO 21, 0",
        "ACO 21, 0",
        "AAP 255, 0",
        "AGP 128, 0",
        "CLE 6",
        "EI 4",
        "DI 254",
        "VECT 4, 0",
        "VECT 255, 0",
        "WAIT 5, 0, 0",
        "RFS 3, 0",
        "UF0 0, 0, 0",
        "UF7 0, 0, 0",
        "RETI",
        "16, 0, 0, 0",
        "29, 0, 0, 0",
        "99, 1, 2, 3",
        "127, 0, 0, 0",
    ] {
        let mut bench = Bench::played(&["CALC LOAD, 3", line, "SGP 1, 2, 1", "STOP"]);
        assert_eq!((bench.variable(1), bench.accumulator()), (1, 3), "{line}");
        let untouched = ["GAP 4, 0", "GAP 2, 0", "GAP 0, 0", "GGP 66, 0"].map(|line| bench.ask(line));
        assert_eq!(untouched, [(OK, 1000), (OK, 0), (OK, 0), (OK, 1)], "{line}");
    }
}
