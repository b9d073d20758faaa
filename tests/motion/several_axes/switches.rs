//! Stop switches: every axis stops at its own.

use super::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};

/// The stop switches of an axis, in microsteps.
fn ends(axis: u8) -> [i64; 2] {
    let n = i64::from(axis);
    [-8_000 - 900 * n, 6_000 + 1_100 * n]
}

fn world(axis: u8) -> String {
    let [left, right] = ends(axis);
    format!("stage.left = {left}\nstage.right = {right}")
}

/// The numbers of the interrupts of the left, or right, stop switches.
fn interrupts(bench: &Bench, side: u8) -> Vec<u8> {
    bench.axes().map(|axis| 27 + 2 * axis + side).collect()
}

#[test]
fn all_axes_turn_until_their_own_stop_switches() {
    for mut bench in Bench::both(world) {
        let numbers: Vec<u8> = [0, 1].into_iter().flat_map(|side| interrupts(&bench, side)).collect();
        for number in &numbers {
            bench.ok(&format!("SGP {number}, 3, 1"));
        }
        bench.count_interrupts(&numbers);
        bench.each("SAP 12, #, 0");
        bench.each("SAP 13, #, 0");
        for (side, command) in [(1_u8, "ROR #, 500"), (0, "ROL #, 600")] {
            bench.each(command);
            bench.run(3 * SECOND);
            for (axis, state) in bench.axes().zip(bench.states()) {
                // The step that comes with the switch may still be made.
                let end = ends(axis)[usize::from(side)];
                assert!((0..=1).contains(&(state.rotor.abs() - end.abs())), "axis {axis}: {} for {end}", state.rotor);
                assert_eq!([bench.get(11, axis), bench.get(10, axis)], [1 - i32::from(side), i32::from(side)]);
            }
            for number in &numbers {
                let closed = side == 0 || number % 2 == 0;
                assert_eq!(bench.variable(*number), i32::from(closed), "interrupt {number}");
            }
        }
    }
}

/// A switch that is pressed by hand stops the axis that it belongs to at once, and no other. When it is released the
/// axis stands until it is told to turn again.
#[test]
fn a_switch_that_is_pressed_stops_its_axis_alone() {
    for mut bench in Bench::bare() {
        bench.each("SAP 12, #, 0");
        bench.each("SAP 13, #, 0");
        for (turn, switch, speed) in [("ROR #, 400", "right", 400), ("ROL #, 500", "left", -500)] {
            bench.each(turn);
            bench.run(SECOND);
            for axis in bench.axes() {
                bench.control(&format!("press {switch} {axis}"));
                bench.run(2 * MILLISECOND);
                let mut expected = vec![speed; usize::from(bench.spec.axes)];
                expected[usize::from(axis)] = 0;
                assert_eq!((bench.speeds(), bench.all(3)), (expected.clone(), expected), "{switch} switch of {axis}");
                for other in bench.axes() {
                    let pressed = i32::from(other == axis);
                    let seen = [bench.get(11, other), bench.get(10, other)];
                    assert_eq!(seen, if switch == "left" { [pressed, 0] } else { [0, pressed] });
                }
                bench.control(&format!("release {switch} {axis}"));
                bench.run(SECOND);
                let mut told = vec![speed; usize::from(bench.spec.axes)];
                told[usize::from(axis)] = 0;
                assert_eq!((bench.speeds(), bench.all(2)), (told.clone(), told), "{switch} switch of {axis} is open");
                bench.ok(&turn.replace('#', &axis.to_string()));
                bench.run(SECOND);
                assert_eq!(bench.speeds(), vec![speed; usize::from(bench.spec.axes)]);
            }
        }
    }
}

/// Parameters 12, 13 and 149 are those of an axis: a switch that is disabled stops nothing, and one with a soft stop
/// brakes.
#[test]
fn what_a_switch_does_is_for_each_axis_to_say() {
    for mut bench in Bench::bare() {
        bench.each("SAP 5, #, 100");
        bench.each("SAP 12, #, 0");
        bench.ok("SAP 12, 0, 1");
        bench.ok("SAP 149, 1, 1");
        bench.each("ROR #, 500");
        bench.run(SECOND);
        for axis in bench.axes() {
            bench.control(&format!("press right {axis}"));
        }
        bench.run(10 * MILLISECOND);
        let speeds = bench.speeds();
        assert_eq!(speeds[0], 500);
        assert!((1..500).contains(&speeds[1]), "{speeds:?}");
        assert!(speeds[2..].iter().all(|speed| *speed == 0), "{speeds:?}");
    }
}

/// A positioning move that a stop switch ends is not told as an arrival, and those of the others are.
#[test]
fn a_move_ends_at_a_stop_switch() {
    for mut bench in Bench::both(world) {
        bench.each("SAP 12, #, 0");
        bench.ok("138, 1, 0, 255");
        // Beyond the switch of axis 0, but not beyond those of the others.
        bench.each("MVP ABS, #, 7000");
        bench.run(3 * SECOND);
        let mut arrivals = bench.arrivals();
        arrivals.sort_unstable();
        assert!(arrivals.into_iter().eq(bench.others(0)));
        assert!((6_000..6_002).contains(&bench.get(1, 0)));
    }
}

/// WAIT LIMSW waits for a switch of the axis that it names.
#[test]
fn a_program_waits_for_the_switches_of_an_axis() {
    for mut bench in Bench::bare() {
        for axis in bench.axes() {
            bench.ok("SGP 100, 2, 0");
            bench.ok("132, 0, 0, 0");
            for line in [&format!("WAIT LIMSW, {axis}, 0"), "CALC LOAD, 1", "AGP 100, 2", "STOP"] {
                bench.ask(line);
            }
            bench.ok("133, 0, 0, 0");
            bench.ok("129, 1, 0, 0");
            for other in bench.others(axis) {
                bench.control(&format!("press left {other}"));
                bench.control(&format!("press right {other}"));
            }
            bench.run(100 * MILLISECOND);
            assert_eq!(bench.variable(100), 0);
            bench.control(&format!("press right {axis}"));
            bench.run(100 * MILLISECOND);
            assert_eq!(bench.variable(100), 1);
            for axis in bench.axes() {
                bench.control(&format!("release left {axis}"));
                bench.control(&format!("release right {axis}"));
            }
            bench.run(100 * MILLISECOND);
        }
    }
}
