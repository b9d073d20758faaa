//! Each axis of the TMCM-6110 does something else at the same time: it moves, searches, stalls, runs into its switch,
//! turns, or loses its driver. Each rotor ends where its own world says, and each axis tells of itself alone.

use super::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};

/// A stall, an arrival and a switch of another axis are no news for an axis: all of it is compared with what that axis
/// shows when it is alone.
#[test]
fn six_axes_do_six_things_at_once_as_each_does_alone() {
    let world = "[[axis]]\n[[axis]]\nstage.home = [8000, 8200]\nstage.left = -20000\n[[axis]]\n[[axis]]\nstage.right = 30000\n\
                 [[axis]]\nmotor.start = -77\n[[axis]]\n";
    // What each axis is told, what its world does to it after a second, and where its rotor then is and stays.
    type Task = (&'static [&'static str], Option<&'static str>, Option<i64>, i32, i32);
    let tasks: [Task; 6] = [
        (&["MVP ABS, 0, 123456"], None, Some(123_456), 0, 1),
        (&["SAP 193, 1, 7", "RFS START, 1"], None, Some(8_100), 0, 1),
        (&["SAP 174, 2, 1", "SAP 181, 2, 500", "ROR 2, 1000"], Some("load 1 2"), None, 1, 0),
        (&["SAP 12, 3, 0", "ROR 3, 700"], None, Some(30_000), 0, 0),
        (&["MVP REL, 4, -45000"], None, Some(-45_077), 0, 1),
        (&["ROL 5, 300"], Some("fault short-a on 5"), None, 0, 0),
    ];
    let run = |chosen: &[usize]| {
        let mut bench = Bench::six(world);
        for axis in chosen {
            for line in tasks[*axis].0 {
                bench.ok(line);
            }
        }
        bench.run(SECOND);
        for axis in chosen {
            tasks[*axis].1.into_iter().for_each(|line| bench.control(line));
        }
        bench.run(10 * SECOND);
        bench
    };
    let shown = |bench: &mut Bench, axis: usize| {
        let numbers = [0, 1, 3, 8, 9, 10, 11, 207, 208];
        let parameters = numbers.map(|number| (number, bench.get(number, axis as u8)));
        (parameters, bench.states()[axis].rotor)
    };
    let mut together = run(&[0, 1, 2, 3, 4, 5]);
    for (axis, (_, _, rotor, errors, reached)) in tasks.into_iter().enumerate() {
        let (parameters, place) = shown(&mut together, axis);
        let get = |number: i32| parameters.iter().find(|(n, _)| i32::from(*n) == number).unwrap().1;
        assert_eq!((get(3), get(8), get(207)), (0, reached, errors), "axis {axis}: speed, arrival, errors");
        if let Some(expected) = rotor {
            assert!((place - expected).abs() < 300, "axis {axis} is at {place}, not at {expected}");
        }
        let (alone, there) = shown(&mut run(&[axis]), axis);
        // Commands to the other axes take their time, so that a world comes into play a little later.
        assert!((place - there).abs() < 256, "axis {axis}: {place} together, {there} alone");
        for ((number, together), (_, alone)) in parameters.into_iter().zip(alone) {
            let near = matches!(number, 0 | 1) && (together - alone).abs() < 256;
            assert!(near || together == alone, "axis {axis}, parameter {number}: {together} together, {alone} alone");
        }
    }
    let before: Vec<_> = (0..6).map(|axis| together.states()[axis].rotor).collect();
    together.run(500 * MILLISECOND);
    assert_eq!((0..6).map(|axis| together.states()[axis].rotor).collect::<Vec<_>>(), before, "all stand");
}
