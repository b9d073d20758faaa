//! Motion: every axis goes where it was sent, at its own speed, and tells of its arrival.

use super::{Bench, UNIT_OF_SPEED};
use hal_sim::clock::{MILLISECOND, SECOND};

/// Speed, acceleration and target of an axis: other ones for each axis, and every second axis to the left.
fn journey(axis: u8) -> (i32, i32, i32) {
    let n = i32::from(axis);
    (600 + 150 * n, 300 + 100 * n, (8_000 + 4_000 * n) * if axis.is_multiple_of(2) { 1 } else { -1 })
}

#[test]
fn all_axes_go_to_their_own_targets_at_the_same_time() {
    for mut bench in Bench::bare() {
        for axis in bench.axes() {
            let (speed, acceleration, _) = journey(axis);
            bench.ok(&format!("SAP 4, {axis}, {speed}"));
            bench.ok(&format!("SAP 5, {axis}, {acceleration}"));
        }
        for axis in bench.axes() {
            bench.ok(&format!("MVP ABS, {axis}, {}", journey(axis).2));
        }
        bench.run(200 * MILLISECOND);
        for (axis, state) in bench.axes().zip(bench.states()) {
            let (speed, _, target) = journey(axis);
            assert_eq!(state.velocity.signum(), target.signum(), "axis {axis} is on its way");
            assert!(state.velocity.abs() <= speed, "axis {axis}");
        }
        bench.run_until(5 * SECOND, |bench| bench.all(8).iter().all(|reached| *reached == 1));
        bench.run(10 * MILLISECOND);
        for (axis, state) in bench.axes().zip(bench.states()) {
            let target = journey(axis).2;
            assert_eq!((state.position, state.rotor, state.lost_steps), (target, target.into(), 0), "axis {axis}");
            assert_eq!((bench.get(0, axis), bench.get(1, axis), bench.get(3, axis)), (target, target, 0));
        }
    }
}

#[test]
fn all_axes_turn_at_their_own_speeds() {
    for mut bench in Bench::bare() {
        let speed = |axis: u8| (i32::from(axis) * 170 + 300) * if axis.is_multiple_of(3) { -1 } else { 1 };
        for axis in bench.axes() {
            bench.ok(&format!("ROR {axis}, {}", speed(axis)));
        }
        bench.run(SECOND);
        let (before, from) = (bench.states(), bench.now());
        bench.run(2 * SECOND);
        let span = (bench.now() - from) as f64 / SECOND as f64;
        for (axis, (before, after)) in bench.axes().zip(before.iter().zip(bench.states())) {
            let (way, expected) = (after.rotor - before.rotor, f64::from(speed(axis)) * UNIT_OF_SPEED * span);
            assert!((way as f64 - expected).abs() < 2.0, "axis {axis}: {way} in place of {expected}");
            assert_eq!((after.velocity, after.lost_steps), (speed(axis), 0), "axis {axis}");
        }
        let turning: Vec<i32> = bench.axes().map(speed).collect();
        assert_eq!(bench.all(3), turning);
        // One after the other is stopped, and the others turn on.
        for axis in bench.axes() {
            bench.ok(&format!("MST {axis}"));
            bench.run(SECOND / 2);
            let expected: Vec<i32> =
                bench.axes().map(|other| if other <= axis { 0 } else { turning[usize::from(other)] }).collect();
            assert_eq!((bench.speeds(), bench.all(3)), (expected.clone(), expected), "axis {axis} was stopped last");
        }
    }
}

/// Nothing that the world or the chips show of the others changes when one axis moves; and GAP says the same.
#[test]
fn one_axis_moves_and_the_others_stand() {
    for mut bench in Bench::bare() {
        // Each has a place of its own, and has been standing for so long that it has its standby current.
        for axis in bench.axes() {
            bench.ok(&format!("MVP ABS, {axis}, {}", 1_000 * (i32::from(axis) + 1)));
        }
        bench.run(4 * SECOND);
        for axis in bench.axes() {
            let (states, positions) = (bench.states(), bench.all(1));
            bench.ok(&format!("MVP REL, {axis}, -3000"));
            for _ in 0..20 {
                bench.run(20 * MILLISECOND);
                let now = bench.all(1);
                for other in bench.others(axis).map(usize::from) {
                    assert_eq!(bench.states()[other], states[other], "axis {axis} moves, axis {other} does not");
                    assert_eq!(now[other], positions[other]);
                }
            }
            assert_eq!(bench.get(1, axis), positions[usize::from(axis)] - 3_000);
            bench.run(3 * SECOND);
        }
    }
}

/// An axis is sent elsewhere while all are on their way: it alone goes there.
#[test]
fn one_axis_is_sent_elsewhere_while_all_move() {
    for mut bench in Bench::bare() {
        bench.each("MVP ABS, #, 60000");
        bench.run(SECOND / 2);
        let last = bench.axes().end - 1;
        bench.ok(&format!("MVP ABS, {last}, -1000"));
        bench.ok("MVP REL, 0, 500");
        let nearer = bench.get(0, 0);
        assert!((10_000..40_000).contains(&nearer), "{nearer}");
        bench.run(6 * SECOND);
        let mut expected = vec![60_000; usize::from(bench.spec.axes)];
        (expected[0], expected[usize::from(last)]) = (nearer, -1_000);
        assert_eq!(bench.all(1), expected);
        assert!(bench.states().iter().zip(&expected).all(|(state, place)| state.rotor == i64::from(*place)));
    }
}

/// A move that is longer than the 24 bits of the motion controller's counter goes by way of waypoints, for each axis.
#[test]
fn all_axes_go_further_than_the_counter_of_the_motion_controller() {
    for mut bench in Bench::bare() {
        bench.each("SAP 4, #, 2047");
        // Without this divisor the way would take five minutes; and the ramp is that of the larger speed then.
        bench.each("SAP 154, #, 0");
        let target = |axis: u8| (9_000_000 + i32::from(axis) * 10_000) * if axis.is_multiple_of(2) { -1 } else { 1 };
        for axis in bench.axes() {
            bench.ok(&format!("MVP ABS, {axis}, {}", target(axis)));
        }
        bench.run_until(60 * SECOND, |bench| {
            bench.run(100 * MILLISECOND);
            bench.all(8).iter().all(|reached| *reached == 1)
        });
        let targets: Vec<i32> = bench.axes().map(target).collect();
        assert_eq!(bench.all(1), targets);
        assert!(bench.states().iter().zip(targets).all(|(state, target)| state.rotor == i64::from(target)));
    }
}

/// However many axes arrive in the same millisecond, each has its event, in the order of their numbers. This holds when
/// each was sent by itself, as a group, as a set, on a straight line, and when reference searches end. With type 0 the
/// event comes once, with type 1 each time.
#[test]
fn axes_that_arrive_at_once_are_all_told() {
    // The group index of all axes, and what starts them: as many of them as can go on a line, or all.
    let starts = [
        (0, "MVP REL, #, 500"),
        (1, "MVP REL, 0, 500"),
        (0, "MVP COORD, 255, 1"),
        (0, "MVP COORD, $47, 1"),
        (0, "RFS START, #"),
    ];
    for ((group, start), kind) in starts.into_iter().flat_map(|start| [(start, 0), (start, 1)]) {
        let world = |axes| "[[axis]]\nstage.left = -500\n".repeat(axes);
        for mut bench in [Bench::tmcm_3110(&world(3)), Bench::six(&world(6))] {
            let all: Vec<u8> = bench.axes().collect();
            let started = if start.contains("$47") { &all[..3] } else { &all };
            bench.each(&format!("SAP 213, #, {group}"));
            bench.each("SCO 1, #, 500");
            bench.ok(&format!("138, {kind}, 0, 255"));
            if start.contains('#') {
                bench.each(start);
            } else {
                bench.ok(start);
            }
            bench.run(20 * SECOND);
            let mut arrivals = bench.arrivals();
            // Searches take a millisecond more or less.
            if start.contains("RFS") {
                arrivals.sort_unstable();
            }
            assert_eq!(arrivals, started, "{start}, type {kind}");
            bench.each("SAP 213, #, 0");
            for axis in started {
                bench.ok(&format!("MVP REL, {axis}, 100"));
            }
            bench.run(SECOND);
            let mut arrivals = bench.arrivals();
            arrivals.sort_unstable();
            assert_eq!(arrivals, if kind == 0 { &[] } else { started }, "behind {start}, type {kind}");
        }
    }
}

/// Command 138 tells of each axis by its bit when that arrives, and interrupt 3 + axis reaches the program; in the
/// order of the arrivals.
#[test]
fn the_arrival_of_each_axis_is_told() {
    for mut bench in Bench::bare() {
        let interrupts: Vec<u8> = bench.axes().map(|axis| 3 + axis).collect();
        bench.count_interrupts(&interrupts);
        assert_eq!(bench.ok("138, 1, 0, 255"), 255);
        // The last axis has the shortest way, so it arrives first; axis 1 is not sent anywhere.
        let sent: Vec<u8> = bench.others(1).collect();
        for axis in &sent {
            bench.ok(&format!("MVP ABS, {axis}, {}", 20_000 - 3_000 * i32::from(*axis)));
        }
        bench.run(5 * SECOND);
        let expected: Vec<u8> = sent.iter().rev().copied().collect();
        assert_eq!(bench.arrivals(), expected);
        for axis in bench.axes() {
            assert_eq!(bench.variable(3 + axis), i32::from(axis != 1), "interrupts of axis {axis}");
        }
        // Type 0: the next move of the last axis only.
        let last = bench.axes().end - 1;
        bench.ok(&format!("138, 0, 0, {}", 1 << last));
        bench.each("MVP REL, #, 1000");
        bench.run(SECOND);
        bench.each("MVP REL, #, 1000");
        bench.run(SECOND);
        assert_eq!(bench.arrivals(), [last]);
    }
}

/// A move that ends before its target, or gives way to another command, tells nothing; those of the others do.
#[test]
fn the_arrival_of_an_axis_that_is_stopped_is_not_told() {
    for mut bench in Bench::bare() {
        for stopped in bench.axes() {
            bench.ok("138, 1, 0, 255");
            bench.each("MVP REL, #, 10000");
            bench.run(100 * MILLISECOND);
            bench.ok(&format!("MST {stopped}"));
            bench.run(SECOND);
            let mut arrivals = bench.arrivals();
            arrivals.sort_unstable();
            assert_eq!(arrivals, bench.others(stopped).collect::<Vec<_>>());
        }
    }
}

/// WAIT POS and WAIT RFS in a program wait for the axis that they name.
#[test]
fn a_program_waits_for_the_axis_that_it_names() {
    for mut bench in Bench::bare() {
        let last = bench.axes().end - 1;
        bench.ok("132, 0, 0, 0");
        let program =
            ["MVP ABS, 0, 60000", &format!("MVP ABS, {last}, 5000"), &format!("WAIT POS, {last}, 0"), "GAP 1, 0"];
        for line in program.into_iter().chain(["AGP 100, 2", "WAIT POS, 0, 0", "GAP 1, 0", "AGP 101, 2", "STOP"]) {
            bench.ask(line);
        }
        bench.ok("133, 0, 0, 0");
        bench.ok("129, 1, 0, 0");
        bench.run_until(5 * SECOND, |bench| bench.ok("GGP 128, 0") == 0);
        let on_the_way = bench.variable(100);
        assert!((4_000..30_000).contains(&on_the_way), "{on_the_way}");
        assert_eq!(bench.variable(101), 60_000);
    }
}

/// Set going and stopped again before the next turn, a motor makes some steps all the same. The arrival back at its
/// target is told when it is there.
#[test]
fn the_steps_of_a_motor_that_turns_for_a_moment_count() {
    for mut bench in Bench::bare() {
        // From 0 to full speed, 500 000 microsteps a second, in a millisecond.
        for line in ["SAP 153, #, 0", "SAP 154, #, 0", "SAP 5, #, 2047", "138, 1, 0, 255"] {
            bench.each(line);
        }
        bench.run(SECOND);
        for axis in bench.axes() {
            bench.ok(&format!("ROR {axis}, 2047"));
            bench.ok(&format!("MST {axis}"));
            bench.run(SECOND);
            let steps = bench.states()[usize::from(axis)].position;
            assert!(steps > 1, "{steps}");
            // 244 microsteps a second.
            bench.ok(&format!("SAP 4, {axis}, 1"));
            bench.ok(&format!("MVP ABS, {axis}, 0"));
            bench.run_until(SECOND, |bench| !bench.late.is_empty());
            assert_eq!((bench.arrivals(), bench.states()[usize::from(axis)].position), (vec![axis], 0));
        }
    }
}
