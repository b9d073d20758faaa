//! Inputs and outputs: IN0 to IN3 are digital and analog inputs, input 10 is ENABLE, and there are four outputs.

use super::bench;
use common::{INVALID_VALUE, WRONG_TYPE};
use hal_sim::clock::MILLISECOND;

#[test]
fn digital_inputs_and_enable() {
    let mut bench = bench();
    for levels in 0..16 {
        for number in 0..4 {
            bench.control(&format!("input {number} {}", levels >> number & 1));
        }
        bench.run(2 * MILLISECOND);
        let each: i32 = (0..4).map(|number| bench.ok(&format!("GIO {number}, 0")) << number).sum();
        assert_eq!((each, bench.ok("GIO 255, 0")), (levels, levels));
    }
    for level in [0, 1, 0] {
        bench.control(&format!("input 10 {level}"));
        bench.run(2 * MILLISECOND);
        assert_eq!((bench.ok("GIO 10, 0"), bench.ok("GIO 255, 0")), (level, 15), "all inputs are IN0 to IN3");
    }
    for port in (4..10).chain(11..255) {
        bench.refused(&format!("GIO {port}, 0"), WRONG_TYPE);
    }
}

/// The converter has 12 bits, the values 16: from 0 to 65535.
#[test]
fn analog_inputs_have_16_bits() {
    let mut bench = bench();
    let readings = [(0, 0), (1, 16), (255, 4080), (256, 4097), (2048, 32_776), (4094, 65_519), (4095, 65_535)];
    for port in 0..4 {
        for (reading, value) in readings {
            bench.control(&format!("analog {port} {reading}"));
            bench.run(2 * MILLISECOND);
            assert_eq!(bench.ok(&format!("GIO {port}, 1")), value, "{port}: {reading}");
        }
    }
    bench.control("analog 2 100");
    bench.run(2 * MILLISECOND);
    let values = [0, 1, 2, 3].map(|port| bench.ok(&format!("GIO {port}, 1")));
    assert_eq!(values, [65_535, 65_535, 1600, 65_535]);
    for port in (4..8).chain(10..=255) {
        bench.refused(&format!("GIO {port}, 1"), WRONG_TYPE);
    }
}

#[test]
fn supply_and_temperature() {
    let mut bench = bench();
    assert_eq!(bench.ok("GIO 8, 1"), 240);
    for (control, port, value) in [
        ("supply 48", 8, 480),
        ("supply 53", 8, 530),
        ("supply 9", 8, 90),
        ("temperature 61", 9, 61),
        ("temperature -20", 9, -20),
    ] {
        bench.control(control);
        bench.run(5 * MILLISECOND);
        assert_eq!(bench.ok(&format!("GIO {port}, 1")), value, "{control}");
    }
}

#[test]
fn four_outputs_and_no_pull_ups() {
    let mut bench = bench();
    let levels = |bench: &common::Bench| {
        let outputs = bench.module.board().borrow().world().outputs();
        (0..4).map(|number| i32::from(outputs.is_on(number)) << number).sum::<i32>()
    };
    for port in 0..4 {
        bench.ok(&format!("SIO {port}, 2, 1"));
        bench.run(2 * MILLISECOND);
        assert_eq!((bench.ok(&format!("GIO {port}, 2")), levels(&bench)), (1, (2 << port) - 1));
    }
    bench.ok("SIO 255, 2, 5");
    bench.run(2 * MILLISECOND);
    assert_eq!(levels(&bench), 5);
    // Bits of outputs that do not exist are ignored.
    bench.ok("SIO 255, 2, 250");
    bench.run(2 * MILLISECOND);
    assert_eq!(levels(&bench), 10);
    for (line, status) in [
        ("SIO 4, 2, 1", WRONG_TYPE),
        ("SIO 0, 0, 0", WRONG_TYPE),
        ("SIO 0, 0, 3", WRONG_TYPE),
        ("SIO 0, 1, 1", INVALID_VALUE),
        ("SIO 0, 2, 2", INVALID_VALUE),
        ("SIO 255, 2, 256", INVALID_VALUE),
        ("GIO 4, 2", WRONG_TYPE),
        ("GIO 0, 3", INVALID_VALUE),
    ] {
        bench.refused(line, status);
    }
    assert_eq!([0, 1, 2, 3].map(|port| bench.ok(&format!("GIO {port}, 2"))), [0, 1, 0, 1]);
}
