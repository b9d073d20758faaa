//! Faults of chips and of the bus to them: what they leave behind.

use super::bench;
use common::NOT_AVAILABLE;
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::vm::ErrorFlag;

/// Bits of parameter 208 after each fault, as long as its motor has not been sent anywhere.
const SHUT_DOWNS: [(&str, i32); 3] = [("overtemperature", 1 << 1), ("short-a", 1 << 3), ("short-b", 1 << 4)];

/// A driver that has shut down is switched on again by the next motion, which is not ended by what was read of the
/// driver before.
#[test]
fn the_motion_after_a_shut_down_goes_to_its_end() {
    for (fault, flag) in SHUT_DOWNS {
        // Each time the reading of the driver is another way ahead.
        for wait in 20..28 {
            let mut bench = bench();
            bench.ok("ROR 1, 51200");
            bench.run(2 * SECOND);
            bench.control(&format!("fault {fault} on 1"));
            bench.run(10 * MILLISECOND);
            bench.control(&format!("fault {fault} off 1"));
            bench.run(wait * MILLISECOND);
            assert_eq!((bench.ok("GAP 3, 1"), bench.ok("GAP 208, 1") & flag), (0, flag), "{fault}");
            let target = bench.ok("MVP REL, 1, 1000");
            bench.run(SECOND);
            assert_eq!((bench.ok("GAP 1, 1"), bench.ok("GAP 8, 1")), (target, 1), "{fault}, {wait} ms");
            assert_eq!(bench.ok("GAP 208, 1") & flag, 0, "{fault}");
            assert!(!bench.module.machine().unwrap().errors.raised(ErrorFlag::Position), "{fault}");
        }
    }
}

/// A fault that lasts shuts the driver down again.
#[test]
fn a_short_that_lasts_ends_the_next_motion_too() {
    let mut bench = bench();
    bench.ok("ROR 2, 51200");
    bench.run(2 * SECOND);
    bench.control("fault short-a on 2");
    bench.run(20 * MILLISECOND);
    let target = bench.ok("MVP REL, 2, 10000");
    bench.run(SECOND);
    assert!(bench.ok("GAP 1, 2") != target && bench.ok("GAP 3, 2") == 0);
    assert_ne!(bench.ok("GAP 208, 2") & 1 << 3, 0);
}

/// A bus that is stuck for two milliseconds, high or low, is no reset of the chips. All motors go on to their targets,
/// also one that is near position zero or one before it, as such a bus reads.
#[test]
fn a_bus_that_is_stuck_for_a_moment_changes_nothing() {
    for fault in ["spi", "spi-low"] {
        for wait in 0..40 {
            let mut bench = bench();
            bench.configure(&[
                "SAP 1, 0, -1500",
                "SAP 1, 2, 40000",
                "MVP ABS, 0, 1500",
                "MVP ABS, 2, -40000",
                "ROR 1, 9999",
            ]);
            // Axis 0 passes zero after some 240 ms.
            bench.run((220 + wait) * MILLISECOND);
            bench.control(&format!("fault {fault} on"));
            bench.run(2 * MILLISECOND);
            bench.control(&format!("fault {fault} off"));
            bench.run(4 * SECOND);
            assert_eq!([0, 1, 2].map(|axis| bench.ok(&format!("GAP 3, {axis}"))), [0, 9999, 0], "{fault} after {wait}");
            assert_eq!([0, 2].map(|axis| bench.ok(&format!("GAP 1, {axis}"))), [1500, -40_000]);
            let rotors = [0, 2].map(|axis| bench.module.board().borrow().world().axis(axis).motor().rotor());
            assert_eq!(rotors, [3000, -80_000], "{fault} after {wait}");
        }
    }
}

/// Three milliseconds and more are too long.
#[test]
fn a_bus_that_stays_stuck_stops_everything() {
    for fault in ["spi", "spi-low"] {
        let mut bench = bench();
        bench.configure(&["ROR 0, 51200", "ROR 2, 51200"]);
        bench.run(2 * SECOND);
        bench.control(&format!("fault {fault} on"));
        bench.run(50 * MILLISECOND);
        bench.refused("ROR 0, 100", NOT_AVAILABLE);
        bench.control(&format!("fault {fault} off"));
        bench.run(SECOND);
        bench.refused("ROR 0, 100", NOT_AVAILABLE);
        assert_eq!([0, 2].map(|axis| bench.module.board().borrow().tmc5160(axis).velocity()), [0, 0], "{fault}");
    }
}
