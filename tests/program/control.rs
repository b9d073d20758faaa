//! The commands that control programs: start, stop, step, reset, download and what they report (manual sections
//! 3.4.2, 3.7.38 and 5.1).

use common::program::{MEMORY, RESET, RUNNING, STEPPING, STOPPED, STORED, Status, command};
use common::{Bench, INVALID_VALUE, NOT_AVAILABLE, WRONG_TYPE};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary};
use tmcm_sim::client::Client;

/// Counts in variable 0, once every 10 ms, without end.
const COUNTING: [&str; 5] = ["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "WAIT TICKS, 0, 1", "JA 0"];

/// Whether the program counts on.
fn counts(bench: &mut Bench) -> bool {
    let before = bench.variable(0);
    bench.run(SECOND / 10);
    bench.variable(0) > before
}

// ---- start and stop

#[test]
fn a_program_is_stopped_and_sent_on() {
    let mut bench = Bench::with_program(&COUNTING);
    assert!(!counts(&mut bench));
    bench.start(0);
    assert!(counts(&mut bench));
    assert_eq!(bench.ok("128"), 0);
    assert!(!counts(&mut bench));
    let (count, place) = (bench.variable(0), bench.program_counter());
    assert_eq!((bench.mode(), bench.ok("GGP 128, 0"), bench.ok("GGP 130, 0")), (STOPPED, STOPPED, place));
    bench.ok("129, 0");
    assert!(counts(&mut bench) && bench.variable(0) > count);
    // Stopped twice, started twice: the same as once.
    for _ in 0..2 {
        bench.ok("129, 0");
        assert!(counts(&mut bench));
    }
    for _ in 0..2 {
        bench.ok("128");
        assert!(!counts(&mut bench));
    }
}

/// From the current address: where it was stopped, not from the beginning, and with its registers and stack.
#[test]
fn continuing_keeps_place_registers_and_stack() {
    let mut bench = Bench::with_program(&["CALC LOAD, 3", "CALCX LOAD", "CSUB 5", "AGP 1, 2", "STOP"]);
    bench.download(5, &["COMP 3", "WAIT TICKS, 0, 10", "JC NE, 9", "CALCX ADD", "RSUB"]);
    bench.start(0);
    bench.run(50 * MILLISECOND);
    bench.ok("128");
    assert_eq!((bench.program_counter(), bench.accumulator(), bench.x()), (6, 3, 3));
    bench.ok("129, 0, 0, 77");
    bench.await_end();
    assert_eq!(bench.variable(1), 6);
}

#[test]
fn a_program_starts_at_any_address() {
    let mut bench = Bench::new();
    for address in [1, 50, 1000, MEMORY - 2] {
        bench.download(address, &[&format!("SGP 1, 2, {address}"), "STOP"]);
    }
    for address in [MEMORY - 2, 1000, 50, 1] {
        bench.run_to_end(address);
        assert_eq!(bench.variable(1), address);
    }
    // Also while it runs: it goes on from there.
    bench.download(10, &["JA 10"]);
    bench.start(10);
    bench.start(50);
    bench.await_end();
    assert_eq!(bench.variable(1), 50);
}

/// A routine that is started at its address has a stack and a context of its own: what was left halfway is forgotten.
#[test]
fn a_start_at_an_address_forgets_what_was_left_halfway() {
    let mut bench = Bench::with_program(&["CSUB 2", "SGP 1, 2, 1", "JA 2"]);
    bench.download(10, &["RSUB", "RETI", "SGP 2, 2, 1", "STOP"]);
    bench.download(100, &["JA 100"]);
    bench.start(0);
    bench.run(10 * MILLISECOND);
    bench.ok("128");
    bench.run_to_end(10);
    assert_eq!([1, 2].map(|n| bench.variable(n)), [0, 1], "no return address");
    for line in ["SGP 0, 3, 50", "VECT 0, 100", "EI 0", "EI 255", "SGP 2, 2, 0"] {
        bench.ok(line);
    }
    bench.start(0);
    bench.run(100 * MILLISECOND);
    assert_eq!(bench.program_counter(), 100, "in the handler");
    bench.ok("DI 255");
    bench.run_to_end(10);
    assert_eq!([1, 2].map(|n| bench.variable(n)), [0, 1], "no interrupted program");
}

/// Types other than 0 and 1, addresses outside: refused, and what runs runs on.
#[test]
fn bad_starts_are_refused() {
    let mut bench = Bench::with_program(&COUNTING);
    for running in [false, true] {
        for kind in 2..=u8::MAX {
            bench.refused(&format!("129, {kind}, 0, 0"), WRONG_TYPE);
        }
        for address in [MEMORY, MEMORY + 1, 65_536, -1, i32::MIN, i32::MAX] {
            bench.refused(&format!("129, 1, 0, {address}"), INVALID_VALUE);
        }
        assert_eq!(counts(&mut bench), running);
        bench.start(0);
    }
}

#[test]
fn ascii_run_and_stop() {
    let mut bench = Bench::with_program(&COUNTING);
    bench.ok("139");
    let type_in = |bench: &mut Bench, line: &str| {
        bench.module.hear(Source::Usb, Client(0), line.as_bytes());
        bench.run(100 * MILLISECOND);
        while bench.module.sent().is_some() {}
        let before = bench.ok_beside("GGP 0, 2");
        bench.run(100 * MILLISECOND);
        bench.ok_beside("GGP 0, 2") > before
    };
    assert!(type_in(&mut bench, "ARUN\r"));
    assert!(!type_in(&mut bench, "ASTOP\r"));
    assert!(type_in(&mut bench, "arun\r"));
    assert!(!type_in(&mut bench, "ASTOP\r"));
}

/// During a download nothing can be run; a program that runs is stopped by it.
#[test]
fn nothing_runs_during_a_download() {
    let mut bench = Bench::with_program(&COUNTING);
    bench.start(0);
    bench.ok("132, 0, 0, 100");
    assert_ne!(bench.mode(), RUNNING);
    for line in ["129, 0", "129, 1, 0, 0", "130"] {
        bench.refused(line, NOT_AVAILABLE);
        assert_eq!(bench.ask_over(Source::Rs485, 1, line).unwrap().status, NOT_AVAILABLE);
    }
    assert_eq!(bench.ask("STOP").0, STORED);
    bench.ok("133");
    bench.start(0);
    assert!(counts(&mut bench));
}

// ---- step and reset

/// A step executes one command to its end, and then the program stands still in step mode.
#[test]
fn stepping_runs_one_command_at_a_time() {
    let mut bench = Bench::with_program(&["CALC LOAD, 5", "CSUB 4", "JA 0", "STOP", "CALC ADD, 1", "RSUB"]);
    for (counter, accumulator) in [(1, 5), (4, 5), (5, 6), (2, 6), (0, 6), (1, 5), (4, 5)] {
        assert_eq!(bench.ok("130"), 0);
        bench.run(20 * MILLISECOND);
        let status = Status { mode: STEPPING, waiting: false, pointer: counter };
        assert_eq!((bench.status(), bench.accumulator()), (status, accumulator));
        assert_eq!((bench.ok("GGP 128, 0"), bench.ok("GGP 130, 0")), (STEPPING, counter));
    }
    // A step of a running program stops it after the next command.
    bench.download(0, &["CALC ADD, 1", "CALC ADD, 1", "JA 0"]);
    bench.start(0);
    bench.run(SECOND);
    bench.ok("130");
    bench.run(20 * MILLISECOND);
    let accumulator = bench.accumulator();
    bench.run(SECOND);
    assert_eq!((bench.accumulator(), bench.mode()), (accumulator, STEPPING));
    // From a step it goes on, and stops.
    bench.ok("129, 0");
    assert_eq!(bench.mode(), RUNNING);
    bench.ok("128");
    assert_eq!(bench.mode(), STOPPED);
}

/// A step over WAIT takes as long as the wait.
#[test]
fn stepping_waits() {
    let mut bench = Bench::with_program(&["WAIT TICKS, 0, 20", "SGP 1, 2, 1", "STOP"]);
    bench.ok("130");
    bench.run(100 * MILLISECOND);
    let status = bench.status();
    assert_eq!((status.waiting, status.pointer), (true, 0));
    bench.run(110 * MILLISECOND);
    assert_eq!((bench.status(), bench.variable(1)), (Status { mode: STEPPING, waiting: false, pointer: 1 }, 0));
}

/// The way into a handler is a step of its own, out of a WAIT as well, and RETI leads back into its rest.
#[test]
fn stepping_through_a_handler() {
    let main = ["SGP 0, 3, 100", "VECT 0, 6", "EI 0", "EI 255", "WAIT TICKS, 0, 15", "STOP"];
    let mut bench = Bench::with_program(&[&main[..], &["CALC ADD, 1", "RETI"]].concat());
    // The timer is due in the WAIT; its period leaves time for the rest of that.
    for (milliseconds, counter, accumulator) in
        [(2, 1, 0), (2, 2, 0), (2, 3, 0), (2, 4, 0), (110, 6, 0), (2, 7, 1), (2, 4, 0), (60, 5, 0)]
    {
        bench.ok("130");
        bench.run(milliseconds * MILLISECOND);
        let status = Status { mode: STEPPING, waiting: false, pointer: counter };
        assert_eq!((bench.status(), bench.accumulator()), (status, accumulator));
    }
}

/// Program counter, stack, accumulator, X and flags go to zero, and nothing runs.
#[test]
fn reset_clears_everything() {
    let mut bench = Bench::new();
    let program = ["CALC LOAD, 5", "CALCX LOAD", "COMP 5", "WAIT REFSW, 0, 1", "CSUB 5", "SGP 0, 2, 1", "JA 6"];
    for running in [false, true] {
        bench.download(0, &program);
        bench.start(0);
        bench.run(SECOND);
        if !running {
            bench.ok("128");
        }
        assert_eq!(bench.ok("131"), 0);
        let status = bench.status();
        assert!([STOPPED, RESET].contains(&status.mode));
        assert_eq!((status.waiting, status.pointer, bench.accumulator(), bench.x()), (false, 0, 0, 0));
        assert_eq!((bench.ok("GGP 128, 0"), bench.ok("GGP 130, 0")), (status.mode, 0));
        bench.run(SECOND);
        assert_eq!(bench.status(), status);
        // No return address, no time-out, no comparison is left.
        bench.download(
            10,
            &["RSUB", "JC ETO, 15", "JC EQ, 15", "JC ZE, 15", "SGP 1, 2, 7", "STOP", "SGP 1, 2, 8", "STOP"],
        );
        bench.ok("SGP 1, 2, 0");
        bench.run_to_end(10);
        assert_eq!(bench.variable(1), 7);
    }
    // From the current address is from the beginning now.
    bench.download(0, &["CALC ADD, 1", "CSUB 20", "STOP"]);
    bench.download(20, &["JA 20"]);
    bench.start(0);
    bench.run(5 * MILLISECOND);
    bench.ok("131");
    bench.download(0, &["RSUB", "JA 30", "SGP 2, 2, 1", "STOP"]);
    bench.download(30, &["SGP 1, 2, 9", "STOP"]);
    // Had the return address 2 been left, RSUB would go there.
    bench.ok("129, 0");
    bench.await_end();
    assert_eq!([1, 2].map(|n| bench.variable(n)), [9, 0]);
}

// ---- what is reported

#[test]
fn status_tells_mode_wait_and_places() {
    let mut bench =
        Bench::with_program(&["CALC LOAD, -2", "CALCX LOAD", "CALC LOAD, 70000", "WAIT TICKS, 0, 10", "STOP"]);
    assert_eq!(bench.status(), Status { mode: bench.ok("GGP 128, 0"), waiting: false, pointer: 0 });
    bench.start(0);
    bench.run(20 * MILLISECOND);
    assert_eq!(bench.status(), Status { mode: RUNNING, waiting: true, pointer: 3 });
    let memory = bench.memory_status();
    assert_eq!((memory.mode, memory.waiting), (RUNNING, true));
    assert_eq!((bench.ok("GGP 128, 0"), bench.ok("GGP 130, 0")), (RUNNING, 3));
    assert_eq!((bench.accumulator(), bench.x()), (70_000, -2));
    bench.await_end();
    let status = bench.status();
    assert_eq!((status.mode, status.waiting), (STOPPED, false));
    for kind in 4..=u8::MAX {
        bench.refused(&format!("135, {kind}"), WRONG_TYPE);
    }
    for line in ["SGP 128, 0, 0", "SGP 129, 0, 0", "SGP 130, 0, 0"] {
        bench.refused(line, WRONG_TYPE);
    }
}

/// Command 134: the command alone, after the host's address and without a status.
#[test]
fn program_memory_is_read_command_by_command() {
    let mut bench = Bench::with_program(&["MVP ABS, 0, -12345", "JC LE, 2047"]);
    let read = |bench: &mut Bench, address| {
        let request = binary::encode_command(1, Command::new(134, 0, 0, address));
        bench.exchange(Source::Usb, request).unwrap().bytes
    };
    let bytes = [2, 4, 0, 0, 0xFF, 0xFF, 0xCF, 0xC7];
    let sum = bytes.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    assert_eq!(read(&mut bench, 0), [&bytes[..], &[sum]].concat());
    assert_eq!(bench.memory(1), command("JC LE, 2047"));
    for address in [2, 1000, MEMORY - 1] {
        assert_eq!(bench.memory(address), Command::default(), "fresh memory is command number 0");
    }
    for address in [MEMORY, -1, i32::MAX] {
        bench.refused(&format!("134, 0, 0, {address}"), INVALID_VALUE);
    }
}
