//! Reference search: every axis finds its own switch, while the others search theirs.

use super::{Bench, NOT_AVAILABLE, OK};
use hal_sim::clock::{MILLISECOND, SECOND};

/// How far the zero point may be from the middle between two edges. It is less than two milliseconds' way at the
/// default switch speed of 100, which is 3 microsteps a millisecond.
const TOLERANCE: i64 = 8;

/// The switches on the stage of an axis, in microsteps: left, right, and the edges of home.
fn stage(axis: u8) -> (i64, i64, [i64; 2]) {
    let n = i64::from(axis);
    (-9_000 - 700 * n, 11_000 + 900 * n, [3_000 + 500 * n, 3_400 + 600 * n])
}

fn world(axis: u8) -> String {
    let (left, right, home) = stage(axis);
    format!("stage.left = {left}\nstage.right = {right}\nstage.home = {home:?}")
}

/// The search mode of an axis, and where on its stage that has its zero point.
fn search(axis: u8) -> (i32, i64) {
    let (left, right, [first, second]) = stage(axis);
    let home = (first + second) / 2;
    [(1, left), (65, right), (5, home), (2, left), (66, right), (7, home)][usize::from(axis)]
}

fn searching(bench: &mut Bench) -> Vec<u8> {
    bench.axes().filter(|axis| bench.ok(&format!("RFS STATUS, {axis}")) != 0).collect()
}

#[test]
fn all_axes_find_their_own_switches_at_the_same_time() {
    for mut bench in Bench::both(world) {
        for axis in bench.axes() {
            bench.ok(&format!("SAP 193, {axis}, {}", search(axis).0));
            bench.ok(&format!("SAP 194, {axis}, {}", 500 + 60 * i32::from(axis)));
        }
        bench.ok("138, 1, 0, 255");
        bench.each("RFS START, #");
        bench.run(100 * MILLISECOND);
        assert!(searching(&mut bench).into_iter().eq(bench.axes()));
        bench.run_until(60 * SECOND, |bench| {
            bench.run(20 * MILLISECOND);
            searching(bench).is_empty()
        });
        for (axis, state) in bench.axes().zip(bench.states()) {
            let (mode, zero) = search(axis);
            assert!((state.rotor - zero).abs() <= TOLERANCE, "mode {mode}, axis {axis}: {} for {zero}", state.rotor);
            assert_eq!((state.position, state.velocity, state.lost_steps), (0, 0, 0), "axis {axis}");
            assert_eq!((bench.get(1, axis), bench.get(0, axis)), (0, 0), "axis {axis}");
            assert_eq!(
                i64::from(bench.get(197, axis)),
                state.rotor,
                "the position of the zero point before, axis {axis}"
            );
            let (left, right, _) = stage(axis);
            let distance = if matches!(mode, 2 | 66) { right - left } else { 0 };
            let measured = i64::from(bench.get(196, axis));
            assert!((measured - distance).abs() <= TOLERANCE, "axis {axis}: {measured} between the switches");
        }
        let mut arrivals = bench.arrivals();
        arrivals.sort_unstable();
        assert!(arrivals.into_iter().eq(bench.axes()), "the end of each search is told once");
    }
}

/// Axis after axis searches alone. The others stand, and what is pressed there is nothing to the one that searches.
#[test]
fn the_switches_of_other_axes_are_not_found() {
    for mut bench in Bench::both(world) {
        for axis in bench.axes() {
            bench.ok(&format!("SAP 193, {axis}, {}", search(axis).0));
            let positions = bench.all(1);
            bench.ok(&format!("RFS START, {axis}"));
            let press = |bench: &mut Bench, word: &str| {
                for other in bench.others(axis) {
                    for switch in ["left", "right", "home"] {
                        bench.control(&format!("{word} {switch} {other}"));
                    }
                }
            };
            bench.run(100 * MILLISECOND);
            let mut pressed = false;
            while searching(&mut bench) == [axis] {
                pressed = !pressed;
                press(&mut bench, if pressed { "press" } else { "release" });
                bench.run(70 * MILLISECOND);
            }
            press(&mut bench, "release");
            let found = bench.states()[usize::from(axis)].rotor;
            assert!((found - search(axis).1).abs() <= TOLERANCE, "axis {axis}: {found}");
            for other in bench.others(axis) {
                assert_eq!(bench.get(1, other), positions[usize::from(other)], "axis {axis} searched");
            }
        }
    }
}

/// While an axis searches, the others move and turn as they are told, and their stop switches act as their own
/// parameters say.
#[test]
fn one_axis_searches_while_the_others_turn() {
    for mut bench in Bench::both(|axis| if axis == 1 { world(axis) } else { String::new() }) {
        bench.each("ROL #, 700");
        bench.ok("SAP 193, 1, 5");
        bench.ok("RFS START, 1");
        bench.run(SECOND);
        for _ in 0..100 {
            bench.run(50 * MILLISECOND);
            let states = bench.states();
            assert!(bench.others(1).all(|other| states[usize::from(other)].velocity == -700));
        }
        assert!(searching(&mut bench).is_empty());
        let found = bench.states()[1].rotor;
        let [first, second] = stage(1).2;
        assert!((found - (first + second) / 2).abs() <= TOLERANCE, "{found}");
        assert!(bench.others(1).all(|other| bench.get(1, other) < -100_000));
    }
}

/// RFS STOP ends the search of one axis; the others find their switches. A search with a speed of zero is refused.
#[test]
fn the_search_of_one_axis_is_stopped() {
    for mut bench in Bench::both(world) {
        let last = bench.axes().end - 1;
        bench.each("RFS START, #");
        bench.run(100 * MILLISECOND);
        bench.ok(&format!("RFS STOP, {last}"));
        assert!(searching(&mut bench).into_iter().eq(bench.others(last)));
        bench.run(10 * SECOND);
        for (axis, state) in bench.axes().zip(bench.states()) {
            let found = (state.rotor - stage(axis).0).abs() <= TOLERANCE;
            assert_eq!((found, state.position == 0, state.velocity), (axis != last, axis != last, 0), "axis {axis}");
        }
        bench.ok(&format!("SAP 195, {last}, 0"));
        for axis in bench.axes() {
            let expected = if axis == last { NOT_AVAILABLE } else { OK };
            assert_eq!(bench.ask(&format!("RFS START, {axis}")).0, expected);
        }
    }
}
