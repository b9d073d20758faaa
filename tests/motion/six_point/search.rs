//! Reference searches of all modes, three at a time; and all that may happen to three axes, at the same time.

use common::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm_sim::Product;

/// How far the zero point may be from the middle between two edges. It is what a motor goes in two milliseconds at the
/// switch speed of 4000 pps, and one microstep for each edge.
const TOLERANCE: i64 = 10;
/// The stop switches are closed for 1000 and 1600 microsteps, the home switch for 801.
const LEFT: i64 = -40_000;
const RIGHT: i64 = 60_000;
const STAGE: &str = "stage.left = -40000\nstage.left_width = 1000\nstage.right = 60000\nstage.right_width = 1600\n\
     stage.home = [20000, 20800]\n";
const HOME: i64 = 20_400;

/// Three axes, each with a stage; the home switches of some are closed at a low level.
fn bench(inverted: [bool; 3]) -> Bench {
    let axis = |inverted| {
        let contacts = if inverted { "stage.normally_closed = [\"home\"]\n" } else { "" };
        format!("[[axis]]\n{STAGE}{contacts}")
    };
    let mut bench = Bench::of_in_world(Product::Tmcm3212, &inverted.map(axis).concat());
    for axis in 0..3 {
        for setting in ["5, #, 500000", "17, #, 500000", "194, #, 40000", "195, #, 4000"] {
            bench.ok(&format!("SAP {}", setting.replace('#', &axis.to_string())));
        }
    }
    bench
}

fn rotor(bench: &Bench, axis: usize) -> i64 {
    bench.module.board().borrow().world().axis(axis).motor().rotor()
}

/// Each mode, where a motor starts, and where its zero point is.
const MODES: [(i32, i32, i64); 16] = [
    (1, 0, LEFT),
    (2, 0, LEFT),
    (3, 0, LEFT - 500),
    (4, 0, LEFT - 500),
    (5, 0, HOME),
    (6, 0, HOME),
    (7, 0, HOME),
    // On a circle, downwards.
    (8, 40_000, HOME),
    (65, 0, RIGHT),
    (66, 0, RIGHT),
    (67, 0, RIGHT + 800),
    (68, 0, RIGHT + 800),
    (133, 0, HOME),
    (134, 0, HOME),
    (135, 0, HOME),
    (136, 40_000, HOME),
];

#[test]
fn every_mode_finds_its_zero_point_three_at_a_time() {
    for first in 0..MODES.len() {
        let modes = [0, 5, 10].map(|next| MODES[(first + next) % MODES.len()]);
        let mut bench = bench(modes.map(|(mode, ..)| mode >= 128));
        for (axis, (mode, start, _)) in modes.iter().enumerate() {
            bench.ok(&format!("MVP ABS, {axis}, {start}"));
            bench.ok(&format!("SAP 193, {axis}, {mode}"));
        }
        bench.run(4 * SECOND);
        for axis in 0..3 {
            bench.ok(&format!("RFS START, {axis}"));
        }
        bench.run_until(60 * SECOND, |bench| {
            bench.run(20 * MILLISECOND);
            (0..3).all(|axis| bench.ok(&format!("RFS STATUS, {axis}")) == 0)
        });
        for (axis, (mode, _, zero)) in modes.into_iter().enumerate() {
            let found = rotor(&bench, axis);
            assert!((found - zero).abs() <= TOLERANCE, "mode {mode}: {found} in place of {zero}");
            let values = [1, 0, 3].map(|number| bench.ok(&format!("GAP {number}, {axis}")));
            assert_eq!(values, [0; 3], "mode {mode}");
            assert_eq!(i64::from(bench.ok(&format!("GAP 197, {axis}"))), found, "mode {mode}");
            if matches!(mode, 2 | 66) {
                let distance = i64::from(bench.ok(&format!("GAP 196, {axis}")));
                assert!((distance - (RIGHT - LEFT)).abs() <= TOLERANCE, "mode {mode}: {distance}");
            }
        }
    }
}

/// Three axes at the same time: one searches, one stalls, one moves; then one deviates, one stops at its switch and one
/// turns on.
#[test]
fn what_happens_to_one_axis_is_nothing_to_the_others() {
    let world = format!("[[axis]]\n{STAGE}[[axis]]\n[[axis]]\nabn.lines = 1000\n");
    let mut bench = Bench::of_in_world(Product::Tmcm3212, &world);
    bench.configure(&["SAP 5, 0, 500000", "SAP 193, 0, 2", "SAP 194, 0, 40000", "SAP 195, 0, 4000"]);
    bench.configure(&["SAP 174, 1, 1", "SAP 181, 1, 20000", "SAP 210, 2, 4000", "SAP 212, 2, 1000"]);
    bench.configure(&["RFS START, 0", "ROR 1, 30000", "MVP ABS, 2, 100000"]);
    bench.run(2 * SECOND);
    bench.control("load 1 1");
    bench.run(SECOND);
    assert!(bench.ok("RFS STATUS, 0") > 0);
    assert_eq!(["GAP 3, 1", "GAP 207, 1", "GAP 207, 2", "GAP 207, 0"].map(|line| bench.ok(line)), [0, 1, 0, 0]);
    bench.run_until(30 * SECOND, |bench| {
        bench.run(20 * MILLISECOND);
        bench.ok("RFS STATUS, 0") == 0
    });
    assert!((rotor(&bench, 0) - LEFT).abs() <= TOLERANCE);
    assert_eq!((bench.ok("GAP 8, 2"), rotor(&bench, 2)), (1, 100_000));

    bench.control("load 0 1");
    bench.configure(&["ROR 0, 40000", "ROR 1, 30000", "ROR 2, 20000"]);
    bench.run(2 * SECOND);
    bench.control("load 1 2");
    bench.run(3 * SECOND);
    let speeds = ["GAP 3, 0", "GAP 3, 1", "GAP 3, 2"].map(|line| bench.ok(line));
    let flags = ["GAP 207, 0", "GAP 207, 1", "GAP 207, 2", "GAP 10, 0"].map(|line| bench.ok(line));
    assert_eq!((speeds, flags), ([0, 30_000, 0], [0, 0, 2, 1]));
}

/// The zero point is in the middle between where the switch of the search closes and where it opens, which the ramp
/// generator latches. The switch is the left one or, from 64 on, the right one. At 50 000 pps, which the motor has by
/// then because of the hysteresis, it makes 50 microsteps between two polls. So what they see would be further away.
#[test]
fn the_zero_point_is_latched_at_the_switch_of_the_search() {
    for (mode, middle) in [(1, -28_500), (65, 28_500)] {
        for start in (0..60).step_by(7) {
            let world = format!("[motor]\nstart = {start}\n[stage]\nleft = -30000\nright = 30000\nhysteresis = 3000\n");
            let mut bench = Bench::of_in_world(Product::Tmcm3212, &world);
            bench.configure(&["SAP 5, 0, 2000000", "SAP 17, 0, 2000000", "SAP 194, 0, 50000", "SAP 195, 0, 50000"]);
            bench.configure(&[&format!("SAP 193, 0, {mode}"), "RFS START, 0"]);
            bench.run_until(20 * SECOND, |bench| bench.ok("RFS STATUS, 0") == 0);
            bench.run(100 * MILLISECOND);
            assert_eq!(bench.ok("GAP 1, 0"), 0);
            assert!((bench.rotor() - middle).abs() <= 3, "mode {mode} from {start}: {}", bench.rotor());
        }
    }
}
