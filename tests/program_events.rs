//! Events at the edges of a program's life: while it stores, when it is reset, and what is none.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::Bench;
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};

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

// ---- while something is stored

/// A command that stores is carried out once: a handler that comes before the bytes are durable may end before or after
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
                let written = |bench: &Bench| {
                    let board = bench.module.board().borrow();
                    (0..256).map(|page| board.at25().page_writes(page)).sum::<u32>()
                };
                let before = written(&bench);
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
                assert!(written(&bench) - before <= 1, "{what}");
                interrupted += bench.variable(2);
            }
            assert!(interrupted > 12, "{wait}, fails: {fails}: {interrupted}");
        }
    }
}

// ---- at a reset

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

/// Interrupt 3 is parameter 8 becoming 1. A move to where the motor stands leaves it 1; one whose target is taken back at
/// once has made it 0 in between.
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
