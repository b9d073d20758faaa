//! Ends of a straight line: for one of its axes, which is told something else, or for all of them.

use super::Bench;
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};

/// A command to one axis of a line is for that axis: the others go on to their targets by themselves.
#[test]
fn a_command_takes_an_axis_out_of_its_line() {
    for (command, told) in [
        ("MST 0", 0),
        ("MST 1", 1),
        ("ROL 2, 300", 2),
        ("MVP ABS, 0, -20000", 0),
        ("SAP 0, 1, 7000", 1),
        ("SAP 1, 0, 5", 0),
    ] {
        let mut bench = Bench::six("");
        bench.draw(&[0, 1, 2], &[100_000, 50_000, 30_000]);
        bench.run(SECOND);
        bench.ok("138, 1, 0, 255");
        bench.ok(command);
        bench.run(6 * SECOND);
        for (axis, place) in [(0, 100_000), (1, 50_000), (2, 30_000)] {
            assert_eq!(bench.get(1, axis) == place, axis != told, "{command}: axis {axis}");
        }
    }
    // The speed is that of parameter 4 again, and a new line takes axes out of an old one.
    let mut bench = Bench::six("");
    bench.draw(&[0, 1, 2], &[200_000, 50_000, 30_000]);
    bench.run(SECOND);
    bench.ok("MST 0");
    bench.run(200 * MILLISECOND);
    assert_eq!(bench.speeds()[1..3], [1_000, 1_000]);
    bench.draw(&[1, 3, 4], &[-40_000, 80_000, 20_000]);
    bench.run(8 * SECOND);
    assert_eq!(bench.all(8), [0, 1, 1, 1, 1, 1]);
    assert_eq!((bench.get(1, 2), bench.get(1, 3), bench.get(1, 4)), (30_000, 80_000, 20_000));
}

/// An axis goes from one line to another: the leader of the old one, and a follower that leads the new one. Those that
/// are left go on at their own speeds.
#[test]
fn an_axis_goes_from_one_line_to_another() {
    let mut bench = Bench::six("");
    bench.draw(&[0, 1, 2], &[200_000, 50_000, 30_000]);
    bench.run(SECOND);
    bench.draw(&[0, 3], &[-100_000, 20_000]);
    bench.run(SECOND / 2);
    assert_eq!(bench.speeds()[..3], [-1_000, 1_000, 1_000]);
    let mut bench = Bench::six("");
    bench.draw(&[0, 1, 2], &[200_000, 50_000, 30_000]);
    bench.run(SECOND);
    bench.draw(&[1, 3], &[150_000, 10_000]);
    bench.run(SECOND / 2);
    let speeds = bench.speeds();
    assert_eq!((speeds[0], speeds[1]), (1_000, 1_000));
    assert!((147..=153).contains(&speeds[2]) && (64..=69).contains(&speeds[3]), "{speeds:?}");
}

/// Two lines: the axis that leads one of them gets another speed, and its followers with it, at their shares: 250 and
/// 150 of
/// 1000. Then it is told to stop. The others of that line go on at their own speeds, and the other line goes on as a
///       line.
#[test]
fn of_two_lines_one_loses_its_leader() {
    for (first, second) in [([0, 1, 2], [3, 4, 5]), ([3, 4, 5], [0, 1, 2])] {
        let mut bench = Bench::six("");
        for axes in [[0, 1, 2], [3, 4, 5]] {
            bench.draw(&axes, &[400_000, 100_000, 60_000]);
        }
        let is_line = |[leader, one, other]: [i32; 3], speed: i32| {
            leader == speed && one.abs_diff(speed / 4) <= 3 && other.abs_diff(speed * 3 / 20) <= 3
        };
        bench.run(SECOND);
        bench.ok(&format!("SAP 4, {}, 600", first[0]));
        bench.run(SECOND / 2);
        let speeds = bench.speeds();
        assert!(is_line(first.map(|axis| speeds[axis]), 600), "{speeds:?}");
        assert!(is_line(second.map(|axis| speeds[axis]), 1_000), "{speeds:?}");
        bench.ok(&format!("MST {}", first[0]));
        bench.run(SECOND / 2);
        let speeds = bench.speeds();
        assert_eq!(first.map(|axis| speeds[axis]), [0, 1_000, 1_000]);
        assert!(is_line(second.map(|axis| speeds[axis]), 1_000), "{speeds:?}");
    }
}

/// A line that has lost an axis is no line any more. When a switch, a stall or its driver stops one of its axes, the
/// others are stopped along their ramps. Axes that are not of the line go on.
#[test]
fn what_stops_one_axis_of_a_line_stops_the_line() {
    for (event, axes) in [("press right #", [0, 2, 4]), ("load 1 #", [4, 0, 2]), ("fault short-a on #", [2, 4, 0])] {
        for met in axes {
            let mut bench = Bench::six("");
            bench.each("SAP 12, #, 0");
            bench.each("SAP 174, #, 1");
            bench.each("SAP 181, #, 300");
            bench.ok("138, 1, 0, 255");
            bench.draw(&axes, &[200_000, 190_000, 180_000]);
            bench.ok("MVP ABS, 1, 20000");
            bench.run(SECOND);
            bench.control(&event.replace('#', &met.to_string()));
            bench.run(SECOND);
            assert!(bench.speeds().iter().all(|speed| *speed == 0), "{event} {met}: {:?}", bench.speeds());
            assert_eq!(bench.arrivals(), [1], "{event} {met}");
            assert!(axes.iter().all(|axis| (10_000..150_000).contains(&bench.ramp(*axis).1)));
            // The host waits for none of them any more, so it is told nothing when SAP has them go on.
            bench.control(
                &event
                    .replace("press", "release")
                    .replace("load 1", "load 0")
                    .replace(" on ", " off ")
                    .replace('#', &met.to_string()),
            );
            for axis in axes {
                bench.ok(&format!("SAP 138, {axis}, 0"));
            }
            bench.run(7 * SECOND);
            assert_eq!((bench.all(8), bench.arrivals()), (vec![1; 6], vec![]), "{event} {met}");
        }
    }
}

/// An event that stops all axes ends the line, too, and nothing goes on by itself afterwards.
#[test]
fn a_line_does_not_go_on_after_the_supply_was_lost() {
    let mut bench = Bench::six("");
    bench.draw(&[0, 1, 2], &[200_000, 190_000, 180_000]);
    bench.run(SECOND);
    bench.control("supply 5");
    bench.run(100 * MILLISECOND);
    bench.control("supply 24");
    bench.run(SECOND);
    assert_eq!((bench.speeds(), bench.all(8)), (vec![0; 6], vec![0, 0, 0, 1, 1, 1]));
    bench.straight(&[0, 1, 2], &[20_000, 10_000, 5_000], 10);
}

/// The first motion command after a line is as any other.
#[test]
fn moves_after_a_line_have_their_own_pace() {
    let mut bench = Bench::six("");
    bench.straight(&[0, 1, 2], &[20_000, 5_000, 333], 10);
    for axis in [0, 1, 2] {
        bench.ok(&format!("MVP REL, {axis}, 50000"));
        bench.run(SECOND);
        assert_eq!(bench.ramp(axis).0, 1_000);
        bench.run(3 * SECOND);
    }
}

/// A divisor, or soft mode, is for the axis that it is written to: its units, or its ramps, are not those of its line
/// any more. It goes on to its target, and so do the others.
#[test]
fn a_divisor_or_soft_mode_takes_an_axis_out_of_its_line() {
    for setting in ["SAP 154, 1, 4", "SAP 154, 0, 4", "SAP 153, 2, 8", "SAP 138, 1, 1"] {
        let mut bench = Bench::six("");
        bench.draw(&[0, 1, 2], &[100_000, 50_000, 30_000]);
        bench.run(SECOND);
        assert_eq!(bench.ramp(2).0, 300, "on the line");
        bench.ok(setting);
        bench.run(200 * MILLISECOND);
        let alone = setting[9..10].parse::<u8>().unwrap();
        let speed = |axis: u8| bench.ramp(axis).0;
        assert_eq!(speed(alone), 1_000, "{setting}: its own speed");
        // What is left of the line has a leader, or all go on alone.
        for axis in (0..3).filter(|axis| *axis != alone) {
            let expected = if alone == 0 { 1_000 } else { [1_000, 500, 300][usize::from(axis)] };
            assert!((speed(axis) - expected).abs() <= 2, "{setting}: axis {axis} turns at {}", speed(axis));
        }
        bench.run(20 * SECOND);
        assert_eq!((bench.get(1, 0), bench.get(1, 1), bench.get(1, 2)), (100_000, 50_000, 30_000), "{setting}");
    }
    // A refused one changes nothing.
    let mut bench = Bench::six("");
    bench.draw(&[0, 1, 2], &[100_000, 50_000, 30_000]);
    bench.run(SECOND);
    assert_eq!(bench.ask("SAP 154, 1, 14").0, 4);
    bench.run(200 * MILLISECOND);
    assert!((bench.ramp(1).0 - 500).abs() <= 2);
}

/// In soft mode an axis would come late: on a line it has the ramps of the others, and is not in soft mode any more.
#[test]
fn a_line_is_straight_for_axes_in_soft_mode() {
    let mut bench = Bench::six("");
    for axis in [0, 2] {
        bench.ok(&format!("SAP 138, {axis}, 1"));
    }
    bench.straight(&[0, 1, 2], &[100_000, 50_000, -30_000], 10);
    assert_eq!(bench.all(138)[..3], [0, 0, 0]);
}

/// A command that stops an axis on a line stops it by its own parameter 5: SAP 1 as well as MST.
#[test]
fn an_axis_that_leaves_its_line_brakes_by_itself() {
    let rest = |command: &str| {
        let mut bench = Bench::six("");
        bench.draw(&[0, 1, 2], &[200_000, 20_000, 10_000]);
        bench.run(SECOND);
        let before = bench.rotor(1);
        bench.ok(command);
        bench.run(SECOND);
        bench.rotor(1) - before
    };
    let (stopped, renumbered) = (rest("MST 1"), rest("SAP 1, 1, 0"));
    assert!((stopped - renumbered).abs() <= 2, "{stopped} and {renumbered} microsteps");
}

/// While the others of a broken line come to rest they are where the line is.
#[test]
fn a_broken_line_is_straight_to_its_end() {
    let mut bench = Bench::six("");
    bench.pace(2_000, 200);
    bench.draw(&[0, 1, 2], &[100_000, 300_000, 200_000]);
    bench.run(2 * SECOND);
    bench.control("fault short-a on 0");
    bench.run(5 * SECOND);
    assert!(bench.rotor(1) < 299_000, "it has stopped");
    let off = bench.rotor(1) as f64 / 300_000.0 - bench.rotor(2) as f64 / 200_000.0;
    assert!((off * 300_000.0).abs() < 300.0, "{off}: {} and {}", bench.rotor(1), bench.rotor(2));
}

/// A press that stops an axis for 3 ms breaks its line, whatever the axis' share of the way is and wherever in a
/// millisecond the switch closes. The line stays broken when the switch opens, after as long as it may be: then this
/// axis stays, too.
#[test]
fn a_line_that_a_short_press_has_broken_stays_broken() {
    const WAYS: [i32; 3] = [200_000, 60_000, -40_000];
    for (axis, side) in [(0, "right"), (1, "right"), (2, "left")] {
        for (phase, span) in (0..8).map(|phase| (phase, 3_000)).chain([(0, 10_000), (0, 25_000), (0, 500_000)]) {
            let mut bench = Bench::six("");
            bench.each("SAP 12, #, 0");
            bench.each("SAP 13, #, 0");
            bench.draw(&[0, 1, 2], &WAYS);
            bench.run(SECOND + phase * 125 * MICROSECOND);
            let before = bench.rotor(0);
            bench.control(&format!("press {side} {axis}"));
            bench.run(span * MICROSECOND);
            bench.control(&format!("release {side} {axis}"));
            bench.run(7 * SECOND);
            let what = format!("axis {axis}, phase {phase}, {span} us");
            assert_eq!((bench.speeds(), bench.all(3)), (vec![0; 6], vec![0; 6]), "{what}");
            assert_eq!(bench.get(0, axis), bench.get(1, axis), "{what}");
            // It is positioning with a ramp, at its target; the others were told to stand.
            let modes = [0, 1, 2].map(|other| if other == axis { 0 } else { 2 });
            assert_eq!(bench.all(138)[..3], modes, "{what}");
            let rotors = [0, 1, 2].map(|axis| bench.rotor(axis));
            assert!(rotors[0].abs_diff(before) < 2_000, "{what}: {rotors:?} from {before}");
            // Less than what the axes make in the time in which they brake.
            for (rotor, way) in rotors.iter().zip(WAYS) {
                let off = *rotor as f64 - rotors[0] as f64 * f64::from(way) / f64::from(WAYS[0]);
                assert!(off.abs() < 600.0, "{what}: {off} microsteps off the line: {rotors:?}");
            }
        }
    }
}

/// The contacts of a switch that bounce for less than a millisecond break no line.
#[test]
fn a_line_outlives_a_glitch() {
    let mut bench = Bench::six("");
    bench.each("SAP 12, #, 0");
    bench.draw(&[0, 1, 2], &[100_000, 60_000, 40_000]);
    for axis in [0, 1, 2] {
        bench.run(500 * MILLISECOND);
        bench.control(&format!("press right {axis}"));
        bench.run(900 * MICROSECOND);
        bench.control(&format!("release right {axis}"));
    }
    bench.run(5 * SECOND);
    assert_eq!(bench.all(8), vec![1; 6]);
    assert_eq!([0, 1, 2].map(|axis| bench.get(1, axis)), [100_000, 60_000, 40_000]);
}
