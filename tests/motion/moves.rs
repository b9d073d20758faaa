//! Moves that are changed or ended on their way, and positions that are overwritten.

use common::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};

/// The TMC429 keeps running through a restart of the firmware: the first thing it is told is to stop.
#[test]
fn a_restart_stops_a_running_motor() {
    for mode in ["ROR 0, 1000", "MVP ABS, 0, 10000000"] {
        let mut bench = Bench::new();
        bench.ok(mode);
        bench.run(SECOND);
        bench.ok("255, 0, 0, 1234");
        let running = bench.rotor();
        bench.run(50 * MILLISECOND);
        assert!(bench.rotor() - running > 1000, "it stopped before the restart");
        bench.run(100 * MILLISECOND);
        let stopped = bench.rotor();
        bench.run(SECOND);
        assert_eq!(bench.rotor(), stopped);
        assert_eq!((bench.ok("GAP 1, 0"), bench.ok("GAP 3, 0")), (0, 0));
        bench.ok("MVP ABS, 0, 500");
        bench.run(SECOND);
        assert_eq!(bench.rotor(), stopped + 500);
    }
}

#[test]
fn a_target_changed_on_the_fly() {
    // Further in the same direction, nearer, and behind: the motor turns round. Always it ends on target.
    for second in [200_000, 40_000, 20_000, -50_000] {
        let mut bench = Bench::new();
        bench.ok("MVP ABS, 0, 100000");
        bench.run(SECOND);
        // 0.9 s at 30 517.6 a second: it is past 20 000 by now.
        assert!((20_000..40_000).contains(&bench.rotor()), "{}", bench.rotor());
        bench.ok(&format!("MVP ABS, 0, {second}"));
        bench.run(10 * SECOND);
        assert_eq!((bench.rotor(), bench.lost_steps()), (second, 0));
        assert_eq!(bench.ok("GAP 8, 0"), 1);
    }
}

/// Also on the way to a target far away the offset counts from where the motor is.
#[test]
fn relative_moves_start_from_the_actual_position() {
    let mut bench = Bench::new();
    bench.ok("MVP ABS, 0, 1000000");
    bench.run(SECOND);
    let here = bench.rotor();
    let target = i64::from(bench.ok("MVP REL, 0, 20000"));
    assert!((20_000..20_100).contains(&(target - here)), "{target} from {here}");
    bench.run(3 * SECOND);
    assert_eq!(bench.rotor(), target);
}

/// Overwriting the position of a motor that stands moves nothing and leaves the mode as it was.
#[test]
fn overwriting_the_position_moves_nothing() {
    for (line, mode) in [("MVP ABS, 0, 3000", 0), ("ROR 0, 100", 2)] {
        let mut bench = Bench::new();
        bench.ok(line);
        bench.run(SECOND);
        bench.ok(if mode == 2 { "MST 0" } else { "GAP 1, 0" });
        bench.run(SECOND);
        let rotor = bench.rotor();
        bench.ok("SAP 1, 0, -777");
        bench.run(SECOND);
        assert_eq!((bench.rotor(), bench.ok("GAP 1, 0"), bench.ok("GAP 0, 0")), (rotor, -777, -777), "{line}");
        assert_eq!((bench.ok("GAP 138, 0"), bench.ok("GAP 8, 0")), (mode, 1), "{line}");
    }
}

#[test]
fn mst_interrupts_a_move_along_the_ramp() {
    let mut bench = Bench::new();
    bench.ok("MVP ABS, 0, 100000");
    bench.run(SECOND);
    let at = bench.rotor();
    bench.ok("MST 0");
    bench.run(SECOND);
    // v^2 / 2a = 30 517.6 * 65.536 ms / 2 = 1000 microsteps. The way is within two of that, by where its steps fall in
    // the ramp's, and up to two milliseconds of the telegram longer.
    assert!((998..1100).contains(&(bench.rotor() - at)), "{}", bench.rotor() - at);
    assert_eq!(bench.ok("GAP 3, 0"), 0);
    assert_eq!(bench.ok("GAP 0, 0"), 100_000);
    assert_eq!(bench.ok("GAP 8, 0"), 0);
    assert_eq!(bench.ok("GAP 138, 0"), 2);
}

/// Divisors change in ramp mode, for whose moment the target of the chip is where the motor stands. Nothing moves,
/// however far the last target is, and however steep the ramp.
#[test]
fn divisors_that_change_at_standstill_move_nothing() {
    let mut bench = Bench::new();
    bench.configure(&["SAP 153, 0, 2", "SAP 5, 0, 2047", "SAP 4, 0, 200", "MVP ABS, 0, 100000"]);
    bench.run(500 * MILLISECOND);
    bench.ok("ROL 0, 50");
    bench.run(500 * MILLISECOND);
    bench.ok("MST 0");
    bench.run(500 * MILLISECOND);
    let (rotor, position) = (bench.rotor(), bench.ok("GAP 1, 0"));
    for line in ["SAP 154, 0, 5", "SAP 153, 0, 0", "SAP 154, 0, 1", "SAP 154, 0, 0", "SAP 153, 0, 7"] {
        bench.ok(line);
        bench.run(100 * MILLISECOND);
        assert_eq!((bench.rotor(), bench.ok("GAP 1, 0"), bench.ok("GAP 3, 0")), (rotor, position, 0), "{line}");
    }
}
