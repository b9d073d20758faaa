//! Ramps at the rotor, against positions worked out from the datasheet's formulas.

use super::bench;
use super::profile::{Settings, acceleration, speed};
use common::Bench;
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::world::trace::Trace;
use tmcm_sim::{Product, VirtualModule};

/// All that a ramp can have.
const SIX_POINTS: Settings = Settings {
    start: 2_000,
    a1: 400_000,
    v1: 40_000,
    a_max: 150_000,
    v_max: 90_000,
    d_max: 200_000,
    d1: 600_000,
    stop: 3_000,
};

fn seconds(span: Nanos) -> f64 {
    span as f64 / SECOND as f64
}

pub(crate) fn start_trace(bench: &Bench, axis: usize) {
    let now = bench.module.now();
    bench.module.board().borrow_mut().change_world(|world| world.axis_mut(axis).start_trace(0, now));
}

pub(crate) fn take_trace(bench: &Bench, axis: usize) -> Trace {
    bench.module.board().borrow_mut().change_world(|world| world.axis_mut(axis).take_trace()).unwrap()
}

/// Moves over a way and compares each step of the rotor with the profile: within two microsteps, or 0.1 % of the way so
/// far.
fn follow(settings: Settings, way: i32) {
    let mut bench = bench();
    for line in settings.commands(0) {
        bench.ok(&line);
    }
    let profile = settings.profile(way);
    for sign in [1, -1] {
        let start = bench.rotor();
        start_trace(&bench, 0);
        bench.ok(&format!("MVP REL, 0, {}", sign * way));
        bench.run_until((profile.seconds() * 1.1 * SECOND as f64) as Nanos + SECOND, |bench| bench.ok("GAP 8, 0") == 1);
        bench.run(5 * MILLISECOND);
        let trace = take_trace(&bench, 0);
        let samples = trace.samples();
        // At rest the ramp generator is in the middle of a microstep, so the first step comes after a half one. It
        // changes its speed each 512 clocks, so all of the ramp may be up to 32 us early or late against one that does
        // so all the time.
        let first = samples.iter().find(|sample| sample.rotor != start).unwrap();
        let begin = (0..1_000_000).map(|us| f64::from(us) * 1e-6).find(|time| profile.position(*time) >= 0.5).unwrap();
        let off = |shift: f64| {
            samples.iter().map(move |sample| (sample, shift)).find_map(|(sample, shift)| {
                let come = (sample.rotor - start).abs() as f64 - 0.5;
                let expected = profile.position(seconds(sample.at) - seconds(first.at) + begin + shift);
                let allowed = (expected * 0.001).max(2.0);
                ((come - expected).abs() > allowed).then(|| format!("{come} in place of {expected}: {sample:?}"))
            })
        };
        let shifts = (-8..=8).map(|n| f64::from(n) * 4e-6);
        let best: Vec<_> = shifts.map(off).collect();
        assert!(best.contains(&None), "{settings:?}, {way}: {:?}", best[8]);
        let last = samples.iter().find(|sample| sample.rotor == start + i64::from(sign * way)).unwrap();
        let took = seconds(last.at - first.at) + begin;
        // The last microsteps are made at VSTOP.
        let expected = profile.seconds();
        let slow = 3.0 / speed(settings.stop.max(settings.start)).max(1.0);
        assert!(
            (took - expected).abs() <= (expected * 0.001).max(slow),
            "{settings:?}, {way}: {took} s for {expected} s"
        );
        assert_eq!((bench.rotor() - start, bench.lost_steps()), (i64::from(sign * way), 0), "{settings:?}, {way}");
    }
}

#[test]
fn a_ramp_of_six_points_is_that_of_the_formulas() {
    follow(SIX_POINTS, 120_000);
}

/// Without V1 there is one phase only; A1 and D1 have no effect.
#[test]
fn a_ramp_without_a_first_velocity_has_one_acceleration_and_one_deceleration() {
    follow(Settings { v1: 0, a1: 7, d1: 7, ..SIX_POINTS }, 120_000);
}

#[test]
fn start_and_stop_velocities_may_be_large_or_none() {
    follow(Settings { start: 0, stop: 10, ..SIX_POINTS }, 120_000);
    follow(Settings { start: 10_000, stop: 20_000, ..SIX_POINTS }, 120_000);
}

/// A top speed below V1 leaves the slow phases alone.
#[test]
fn a_top_speed_below_the_first_velocity_leaves_the_first_phases() {
    follow(Settings { v_max: 30_000, ..SIX_POINTS }, 60_000);
}

/// In velocity mode AMAX alone counts, up and down.
#[test]
fn velocity_mode_has_one_acceleration() {
    let mut bench = bench();
    for line in SIX_POINTS.commands(0) {
        bench.ok(&line);
    }
    let (a, top) = (acceleration(150_000), speed(80_000));
    let ramp = top / a;
    for (line, sign) in [("ROR 0, 80000", 1.0), ("ROL 0, 80000", -1.0)] {
        start_trace(&bench, 0);
        bench.ok(line);
        bench.run(2 * SECOND);
        bench.ok("MST 0");
        bench.run(SECOND);
        let trace = take_trace(&bench, 0);
        let samples = trace.samples();
        let (from, first) = (samples[0].rotor, samples[1].at);
        // The first step comes after half a microstep, sqrt(1 / a).
        let begin = (1.0 / a).sqrt();
        for sample in samples.iter().skip(1).filter(|sample| seconds(sample.at - first) < 1.9) {
            let time = seconds(sample.at - first) + begin;
            let expected = if time < ramp { a * time * time / 2.0 } else { top * (time - ramp / 2.0) };
            let come = (sample.rotor - from) as f64 * sign - 0.5;
            assert!((come - expected).abs() <= (expected * 0.001).max(2.0), "{line}: {come} in place of {expected}");
        }
        // Down: v^2 / 2 a microsteps.
        let end = samples.last().unwrap();
        let half = samples.iter().rev().find(|sample| sample.rotor.abs_diff(end.rotor) >= 10_000).unwrap();
        let expected = (2.0 * 10_000.0 / a).sqrt();
        let took = seconds(end.at - half.at);
        assert!((took - expected).abs() < 0.02 * expected, "{line}: {took} in place of {expected}");
        assert_eq!(bench.ok("GAP 3, 0"), 0);
    }
}

/// TZEROWAIT: 31250 units of 32 us are a second, in which the motor stays where it has stopped.
#[test]
fn a_motor_waits_before_it_turns_round() {
    let mut bench = bench();
    bench.configure(&["SAP 4, 0, 50000", "SAP 5, 0, 500000", "SAP 17, 0, 500000", "SAP 21, 0, 31250"]);
    bench.ok("MVP ABS, 0, 20000");
    bench.run_until(2 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
    let arrived = bench.module.now();
    bench.ok("MVP ABS, 0, 0");
    bench.run_until(2 * SECOND, |bench| bench.rotor() != 20_000);
    let waited = seconds(bench.module.now() - arrived);
    assert!((0.99..1.01).contains(&waited), "{waited}");
}

/// The largest move that there is: from 0 over 2^31 - 1 microsteps. At the top speed of 7 999 512 pps it takes 268.5 s,
/// and both ramps at 7 629 278 pps per second take about a second more.
#[test]
fn a_move_over_half_of_all_positions_arrives() {
    // No motor turns at 9375 rpm; one without inductance does, so that the rotor is where the chip has sent it.
    let mut bench = Bench::of_in_world(Product::Tmcm3212, "[motor]\ninductance = 0\n");
    bench.configure(&["SAP 4, 0, 7999774", "SAP 5, 0, 7629278", "SAP 17, 0, 7629278"]);
    bench.ok("MVP ABS, 0, 2147483647");
    let from = bench.module.now();
    bench.run_until(400 * SECOND, |bench| {
        bench.run(100 * MILLISECOND);
        bench.ok("GAP 8, 0") == 1
    });
    let took = seconds(bench.module.now() - from);
    assert_eq!(bench.ok("GAP 1, 0"), i32::MAX);
    let ideal = 2_147_483_647.0 / speed(7_999_512) + speed(7_999_512) / acceleration(7_629_278);
    assert!((took - ideal).abs() < 0.002 * ideal, "{took} in place of {ideal}");
}
