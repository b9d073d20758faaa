//! The unit of speeds and accelerations (parameter 255), and what the chip's registers cannot hold.

use super::bench;
use common::INVALID_VALUE;
use hal_sim::clock::SECOND;

/// 0: the numbers are the chip's. 16e6 / 2^24 = 0.953674 pps: at 50 000 the motor makes 47 683.7 microsteps in a
/// second.
#[test]
fn with_the_unit_mode_0_numbers_are_those_of_the_chip() {
    let mut bench = bench();
    bench.configure(&["SAP 255, 0, 0", "SAP 5, 0, 4000", "ROR 0, 50000"]);
    bench.run(2 * SECOND);
    let from = bench.rotor();
    bench.run(10 * SECOND);
    let rate = (bench.rotor() - from) as f64 / 10.0;
    assert!((rate - 47_683.7).abs() < 1.0, "{rate}");
    assert_eq!((bench.ok("GAP 3, 0"), bench.ok("GAP 2, 0")), (50_000, 50_000));
    // A change keeps the numbers, and the motor goes over to what they mean now.
    bench.ok("SAP 255, 0, 1");
    assert_eq!((bench.ok("GAP 2, 0"), bench.ok("GAP 5, 0")), (50_000, 4_000));
    bench.run(10 * SECOND);
    let from = bench.rotor();
    bench.run(10 * SECOND);
    let rate = (bench.rotor() - from) as f64 / 10.0;
    assert!((rate - 50_000.0).abs() < 1.0, "{rate}");
}

/// ROR and ROL have a printed range of 32 bits, the chip has 2^23 - 512, which is 7 999 512 pps: they are clamped.
/// Parameters 2 and 4 have ranges of their own.
#[test]
fn rotations_beyond_the_chip_are_clamped() {
    for (line, sign) in [("ROR 0, 2147483647", 1), ("ROL 0, 2147483647", -1), ("ROR 0, -2147483648", -1)] {
        let mut bench = bench();
        bench.configure(&["SAP 5, 0, 7629278", line]);
        bench.run(3 * SECOND);
        assert_eq!(bench.ok("GAP 3, 0"), sign * 7_999_512, "{line}");
        assert_eq!(bench.ok("GAP 2, 0"), sign * 7_999_774, "{line}");
    }
    let mut bench = bench();
    bench.configure(&["SAP 2, 0, 0", "SAP 4, 0, 7999774"]);
    for line in ["SAP 2, 0, 7999775", "SAP 2, 0, -7999775", "SAP 4, 0, 7999775", "SAP 4, 0, -1", "SAP 5, 0, 7629279"] {
        bench.refused(line, INVALID_VALUE);
    }
}

/// Speeds of 0 for start and stop are read back as they were written, and the motor arrives all the same.
#[test]
fn start_and_stop_speeds_of_zero_are_no_trap() {
    let mut bench = bench();
    bench.configure(&["SAP 19, 0, 0", "SAP 20, 0, 0", "SAP 18, 0, 0", "MVP ABS, 0, 40000"]);
    bench.run_until(20 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
    assert_eq!([19, 20, 18].map(|number| bench.ok(&format!("GAP {number}, 0"))), [0; 3]);
    assert_eq!(bench.rotor(), 40_000);
}

/// An acceleration of 0 is the smallest one that there is, 116.4 pps per second: a motor can always be stopped.
#[test]
fn a_motor_without_acceleration_can_be_stopped() {
    let mut bench = bench();
    bench.ok("ROR 0, 1000");
    bench.run(SECOND);
    bench.configure(&["SAP 5, 0, 0", "MST 0"]);
    bench.run(9 * SECOND);
    assert_eq!(["GAP 3, 0", "GAP 5, 0"].map(|line| bench.ok(line)), [0, 0]);
}

/// With a top speed of 0 a motor stays where it is, as on the sisters.
#[test]
fn a_top_speed_of_zero_is_a_motor_that_stays() {
    let mut bench = bench();
    bench.configure(&["SAP 4, 0, 0", "MVP ABS, 0, 40000"]);
    bench.run(SECOND);
    assert_eq!((bench.rotor(), bench.ok("GAP 8, 0")), (0, 0));
    bench.ok("SAP 4, 0, 50000");
    bench.run_until(20 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
}
