//! A motor turns as fast as its torque allows: what its current makes, and what the supply lets through. The limits
//! here are worked out from the figures of the data sheet and from the formula alone.

use common::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm_sim::Product;

/// The default motor: ohms, henries, newton metres with the rated amperes in both phases, and the drag at 1000 full
/// steps/s.
const R: f64 = 1.4;
const L: f64 = 3.0e-3;
const HOLDING: f64 = 0.59;
const RATED: f64 = 2.0;
const DRAG: f64 = 0.012;
/// Volts that the bridges take.
const DROP: f64 = 0.5;
/// The peak of 2 A RMS, the full current of the TMCM-1140.
const FULL: f64 = 2.0 * std::f64::consts::SQRT_2;

/// The torque by the voltage, as a share of that at full current: (V / Z - K' w R / Z^2) / I.
fn by_voltage(volts: f64, full_steps: f64) -> f64 {
    // 50 pole pairs; an electrical turn is four full steps.
    let emf = HOLDING / (std::f64::consts::SQRT_2 * RATED * 50.0);
    let w = full_steps / 4.0 * std::f64::consts::TAU;
    let z = R.hypot(w * L);
    ((volts - DROP) / z - emf * w * R / (z * z)) / FULL
}

/// The speed in full steps per second at which a motor with this load has no torque left.
fn limit(volts: f64, load: f64) -> f64 {
    let left = |speed: f64| by_voltage(volts, speed).min(1.0) - load - DRAG * speed / 1_000.0;
    let (mut low, mut high) = (0.0, 50_000.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if left(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

/// A motor at its full current and with 16 microsteps, which is to reach so many full steps per second.
fn spun(toml: &str, load: f64, full_steps: f64) -> Bench {
    let mut bench = Bench::of_in_world(Product::Tmcm1140, toml);
    // With a pulse divisor of 0 a unit of speed is 16 MHz / 2048 / 32 = 244.14 microsteps a second.
    bench.configure(&["SAP 6, 0, 255", "SAP 140, 0, 4", "SAP 154, 0, 0", "SAP 153, 0, 4", "SAP 5, 0, 400"]);
    bench.control(&format!("load {load}"));
    bench.run(100 * MILLISECOND);
    bench.ok(&format!("ROR 0, {}", (full_steps * 16.0 / 244.14).round()));
    bench.run(4 * SECOND);
    bench
}

fn lost(bench: &Bench) -> i64 {
    bench.module.board().borrow().world().axis(0).motor().lost_steps()
}

fn check(toml: &str, volts: f64, load: f64) -> f64 {
    let limit = limit(volts, load);
    for (share, holds) in [(0.95, true), (1.05, false)] {
        let bench = spun(toml, load, share * limit);
        assert_eq!(lost(&bench) == 0, holds, "{volts} V, load {load}: {share} of {limit}: lost {}", lost(&bench));
    }
    limit
}

#[test]
fn the_voltage_limits_a_fast_motor() {
    let mut half = Vec::new();
    for volts in [12.0, 18.0, 24.0] {
        let world = format!("[supply]\nvolts = {volts}\n");
        let free = check(&world, volts, 0.0);
        check(&world, volts, 0.25);
        half.push(check(&world, volts, 0.5));
        if volts == 24.0 {
            let rpm = free / 200.0 * 60.0;
            assert!((1_500.0..5_000.0).contains(&rpm), "{rpm}");
        }
    }
    assert!(half.is_sorted() && half[2] > 1.8 * half[0], "{half:?}");
}

/// At 100 full steps a second the voltage would do for six times the full current.
#[test]
fn the_current_limits_a_slow_motor() {
    for volts in [12.0, 18.0, 24.0] {
        let world = format!("[supply]\nvolts = {volts}\n");
        for (current, share) in [(255, 1.0), (127, 0.5)] {
            for (part, holds) in [(0.95, true), (1.05, false)] {
                let mut bench = Bench::of_in_world(Product::Tmcm1140, &world);
                bench.configure(&[&format!("SAP 6, 0, {current}"), "ROR 0, 838"]);
                bench.run(SECOND);
                bench.control(&format!("load {}", (part * share - DRAG * 0.1_f64).min(1.0)));
                bench.run(SECOND);
                assert_eq!(lost(&bench) == 0, holds, "{volts} V, current {current}: {part}");
            }
        }
    }
}

#[test]
fn the_supply_counts_at_once() {
    let speed = (limit(12.0, 0.25) + limit(24.0, 0.25)) / 2.0;
    let mut bench = spun("", 0.25, speed);
    assert_eq!(lost(&bench), 0);
    bench.control("supply 12");
    bench.run(10 * MILLISECOND);
    assert!(lost(&bench) > 0);
}

/// A motor that a switch stops at once is as strong there as it was before it turned.
#[test]
fn a_motor_that_stands_takes_nothing_for_its_speed() {
    let mut bench = spun("", 0.0, 2_000.0);
    bench.ok("SAP 12, 0, 0");
    bench.control("press right");
    bench.run(100 * MILLISECOND);
    let board = bench.module.board();
    let seen = |what: fn(&hal_sim::world::motor::Motor) -> u32| what(board.borrow().world().axis(0).motor());
    assert_eq!((seen(|motor| motor.demand()), seen(|motor| motor.available())), (0, 65_536));
}

#[test]
fn without_inductance_there_is_no_limit() {
    let bench = spun("[motor]\ninductance = 0\ndrag = 1.0\n", 0.9, 30_000.0);
    assert_eq!(lost(&bench), 0);
}

/// The load value at the default threshold (174 = 5), at 119 full steps a second and with the default current of 17/32.
/// It is 512 without a load, and 0 where the motor just holds: 0.5297 and a drag of 0.0014 of 0.5313. Stop on stall
/// stops only the motor that has lost.
#[test]
fn the_default_threshold_tells_a_stall_from_a_free_motor() {
    for product in [Product::Tmcm1140, Product::Tmcm3110, Product::Tmcm6110] {
        let mut bench = Bench::of(product);
        bench.configure(&["ROR 0, 1000", "SAP 173, 0, 0"]);
        bench.run(SECOND);
        assert!((500..=512).contains(&bench.ok("GAP 206, 0")), "{product:?}");
        bench.control("load 0.5297");
        bench.run(SECOND);
        assert_eq!((bench.ok("GAP 206, 0"), lost(&bench)), (0, 0), "{product:?}");
        bench.control("load 0");
        bench.ok("SAP 181, 0, 500");
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 3, 0"), 1_000, "{product:?}");
        bench.control("load 0.6");
        bench.run(SECOND);
        assert_eq!((bench.ok("GAP 3, 0"), bench.ok("GAP 207, 0")), (0, 1), "{product:?}");
    }
}
