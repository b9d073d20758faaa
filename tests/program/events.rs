//! Events at the edges of a program's life: while it stores, when it ends and starts again, when it is reset, and what
//! is none.

use common::Bench;
use common::program::{RUNNING, STOPPED};
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use tmcm_sim::VirtualModule;

/// Where the handler is.
const HANDLER: i32 = 100;
/// A handler that counts in variable 0.
const COUNT: [&str; 4] = ["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "RETI"];

/// A module whose input 0 calls a handler with every rising edge; all of that is set by the host.
fn with_handler(handler: &[&str]) -> Bench {
    let mut bench = Bench::new();
    bench.download(HANDLER, handler);
    for line in ["SGP 39, 3, 1", "VECT 39, 100", "EI 39", "EI 255"] {
        bench.ok(line);
    }
    bench
}

fn raise(bench: &mut Bench) {
    bench.control("input 0 0");
    bench.run(2 * MILLISECOND);
    bench.control("input 0 1");
    bench.run(2 * MILLISECOND);
}

// ---- while something is stored

/// A command that stores is carried out once. A handler that comes before the bytes are durable may end before or after
/// that, and what it changes meanwhile is not stored. Nor is a store that has failed tried again.
#[test]
fn a_store_that_a_handler_interrupts_is_carried_out_once() {
    for wait in ["CALC LOAD, 0", "WAIT TICKS, 0, 0", "WAIT TICKS, 0, 1"] {
        for fails in [false, true] {
            let mut interrupted = 0;
            for moment in 0..24 {
                let mut bench = with_handler(&["SGP 1, 2, 9", "SGP 2, 2, 1", wait, "RETI"]);
                bench.download(0, &["STGP 1, 2", "GGP 3, 2", "CALC ADD, 1", "AGP 3, 2", "STOP"]);
                bench.ok("SGP 1, 2, 5");
                bench.run(2 * MILLISECOND);
                let before = bench.page_writes();
                bench.set_off(0);
                // Within the millisecond in which it is started the program comes to its first command.
                bench.run(900 * MICROSECOND);
                bench.control("input 0 1");
                bench.run(moment * MILLISECOND / 4);
                if fails {
                    bench.control("fault eeprom on");
                }
                bench.await_end();
                bench.run(20 * MILLISECOND);
                bench.control("fault eeprom off");
                let what = format!("{wait}, {moment}, fails: {fails}");
                assert_eq!(bench.variable(3), 1, "{what}");
                let kept = Bench::with_eeprom(&bench.eeprom()).variable(1);
                assert!(kept == 5 || kept == 0 && fails, "{what}: {kept}");
                assert!(bench.page_writes() - before <= 1, "{what}");
                interrupted += bench.variable(2);
            }
            assert!(interrupted > 12, "{wait}, fails: {fails}: {interrupted}");
        }
    }
}

// ---- at an end, a reset, a start

/// Lets time pass until no program runs, and stops within that millisecond: what the host sends now comes before the
/// next look at the events.
fn until_it_ends(bench: &mut Bench) {
    for _ in 0..50 {
        if bench.ok_beside("GGP 128, 0") == STOPPED {
            return;
        }
        bench.run(100 * MICROSECOND);
    }
    panic!("it does not end");
}

/// An event that waits when a program ends is none of the next run's, however it ends and however soon it starts again.
#[test]
fn an_event_that_waits_at_the_end_of_a_program_is_forgotten() {
    for (end, start) in [
        (&["STOP"][..], "129, 1, 0, 50"),
        (&["STOP"], "129, 1, 0, 0"),
        (&["0, 0, 0, 0"], "129, 1, 0, 50"),
        (&["JA -1"], "129, 1, 0, 50"),
        (&["CSUB 4000"], "129, 1, 0, 50"),
        (&["VECT 0, 4000"], "129, 1, 0, 50"),
        (&["JA 2047"], "129, 1, 0, 50"),
        (&[], "129, 1, 0, 50"),
        (&[], "129, 0"),
    ] {
        for pause in [0, 3 * MILLISECOND] {
            let mut bench = with_handler(&COUNT);
            bench.download(50, &["JA 50"]);
            bench.download(2047, &["CALC LOAD, 0"]);
            let waiting = ["GGP 9, 2", "COMP 1", "JC NE, 0"];
            let program: Vec<&str> = waiting.iter().chain(end).chain(&["JA 0"]).copied().collect();
            bench.download(0, &program);
            bench.ok("DI 255");
            bench.start(0);
            bench.run(5 * MILLISECOND);
            raise(&mut bench);
            if end.is_empty() {
                bench.ok_beside("128");
            } else {
                bench.ok_beside("SGP 9, 2, 1");
            }
            until_it_ends(&mut bench);
            bench.run(pause);
            for line in ["SGP 9, 2, 0", "EI 255", start] {
                bench.ok_beside(line);
            }
            bench.run(50 * MILLISECOND);
            assert_eq!((bench.mode(), bench.variable(0)), (RUNNING, 0), "{end:?}, {start}, {pause} ns later");
            raise(&mut bench);
            assert_eq!(bench.variable(0), 1, "{end:?}, {start}: the next one counts");
        }
    }
}

/// 131 does not make the levels of the inputs unknown: an edge right behind it, with all enabled again and the program
/// started within the same millisecond, is one.
#[test]
fn an_edge_right_behind_a_reset_counts() {
    for (before, after, count) in [("0", "1", 1), ("1", "1", 0), ("1", "0", 0)] {
        let mut bench = with_handler(&COUNT);
        bench.download(0, &["JA 0"]);
        bench.control(&format!("input 0 {before}"));
        bench.start(0);
        bench.run(5 * MILLISECOND);
        bench.ok("SGP 0, 2, 0");
        let now = bench.module.now();
        for line in ["131", "VECT 39, 100", "EI 39", "EI 255", "129, 1"] {
            bench.ok_beside(line);
        }
        bench.control(&format!("input 0 {after}"));
        assert_eq!(bench.module.now(), now);
        bench.run(20 * MILLISECOND);
        assert_eq!(bench.variable(0), count, "{before} to {after}");
    }
}

// ---- what is none

/// Interrupt 3 is parameter 8 becoming 1. A move to where the motor stands leaves it 1; one whose target is taken back
/// at once has made it 0 in between.
#[test]
fn a_move_to_where_the_motor_stands_raises_no_interrupt() {
    let mut bench = Bench::new();
    bench.download(HANDLER, &COUNT);
    bench.download(0, &["VECT 3, 100", "EI 3", "EI 255", "JA 3"]);
    bench.start(0);
    bench.run(5 * MILLISECOND);
    for position in [0, 1000] {
        bench.ok(&format!("MVP ABS, 0, {position}"));
        bench.run(SECOND);
        let before = bench.variable(0);
        for line in [
            format!("MVP ABS, 0, {position}"),
            "MVP REL, 0, 0".into(),
            format!("SAP 0, 0, {position}"),
            format!("SAP 1, 0, {position}"),
            "SAP 138, 0, 1".into(),
            "SAP 138, 0, 0".into(),
        ] {
            bench.ok(&line);
            assert_eq!(bench.ok("GAP 8, 0"), 1, "{line}");
            bench.run(100 * MILLISECOND);
            assert_eq!(bench.variable(0), before, "{line}");
        }
        // In no time: over RS485 replies come at once.
        bench.ok_beside("MVP REL, 0, 5000");
        assert_eq!(bench.ok_beside("GAP 8, 0"), 0);
        bench.ok_beside(&format!("MVP ABS, 0, {position}"));
        bench.run(SECOND);
        assert_eq!((bench.variable(0), bench.ok("GAP 1, 0")), (before + 1, position));
    }
}

// ---- a stall

/// A stall ends a move once. What stands still afterwards is stopped by nothing any more. So neither the flag EPO, once
/// it is cleared, nor interrupt 15 nor the event of command 138 comes again, whatever happens to the motor.
#[test]
fn a_stall_ends_a_move_once() {
    for afterwards in [
        &["load 1"][..],
        &["load 0"],
        &["press right", "release right"],
        &["slip -20"],
        &["fault short-a on", "fault short-a off"],
        &["supply 8.4", "supply 24"],
    ] {
        let mut bench = Bench::new();
        bench.download(HANDLER, &COUNT);
        // Variable 1 shows the flag.
        bench.download(0, &["JC EPO, 3", "SGP 1, 2, 0", "JA 0", "SGP 1, 2, 1", "JA 0"]);
        for line in
            ["VECT 15, 100", "EI 15", "EI 255", "SAP 174, 0, 1", "SAP 5, 0, 100", "SAP 12, 0, 0", "138, 1, 0, 1"]
        {
            bench.ok(line);
        }
        for line in ["SAP 181, 0, 500", "SAP 212, 0, 1000", "SGP 68, 0, 3000"] {
            bench.ok(line);
        }
        bench.start(0);
        bench.ok("MVP ABS, 0, 500000");
        bench.run(SECOND);
        assert_eq!((bench.variable(0), bench.variable(1)), (0, 0));
        bench.control("load 1");
        bench.run(SECOND / 5);
        assert_eq!((bench.speed(), bench.variable(0), bench.variable(1)), (0, 1, 1));
        assert_eq!(bench.ok("GAP 207, 0") & 1, 1);
        bench.ok("CLE EPO");
        for event in afterwards {
            bench.control(event);
            // In between a heartbeat is missed.
            for milliseconds in [100, 4000] {
                assert_eq!(bench.listen(milliseconds * MILLISECOND), [], "{event}");
                // A low supply stops the program, too, as long as it is low.
                bench.ask("129, 0");
                bench.run(10 * MILLISECOND);
                assert_eq!((bench.variable(0), bench.variable(1)), (1, 0), "{event}, {milliseconds} ms");
            }
        }
        assert_eq!(bench.mode(), RUNNING, "{afterwards:?}");
    }
}
