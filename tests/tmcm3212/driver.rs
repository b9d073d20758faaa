//! Parameters that act in the driver: what a chip has of them in its registers, whenever they are written.

use super::bench;
use crate::common::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};

/// Registers of the chip.
const IHOLD_IRUN: u8 = 0x10;
const TPOWERDOWN: u8 = 0x11;
const TCOOLTHRS: u8 = 0x14;

fn register(bench: &Bench, axis: usize, address: u8) -> u32 {
    bench.module.board().borrow().tmc5160(axis).register(address)
}

/// The chip has both currents for itself, so it is told each when it is written: IHOLD in bits 0..4, IRUN in 8..12.
#[test]
fn currents_are_told_to_the_chip_at_once() {
    let mut bench = bench();
    bench.run(5 * SECOND);
    for (line, currents) in [
        // Also a current that is the same as the one that the motor has at rest.
        ("SAP 7, 1, 200", 25 | 16 << 8),
        ("SAP 6, 1, 200", 25 | 25 << 8),
        ("SAP 7, 1, 0", 25 << 8),
        ("SAP 6, 1, 255", 31 << 8),
        ("SAP 6, 1, 7", 0),
    ] {
        bench.ok(line);
        assert_eq!(register(&bench, 1, IHOLD_IRUN) & 0x1F1F, currents, "{line}");
        bench.run(20 * MILLISECOND);
        assert_eq!(register(&bench, 1, IHOLD_IRUN) & 0x1F1F, currents, "{line}");
    }
    assert_eq!(register(&bench, 0, IHOLD_IRUN) & 0x1F1F, 1 | 16 << 8, "the other axes have theirs");
}

/// Units of 10 ms become the chip's of 2^18 clocks, 16.384 ms: 2 s are 122.07.
#[test]
fn the_delay_of_the_standby_current_is_told_to_the_chip() {
    let mut bench = bench();
    assert_eq!(register(&bench, 0, TPOWERDOWN), 122);
    for (delay, units) in [(0, 0), (1, 1), (100, 61), (417, 255)] {
        bench.ok(&format!("SAP 214, 0, {delay}"));
        assert_eq!(register(&bench, 0, TPOWERDOWN), units, "{delay}");
    }
}

/// The chip has one threshold for both stall and coolStep, as a time: at 10000 pps 16e6 / 10000 = 1600 clocks are 1/256 of a
/// full step. It gets the lower speed of the two.
#[test]
fn thresholds_are_told_to_a_chip_whose_motor_turns() {
    let mut bench = bench();
    bench.ok("ROR 2, 51200");
    bench.run(2 * SECOND);
    // coolStep is on while 172 is not 0.
    for (line, clocks) in
        [("SAP 181, 2, 20000", 800), ("SAP 181, 2, 10000", 1600), ("SAP 182, 2, 5000", 1600), ("SAP 172, 2, 4", 3200)]
    {
        bench.ok(line);
        let register = register(&bench, 2, TCOOLTHRS);
        assert!(register.abs_diff(clocks) <= clocks / 8, "{line}: {register}");
    }
}
