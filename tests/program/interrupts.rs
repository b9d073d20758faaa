//! Interrupts of programs: what raises each of them (manual sections 3.6.6 and 5.4).

use common::Bench;
use common::program::RUNNING;
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm_sim::VirtualModule;

/// Where handlers are.
const HANDLER: i32 = 100;
/// A handler that counts in variable 0; four commands.
const COUNT: [&str; 4] = ["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "RETI"];

/// A program that enables one interrupt, with its handler, and then does nothing in this way.
fn waiting_for(bench: &mut Bench, interrupt: u8, idle: &[&str]) {
    bench.download(HANDLER, &COUNT);
    let enable = [format!("VECT {interrupt}, {HANDLER}"), format!("EI {interrupt}")];
    let mut program = vec![&*enable[0], &*enable[1], "EI 255"];
    program.extend(idle);
    bench.download(0, &program);
    bench.start(0);
    bench.run(5 * MILLISECOND);
}

/// Doing nothing: busily, or waiting for ever.
const IDLE: [&[&str]; 2] = [&["JA 3"], &["WAIT REFSW, 0, 0"]];

// ---- timers

/// Each timer calls its handler once in its period, exactly.
#[test]
fn timers_keep_their_period() {
    for idle in IDLE {
        for timer in 0..3 {
            for period in [1, 2, 7, 10, 500] {
                let mut bench = Bench::new();
                bench.ok(&format!("SGP {timer}, 3, {period}"));
                waiting_for(&mut bench, timer, idle);
                for _ in 0..3 {
                    let start = bench.module.now();
                    let before = bench.variable(0);
                    bench.module.run_until(start + 7000 * MILLISECOND);
                    assert_eq!(bench.variable(0) - before, 7000 / period, "timer {timer}, {period} ms, {idle:?}");
                }
            }
        }
    }
}

/// The moments themselves, seen at an output that the handler toggles.
#[test]
fn a_timer_s_handler_comes_evenly() {
    for period in [1, 3, 50] {
        let mut bench = Bench::new();
        bench.ok(&format!("SGP 1, 3, {period}"));
        waiting_for(&mut bench, 1, IDLE[1]);
        bench.download(HANDLER, &["GIO 0, 2", "JC NZ, 104", "SIO 0, 2, 1", "RETI", "SIO 0, 2, 0", "RETI"]);
        bench.start(0);
        let edges = bench.edges(0, 5 * SECOND);
        assert!(edges.len() >= 5000 / period - 2, "{period} ms: {} edges", edges.len());
        // The first may come while the host is being answered, within a millisecond that has begun. A program runs
        // after the chips have been looked after, which takes some datagrams of 24 us more or less.
        let (first, edges) = (edges[1], &edges[1..]);
        for (n, edge) in (0..).zip(edges) {
            let late = (edge - first).abs_diff(n * period as u64 * MILLISECOND);
            assert!(late < MILLISECOND / 10, "{period} ms, edge {n}: {late} ns");
        }
    }
}

/// A millisecond timer over a busy program, for a minute.
#[test]
fn a_millisecond_timer_counts_60_000_in_a_minute() {
    let mut bench = Bench::new();
    bench.ok("SGP 0, 3, 1");
    waiting_for(&mut bench, 0, &["CALC ADD, 1", "JA 3"]);
    let start = bench.module.now();
    let before = bench.variable(0);
    bench.module.run_until(start + 60 * SECOND);
    assert_eq!(bench.variable(0) - before, 60_000);
}

/// All three at once, each in its own period.
#[test]
fn timers_do_not_disturb_each_other() {
    let mut bench = Bench::new();
    let program = ["VECT 0, 100", "VECT 1, 110", "VECT 2, 120", "EI 0", "EI 1", "EI 2", "EI 255", "JA 7"];
    for timer in 0..3 {
        let [read, write] = [format!("GGP {timer}, 2"), format!("AGP {timer}, 2")];
        bench.download(HANDLER + 10 * timer, &[&read, "CALC ADD, 1", &write, "RETI"]);
    }
    bench.download(0, &program);
    for (timer, period) in [(0, 1), (1, 20), (2, 70)] {
        bench.ok(&format!("SGP {timer}, 3, {period}"));
    }
    bench.start(0);
    bench.run(SECOND);
    // The first look decides where in a period each timer is.
    for (timer, period) in [(0, 1), (1, 20), (2, 70)] {
        let start = bench.module.now();
        let before = bench.variable(timer);
        bench.module.run_until(start + 14 * SECOND);
        assert_eq!(bench.variable(timer) - before, 14_000 / period, "timer {timer}");
    }
}

/// Period 0 switches a timer off; a new period holds from then on; the longest are unsigned.
#[test]
fn a_timer_s_period_changes() {
    let mut bench = Bench::new();
    waiting_for(&mut bench, 0, IDLE[0]);
    let mut count = |period: u32| {
        bench.ok(&format!("SGP 0, 3, {period}"));
        let before = bench.variable(0);
        bench.run(SECOND);
        bench.variable(0) - before
    };
    assert_eq!(count(0), 0);
    assert!((99..=101).contains(&count(10)));
    assert!((19..=21).contains(&count(50)));
    assert_eq!(count(0), 0);
    for period in [u32::MAX, 0x8000_0000, 60_000] {
        assert_eq!(count(period), 0, "{period} ms");
    }
    // Not when the period before it is over.
    assert!((99..=101).contains(&count(10)));
}

/// A timer that was switched off by DI has its whole period before it when EI switches it on, however long it was off.
#[test]
fn a_timer_that_was_off_has_its_whole_period() {
    for off in [20, 300, 1_000] {
        let mut bench = Bench::new();
        bench.ok("SGP 0, 3, 200");
        waiting_for(&mut bench, 0, IDLE[0]);
        bench.run(100 * MILLISECOND);
        bench.ok("DI 0");
        bench.run(off * MILLISECOND);
        bench.ok("EI 0");
        bench.run(190 * MILLISECOND);
        assert_eq!(bench.variable(0), 0, "off for {off} ms");
        bench.run(20 * MILLISECOND);
        assert_eq!(bench.variable(0), 1, "off for {off} ms");
    }
}

/// Without a program the timers stand; a program that goes on has its whole period before it.
#[test]
fn timers_stand_while_no_program_runs() {
    let mut bench = Bench::new();
    bench.ok("SGP 0, 3, 500");
    waiting_for(&mut bench, 0, IDLE[0]);
    bench.run(400 * MILLISECOND);
    bench.ok("128");
    bench.run(2 * SECOND);
    bench.ok("129, 0");
    bench.run(450 * MILLISECOND);
    assert_eq!(bench.variable(0), 0);
    bench.run(60 * MILLISECOND);
    assert_eq!(bench.variable(0), 1);
}

// ---- motion

#[test]
fn target_reached() {
    for idle in IDLE {
        let mut bench = Bench::new();
        waiting_for(&mut bench, 3, idle);
        bench.run(SECOND);
        assert_eq!(bench.variable(0), 0, "standing at the target is not reaching it");
        for (count, line) in [(1, "MVP ABS, 0, 5000"), (2, "MVP REL, 0, 1"), (3, "MVP ABS, 0, -1"), (4, "SAP 0, 0, 77")]
        {
            let before = bench.variable(0);
            bench.ok(line);
            assert!(bench.variable(0) == before || bench.ok("GAP 8, 0") == 1, "{line}: not before it is there");
            bench.run(2 * SECOND);
            assert_eq!(bench.variable(0), count, "{line}: once");
        }
        // A move that is stopped does not reach its target.
        bench.ok("MVP ABS, 0, 1000000");
        bench.run(100 * MILLISECOND);
        bench.ok("MST 0");
        bench.run(SECOND);
        assert_eq!(bench.variable(0), 4);
    }
}

/// Back and forth: the handler sends the motor to the other end; a single event missed and it would stand still.
#[test]
fn a_handler_drives_the_motor_back_and_forth() {
    for distance in [1, 2, 3, 100] {
        let mut bench = Bench::new();
        let there = format!("MVP ABS, 0, {distance}");
        bench.download(0, &["VECT 3, 100", "EI 3", "EI 255", &there, "JA 4"]);
        let handler = ["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "CALC AND, 1", "JC ZE, 107", "MVP ABS, 0, 0", "RETI"];
        bench.download(HANDLER, &handler);
        bench.download(HANDLER + 7, &[&there, "RETI"]);
        for parameter in ["SAP 4, 0, 2047", "SAP 5, 0, 2047"] {
            bench.ok(parameter);
        }
        bench.start(0);
        // A thousand cycles are two thousand arrivals.
        let mut last = 0;
        while last < 2000 {
            bench.run(SECOND);
            let count = bench.variable(0);
            assert!(count > last, "distance {distance}: it stands still after {count} moves");
            last = count;
        }
        assert_eq!(bench.lost_steps(), 0);
        assert!((0..=i64::from(distance)).contains(&bench.rotor()));
    }
}

/// The same with every move begun by the program behind WAIT POS, in either order of events.
#[test]
fn every_move_of_a_program_is_reported_once() {
    for distance in [1, 40] {
        let mut bench = Bench::new();
        bench.download(HANDLER, &COUNT);
        let (there, back) = (format!("MVP REL, 0, {distance}"), format!("MVP REL, 0, -{distance}"));
        bench.download(
            0,
            &[
                "VECT 3, 100",
                "EI 3",
                "EI 255",
                &there,
                "WAIT POS, 0, 0",
                &back,
                "WAIT POS, 0, 0",
                "GGP 1, 2",
                "CALC ADD, 2",
            ],
        );
        bench.download(9, &["AGP 1, 2", "COMP 500", "JC LT, 3", "WAIT TICKS, 0, 1", "STOP"]);
        bench.run_to_end(0);
        assert_eq!((bench.variable(0), bench.variable(1)), (500, 500), "distance {distance}");
    }
}

#[test]
fn stall() {
    let mut bench = Bench::new();
    bench.ok("SAP 174, 0, 1");
    waiting_for(&mut bench, 15, IDLE[0]);
    for count in 1..=3 {
        bench.ok("SAP 181, 0, 0");
        bench.ok("ROR 0, 1000");
        bench.run(SECOND);
        bench.ok("SAP 181, 0, 500");
        bench.run(SECOND);
        assert_eq!(bench.variable(0), count - 1);
        bench.control("load 1");
        bench.run(SECOND / 5);
        assert_eq!((bench.speed(), bench.variable(0)), (0, count));
        bench.control("load 0");
        bench.run(SECOND);
        assert_eq!(bench.variable(0), count, "once for each stall");
    }
}

/// The deviation of the built-in encoder (parameters 209, 212) and of an external one (216 to 218). The external one
/// has 2 000 lines and 51 200 / 8 000 * 512 = 3277 as its prescaler, without the three lowest bits 3264.
#[test]
fn deviation() {
    for (world, limit) in [("", 212), ("[abn]\nlines = 2000\n", 218)] {
        let mut bench = Bench::in_world(world);
        bench.ok("SAP 217, 0, 3264");
        waiting_for(&mut bench, 21, IDLE[0]);
        for count in 1..=3 {
            bench.ok(&format!("SAP {limit}, 0, 0"));
            let position = bench.ok("GAP 1, 0");
            for encoder in [209, 216] {
                bench.ok(&format!("SAP {encoder}, 0, {position}"));
            }
            bench.ok("ROR 0, 300");
            bench.run(SECOND);
            // Eight full steps are 2 048 microsteps.
            bench.control("slip -8");
            bench.run(SECOND);
            assert_eq!(bench.variable(0), count - 1, "without a limit it is nobody's business");
            bench.ok(&format!("SAP {limit}, 0, 1000"));
            bench.run(20 * MILLISECOND);
            assert_eq!((bench.speed(), bench.variable(0)), (0, count), "parameter {limit}");
            bench.run(SECOND);
            assert_eq!(bench.variable(0), count, "once for each deviation");
        }
    }
}

// ---- switches and inputs

/// Tells which of four changes, up, down, up, down, an interrupt has counted.
fn edges_counted(bench: &mut Bench, up: &str, down: &str) -> [i32; 4] {
    [up, down, up, down].map(|line| {
        let before = bench.variable(0);
        bench.control(line);
        bench.run(20 * MILLISECOND);
        bench.variable(0) - before
    })
}

/// Off, low to high, high to low, both.
const TRANSITIONS: [[i32; 4]; 4] = [[0, 0, 0, 0], [1, 0, 1, 0], [0, 1, 0, 1], [1, 1, 1, 1]];

#[test]
fn inputs() {
    for idle in IDLE {
        for input in 0..4 {
            let interrupt = 39 + input;
            // WAIT REFSW looks at the home switch, which is input 3.
            if input == 3 && idle == IDLE[1] {
                continue;
            }
            for (transition, expected) in TRANSITIONS.into_iter().enumerate() {
                let mut bench = Bench::new();
                bench.control(&format!("input {input} 0"));
                bench.run(20 * MILLISECOND);
                bench.ok(&format!("SGP {interrupt}, 3, {transition}"));
                waiting_for(&mut bench, interrupt, idle);
                let (up, down) = (format!("input {input} 1"), format!("input {input} 0"));
                assert_eq!(edges_counted(&mut bench, &up, &down), expected, "input {input}, transition {transition}");
                // The neighbours do not count.
                for other in (0..4).filter(|other| *other != input) {
                    let (up, down) = (format!("input {other} 1"), format!("input {other} 0"));
                    if !(idle == IDLE[1] && other == 3) {
                        assert_eq!(edges_counted(&mut bench, &up, &down), [0; 4], "input {other}, not {input}");
                    }
                }
            }
        }
    }
}

/// The levels of the stop switches are the logical ones of parameters 10 and 11: pressed is high.
#[test]
fn stop_switches() {
    for (interrupt, switch, other) in [(27, "left", "right"), (28, "right", "left")] {
        for (transition, expected) in TRANSITIONS.into_iter().enumerate() {
            let mut bench = Bench::new();
            bench.ok(&format!("SGP {interrupt}, 3, {transition}"));
            waiting_for(&mut bench, interrupt, IDLE[0]);
            for moving in [false, true] {
                let counted = edges_counted(&mut bench, &format!("press {switch}"), &format!("release {switch}"));
                assert_eq!(counted, expected, "{switch}, transition {transition}, moving {moving}");
                let others = edges_counted(&mut bench, &format!("press {other}"), &format!("release {other}"));
                assert_eq!(others, [0; 4], "{other}, not {switch}");
                bench.ok("ROR 0, 500");
            }
        }
    }
}

/// The stage's own switch, on the motor's way through it, also where it stops the motor.
#[test]
fn a_stop_switch_on_the_way() {
    for (stops, count) in [(1, 2), (0, 1)] {
        let mut bench = Bench::in_world("[stage]\nright = 10000\nright_width = 3000\n");
        bench.ok(&format!("SAP 12, 0, {stops}"));
        bench.ok("SGP 28, 3, 3");
        waiting_for(&mut bench, 28, IDLE[0]);
        bench.ok("MVP ABS, 0, 20000");
        bench.run(3 * SECOND);
        assert_eq!(bench.variable(0), count);
    }
}

/// The handler of an interrupt may take its time: meanwhile nothing of the program happens.
#[test]
fn a_long_handler_holds_the_program() {
    let mut bench = Bench::new();
    bench.ok("SGP 39, 3, 1");
    waiting_for(&mut bench, 39, &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "JA 3"]);
    bench.download(HANDLER, &["WAIT TICKS, 0, 20", "RETI"]);
    bench.start(0);
    bench.control("input 0 1");
    bench.run(10 * MILLISECOND);
    let count = bench.variable(1);
    bench.run(150 * MILLISECOND);
    assert_eq!((bench.variable(1), bench.mode()), (count, RUNNING));
    bench.run(100 * MILLISECOND);
    assert!(bench.variable(1) > count);
}

/// A timer that is faster than its handler: the program gets a command in between, so that it is never at a stand.
#[test]
fn too_many_interrupts_do_not_starve_the_program() {
    let mut bench = Bench::new();
    bench.ok("SGP 0, 3, 1");
    waiting_for(&mut bench, 0, &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "JA 3"]);
    bench.download(HANDLER, &["WAIT TICKS, 0, 1", "RETI"]);
    bench.start(0);
    let before = bench.variable(1);
    bench.run(10 * SECOND);
    // One command after each of a thousand handlers, and four to count one.
    let count = bench.variable(1) - before;
    assert!((225..=275).contains(&count), "{count}");
}

/// EEPROM writes delay no interrupts: a millisecond timer misses nothing while the program stores without end.
#[test]
fn a_program_that_stores_has_its_interrupts() {
    let mut bench = Bench::new();
    bench.ok("SGP 0, 3, 1");
    waiting_for(&mut bench, 0, &["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "STGP 1, 2", "JA 3"]);
    let start = bench.module.now();
    let before = bench.variable(0);
    bench.module.run_until(start + 10 * SECOND);
    assert_eq!(bench.variable(0) - before, 10_000);
    // A page takes 5 ms, and what the program does next waits for it: at most 200 in a second.
    let stored = bench.variable(1);
    assert!((500..=2000).contains(&stored), "{stored}");
    // All but the last has been waited for.
    let mut copy = Bench::with_eeprom(&bench.eeprom());
    assert!(copy.variable(1) >= stored - 1);
}

/// A handler that stores in the middle of a program that stores: each goes on when its own is durable.
#[test]
fn a_handler_stores_while_the_program_stores() {
    for delay in 0..20 {
        let mut bench = Bench::new();
        bench.ok("SGP 39, 3, 1");
        waiting_for(
            &mut bench,
            39,
            &["CALC ADD, 1", "AGP 1, 2", "STGP 1, 2", "COMP 40", "JC LT, 3", "SIO 0, 2, 1", "STOP"],
        );
        bench.download(HANDLER, &["SGP 2, 2, 7", "STGP 2, 2", "SIO 1, 2, 1", "RETI"]);
        bench.ok("SIO 0, 2, 0");
        bench.ok("CALC LOAD, 0");
        bench.start(0);
        bench.run(50 * MILLISECOND + delay * MILLISECOND / 4);
        bench.control("input 0 1");
        while !bench.outputs()[1] {
            let next = bench.module.next_event().unwrap();
            bench.module.run_until(next);
        }
        assert_eq!(Bench::with_eeprom(&bench.eeprom()).variable(2), 7);
        bench.await_end();
        assert_eq!((bench.variable(1), bench.outputs()[0]), (40, true));
        assert_eq!(Bench::with_eeprom(&bench.eeprom()).variable(1), 40);
    }
}
