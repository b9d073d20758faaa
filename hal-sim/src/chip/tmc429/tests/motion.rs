//! Ramps, positioning and velocities (datasheet chapters 8 and 9).

use super::*;

#[test]
fn step_rate() {
    // R = f_CLK * v / (2^PULSE_DIV * 2048 * 32) (8.1.13.1)
    for (pulse_div, velocity, seconds, expected) in [
        (0, 2047, 2, 999_511),   // 499 755.859 Hz
        (3, 2047, 10, 624_694),  // 62 469.482 Hz
        (5, 1000, 10, 76_293),   // 7 629.395 Hz
        (13, 1, 1000, 29),       // 0.029 802 Hz
        (7, -300, 100, -57_220), // 572.205 Hz
    ] {
        let mut rig = Rig::with(HOLD, pulse_div, 0, 0);
        rig.write(V_ACTUAL, (velocity as u32) & 0xFFF);
        rig.run(seconds * SECOND);
        let position = rig.chip.position(0);
        assert!(position.abs_diff(expected) <= 1, "{position}, not {expected}");
        assert_eq!(rig.stage.position, position);
        assert_eq!(rig.chip.velocity(0), velocity);
    }
}

#[test]
fn steps_are_on_the_exact_grid() {
    // 11.0592 MHz: a tick has 2893.518 ns. v = 1024 steps every second pulse tick of 2^4 ticks: step n is at
    // tick 32 * n, 32 * 32 / 11.0592 MHz = 92.592592.. us each.
    let mut rig = Rig { chip: Tmc429::new(11_059_200), stage: Stage::default(), now: 0 };
    rig.write(IF_CONF, STEP_DIR);
    rig.write(DIVIDERS, 4 << 12);
    rig.write(MODE, NO_STOPS | HOLD);
    rig.write(V_ACTUAL, 1024);
    rig.run(100 * SECOND);
    for (n, (at, _, _)) in (1_u128..).zip(&rig.stage.steps) {
        assert_eq!(u128::from(*at), (n * 1024 * 1_000_000_000).div_ceil(11_059_200));
    }
    // 11 059 200 / 1024 = 10 800 per second.
    assert_eq!(rig.stage.steps.len(), 1_080_000);
}

#[test]
fn acceleration() {
    // dR = f^2 * A_MAX / 2^(PULSE_DIV + RAMP_DIV + 29): with 3, 7 and A_MAX = 100 it is 46 566.1 pps/s. To
    // v = 1000, i.e. 30 517.6 pps, that takes 655.36 ms and v^2 / 2a = 10 000 steps.
    let mut rig = Rig::with(VELOCITY, 3, 7, 100);
    rig.write(V_TARGET, 1000);
    rig.run(327_680 * MICROSECOND);
    assert_eq!(rig.chip.velocity(0), 500);
    assert_eq!(rig.read(A_ACTUAL), 100);
    // The pulse generator does not see the fraction, half a unit on average: 5 steps in 20 480 pulse ticks.
    // Half a ramp tick of lag makes another v * 8 / 2048, 2 steps.
    assert!(rig.chip.position(0).abs_diff(2500 - 7) <= 2);
    rig.run(327_680 * MICROSECOND - TICK);
    assert_eq!(rig.chip.velocity(0), 999);
    rig.run(TICK);
    assert_eq!(rig.chip.velocity(0), 1000);
    assert_eq!(rig.read(A_ACTUAL), 0);
    assert!(rig.chip.position(0).abs_diff(10_000 - 14) <= 2);
    // Through zero to -1000: twice as long; on the way the sign is cut towards zero, so 0 is held twice.
    rig.write(V_TARGET, 0xFFF & 1000_u32.wrapping_neg());
    rig.run(MILLISECOND);
    assert_eq!(rig.read(A_ACTUAL), 0xF9C);
    rig.run(1_310_720 * MICROSECOND - MILLISECOND);
    assert_eq!((rig.chip.velocity(0), rig.read(V_ACTUAL)), (-1000, 0xC18));
    // V_MAX is lowered in motion: it ramps down to it.
    rig.write(V_MAX, 500);
    rig.run(300 * MILLISECOND);
    assert!((-600..-500).contains(&rig.chip.velocity(0)));
    rig.run(30 * MILLISECOND);
    assert_eq!(rig.chip.velocity(0), -500);
    // A_MAX = 0 freezes the velocity (8.1.7).
    rig.write(A_MAX, 0);
    rig.write(V_TARGET, 0);
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(0), -500);
}

#[test]
fn tiny_acceleration_is_exact() {
    // A_MAX = 1 and RAMP_DIV = 0: 256 ramp ticks of 2 us for each unit of velocity.
    let mut rig = Rig::with(VELOCITY, 0, 0, 1);
    rig.write(V_TARGET, 2047);
    for unit in 1..=2047 {
        rig.run(511 * MICROSECOND);
        assert_eq!(rig.chip.velocity(0), unit - 1);
        rig.run(MICROSECOND);
        assert_eq!(rig.chip.velocity(0), unit);
    }
}

/// Pairs of (A_MAX, RAMP_DIV, PULSE_DIV) and PMUL, PDIV with p' / p = 0.99 by 8.1.10.2.2:
/// PMUL = 0.99 * A_MAX / (128 * 2^(RAMP_DIV - PULSE_DIV)) * 2^(3 + PDIV).
const GOOD: [(u32, u32, u32, u32, u32); 9] = [
    (500, 3, 2, 247, 4),
    (1000, 7, 3, 247, 6),
    (2047, 7, 3, 253, 5),
    (100, 7, 5, 198, 7),
    (1, 0, 0, 253, 12),
    (2047, 0, 0, 253, 1),
    (10, 5, 5, 158, 8),
    (300, 9, 6, 148, 6),
    (1000, 6, 6, 247, 2),
];

#[test]
fn positioning_arrives_without_overshoot() {
    for (a_max, ramp_div, pulse_div, pmul, pdiv) in GOOD {
        for distance in [1, 2, 3, 7, 50, 999, 12_345, 200_000] {
            for v_max in [30, 400, 2047] {
                let mut rig = Rig::with(RAMP, pulse_div, ramp_div, a_max);
                rig.write(V_MAX, v_max);
                rig.write(PMUL_PDIV, pmul << 8 | pdiv);
                rig.write(X_TARGET, distance);
                assert_eq!(rig.status() & 1, 0);
                let time = rig.settle();
                let case = (a_max, ramp_div, pulse_div, distance, v_max);
                assert_eq!(rig.chip.position(0), distance as i32, "{case:?}");
                assert_eq!(rig.stage.highest, distance as i32, "{case:?}");
                assert_eq!((rig.chip.velocity(0), rig.status() & 1), (0, 1), "{case:?}");
                // A trapezoid or triangle: with v in pps and a in pps/s the time is d/v + v/a, or 2 sqrt(d/a).
                let v = 16e6 * f64::from(v_max) / f64::from(65_536 << pulse_div);
                let a = 16e6 * 16e6 * f64::from(a_max) / 2_f64.powi((pulse_div + ramp_div + 29) as i32);
                let d = f64::from(distance);
                let ideal = if d > v * v / a { d / v + v / a } else { 2.0 * (d / a).sqrt() };
                let seconds = time as f64 / 1e9;
                if distance > 10 {
                    let ratio = seconds / ideal;
                    assert!((0.9..1.08).contains(&ratio), "{case:?}: {seconds} s for {ideal} s");
                }
            }
        }
    }
}

#[test]
fn braking_starts_where_p_says() {
    // A_MAX = 1000, RAMP_DIV = 7, PULSE_DIV = 3: p = 1000 / (128 * 16) = 0.488. S = 2048 / p = 4194 steps from full
    // speed, and as many with p' = 247 / 512 = 0.482. Then v = sqrt(2048 * 0.482 * d) < 2047 below d = 2047^2 / 988 =
    // 4241.1.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(X_TARGET, 20_000);
    while rig.chip.position(0) < 20_000 - 4242 {
        rig.run(TICK);
    }
    assert_eq!((rig.read(V_TARGET), rig.read(V_ACTUAL)), (2047, 2047));
    while rig.chip.position(0) < 20_000 - 4241 {
        rig.run(TICK);
    }
    assert_eq!(rig.read(V_TARGET), 2046);
    // At a quarter of the way half the velocity: sqrt(988 * 1060) = 1023.
    while rig.chip.position(0) < 20_000 - 1060 {
        rig.run(TICK);
    }
    assert_eq!(rig.read(V_TARGET), 1023);
    assert!(rig.chip.velocity(0).abs_diff(1023) <= 5);
}

#[test]
fn too_large_p_overshoots_and_comes_back() {
    // Twice the p of the acceleration: braking starts at half the way it needs, and v^2 at the target is
    // still half of the initial, 2047 / sqrt(2) = 1447. The way to rest is then half of S = 4194, i.e. 2097.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 5);
    rig.write(X_TARGET, 20_000);
    while rig.chip.position(0) < 20_000 {
        rig.run(10 * MICROSECOND);
    }
    assert!(rig.chip.velocity(0).abs_diff(1447) <= 20, "{}", rig.chip.velocity(0));
    rig.run(300 * MILLISECOND);
    assert!(rig.stage.highest.abs_diff(20_000 + 2097) <= 60, "{}", rig.stage.highest);
    // Each return passes the target again, with 0.7 times the velocity or so, until it is slow enough.
    let settled = rig.settle();
    assert!(settled > 100 * MILLISECOND, "{settled}");
    assert_eq!((rig.chip.position(0), rig.stage.position), (20_000, 20_000));
    let turns = rig.stage.steps.windows(2).filter(|pair| pair[0].2 != pair[1].2).count();
    assert!((4..40).contains(&turns), "{turns} turns");
}

#[test]
fn too_small_p_creeps() {
    // A sixteenth of the good p. Braking takes v^2 / (2048 * p) = 2047^2 / (2048 * 0.0302) = 67 856 steps, at half of
    // 62 469 Hz on average 2.17 s. The ramp up still takes 2047^2 / 1000 = 4190 steps in 0.13 s. The rest of the way,
    // 127 954 steps, takes 2.05 s. With the good p the move would take 3.3 s.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 10);
    rig.write(X_TARGET, 200_000);
    let time = rig.settle();
    assert!(time.abs_diff(4_360 * MILLISECOND) < 100 * MILLISECOND, "{time}");
    assert_eq!(rig.stage.highest, 200_000);
}

#[test]
fn v_min_is_kept_up_to_the_target() {
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(V_MIN, 500);
    rig.write(X_TARGET, 20_000);
    while rig.chip.position(0) < 19_999 {
        rig.run(TICK);
    }
    assert_eq!(rig.chip.velocity(0), 500);
    rig.settle();
    assert_eq!((rig.stage.highest, rig.chip.velocity(0)), (20_000, 0));
}

#[test]
fn target_set_to_the_position_is_no_magic_stop() {
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(X_TARGET, 1_000_000);
    rig.run(SECOND);
    let here = rig.chip.position(0);
    rig.write(X_TARGET, here as u32);
    rig.settle();
    // S = 4194 steps to rest.
    assert!(rig.stage.highest.abs_diff(here + 4194) < 50);
    assert_eq!(rig.chip.position(0), here);
    // With A_MAX = 0 it runs through for good.
    rig.write(X_TARGET, (here + 10_000) as u32);
    rig.run(100 * MILLISECOND);
    rig.write(A_MAX, 0);
    rig.run(10 * SECOND);
    assert!(rig.chip.position(0) > here + 50_000);
}

#[test]
fn v_max_zero_holds() {
    let mut rig = Rig::with(RAMP, 0, 0, 1000);
    rig.write(V_MAX, 0);
    rig.write(X_TARGET, 1000);
    assert_eq!(rig.settle(), 0);
    assert_eq!((rig.chip.position(0), rig.status() & 1), (0, 0));
}

#[test]
fn soft_mode_decays_exponentially() {
    // v = p * d: the rest of the way halves every ln 2 * 2^PULSE_DIV * 65 536 / (f * p). PULSE_DIV = 3 and
    // p = 247 / 512 (A_MAX = 1000): 47.08 ms. From v = 500, reached at d = 1036.
    let mut rig = Rig::with(SOFT, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(V_MAX, 500);
    rig.write(X_TARGET, 5_000);
    while rig.chip.position(0) < 4_200 {
        rig.run(TICK);
    }
    for rest in [400, 200, 100, 50_i32] {
        rig.run(47_080 * MICROSECOND);
        let left = 5_000 - rig.chip.position(0);
        assert!(left.abs_diff(rest) <= 4, "{left} for {rest}");
        assert!(rig.chip.velocity(0).abs_diff(left * 247 / 512) <= 2);
    }
    rig.settle();
    assert_eq!((rig.chip.position(0), rig.stage.highest), (5_000, 5_000));
    // With V_MIN = 0 it does not get there: p * d < 1 for d = 2 (8.1.3).
    rig.write(V_MIN, 0);
    rig.write(X_TARGET, 6_000);
    rig.run(10 * SECOND);
    assert_eq!(rig.chip.position(0), 5_998);
}

#[test]
fn hold_mode_ignores_limits() {
    let mut rig = Rig::with(HOLD, 5, 5, 1);
    rig.write(V_MAX, 10);
    rig.write(V_ACTUAL, 2000);
    rig.run(SECOND);
    // 16 MHz * 2000 / (32 * 65 536) = 15 258.8
    assert_eq!((rig.chip.velocity(0), rig.chip.position(0)), (2000, 15_258));
    rig.write(V_ACTUAL, 0);
    assert_eq!((rig.chip.velocity(0), rig.chip.next_event()), (0, None));
}

#[test]
fn starts_with_a_written_velocity() {
    // 12.2, in ramp_mode.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(V_MIN, 300);
    rig.write(X_TARGET, 1000);
    rig.write(V_ACTUAL, 300);
    // 300 of 2048 each 16 us: the first step after 7 pulse ticks.
    rig.run(7 * 16 * MICROSECOND);
    assert_eq!(rig.chip.position(0), 1);
    rig.settle();
    assert_eq!(rig.stage.highest, 1000);
}

#[test]
fn positions_wrap_at_24_bits() {
    let mut rig = Rig::with(RAMP, 0, 0, 2047);
    rig.write(PMUL_PDIV, 253 << 8 | 1);
    rig.write(MODE, NO_STOPS | VELOCITY);
    rig.write(X_ACTUAL, 0x7F_FFF0);
    rig.write(X_TARGET, 0x80_0010);
    rig.write(MODE, NO_STOPS | RAMP);
    rig.settle();
    assert_eq!((rig.chip.position(0), rig.read(X_ACTUAL)), (-0x7F_FFF0, 0x80_0010));
    assert_eq!(rig.stage.position, 32);
    rig.write(X_TARGET, 0x7F_FFFF);
    rig.settle();
    assert_eq!((rig.chip.position(0), rig.stage.position), (0x7F_FFFF, 15));
    // A distance of 2^23 - 1 is the longest in the right direction.
    rig.write(X_TARGET, 0xFF_FFFE);
    rig.run(MILLISECOND);
    assert_eq!(rig.read(V_TARGET), 2047);
    rig.write(X_TARGET, 0x00_0200);
    rig.run(MILLISECOND);
    assert_eq!(rig.read(V_TARGET), 0x801);
}
