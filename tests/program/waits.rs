//! The command WAIT in its five forms: how long it takes, its time-out and flag (manual section 3.7.22).

use common::program::{RUNNING, STOPPED, Status, TICK, spans};
use common::{Bench, OK};
use hal_sim::clock::{MILLISECOND, SECOND};

/// The forms that wait for an event, and one that makes it happen; nothing of it does by itself.
const EVENTS: [(&str, &str, &[&str]); 5] = [
    ("POS", "[motor]\n", &["SAP 4, 0, 50", "MVP ABS, 0, 100000"]),
    ("REFSW", "", &[]),
    ("LIMSW", "", &[]),
    ("LIMSW", "", &[]),
    ("RFS", "[stage]\nleft = -1000000000\n", &["SAP 193, 0, 1", "RFS START, 0"]),
];

/// Makes happen what the form waits for.
fn happen(bench: &mut Bench, event: usize) {
    match event {
        0 => _ = bench.ok("SAP 4, 0, 2047"),
        1 => bench.control("press home"),
        2 => bench.control("press left"),
        3 => bench.control("press right"),
        _ => _ = bench.ok("RFS STOP, 0"),
    }
}

/// A program that waits between two edges of output 0 and then notes 1 or, with a time-out, 2 in variable 1.
fn waiting(world: &str, before: &[&str], wait: &str) -> Bench {
    let mut bench = Bench::in_world(world);
    for line in before {
        bench.ok(line);
    }
    bench.download(0, &["SIO 0, 2, 1", wait, "SIO 0, 2, 0", "JC ETO, 6", "SGP 1, 2, 1", "STOP", "SGP 1, 2, 2", "STOP"]);
    bench
}

/// Tells how long output 0 is on, in a run of the program, by the module's clock. The clock counts milliseconds, and
/// the first had begun already when the host set the program off. No edges, no time.
fn duration(bench: &mut Bench, limit: u64) -> u64 {
    bench.set_off(0);
    let edges = bench.edges(0, limit);
    assert!(edges.len() <= 2);
    spans(&edges).first().map_or(0, |span| span.next_multiple_of(MILLISECOND))
}

/// A tick is 10 ms.
#[test]
fn ticks_are_ten_milliseconds() {
    for ticks in [1, 2, 3, 10, 99, 1000] {
        let mut bench = waiting("", &[], &format!("WAIT TICKS, 0, {ticks}"));
        assert_eq!(duration(&mut bench, 11 * SECOND), ticks * TICK, "{ticks} ticks");
        assert_eq!(bench.variable(1), 1, "that is no time-out");
    }
    // The program's own clock agrees.
    let mut bench = Bench::played(&["SGP 132, 0, 0", "WAIT TICKS, 0, 123", "GGP 132, 0", "STOP"]);
    assert_eq!(bench.accumulator(), 1230);
}

/// Wherever in a millisecond the program was set off, and whatever it had to do before.
#[test]
fn ticks_are_exact_at_any_moment() {
    for offset in 0..20 {
        let mut bench = waiting("", &[], "WAIT TICKS, 0, 5");
        bench.run(offset * 73_000);
        assert_eq!(duration(&mut bench, SECOND), 5 * TICK, "set off {} us later", offset * 73);
    }
    let mut program = vec!["CALC ADD, 1"; 77];
    program.extend(["SGP 132, 0, 0", "WAIT TICKS, 0, 7", "GGP 132, 0", "STOP"]);
    assert_eq!(Bench::played(&program).accumulator(), 70);
}

#[test]
fn many_waits_do_not_drift() {
    let mut bench =
        Bench::with_program(&["SIO 0, 2, 1", "WAIT TICKS, 0, 1", "SIO 0, 2, 0", "WAIT TICKS, 0, 2", "JA 0"]);
    bench.set_off(0);
    let edges = bench.edges(0, 30 * SECOND);
    let spans = spans(&edges[1..]);
    let wrong = (0..spans.len()).find(|n| spans[*n] != TICK * (2 - *n as u64 % 2));
    assert_eq!(wrong.map(|n| (n, spans[n])), None);
    assert!(edges.len() >= 1998, "{} edges in 30 s", edges.len());
}

/// -1 takes the accumulator; it is not changed by that.
#[test]
fn minus_one_takes_the_accumulator() {
    for (line, time) in [("WAIT TICKS, 0, -1", 12 * TICK), ("WAIT REFSW, 0, -1", 12 * TICK)] {
        let mut bench = waiting("", &["CALC LOAD, 12"], line);
        assert_eq!(duration(&mut bench, SECOND), time, "{line}");
        assert_eq!(bench.accumulator(), 12);
    }
    // Zero from the accumulator is zero: no wait, or no time-out.
    for line in ["WAIT TICKS, 0, -1", "WAIT TICKS, 0, 0"] {
        let mut bench = waiting("", &[], line);
        bench.start(0);
        bench.run(2 * MILLISECOND);
        assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 1), "{line}");
    }
    let mut bench = waiting("", &[], "WAIT REFSW, 0, -1");
    bench.start(0);
    bench.run(100 * SECOND);
    assert!(bench.status().waiting);
}

/// Negative times, forms and motors that do not exist: the command fails, and the program goes on at once.
#[test]
fn waits_that_fail_are_ignored() {
    for (accumulator, line) in [
        (0, "WAIT TICKS, 0, -2"),
        (0, "WAIT TICKS, 0, -2147483648"),
        (0, "WAIT POS, 0, -2"),
        (0, "WAIT REFSW, 0, -1000"),
        (0, "WAIT LIMSW, 0, -2"),
        (0, "WAIT RFS, 0, -2"),
        (-1, "WAIT TICKS, 0, -1"),
        (-5, "WAIT REFSW, 0, -1"),
        (i32::MIN, "WAIT LIMSW, 0, -1"),
        (0, "WAIT 5, 0, 10"),
        (0, "WAIT 255, 0, 10"),
        (0, "WAIT POS, 1, 10"),
        (0, "WAIT REFSW, 255, 10"),
        (0, "WAIT LIMSW, 1, 10"),
        (0, "WAIT RFS, 1, 10"),
    ] {
        let mut bench =
            waiting("", &[&format!("CALC LOAD, {accumulator}"), "SAP 4, 0, 1", "MVP ABS, 0, 9000000"], line);
        bench.set_off(0);
        bench.run(5 * MILLISECOND);
        assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 1), "{accumulator}: {line}");
    }
    // The motor field of TICKS means nothing.
    assert_eq!(duration(&mut waiting("", &[], "WAIT TICKS, 7, 3"), SECOND), 3 * TICK);
}

/// The longest wait there is, 248 days: it has not ended early.
#[test]
fn a_very_long_wait_does_not_wrap() {
    for line in ["WAIT TICKS, 0, 2147483647", "WAIT REFSW, 0, 2147483647"] {
        let mut bench = waiting("", &[], line);
        bench.start(0);
        bench.run(60 * SECOND);
        assert!(bench.status().waiting, "{line}");
    }
}

/// Without a time-out: on the event, soon, and without the flag.
#[test]
fn waits_end_with_their_event() {
    for (event, (form, world, before)) in EVENTS.into_iter().enumerate() {
        for ticks in [0, 1000] {
            let mut bench = waiting(world, before, &format!("WAIT {form}, 0, {ticks}"));
            bench.start(0);
            bench.run(3 * SECOND);
            assert!(bench.status().waiting, "{form}");
            assert_eq!((bench.program_counter(), bench.mode()), (1, RUNNING), "{form}: held at the address of WAIT");
            happen(&mut bench, event);
            if form == "POS" {
                bench.run_until(20 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
            }
            bench.run(3 * MILLISECOND);
            assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 1), "{form}");
            assert!(!bench.status().waiting);
        }
    }
}

/// With a time-out that comes first: exactly then, and with the flag.
#[test]
fn waits_end_with_their_time_out() {
    for (form, world, before) in EVENTS {
        for ticks in [1, 25] {
            let mut bench = waiting(world, before, &format!("WAIT {form}, 0, {ticks}"));
            assert_eq!(duration(&mut bench, SECOND), ticks * TICK, "{form}, {ticks} ticks");
            assert_eq!(bench.variable(1), 2, "{form}");
        }
    }
}

/// An event that has happened already is not waited for.
#[test]
fn an_event_that_is_there_is_not_waited_for() {
    for (event, (form, world, _)) in EVENTS.into_iter().enumerate() {
        let mut bench = waiting(world, &[], &format!("WAIT {form}, 0, 1"));
        if (1..4).contains(&event) {
            happen(&mut bench, event);
            bench.run(3 * MILLISECOND);
        }
        bench.set_off(0);
        bench.run(5 * MILLISECOND);
        assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 1), "{form}");
    }
}

/// The other switches are not waited for.
#[test]
fn a_wait_knows_its_switch() {
    for (form, others) in [("REFSW", ["left", "right"]), ("LIMSW", ["home", "home"])] {
        for other in others {
            let mut bench = waiting("", &[], &format!("WAIT {form}, 0, 20"));
            bench.control(&format!("press {other}"));
            assert_eq!(duration(&mut bench, SECOND), 20 * TICK, "{form}, {other} pressed");
            assert_eq!(bench.variable(1), 2);
        }
    }
}

/// A positioning right before WAIT POS: it waits for this move, not for the one before; also for moves of one
/// microstep and of none.
#[test]
fn waiting_for_the_position_after_mvp() {
    for distance in [0, 1, -1, 2, 500, -51_200] {
        let mut bench =
            Bench::with_program(&[&format!("MVP REL, 0, {distance}"), "WAIT POS, 0, 0", "GAP 1, 0", "STOP"]);
        for round in 1..=3 {
            bench.run_to_end(0);
            assert_eq!(bench.accumulator(), round * distance, "{distance}");
            assert_eq!(bench.rotor(), i64::from(round * distance));
        }
    }
}

/// The flag of a time-out stays until CLE ETO or CLE ALL, through waits that end well.
#[test]
fn the_time_out_flag_stays_until_cleared() {
    for (line, stays) in [
        ("CALC ADD, 0", true),
        ("WAIT TICKS, 0, 1", true),
        ("WAIT LIMSW, 0, 0", true),
        ("CLE EAL", true),
        ("CLE EDV", true),
        ("CLE EPO", true),
        ("CLE ESD", true),
        ("CLE 6", true),
        ("CLE ETO", false),
        ("CLE ALL", false),
    ] {
        let mut bench = waiting("", &[], "WAIT REFSW, 0, 1");
        bench.control("press left");
        bench.run_to_end(0);
        bench.download(0, &[line, "JC ETO, 4", "SGP 1, 2, 1", "STOP", "SGP 1, 2, 2", "STOP"]);
        bench.run_to_end(0);
        assert_eq!(bench.variable(1), if stays { 2 } else { 1 }, "{line}");
    }
}

/// A host that stops a waiting program sends it on at the same WAIT.
#[test]
fn a_stopped_wait_begins_again() {
    let mut bench = waiting("", &[], "WAIT TICKS, 0, 50");
    bench.start(0);
    bench.run(20 * TICK);
    bench.ok("128");
    assert_eq!(bench.status(), Status { mode: STOPPED, waiting: false, pointer: 1 });
    bench.run(SECOND);
    assert_eq!((bench.variable(1), bench.outputs()[0]), (0, true));
    bench.ok("129, 0");
    bench.run(48 * TICK);
    assert!(bench.status().waiting, "the whole time again");
    bench.run(3 * TICK);
    assert_eq!((bench.ask("GGP 1, 2"), bench.outputs()[0]), ((OK, 1), false));
}
