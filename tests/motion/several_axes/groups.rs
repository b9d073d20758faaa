//! Commands for several axes: MVP COORD with a set of them, which begin to move at once, and the group index (parameter
//! 213).

use super::{Bench, NOT_AVAILABLE};
use hal_sim::board::{Chip, Datagram};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::tmcl::Status;

const INVALID_VALUE: u8 = Status::InvalidValue as u8;

/// Gives all axes a coordinate 2 of their own, in the direction of `sign`.
fn coordinates(bench: &mut Bench, sign: i32) {
    for axis in bench.axes() {
        bench.ok(&format!("SCO 2, {axis}, {}", sign * (1_000 * i32::from(axis) + 5_000)));
    }
}

/// The TMC429 and the ramp generator of a datagram that writes a target or a ramp mode.
fn sets_going(datagram: &Datagram) -> Option<u8> {
    let [first, ..] = datagram.bytes[..] else { return None };
    let Chip::Tmc429(chip) = datagram.chip else { return None };
    // The register stands in bits 4 to 1: 0 is X_TARGET, 10 the ramp mode (TMC429 datasheet, section 6.2.2.1).
    (matches!(first & 0x1F, 0 | 0x14)).then(|| 3 * chip as u8 + (first >> 5))
}

/// Each set moves the axes that it has; the reply is the target of the first one.
#[test]
fn a_set_of_axes_goes_to_a_coordinate() {
    for (motor, moved) in [
        (0x87, vec![0, 1, 2]),
        (0xAA, vec![1, 3, 5]),
        (0x90, vec![4]),
        (0xBF, vec![0, 1, 2, 3, 4, 5]),
        (255, vec![0, 1, 2, 3, 4, 5]),
        (0x62, vec![1, 5]),
        (0x48, vec![3]),
        (4, vec![4]),
    ] {
        let mut bench = Bench::six("");
        coordinates(&mut bench, 1);
        bench.ok("138, 1, 0, 255");
        let place = |axis: u8| 1_000 * i32::from(axis) + 5_000;
        assert_eq!(bench.ok(&format!("MVP COORD, {motor}, 2")), place(moved[0]), "{motor:#x}");
        bench.run(2 * SECOND);
        for axis in bench.axes() {
            let expected = if moved.contains(&axis) { place(axis) } else { 0 };
            assert_eq!(bench.get(1, axis), expected, "{motor:#x}: axis {axis}");
        }
        let mut arrivals = bench.arrivals();
        arrivals.sort_unstable();
        assert_eq!(arrivals, moved, "{motor:#x}");
    }
}

#[test]
fn sets_that_are_refused_move_nothing() {
    for mut bench in Bench::bare() {
        coordinates(&mut bench, 1);
        bench.each("ROR #, 100");
        bench.run(SECOND / 2);
        let turning = bench.speeds();
        let missing = if bench.spec.axes == 3 { [0x88, 0x49, 0xBF] } else { [0x80, 0x40, 0xC7] };
        let refused = [6, 0x3F, 0x80, 0x40, 0xC0, 0xC7, 0xFE, 0x7C, 0x4F].into_iter().chain(missing);
        for motor in refused {
            for kind in ["COORD", "ABS", "REL"] {
                assert_eq!(bench.ask(&format!("MVP {kind}, {motor}, 2")).0, INVALID_VALUE, "{kind} {motor:#x}");
            }
        }
        // No other command knows sets, MVP knows them for coordinates only, and a coordinate has to exist.
        for line in ["MVP ABS, $83, 2", "MVP REL, $43, 2", "MVP REL, 255, 2", "ROR $83, 9", "MST $83", "SCO 2, $83, 1"]
        {
            assert_eq!(bench.ask(&line.replace("$83", "131").replace("$43", "67")).0, INVALID_VALUE, "{line}");
        }
        for motor in [0x83, 0x43, 255] {
            assert_eq!(bench.ask(&format!("MVP COORD, {motor}, 21")).0, INVALID_VALUE);
            assert_eq!(bench.ask(&format!("MVP COORD, {motor}, -1")).0, INVALID_VALUE);
            assert_eq!(bench.ask(&format!("MVP 3, {motor}, 2")).0, Status::WrongType as u8);
        }
        // On a line, and there alone, the divisors have to be equal.
        for divisor in ["SAP 153, 2, 8", "SAP 154, 2, 4"] {
            bench.ok(divisor);
            assert_eq!(bench.ask("MVP COORD, 70, 2").0, NOT_AVAILABLE);
            assert_eq!(bench.ask("MVP COORD, 69, 2").0, NOT_AVAILABLE);
            bench.ok("SAP 153, 2, 7");
            bench.ok("SAP 154, 2, 3");
        }
        bench.run(100 * MILLISECOND);
        assert_eq!(bench.speeds(), turning);
        // While the motors are locked none moves.
        bench.control("supply 5");
        bench.run(100 * MILLISECOND);
        for motor in [0x83, 0x43, 255] {
            assert_eq!(bench.ask(&format!("MVP COORD, {motor}, 2")).0, NOT_AVAILABLE);
        }
        bench.control("supply 24");
        bench.run(SECOND);
        assert!(bench.speeds().iter().all(|speed| *speed == 0));
        bench.ok("SAP 154, 2, 4");
        bench.ok("MVP COORD, $87, 2");
        bench.run(5 * SECOND);
        assert_eq!(bench.all(1)[..3], [5_000, 6_000, 7_000]);
    }
}

/// The last thing that the chips are told is the datagram that makes each motor go: one after the other, with nothing
/// in between. So the first axis is ahead of the last one by what it gains in less than 0.2 ms.
#[test]
fn a_set_of_axes_starts_at_once() {
    for (motor, axes) in [(0x87, 3), (0x47, 3), (255, 6)] {
        for turns in [false, true] {
            let mut bench = Bench::six("");
            // The ramp generator accelerates in steps of 8 microseconds, by 8 units of speed in each.
            for line in ["SAP 153, #, 2", "SAP 5, #, 2047", "SAP 4, #, 2047", "SAP 6, #, 200"] {
                bench.each(line);
            }
            if turns {
                bench.each("ROL #, 50");
                bench.run(SECOND / 2);
                bench.each("MST #");
            }
            bench.run(3 * SECOND);
            for axis in bench.axes() {
                bench.ok(&format!("SCO 2, {axis}, 300000"));
            }
            bench.board.borrow_mut().take_datagrams();
            bench.ok(&format!("MVP COORD, {motor}, 2"));
            let sent = bench.board.borrow_mut().take_datagrams();
            let last: Vec<u8> = sent[sent.len() - axes..].iter().filter_map(sets_going).collect();
            assert_eq!(last, (0..axes as u8).collect::<Vec<_>>(), "{sent:?}");
            let speeds = bench.speeds();
            let ahead = speeds[0] - speeds[axes - 1];
            assert!(speeds[0] > 0 && (0..200).contains(&ahead), "{speeds:?}");
        }
    }
}

/// A search ends where its axis is sent elsewhere with others, and tells nothing.
#[test]
fn a_set_of_axes_ends_their_searches() {
    for motor in [0x47, 0x87] {
        let mut bench = Bench::six("");
        coordinates(&mut bench, 1);
        bench.ok("138, 1, 0, 255");
        bench.ok("RFS START, 1");
        bench.run(SECOND);
        bench.ok(&format!("MVP COORD, {motor}, 2"));
        assert_eq!(bench.ok("RFS STATUS, 1"), 0);
        bench.run(6 * SECOND);
        assert_eq!(bench.all(1)[..3], [5_000, 6_000, 7_000]);
        let mut arrivals = bench.arrivals();
        arrivals.sort_unstable();
        assert_eq!(arrivals, [0, 1, 2]);
    }
}

/// Bit 6 with one axis is a plain move: also with an axis whose divisors are others.
#[test]
fn a_line_of_one_axis_is_a_plain_move() {
    let mut bench = Bench::six("");
    coordinates(&mut bench, 30);
    bench.ok("SAP 153, 2, 5");
    bench.ok("MVP COORD, $44, 2");
    bench.run(SECOND);
    assert_eq!(bench.speeds(), [0, 0, 1_000, 0, 0, 0]);
    bench.ok("SAP 4, 2, 300");
    bench.run(SECOND);
    assert_eq!(bench.speeds(), [0, 0, 300, 0, 0, 0]);
}

/// Axes 0, 2 and 4 are one group, 1 and 5 another, and axis 3 is in none.
fn grouped() -> Bench {
    let mut bench = Bench::six("");
    for (axis, index) in [(0, 7), (2, 7), (4, 7), (1, 255), (5, 255)] {
        bench.ok(&format!("SAP 213, {axis}, {index}"));
    }
    bench
}

#[test]
fn axes_of_a_group_turn_and_stop_together() {
    let mut bench = grouped();
    for (line, speeds) in [
        ("ROR 2, 300", [300, 0, 300, 0, 300, 0]),
        ("ROL 5, 200", [300, -200, 300, 0, 300, -200]),
        ("ROR 3, 100", [300, -200, 300, 100, 300, -200]),
        ("MST 4", [0, -200, 0, 100, 0, -200]),
        ("SAP 2, 1, 400", [0, 400, 0, 100, 0, -200]),
        ("MST 3", [0, 400, 0, 0, 0, -200]),
        ("MST 1", [0; 6]),
    ] {
        bench.ok(line);
        bench.run(SECOND);
        assert_eq!(bench.speeds(), speeds, "{line}");
    }
    assert_eq!(bench.ask("ROR 2, 2048").0, INVALID_VALUE);
    bench.ok("SAP 213, 4, 0");
    bench.ok("ROR 0, 10");
    bench.run(SECOND);
    assert_eq!(bench.speeds(), [10, 0, 10, 0, 0, 0]);
}

/// To a position, by a distance from where each of them is, and to the coordinate of each. The reply is the target of
/// the axis that was named, and each arrival is told.
#[test]
fn axes_of_a_group_go_together() {
    let mut bench = grouped();
    bench.ok("138, 1, 0, 255");
    for (line, reply, places) in [
        ("MVP ABS, 2, 3000", 3_000, [3_000, 0, 3_000, 0, 3_000, 0]),
        ("MVP ABS, 3, 100", 100, [3_000, 0, 3_000, 100, 3_000, 0]),
        ("MVP COORD, 4, 2", 9_000, [5_000, 0, 7_000, 100, 9_000, 0]),
        ("MVP REL, 2, -500", 6_500, [4_500, 0, 6_500, 100, 8_500, 0]),
        ("MVP COORD, 5, 2", 10_000, [4_500, 6_000, 6_500, 100, 8_500, 10_000]),
        ("SAP 0, 0, 0", 0, [0, 6_000, 6_500, 100, 8_500, 10_000]),
        ("MVP COORD, $81, 2", 5_000, [5_000, 6_000, 6_500, 100, 8_500, 10_000]),
    ] {
        coordinates(&mut bench, 1);
        let before = bench.all(1);
        assert_eq!(bench.ok(line), reply, "{line}");
        bench.run(2 * SECOND);
        assert_eq!(bench.all(1), places, "{line}");
        let mut arrivals = bench.arrivals();
        arrivals.sort_unstable();
        let moved: Vec<u8> =
            bench.axes().filter(|axis| before[usize::from(*axis)] != places[usize::from(*axis)]).collect();
        let expected = if line.starts_with("SAP") { vec![] } else { moved };
        assert_eq!(arrivals, expected, "{line}");
    }
}

#[test]
fn axes_of_a_group_search_together() {
    let world: String = (0..6).map(|axis| format!("[[axis]]\nstage.left = {}\n", -4_000 - 500 * axis)).collect();
    let mut bench = Bench::six(&world);
    for axis in [0, 2, 4] {
        bench.ok(&format!("SAP 213, {axis}, 7"));
    }
    bench.ok("138, 1, 0, 255");
    bench.ok("RFS START, 2");
    bench.run(100 * MILLISECOND);
    let searching = |bench: &mut Bench| -> Vec<i32> { (0..6).map(|n| bench.ok(&format!("RFS STATUS, {n}"))).collect() };
    assert_eq!(searching(&mut bench), [1, 0, 1, 0, 1, 0]);
    bench.run(20 * SECOND);
    assert_eq!((searching(&mut bench), bench.all(1)), (vec![0; 6], vec![0; 6]));
    let mut arrivals = bench.arrivals();
    arrivals.sort_unstable();
    assert_eq!(arrivals, [0, 2, 4]);
    bench.ok("MVP ABS, 0, 4000");
    bench.run(SECOND);
    assert_eq!(bench.arrivals().len(), 3);
    bench.ok("RFS START, 4");
    bench.run(100 * MILLISECOND);
    assert_eq!(searching(&mut bench), [1, 0, 1, 0, 1, 0]);
    bench.ok("RFS STOP, 0");
    assert_eq!(searching(&mut bench), [0; 6]);
    bench.run(SECOND);
    assert_eq!((bench.speeds(), bench.arrivals()), (vec![0; 6], vec![]));
}

/// An action that is not allowed to one axis of a group is done by none of them.
#[test]
fn a_group_of_which_an_axis_refuses_does_nothing() {
    let mut bench = grouped();
    for number in [194, 195] {
        bench.ok(&format!("SAP {number}, 4, 0"));
        assert_eq!(bench.ask("RFS START, 0").0, NOT_AVAILABLE);
        bench.run(100 * MILLISECOND);
        assert_eq!((bench.speeds(), bench.ok("RFS STATUS, 0")), (vec![0; 6], 0));
        bench.ok(&format!("SAP {number}, 4, 100"));
    }
    bench.control("supply 5");
    bench.run(100 * MILLISECOND);
    for line in ["ROR 0, 100", "ROL 0, 100", "MVP ABS, 0, 100", "MVP REL, 2, 100", "MVP COORD, 4, 2", "RFS START, 0"] {
        assert_eq!(bench.ask(line).0, NOT_AVAILABLE, "{line}");
    }
    bench.control("supply 24");
    bench.run(100 * MILLISECOND);
    for line in ["MVP COORD, 0, 21", "MVP COORD, 4, -1", "ROR 0, 5000"] {
        assert_eq!(bench.ask(line).0, INVALID_VALUE, "{line}");
    }
    bench.run(SECOND);
    assert_eq!((bench.speeds(), bench.all(1)), (vec![0; 6], vec![0; 6]));
}
