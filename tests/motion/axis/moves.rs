//! When a move ends, at its target or before it.

use common::Bench;
use common::loose::LooseBench;
use hal_sim::clock::{MILLISECOND, SECOND};

/// Number of polls after which the state of a switch counts.
const SETTLED: usize = 20;

/// A motor that stands before a closed left switch.
fn before_a_switch() -> Bench {
    let mut bench = Bench::new();
    bench.ok("SAP 13, 0, 0");
    bench.control("press left");
    bench.run(100 * MILLISECOND);
    bench
}

/// How many polls it takes until the move is cut short, if it is before `limit`.
fn polls_until_cut_short(bench: &mut Bench, limit: usize) -> Option<usize> {
    (1..=limit).find(|_| {
        bench.poll(1);
        bench.cut_short()
    })
}

#[test]
fn a_move_ends_when_a_switch_has_held_it_for_twenty_polls() {
    for phase in 0..8 {
        let mut bench = before_a_switch();
        bench.poll(phase);
        bench.tell("MVP ABS, 0, -1000");
        assert_eq!(polls_until_cut_short(&mut bench, 100), Some(SETTLED), "phase {phase}");
        assert_eq!(bench.rotor(), 0);
    }
}

/// A switch that bounces, also in the last of the twenty, has not held it: they are counted anew. The motor has
/// moved in between, so that it may take two polls until its speed is known to be zero again.
#[test]
fn a_switch_that_bounces_holds_a_move_anew() {
    for bounce in 1..SETTLED {
        let mut bench = before_a_switch();
        bench.tell("MVP ABS, 0, -1000");
        assert_eq!(polls_until_cut_short(&mut bench, bounce), None);
        bench.control("release left");
        bench.poll(1);
        bench.control("press left");
        let polls = polls_until_cut_short(&mut bench, 100).unwrap();
        assert!((SETTLED..=SETTLED + 2).contains(&polls), "{polls} after poll {bounce}");
    }
}

/// Parameter 141: up to that far from where the chip's counter of 24 bits is zero the switch does not hold the motor,
/// however slowly it starts. Here it stands for 105 ms before its speed is 1. With 0 the switch holds it everywhere.
#[test]
fn the_tolerance_of_the_switches_ends_at_the_microstep() {
    for (tolerance, start, target, arrives) in [
        (0, 0, -50, false),
        (0, 1, -50, false),
        (100, 0, -50, true),
        (100, 100, -100, true),
        (100, -100, -101, true),
        (100, -101, -102, false),
        (99, -100, -101, false),
        (100, 1 << 24, (1 << 24) - 50, true),
        (100, 3 << 23, (3 << 23) - 50, false),
    ] {
        let mut bench = before_a_switch();
        for line in ["SAP 153, 0, 10", "SAP 154, 0, 4", "SAP 5, 0, 5"] {
            bench.ok(line);
        }
        bench.ok(&format!("SAP 141, 0, {tolerance}"));
        bench.ok(&format!("SAP 1, 0, {start}"));
        bench.ok(&format!("MVP ABS, 0, {target}"));
        bench.run(5 * SECOND);
        let seen = (bench.ok("GAP 1, 0"), bench.cut_short());
        assert_eq!(seen, if arrives { (target, false) } else { (start, true) }, "{tolerance}, {start}");
    }
}

/// A motor at its target on a closed switch stands like any other: a move to where it is arrives and is no error, and
/// it costs no more datagrams.
#[test]
fn a_closed_switch_at_the_target_is_none_of_a_move_s_concern() {
    let spent = [false, true].map(|closed| {
        let mut bench = Bench::in_world("[stage]\nleft = -1000\nright = 1000\n");
        for line in ["SAP 12, 0, 0", "SAP 13, 0, 0", "138, 1, 0, 1"] {
            bench.ok(line);
        }
        for target in if closed { [-1000, 1000] } else { [-900, 900] } {
            bench.ok(&format!("MVP ABS, 0, {target}"));
            bench.run(SECOND);
            for _ in 0..3 {
                bench.ok(&format!("MVP ABS, 0, {target}"));
                assert_eq!(bench.listen(SECOND / 10).len(), 1, "the event");
            }
            assert_eq!((bench.rotor(), bench.ok("GAP 8, 0"), bench.cut_short()), (target, 1, false));
        }
        let before = bench.datagrams();
        bench.poll(64);
        bench.datagrams() - before
    });
    assert_eq!(spent[0], spent[1]);
}

/// A program that reads the position, makes it the target and overwrites it: the motor passes its target at speed then.
/// It brakes along the ramp and stays where that ends; nothing pulls it back.
#[test]
fn a_position_overwritten_at_the_target_at_speed_stops_the_motor_along_the_ramp() {
    let mut bench = Bench::with_program(&["GAP 1, 0", "AAP 0, 0", "SAP 1, 0, 5000", "STOP"]);
    bench.ok("ROR 0, 1000");
    bench.run(SECOND);
    let rotor = bench.rotor();
    bench.start(0);
    bench.run(SECOND);
    // v^2 / 2a = 1000 microsteps, and 61 in the two milliseconds of the command.
    assert!((990..1100).contains(&(bench.rotor() - rotor)), "{}", bench.rotor() - rotor);
    let position = bench.ok("GAP 1, 0");
    assert!((5990..6010).contains(&position), "{position}");
    assert_eq!(bench.ok("GAP 138, 0"), 2);
}

/// ROR, or ROL, takes over from a move so long that it goes in legs. The motor turns on, at its speed, far past where
/// the next leg would have begun, and the motion controller is not told of targets.
#[test]
fn a_rotation_after_a_long_move_is_left_alone() {
    let rotate = |before: &str, line: &str, speed: i32| {
        let mut bench = Bench::new();
        for setting in ["SAP 153, 0, 3", "SAP 154, 0, 0", "SAP 4, 0, 2047", before] {
            bench.ok(setting);
        }
        bench.run(SECOND);
        bench.ok(line);
        bench.run(SECOND);
        let (from, before) = (bench.rotor(), bench.datagrams());
        for _ in 0..64 {
            bench.poll(256);
            assert_eq!(bench.module.board().borrow().tmc429(0).velocity(0), speed);
        }
        // 2047 is 499 756 microsteps a second.
        let moved = (bench.rotor() - from).abs();
        assert!((8_180_000..8_200_000).contains(&moved), "{moved}");
        bench.datagrams() - before
    };
    for (line, speed) in [("ROR 0, 2047", 2047), ("ROL 0, 2047", -2047)] {
        let usual = rotate("GAP 1, 0", line, speed);
        for before in ["MVP ABS, 0, 100000000", "MVP ABS, 0, -100000000"] {
            assert_eq!(rotate(before, line, speed), usual, "{before}, {line}");
        }
    }
}

/// A datagram that is lost where a leg of a long move begins: the move goes on and arrives.
#[test]
fn a_long_move_arrives_though_the_beginning_of_a_leg_was_not_heard() {
    for (lost, heard) in [(1, false), (2, false), (3, false), (1, true), (3, true)] {
        let mut bench = LooseBench::new();
        for line in ["SAP 153, 0, 3", "SAP 154, 0, 0", "SAP 4, 0, 2047", "MVP ABS, 0, 7000000"] {
            bench.ok(line);
        }
        bench.run(1000);
        // The next thing that is written is the target of the second leg.
        bench.fails.after(0, lost, heard);
        bench.run(16_000);
        assert_eq!(bench.fails.get(), 0);
        assert_eq!(bench.board.borrow().world().axis(0).motor().rotor(), 7_000_000, "{lost} lost, heard: {heard}");
    }
}

/// Command 138: into velocity mode and back to the target is another move than the one the host wanted to know of.
#[test]
fn velocity_mode_disarms_the_event() {
    for (mode, events) in [(1, 1), (2, 0)] {
        let mut bench = Bench::new();
        bench.ok("138, 1, 0, 1");
        bench.ok("MVP ABS, 0, 30000");
        bench.run(SECOND / 4);
        bench.ok(&format!("SAP 138, 0, {mode}"));
        bench.run(SECOND / 4);
        bench.ok("SAP 138, 0, 0");
        assert_eq!(bench.listen(5 * SECOND).len(), events, "mode {mode}");
        assert_eq!(bench.rotor(), 30_000);
    }
}

/// A move that a rotation has ended is none any more: the switch that stops the motor is not the end of a move.
#[test]
fn a_move_that_a_rotation_has_ended_is_not_cut_short() {
    for ends in ["ROR 0, 500", "SAP 138, 0, 2", "MST 0"] {
        let mut bench = Bench::new();
        bench.configure(&["SAP 12, 0, 0", "MVP ABS, 0, 100000"]);
        bench.run(200 * MILLISECOND);
        bench.tell(ends);
        bench.control("press right");
        bench.poll(10 * SETTLED);
        assert!(bench.speed() == 0 && bench.rotor() < 90_000 && !bench.cut_short(), "{ends}");
    }
}
