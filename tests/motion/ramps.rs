//! Motion, measured in the world: the rotor's own trace against numbers worked out from the formulas of the
//! TMC429 datasheet (sections 8.1.10 and 8.1.13). With the default 256 microsteps a step of the chip turns
//! the rotor by one unit of the world.

use common::Bench;
use embedded_hal::spi::SpiDevice;
use hal_sim::board::Chip;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::world::trace::Trace;
use tmcm_sim::VirtualModule;

/// Clock of the TMC429.
const CLOCK: f64 = 16e6;

/// Microsteps per second of internal velocity `v`: f * v / (2^PULSE_DIV * 2048 * 32).
fn pps(v: i32, pulse_div: u32) -> f64 {
    CLOCK * f64::from(v) / (f64::from(1 << pulse_div) * 2048.0 * 32.0)
}

/// Microsteps per second^2 of internal acceleration `a`: f^2 * a / 2^(PULSE_DIV + RAMP_DIV + 29).
fn pps2(a: i32, ramp_div: u32, pulse_div: u32) -> f64 {
    CLOCK * CLOCK * f64::from(a) / 2_f64.powi((pulse_div + ramp_div + 29) as i32)
}

fn seconds(span: Nanos) -> f64 {
    span as f64 / SECOND as f64
}

fn start_trace(bench: &Bench, interval: Nanos) {
    let now = bench.module.now();
    bench.module.board().borrow_mut().change_world(|world| world.axis_mut(0).start_trace(interval, now));
}

fn take_trace(bench: &Bench) -> Trace {
    bench.module.board().borrow_mut().change_world(|world| world.axis_mut(0).take_trace()).unwrap()
}

/// When the rotor first was `steps` away from where the trace begins.
fn passes(trace: &Trace, steps: u64) -> f64 {
    let samples = trace.samples();
    let start = samples[0].rotor;
    seconds(samples.iter().find(|s| s.rotor.abs_diff(start) == steps).expect("it never gets there").at)
}

fn assert_near(what: &str, got: f64, expected: f64, tolerance: f64) {
    assert!((got / expected - 1.0).abs() <= tolerance, "{what}: {got} is not within {tolerance} of {expected}");
}

/// 16e6 * 1000 / (2^3 * 65 536) = 30 517.6 microsteps per second.
#[test]
fn ror_1000_turns_at_the_formula_s_rate() {
    assert!((pps(1000, 3) - 30_517.6).abs() < 0.1);
    for (line, sign) in [("ROR 0, 1000", 1), ("ROL 0, 1000", -1), ("ROR 0, -1000", -1)] {
        let mut bench = Bench::new();
        bench.ok(line);
        bench.run(SECOND);
        let (from, start) = (bench.module.now(), bench.rotor());
        bench.run(10 * SECOND);
        let moved = sign * (bench.rotor() - start);
        let took = seconds(bench.module.now() - from);
        assert_near(line, moved as f64 / took, pps(1000, 3), 0.001);
        assert_eq!(bench.lost_steps(), 0);
    }
}

/// From 0 to 1000: 30 517.6 / (16e6^2 * 1000 / 2^39) = 65.536 ms.
#[test]
fn acceleration_takes_the_computed_time() {
    let expected = pps(1000, 3) / pps2(1000, 7, 3);
    assert!((expected - 0.065_536).abs() < 1e-6);
    let mut bench = Bench::new();
    start_trace(&bench, 0);
    bench.ok("ROR 0, 1000");
    bench.run(SECOND);
    bench.ok("MST 0");
    bench.run(SECOND);
    let trace = take_trace(&bench);
    // s = a t^2 / 2: step 900 comes sqrt(900) - sqrt(100) = 20 times sqrt(2/a) after step 100. Both lie on
    // the ramp, which is 30 517.6 * 65.536 ms / 2 = 1000 steps long.
    let v = pps(1000, 3);
    let a = 2.0 * (20.0 / (passes(&trace, 900) - passes(&trace, 100))).powi(2);
    assert_near("acceleration", v / a, expected, 0.01);
    // Braking is the same ramp backwards: v^2 / 2a = 1000 steps before the end of the last.
    let samples = trace.samples();
    let at = |left: usize| seconds(samples[samples.len() - 1 - left].at);
    let a = 2.0 * (20.0 / (at(100) - at(900))).powi(2);
    assert_near("deceleration", v / a, expected, 0.01);
}

/// A positioning move, which must be right whatever the divisors.
struct Move {
    acceleration: i32,
    speed: i32,
    ramp_div: u32,
    pulse_div: u32,
}

impl Move {
    /// Runs the move, out and back, and says what is wrong with it.
    fn run(&self, spoil: impl Fn(&Bench)) -> Result<(), String> {
        let &Move { acceleration, speed, ramp_div, pulse_div } = self;
        let mut bench = Bench::new();
        // Through pairs that all have accelerations: the ratio grows or shrinks by steps.
        set_divisors(&mut bench, ramp_div, pulse_div);
        bench.ok(&format!("SAP 4, 0, {speed}"));
        bench.ok(&format!("SAP 5, 0, {acceleration}"));
        let (v, a) = (pps(speed, pulse_div), pps2(acceleration, ramp_div, pulse_div));
        let ramp = v * v / (2.0 * a);
        // Two ramps, and half a second of cruise in between.
        let distance = (2.0 * ramp + v / 2.0).ceil() as i64 + 10;
        let ideal = (distance as f64 - 2.0 * ramp) / v + 2.0 * v / a;
        for target in [distance, 0] {
            let start = bench.rotor();
            let from = bench.module.now();
            start_trace(&bench, 0);
            bench.ok(&format!("MVP ABS, 0, {target}"));
            spoil(&bench);
            let limit = from + ((1.2 * ideal + 0.1) * SECOND as f64) as Nanos;
            while bench.module.now() < limit && bench.rotor() != target {
                bench.run(MILLISECOND);
            }
            bench.run(20 * MILLISECOND);
            let trace = take_trace(&bench);
            if trace.overshoot(start, target) != 0 {
                return Err(format!("overshoots by {}", trace.overshoot(start, target)));
            }
            if bench.rotor() != target {
                return Err(format!("stands at {} in place of {target}", bench.rotor()));
            }
            if bench.lost_steps() != 0 {
                return Err(format!("slipped by {} full steps", bench.lost_steps()));
            }
            check_arrival(&trace, a, acceleration, pulse_div)?;
            let arrived = trace.samples().last().unwrap().at;
            let took = seconds(arrived - from);
            // PMUL is 1.2 to 3 % small, and so is the braking. The last step is cut short: the motor stands as
            // soon as it is there, where an ideal ramp would still need up to sqrt(2/a).
            if took > 1.1 * ideal + 0.01 || took < 0.97 * ideal - 0.01 - (2.0 / a).sqrt() {
                return Err(format!("took {took} s in place of {ideal} s"));
            }
            if bench.ok("GAP 8, 0") != 1 {
                return Err("position reached flag is not set".into());
            }
        }
        Ok(())
    }
}

/// Checks the speed near the end, over runs of eight steps. It is never above what the acceleration can still brake, so
/// that the last steps come at or near the stop speed of 1. The ramp generator works in units of one internal velocity
/// step and of a microstep, and steps leave on pulse ticks only. The velocity, changed once a ramp tick by A/256, lags
/// up to five ramp ticks behind the braking law. So much is allowed.
fn check_arrival(trace: &Trace, a: f64, acceleration: i32, pulse_div: u32) -> Result<(), String> {
    const RUN: usize = 8;
    let unit = pps(1, pulse_div);
    let lag = 5.0 * unit * f64::from(acceleration) / 256.0;
    let tick = f64::from(32 << pulse_div) / CLOCK;
    let samples = trace.samples();
    let end = samples.last().unwrap().rotor;
    for run in samples.windows(RUN + 1).rev().take(2000) {
        let got = RUN as f64 / (seconds(run[RUN].at - run[0].at) + tick);
        let left = (end - run[RUN].rotor).unsigned_abs() as f64;
        let fastest = (2.0 * a * (left + RUN as f64)).sqrt() + 2.0 * unit + lag;
        if got > fastest {
            return Err(format!("{left} steps before the end still {got} steps/s, not {fastest}"));
        }
    }
    Ok(())
}

/// Sets both divisors, by way of equal ones: at ratio 1 every acceleration has a PMUL/PDIV pair.
fn set_divisors(bench: &mut Bench, ramp_div: u32, pulse_div: u32) {
    let middle = ramp_div.abs_diff(pulse_div) / 2 + ramp_div.min(pulse_div);
    for (parameter, value) in [(153, 7), (154, 7), (153, middle), (154, middle), (153, ramp_div), (154, pulse_div)] {
        bench.ok(&format!("SAP {parameter}, 0, {value}"));
    }
}

/// Accelerations to try at a pair of divisors: the datasheet's limits, 2^(R - P - 1) and 2^(R - P + 12) - 1, and
/// one in between. The only pairs without any are those whose ratio is 2^13, one way or the other.
fn accelerations(ramp_div: u32, pulse_div: u32) -> Vec<i32> {
    if ramp_div.abs_diff(pulse_div) > 12 {
        return vec![];
    }
    let ratio = 2_f64.powi(ramp_div as i32 - pulse_div as i32);
    // Where the limits leave nothing within 1..=2047, a PMUL/PDIV pair exists for that end of the range.
    let lowest = ((ratio / 2.0).ceil() as i32).clamp(1, 2047);
    let highest = ((ratio * 4096.0 - 1.0) as i32).clamp(1, 2047);
    let middle = (f64::from(lowest) * f64::from(highest)).sqrt() as i32;
    let mut all = vec![lowest, middle.clamp(lowest, highest), highest];
    all.dedup();
    all
}

/// The fastest speed that is reached within about two seconds: a ramp tick takes 2 us * 2^RAMP_DIV and adds
/// A/256.
fn speed_within_reach(acceleration: i32, ramp_div: u32) -> i32 {
    let per_second = f64::from(acceleration) / 256.0 * 500_000.0 / f64::from(1 << ramp_div);
    ((2.0 * per_second) as i32).clamp(4, 2047)
}

fn every_divisor_pair(ramp_divs: impl Iterator<Item = u32>) {
    let mut moves = 0;
    for ramp_div in ramp_divs {
        for pulse_div in 0..=13 {
            for acceleration in accelerations(ramp_div, pulse_div) {
                let speed = speed_within_reach(acceleration, ramp_div);
                let what = Move { acceleration, speed, ramp_div, pulse_div };
                if let Err(message) = what.run(|_| ()) {
                    panic!("A {acceleration} V {speed} R {ramp_div} P {pulse_div}: {message}");
                }
                moves += 1;
            }
        }
    }
    assert!(moves > 200, "only {moves} moves");
}

#[test]
fn every_divisor_pair_brakes_along_its_ramp_even() {
    every_divisor_pair((0..=13).step_by(2));
}

#[test]
fn every_divisor_pair_brakes_along_its_ramp_odd() {
    every_divisor_pair((1..=13).step_by(2));
}

/// The check above must see a wrong PMUL. With PDIV one too small p is doubled and the motor overshoots; with PMUL
/// halved by PDIV one too large it arrives late.
#[test]
fn a_wrong_braking_parameter_is_caught() {
    let good = Move { acceleration: 1000, speed: 1000, ramp_div: 7, pulse_div: 3 };
    good.run(|_| ()).unwrap();
    // PMUL 247, PDIV 6 are right for these.
    for (pdiv, expected) in [(5, "overshoots"), (9, "took")] {
        let message = good
            .run(|bench| {
                let mut chip = bench.module.board().spi(Chip::Tmc429(0), 1_312_500);
                chip.transfer_in_place(&mut [0x12, 0, 247, pdiv]).unwrap();
            })
            .unwrap_err();
        assert!(message.starts_with(expected), "{message}");
    }
}

/// 2^26 microsteps at 2047 * 16e6 / 65 536 = 499 756 a second: 134 s, with the chip's target moved ahead 16
/// times. From the end of acceleration to the start of braking the speed stays the same.
fn long_move(start: i32, target: i32) {
    let mut bench = Bench::new();
    set_divisors(&mut bench, 3, 0);
    bench.ok("SAP 4, 0, 2047");
    bench.ok("SAP 5, 0, 1000");
    bench.ok(&format!("SAP 1, 0, {start}"));
    let (v, a) = (pps(2047, 0), pps2(1000, 3, 0));
    let (from, rotor) = (bench.module.now(), bench.rotor());
    start_trace(&bench, 10 * MILLISECOND);
    bench.ok(&format!("MVP ABS, 0, {target}"));
    let distance = i64::from(target.wrapping_sub(start));
    let ideal = distance.unsigned_abs() as f64 / v + v / a;
    bench.run((1.02 * ideal * SECOND as f64) as Nanos);
    assert_eq!(bench.ok("GAP 1, 0"), target);
    assert_eq!(bench.rotor() - rotor, distance);
    assert_eq!(bench.lost_steps(), 0);
    let trace = take_trace(&bench);
    assert_eq!(trace.overshoot(rotor, rotor + distance), 0);
    let margin = (2.0 * v / a * SECOND as f64) as Nanos;
    let last = trace.samples().last().unwrap().at - margin;
    let mut looked = 0;
    for run in trace.samples().windows(11).filter(|run| run[0].at > from + margin && run[10].at < last) {
        let speed = run[0].rotor.abs_diff(run[10].rotor) as f64 / seconds(run[10].at - run[0].at);
        assert_near("cruise", speed, v, 0.001);
        looked += 1;
    }
    assert!(looked > 10_000, "{looked}");
}

#[test]
fn a_move_of_2_26_keeps_its_speed_forwards() {
    long_move(0, 1 << 26);
}

#[test]
fn a_move_of_2_26_keeps_its_speed_backwards() {
    long_move(0, -(1 << 26));
}

#[test]
fn a_move_of_2_26_keeps_its_speed_across_the_32_bit_wrap() {
    let start = i32::MAX - (1 << 25);
    long_move(start, start.wrapping_add(1 << 26));
}

/// At the default divisors no acceleration below 5 has a PMUL/PDIV pair: positioning uses 5, velocity mode 1.
#[test]
fn an_acceleration_without_a_pair_is_raised_for_positioning_only() {
    for (line, acceleration) in [("MVP ABS, 0, 2000", 5), ("ROR 0, 1000", 1)] {
        let mut bench = Bench::new();
        bench.ok("SAP 5, 0, 1");
        assert_eq!(bench.ok("GAP 5, 0"), 1);
        start_trace(&bench, 0);
        bench.ok(line);
        bench.run(3 * SECOND);
        let trace = take_trace(&bench);
        let a = 2.0 * (20.0 / (passes(&trace, 900) - passes(&trace, 100))).powi(2);
        assert_near(line, a, pps2(acceleration, 7, 3), 0.02);
    }
}

#[test]
fn reversal_at_speed_turns_round_along_the_ramp() {
    let mut bench = Bench::new();
    bench.ok("ROR 0, 1000");
    bench.run(SECOND);
    start_trace(&bench, 0);
    bench.ok("ROL 0, 1000");
    bench.run(SECOND);
    let trace = take_trace(&bench);
    // From +v to -v takes two ramps.
    let turn = trace.samples().iter().max_by_key(|s| s.rotor).unwrap();
    let first = trace.samples()[0];
    assert!((980..1020).contains(&(turn.rotor - first.rotor)), "{}", turn.rotor - first.rotor);
    assert_near("speed", -256.0 * trace.speed(first.at + SECOND / 2, first.at + SECOND).unwrap(), pps(1000, 3), 0.001);
    assert_eq!(bench.lost_steps(), 0);
}

/// Soft mode approaches exponentially: the speed falls in proportion to what is left.
#[test]
fn soft_mode_approaches_exponentially() {
    let mut bench = Bench::new();
    bench.ok("SAP 138, 0, 1");
    start_trace(&bench, 0);
    bench.ok("MVP ABS, 0, 30000");
    bench.run(10 * SECOND);
    assert_eq!(bench.rotor(), 30_000);
    assert_eq!(bench.ok("GAP 138, 0"), 1);
    let trace = take_trace(&bench);
    let speed_at = |left: i64| {
        let samples = trace.samples();
        let i = samples.iter().position(|s| s.rotor >= 30_000 - left).unwrap();
        32.0 / seconds(samples[i + 16].at - samples[i - 16].at)
    };
    // v = p * d in internal units: p' = 247/512, v = 0.482 * 16e6 / 2^19 = 14.7 per second and step.
    let p = 247.0 / 512.0 * pps(1, 3);
    for left in [1600, 800, 400, 200] {
        assert_near("soft approach", speed_at(left), p * left as f64, 0.05);
    }
}

/// The very same scenario, twice: the same trace to the last sample.
#[test]
fn two_runs_are_identical() {
    fn run() -> Vec<hal_sim::world::trace::Sample> {
        let mut bench =
            Bench::in_world("seed = 7\n[motor]\nfriction = 0.1\nstall_guard_noise = 20\n[stage]\nright = 30000\n");
        start_trace(&bench, 0);
        for line in
            ["SAP 12, 0, 0", "ROR 0, 700", "MVP ABS, 0, 5000", "SAP 4, 0, 300", "MVP REL, 0, 40000", "GAP 206, 0"]
        {
            bench.ok(line);
            bench.run(700 * MILLISECOND + 13 * MICROSECOND);
        }
        take_trace(&bench).samples().to_vec()
    }
    let first = run();
    assert!(first.len() > 10_000);
    assert_eq!(first, run());
}
