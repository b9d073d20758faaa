//! Changes while the motor is on its way. In every phase of a ramp it arrives all the same, and runs over its target
//! only where it could not stop before.

use super::bench;
use super::ramps::{start_trace, take_trace};
use common::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm_sim::VirtualModule;

const RAMP: [&str; 8] = [
    "SAP 19, 0, 1000",
    "SAP 15, 0, 300000",
    "SAP 16, 0, 30000",
    "SAP 5, 0, 100000",
    "SAP 4, 0, 60000",
    "SAP 17, 0, 150000",
    "SAP 18, 0, 400000",
    "SAP 20, 0, 2000",
];

/// The times in ms at which the motor is in each phase of a move over 60 000 microsteps with that ramp: A1 until 97,
/// AMAX until 397, at its top speed until about 1.05 s, DMAX for 200 ms, D1 for 70 ms, and at its target.
const PHASES: [u64; 6] = [50, 250, 700, 1_050, 1_230, 1_500];

/// A motor on its way to 60 000, `time` milliseconds after its start.
fn under_way(time: u64) -> Bench {
    let mut bench = bench();
    bench.configure(&RAMP);
    bench.ok("MVP ABS, 0, 60000");
    bench.run(time * MILLISECOND);
    bench
}

fn arrives(bench: &mut Bench, target: i32, what: &str) {
    let limit = bench.module.now() + 10 * SECOND;
    while bench.ok("GAP 8, 0") != 1 || bench.ok("GAP 3, 0") != 0 {
        assert!(bench.module.now() < limit, "{what}: stands at {}", bench.ok("GAP 1, 0"));
        bench.run(MILLISECOND);
    }
    bench.run(20 * MILLISECOND);
    assert_eq!((bench.ok("GAP 1, 0"), bench.rotor(), bench.lost_steps()), (target, target.into(), 0), "{what}");
}

/// Speed v and position x: with D1 above VSTOP and DMAX above V1 it can stop in (v^2 - V1^2) / 2 DMAX + V1^2 / 2 D1.
fn stopping(speed: i32) -> f64 {
    let (v, v1) = (f64::from(speed.abs()), 30_000_f64);
    let low = v.min(v1);
    (v * v - low * low) / 300_000.0 + low * low / 800_000.0
}

#[test]
fn a_new_target_is_reached_from_every_phase() {
    for time in PHASES {
        for target in [200_000, 61_000, 30_000, 0, -90_000] {
            let what = format!("{target} after {time} ms");
            let mut bench = under_way(time);
            let (speed, position) = (bench.ok("GAP 3, 0"), bench.ok("GAP 1, 0"));
            start_trace(&bench, 0);
            bench.ok(&format!("MVP ABS, 0, {target}"));
            arrives(&mut bench, target, &what);
            let trace = take_trace(&bench, 0);
            let over = trace.overshoot(position.into(), target.into());
            // What the motor needs for stopping, a little more for what passes between the two readings.
            let room = f64::from(target - position) * f64::from(if speed < 0 { -1 } else { 1 });
            if speed != 0 && room > stopping(speed) * 1.05 + 200.0 {
                assert_eq!(over, 0, "{what}");
            }
        }
    }
}

#[test]
fn a_new_speed_holds_in_every_phase() {
    for time in PHASES {
        for speed in [20_000, 45_000, 90_000] {
            let mut bench = under_way(time);
            bench.ok(&format!("SAP 4, 0, {speed}"));
            arrives(&mut bench, 60_000, &format!("speed {speed} after {time} ms"));
        }
    }
}

/// With other accelerations the motor may run over its target, but it comes back.
#[test]
fn new_accelerations_hold_in_every_phase() {
    for time in PHASES {
        for (line, what) in [("SAP 5, 0, 500000", "AMAX"), ("SAP 17, 0, 20000", "DMAX"), ("SAP 16, 0, 0", "V1")] {
            let mut bench = under_way(time);
            bench.ok(line);
            arrives(&mut bench, 60_000, &format!("{what} after {time} ms"));
        }
    }
}

/// From a move to velocity mode, the other way round, and to a move again, without a step lost.
#[test]
fn a_motor_goes_over_between_positions_and_speeds_in_every_phase() {
    for time in PHASES {
        let mut bench = under_way(time);
        bench.ok("ROL 0, 50000");
        bench.run(2 * SECOND);
        assert_eq!(bench.ok("GAP 3, 0"), -50_000);
        bench.ok("ROR 0, 20000");
        bench.run(2 * SECOND);
        assert_eq!(bench.ok("GAP 3, 0"), 20_000);
        bench.ok("MVP ABS, 0, -70000");
        arrives(&mut bench, -70_000, &format!("{time} ms"));
    }
}

/// MST brakes with AMAX, from any phase, and the motor stays where it then is.
#[test]
fn mst_stops_along_the_ramp_in_every_phase() {
    for time in PHASES {
        let mut bench = under_way(time);
        let (speed, position) = (bench.ok("GAP 3, 0"), bench.ok("GAP 1, 0"));
        bench.ok("MST 0");
        bench.run(2 * SECOND);
        let way = bench.ok("GAP 1, 0") - position;
        let expected = f64::from(speed) * f64::from(speed) / 200_000.0;
        assert_eq!(bench.ok("GAP 3, 0"), 0);
        assert!((f64::from(way) - expected).abs() < 0.03 * expected + 500.0, "{time} ms: {way} for {expected}");
        assert_eq!(i64::from(bench.ok("GAP 1, 0")), bench.rotor());
    }
}
