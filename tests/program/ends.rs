//! The ends of a program, and its new starts by command 129, type 0, or RUN: on the virtual module and in the flash
//! image.

use common::image_host::Host;
use common::program::{MEMORY, RUNNING, STOPPED};
use common::{Bench, OK};
use hal_sim::clock::MILLISECOND;
use tmcm::module::Source;

/// Programs that add 1 to user variable 1 and end: what ends them, the commands from address 0 on, and those at the end
/// of program memory.
const ENDS: [(&str, &[&str], &[&str]); 9] = [
    ("STOP in the main program", &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "STOP", "SGP 2, 2, 1"], &[]),
    (
        "STOP in a subroutine of a subroutine",
        &["CSUB 2", "SGP 2, 2, 1", "CSUB 4", "RSUB", "GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "STOP"],
        &[],
    ),
    (
        "STOP in the handler of a timer, in a subroutine",
        &[
            "VECT 0, 6",
            "SGP 0, 3, 1",
            "EI 0",
            "EI 255",
            "WAIT TICKS, 0, 100",
            "SGP 2, 2, 1",
            "CSUB 8",
            "RETI",
            "GGP 1, 2",
            "CALC ADD, 1",
            "AGP 1, 2",
            "STOP",
        ],
        &[],
    ),
    ("command 0", &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "0, 0, 0, 0", "SGP 2, 2, 1"], &[]),
    ("a jump out of program memory", &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "JA 2048", "SGP 2, 2, 1"], &[]),
    ("a conditional jump there", &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "JC NZ, -1", "SGP 2, 2, 1"], &[]),
    ("a call there", &["CSUB 2", "SGP 2, 2, 1", "GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "CSUB 2048"], &[]),
    ("a vector there", &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "VECT 0, 2048", "SGP 2, 2, 1"], &[]),
    ("the end of program memory", &["CSUB 2045"], &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2"]),
];

/// Runs each of the programs as often as `times` says, by command 129, type 0, alone. `ask` sends a request and gives
/// status and value of the reply; that takes a millisecond at least.
fn run_again_and_again(times: i32, programs: &[(&str, &[&str], &[&str])], ask: &mut dyn FnMut(&str) -> (u8, i32)) {
    for (what, start, end) in programs {
        for line in ["131", "SGP 0, 3, 0", "SGP 1, 2, 0"] {
            assert_eq!(ask(line).0, OK, "{what}: {line}");
        }
        for (address, lines) in [(0, start), (MEMORY - end.len() as i32, end)] {
            ask(&format!("132, 0, 0, {address}"));
            for line in *lines {
                ask(line);
            }
            assert_eq!(ask("133").0, OK);
        }
        for time in 1..=times {
            assert_eq!(ask("129").0, OK);
            let mut looks = 0;
            while ask("GGP 128, 0").1 == RUNNING {
                looks += 1;
                assert!(looks < 100, "{what}: it does not end");
            }
            let seen = ["GGP 1, 2", "GGP 2, 2", "GGP 130, 0", "135, 1"].map(|line| ask(line).1);
            assert_eq!(seen, [time, 0, 0, STOPPED], "{what}, run {time}: count, beyond the end, counter, state");
        }
    }
}

#[test]
fn an_ended_program_starts_again_a_hundred_times() {
    let mut bench = Bench::new();
    run_again_and_again(100, &ENDS, &mut |line| bench.ask(line));
}

#[test]
fn an_ended_program_starts_again_a_hundred_times_in_the_image() {
    let mut host = Host::new("");
    host.plug_usb();
    run_again_and_again(100, &ENDS[..3], &mut |line| host.ask_usb(line));
    run_again_and_again(2, &ENDS[3..], &mut |line| host.ask_usb(line));
}

/// A line in ASCII mode, and what is answered but for the echo.
fn typed(bench: &mut Bench, line: &str) -> String {
    bench.module.hear(Source::Rs485, Default::default(), format!("{line}\r").as_bytes());
    bench.run(50 * MILLISECOND);
    let sent = std::iter::from_fn(|| bench.module.sent()).flat_map(|sent| sent.bytes).collect();
    String::from_utf8(sent).unwrap().replace('\r', "|")
}

#[test]
fn run_in_ascii_mode_starts_an_ended_program_again() {
    let mut bench = Bench::with_program(&["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "STOP"]);
    bench.ask_over(Source::Rs485, 1, "139").unwrap();
    for time in 1..=3 {
        assert_eq!(typed(&mut bench, "ARUN"), "ARUN|BA 100 0|");
        assert_eq!(bench.variable(1), time);
    }
}

/// Commands 128, and the under-voltage that locks the motor, leave a program where it is; 129, type 0, goes on there,
/// also in a subroutine.
#[test]
fn a_program_that_is_stopped_from_outside_goes_on_where_it_was() {
    let program = ["CSUB 3", "SGP 2, 2, 2", "STOP", "WAIT TICKS, 0, 10", "SGP 1, 2, 1", "RSUB"];
    let stops: [&[&str]; 2] = [&["128"], &["supply 7", "supply 24"]];
    for stop in stops {
        let mut bench = Bench::with_program(&program);
        bench.start(0);
        bench.run(20 * MILLISECOND);
        for line in stop {
            if line.starts_with("supply") {
                bench.control(line);
            } else {
                bench.ok(line);
            }
            bench.run(20 * MILLISECOND);
        }
        assert_eq!((bench.mode(), bench.program_counter()), (STOPPED, 3), "{stop:?}");
        bench.ok("129");
        bench.await_end();
        assert_eq!((bench.variable(1), bench.variable(2), bench.program_counter()), (1, 2, 0), "{stop:?}");
    }
}

/// The end of a download (133) takes the program counter back to 0 and forgets calls under way; registers, error flags,
/// enables and vectors stay.
#[test]
fn the_end_of_a_download_rewinds_the_program() {
    let mut bench =
        Bench::with_program(&["CALC LOAD, 7", "CALCX LOAD", "WAIT REFSW, 0, 1", "CSUB 5", "STOP", "WAIT RFS, 0, 0"]);
    bench.download(5, &["WAIT TICKS, 0, 1000"]);
    bench.start(0);
    bench.run(100 * MILLISECOND);
    assert_eq!((bench.mode(), bench.program_counter()), (RUNNING, 5), "in the subroutine");
    // The program at 0 returns from the subroutine that is not forgotten, or has no effect.
    bench.ok("128");
    bench.ok("132, 0, 0, 0");
    for line in ["RSUB", "JC ETO, 3", "STOP", "SGP 1, 2, 1", "STOP"] {
        bench.ask(line);
    }
    assert_eq!(bench.program_counter(), 5, "where it was stopped");
    bench.ok("133");
    assert_eq!((bench.program_counter(), bench.accumulator(), bench.x()), (0, 7, 7));
    bench.ok("129");
    bench.await_end();
    assert_eq!(bench.variable(1), 1, "the error flag ETO has stayed, the return address has not");
}
