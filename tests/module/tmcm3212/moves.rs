//! MVP by its options: where a distance counts from, sets of axes, groups; and the events of command 138.

use super::{bench, in_world};
use common::{Bench, INVALID_VALUE, OK};
use hal_sim::clock::SECOND;

fn positions(bench: &mut Bench) -> [i32; 3] {
    [0, 1, 2].map(|axis| bench.ok(&format!("GAP 1, {axis}")))
}

fn all_arrived(bench: &mut Bench) {
    bench.run_until(60 * SECOND, |bench| (0..3).all(|axis| bench.ok(&format!("GAP 8, {axis}")) == 1));
}

/// The events of command 138 that come while time passes, as axes.
fn events(bench: &mut Bench, seconds: u64) -> Vec<i32> {
    let mut events = Vec::new();
    for event in bench.listen(seconds * SECOND) {
        assert_eq!((event.status, event.opcode), (128, 138));
        events.push(event.value);
    }
    events
}

/// Parameter 127: 0 target, 1 actual position, which is the default and what the manual says of MVP REL, 2 encoder.
#[test]
fn a_distance_counts_from_what_parameter_127_says() {
    for (option, target) in [(None, 7_000), (Some(1), 7_000), (Some(0), 101_000), (Some(2), -500 + 1_000)] {
        let mut bench = bench();
        if let Some(option) = option {
            bench.ok(&format!("SAP 127, 0, {option}"));
        }
        // The motor is stopped on its way to 100000, at 6000; the encoder's position is -500.
        bench.ok("MVP ABS, 0, 100000");
        bench.ok("MST 0");
        bench.run(SECOND);
        bench.configure(&["SAP 1, 0, 6000", "SAP 209, 0, -500"]);
        if option == Some(0) {
            // Overwriting the position has made it the target, too.
            bench.configure(&["MVP ABS, 0, 100000", "MVP REL, 0, 1000"]);
        } else {
            bench.ok("MVP REL, 0, 1000");
        }
        assert_eq!(bench.ok("GAP 0, 0"), target, "{option:?}");
        bench.run_until(20 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
        assert_eq!(bench.ok("GAP 1, 0"), target);
        bench.refused("SAP 127, 0, 3", INVALID_VALUE);
    }
}

/// Each axis has an option of its own.
#[test]
fn axes_of_a_group_count_from_their_own() {
    let mut bench = bench();
    bench.configure(&["SAP 213, 0, 5", "SAP 213, 2, 5", "SAP 127, 2, 0"]);
    bench.configure(&["MVP ABS, 0, 30000", "MVP REL, 0, -500"]);
    // Axis 0 has hardly begun to move, axis 2 counts from where it was sent.
    let target = [0, 1, 2].map(|axis| bench.ok(&format!("GAP 0, {axis}")));
    assert!((-500..0).contains(&target[0]), "{target:?}");
    assert_eq!(target[1..], [0, 29_500]);
}

#[test]
fn sets_of_axes_go_to_a_coordinate() {
    let mut bench = bench();
    for (axis, [one, two]) in [[10_000, 1], [-20_000, 2], [30_000, 3]].into_iter().enumerate() {
        bench.configure(&[&format!("SCO 1, {axis}, {one}"), &format!("SCO 2, {axis}, {two}")]);
    }
    for (motor, number, expected) in [
        (0x87, 1, [10_000, -20_000, 30_000]),
        (0x47, 2, [1, 2, 3]),
        (0x43, 1, [10_000, -20_000, 3]),
        (255, 2, [1, 2, 3]),
        (0x84, 1, [1, 2, 30_000]),
        (1, 1, [1, -20_000, 30_000]),
    ] {
        let first = expected[if motor < 3 { 1 } else { (motor & 7_u8).trailing_zeros() as usize }];
        assert_eq!(bench.ask(&format!("MVP COORD, {motor}, {number}")), (OK, first), "{motor:#X}");
        all_arrived(&mut bench);
        assert_eq!(positions(&mut bench), expected, "{motor:#X}");
    }
    for motor in [3, 7, 0x40, 0x80, 0x88, 0x48, 0xC3, 0x8F, 0xBF, 0x7F, 254] {
        bench.refused(&format!("MVP COORD, {motor}, 1"), INVALID_VALUE);
        bench.refused(&format!("MVP ABS, {motor}, 1"), INVALID_VALUE);
    }
    for motor in [0x47, 0x87, 255] {
        bench.refused(&format!("MVP ABS, {motor}, 1"), INVALID_VALUE);
        bench.refused(&format!("MVP REL, {motor}, 1"), INVALID_VALUE);
        bench.refused(&format!("MVP COORD, {motor}, 21"), INVALID_VALUE);
        bench.refused(&format!("ROR {motor}, 1"), INVALID_VALUE);
    }
    assert_eq!(positions(&mut bench), [1, -20_000, 30_000]);
}

#[test]
fn axes_of_a_group_do_what_one_of_them_is_told() {
    let mut bench = bench();
    bench.configure(&["SAP 213, 0, 7", "SAP 213, 1, 7"]);
    bench.ok("MVP ABS, 1, 4000");
    all_arrived(&mut bench);
    assert_eq!(positions(&mut bench), [4_000, 4_000, 0]);
    bench.ok("ROR 0, 10000");
    bench.run(SECOND);
    assert_eq!([0, 1, 2].map(|axis| bench.ok(&format!("GAP 3, {axis}"))), [10_000, 10_000, 0]);
    bench.ok("MST 1");
    bench.run(SECOND);
    assert_eq!([0, 1, 2].map(|axis| bench.ok(&format!("GAP 3, {axis}"))), [0; 3]);
    bench.configure(&["SAP 213, 0, 0", "SAP 213, 1, 0", "MVP ABS, 2, 50"]);
    bench.run_until(SECOND, |bench| bench.ok("GAP 8, 2") == 1);
    let after = positions(&mut bench);
    assert_eq!(after[2], 50);
    bench.run(SECOND);
    assert_eq!(positions(&mut bench), after, "without an index each axis is alone");
}

/// A host that knows no number of axes asks with all eight bits.
#[test]
fn events_of_moves_and_searches_with_a_mask_of_255() {
    let stage = |axis: u8| format!("[axis.stage]\nleft = -{}\n", 3_000 * (1 + i32::from(axis)));
    let mut bench = in_world(stage);
    assert_eq!(bench.ok("138, 1, 0, 255"), 255);
    bench.configure(&["MVP ABS, 2, 3000", "MVP ABS, 0, 6000"]);
    assert_eq!(events(&mut bench, 3), [4, 1]);
    // Mode 1 goes to the left switch.
    for axis in 0..3 {
        bench.configure(&[&format!("SAP 194, {axis}, 20000"), &format!("SAP 195, {axis}, 5000")]);
        bench.ok(&format!("RFS START, {axis}"));
        let told = events(&mut bench, 8);
        assert_eq!((told, bench.ok(&format!("RFS STATUS, {axis}"))), (vec![1 << axis], 0), "axis {axis}");
        assert_eq!(bench.ok(&format!("GAP 1, {axis}")), 0);
    }
    // All at once, and one of them is stopped: that is none.
    for axis in 0..3 {
        bench.configure(&[&format!("MVP ABS, {axis}, 5000")]);
    }
    events(&mut bench, 3);
    for axis in 0..3 {
        bench.ok(&format!("RFS START, {axis}"));
    }
    bench.ok("RFS STOP, 1");
    let mut told = events(&mut bench, 20);
    told.sort_unstable();
    assert_eq!(told, [1, 4]);
}
