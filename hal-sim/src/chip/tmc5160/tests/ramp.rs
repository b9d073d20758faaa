//! The ramp generator against the closed formulas (chapter 12), and changes on the fly.

use super::*;

/// The registers of the example of 23.1, in their order, without the target.
const EXAMPLE: [(u8, u32); 7] =
    [(A1, 1_000), (V1, 50_000), (AMAX, 500), (VMAX, 200_000), (DMAX, 700), (D1, 1_400), (VSTOP, 10)];

/// A ramp of one acceleration and one deceleration.
fn simple(vmax: u32, a: u32, d: u32) -> Vec<(u8, u32)> {
    vec![(AMAX, a), (VMAX, vmax), (DMAX, d), (D1, d), (VSTOP, 10)]
}

/// 12.1: "v[Hz] = v[5160] * ( fCLK[Hz]/2 / 2^23 )".
#[test]
fn example_of_12_1_velocity_unit() {
    for velocity in [1_000, 123_456, 8_388_096] {
        let mut rig = Rig::with(&[(AMAX, 0xFFFF), (VMAX, velocity), (RAMPMODE, 1)]);
        rig.run(2 * SECOND);
        assert_eq!(rig.chip.velocity(), velocity.cast_signed());
        let before = rig.position();
        rig.run(2 * SECOND);
        near(f64::from(rig.position() - before), 2.0 * hertz(velocity), 2.0);
    }
}

/// 12.1: "a[Hz/s] = a[5160] * fCLK[Hz]^2 / (512*256) / 2^24".
#[test]
fn example_of_12_1_acceleration_unit() {
    for (acceleration, mode, sign) in [(1, 1, 1.0), (37, 2, -1.0), (1_000, 1, 1.0)] {
        let mut rig = Rig::with(&[(AMAX, acceleration), (VMAX, 8_000_000), (RAMPMODE, mode)]);
        let began = rig.now;
        for _ in 0..10 {
            rig.run(SECOND / 4);
            let seconds = (rig.now - began) as f64 / 1e9;
            let way = hertz_per_second(acceleration) * seconds * seconds / 2.0;
            near(f64::from(rig.position()), sign * way, 2.0);
            near(f64::from(rig.chip.velocity()) * hertz(1), sign * hertz_per_second(acceleration) * seconds, hertz(3));
        }
    }
}

/// 12.1: "rs = (v[5160])^2 / a[5160] / 2^8, assuming acceleration from 0 to v".
#[test]
fn example_of_12_1_ramp_steps() {
    for (velocity, acceleration) in [(100_000, 1_000), (50_000, 77), (1_000_000, 30_000)] {
        let mut rig = Rig::with(&[(AMAX, acceleration), (VMAX, velocity), (RAMPMODE, 1)]);
        rig.until(TICK, |rig| rig.chip.velocity() == velocity.cast_signed());
        let steps = f64::from(velocity) * f64::from(velocity) / f64::from(acceleration) / 256.0;
        // A tick more or less is hertz(velocity) * 32 us.
        near(f64::from(rig.position()), steps, 2.0 + hertz(velocity) * 32e-6);
    }
}

/// The time of a move by the closed formulas: phases from speed to speed, in microsteps per second.
fn time_of_phases(phases: &[(f64, f64, f64)], way: f64, cruise: f64) -> f64 {
    let (mut time, mut length) = (0.0, 0.0);
    for (from, to, rate) in phases {
        time += (to - from).abs() / rate;
        length += (to * to - from * from).abs() / 2.0 / rate;
    }
    assert!(length < way, "the move is too short for its top speed");
    time + (way - length) / cruise
}

/// 12.2.1: the six-point ramp of 23.1 takes its time, and has its knees.
#[test]
fn a_six_point_ramp_takes_the_time_of_the_formulas() {
    for target in [1_000_000, -1_000_000] {
        let mut rig = Rig::with(&EXAMPLE);
        rig.write(XTARGET, target as u32);
        let began = rig.now;
        rig.settle();
        assert_eq!(rig.position(), target);
        let (v1, vmax, vstop) = (hertz(50_000), hertz(200_000), hertz(10));
        let [a1, amax, dmax, d1] = [1_000, 500, 700, 1_400].map(hertz_per_second);
        let phases = [(0.0, v1, a1), (v1, vmax, amax), (vmax, v1, dmax), (v1, vstop, d1)];
        let took = (rig.stage.turns.last().unwrap().0 - began) as f64 / 1e9;
        near(took, time_of_phases(&phases, 1_000_000.0, vmax), 0.0);
        // The knee: V1 is reached at v1/a1, where v1^2/2/a1 microsteps are behind.
        let knee = began + (v1 / a1 * 1e9) as Nanos;
        let steps = rig.stage.turns.iter().filter(|(at, _)| *at <= knee).count();
        near(steps as f64, v1 * v1 / 2.0 / a1, 2.0);
        let knee = knee + ((vmax - v1) / amax * 1e9) as Nanos;
        let steps = rig.stage.turns.iter().filter(|(at, _)| *at <= knee).count();
        near(steps as f64, v1 * v1 / 2.0 / a1 + (vmax * vmax - v1 * v1) / 2.0 / amax, 2.0);
        // The knee on the way down lies as far before the target.
        let end = rig.stage.turns.last().unwrap().0;
        let knee = end - ((v1 - vstop) / d1 * 1e9) as Nanos;
        let steps = rig.stage.turns.iter().filter(|(at, _)| *at > knee).count();
        near(steps as f64, (v1 * v1 - vstop * vstop) / 2.0 / d1, 2.0);
    }
}

/// 12.2.2: the motor starts with VSTART and stops from VSTOP.
#[test]
fn start_and_stop_velocity_are_jumps() {
    let (vstart, vstop) = (20_000, 30_000);
    let mut rig = Rig::with(&simple(100_000, 500, 800));
    rig.write(VSTART, vstart);
    rig.write(VSTOP, vstop);
    let began = rig.now;
    rig.write(XTARGET, 300_000);
    rig.run(TICK);
    assert!((20_000..20_005).contains(&rig.chip.velocity()), "{}", rig.chip.velocity());
    let mut slowest = i32::MAX;
    while !rig.chip.ramp.at_target() {
        rig.run(TICK);
        if rig.chip.velocity() != 0 {
            slowest = rig.chip.velocity();
        }
    }
    assert!((30_000..=30_010).contains(&slowest), "{slowest}");
    let (a, d) = (hertz_per_second(500), hertz_per_second(800));
    let phases = [(hertz(vstart), hertz(100_000), a), (hertz(100_000), hertz(vstop), d)];
    let took = (rig.stage.turns.last().unwrap().0 - began) as f64 / 1e9;
    near(took, time_of_phases(&phases, 300_000.0, hertz(100_000)), 100e-6);
}

/// V1 = 0 disables A1 and D1 (6.3.1).
#[test]
fn without_v1_only_amax_and_dmax_count() {
    let mut rig = Rig::with(&simple(100_000, 500, 800));
    rig.write(A1, 1);
    rig.write(D1, 1);
    rig.write(XTARGET, 300_000);
    let began = rig.now;
    rig.settle();
    let phases = [(0.0, hertz(100_000), hertz_per_second(500)), (hertz(100_000), 0.0, hertz_per_second(800))];
    let took = (rig.stage.turns.last().unwrap().0 - began) as f64 / 1e9;
    near(took, time_of_phases(&phases, 300_000.0, hertz(100_000)), 0.0);
}

#[test]
fn moves_of_any_length_arrive_without_overshoot() {
    for (a, d, vmax, vstart, vstop) in [
        (1_000, 1_000, 100_000, 0, 1),
        (65_535, 65_535, 8_388_096, 0, 10),
        (65_535, 300, 2_000_000, 0, 10),
        (10, 65_535, 2_000_000, 5_000, 5_000),
        (1, 1, 500, 0, 1),
        (40_000, 3, 60_000, 0, 10),
    ] {
        for way in [1, 2, 3, 10, 100, 1_000, 30_000] {
            for sign in [1, -1] {
                let mut rig = Rig::with(&simple(vmax, a, d));
                rig.write(VSTART, vstart);
                rig.write(VSTOP, vstop);
                rig.write(XTARGET, (way * sign) as u32);
                rig.settle();
                let name = format!("{way} with a {a}, d {d}, vmax {vmax}");
                assert_eq!(rig.position(), way * sign, "{name}");
                assert_eq!(rig.stage.turns.len(), way as usize, "{name}: no step back");
                assert_eq!(rig.read(RAMP_STAT) & 0x1F80, 0x0680, "{name}: reached, at rest, no second move");
            }
        }
    }
}

/// A triangle: the top speed is where acceleration and braking meet, v^2/2 (1/a + 1/d) = way.
#[test]
fn a_short_move_has_the_top_speed_of_the_formula() {
    let mut rig = Rig::with(&simple(1_000_000, 2_000, 1_000));
    rig.write(XTARGET, 20_000);
    let top = rig.top_speed(2 * SECOND);
    let (a, d) = (hertz_per_second(2_000), hertz_per_second(1_000));
    near(f64::from(top) * hertz(1), (2.0 * 20_000.0 / (1.0 / a + 1.0 / d)).sqrt(), 2_000.0 / 256.0);
}

/// "The maximum possible displacement is +/-((2^31)-1)", and the position is allowed to wrap around (6.3.1).
#[test]
fn the_longest_way_wraps_around() {
    for (from, to, way) in [(-(1 << 30), (1 << 30) - 1, i32::MAX), (i32::MAX - 10, i32::MIN + 20, 31)] {
        let mut rig = Rig::with(&simple(8_388_096, 65_535, 65_535));
        rig.write(XTARGET, from as u32);
        rig.write(RAMPMODE, 3);
        rig.write(XACTUAL, from as u32);
        rig.write(RAMPMODE, 0);
        rig.write(XTARGET, to as u32);
        let steps = rig.chip.field();
        if way < 1_000 {
            rig.settle();
            assert_eq!((rig.position(), rig.chip.field() - steps), (to, way.into()));
        } else {
            // A second for the ramp of 2^23 / 65 535 * 256 changes, 1.05 s, and 7 999 512 microsteps per second from
            // then on.
            rig.run(3 * SECOND);
            near((rig.chip.field() - steps) as f64, (3.0 - 1.0485 / 2.0) * 7_999_512.0, 0.0);
        }
    }
}

#[test]
fn velocity_mode_passes_through_rest_and_hold_mode_keeps_the_velocity() {
    let mut rig = Rig::with(&[(AMAX, 1_000), (VMAX, 100_000), (RAMPMODE, 1), (XTARGET, 1 << 30)]);
    rig.run(SECOND);
    assert_eq!(rig.read(RAMP_STAT) & 0x700, 0x100);
    rig.write(RAMPMODE, 3);
    rig.write(VMAX, 0);
    rig.run(SECOND);
    assert_eq!(rig.read(VACTUAL), 100_000);
    rig.write(VMAX, 50_000);
    rig.write(RAMPMODE, 2);
    // 150 000 / 1000 * 256 changes of 32 us, and one at rest.
    let began = rig.now;
    rig.until(TICK, |rig| rig.chip.velocity() == -50_000);
    near((rig.now - began) as f64, 150.0 * 256.0 * TICK as f64, 2.0 * TICK as f64);
    assert_eq!(rig.read(VACTUAL), 0xFF_FFFF - 49_999);
    assert_eq!(rig.read(RAMP_STAT) & 0x700, 0x100);
    rig.write(VMAX, 0);
    rig.run(SECOND);
    assert_eq!(rig.read(RAMP_STAT) & 0x700, 0x500, "at rest, which is VMAX");
    assert_eq!(rig.chip.next_event().map(|next| next - rig.now > SECOND / 20), None);
}

/// 12.2.2: TZEROWAIT * 512 clocks between a stop and the next move, which t_zerowait_active shows.
#[test]
fn the_motor_waits_before_it_turns_back() {
    let mut rig = Rig::with(&simple(100_000, 2_000, 2_000));
    rig.write(TZEROWAIT, 3_125);
    rig.write(XTARGET, 10_000);
    rig.until(TICK, |rig| rig.chip.ramp.at_target());
    let end = rig.stage.turns.last().unwrap().0;
    rig.write(XTARGET, 0);
    assert_eq!(rig.read(RAMP_STAT) & 0xC00, 0xC00);
    rig.run(end + 99 * MILLISECOND - rig.now);
    assert_eq!(rig.read(RAMP_STAT) & 0xC00, 0xC00);
    rig.run(2 * MILLISECOND);
    assert_eq!(rig.read(RAMP_STAT) & 0xC00, 0);
    rig.settle();
    assert_eq!(rig.position(), 0);
}

/// The moments in the example's ramp at which something is changed: in each of its phases.
fn phases() -> Vec<(&'static str, i32, bool)> {
    vec![
        ("below V1 going up", 20_000, true),
        ("above V1 going up", 100_000, true),
        ("cruising", 200_000, true),
        ("above V1 going down", 120_000, false),
        ("below V1 going down", 20_000, false),
    ]
}

/// The example on its way to 400 000, in the phase.
fn in_phase((_, speed, rising): (&str, i32, bool)) -> Rig {
    let mut rig = Rig::with(&EXAMPLE);
    rig.write(XTARGET, 1_000_000);
    rig.until(TICK, |rig| rig.chip.velocity() >= speed);
    if !rising {
        rig.until(TICK, |rig| rig.chip.velocity() == 200_000);
        rig.until(TICK, |rig| rig.chip.velocity() <= speed);
    }
    rig
}

#[test]
fn a_target_that_changes_in_any_phase_is_reached() {
    for phase in phases() {
        for ahead in [500_000, 100_000, 20_000, 3_000, 100, 0, -1, -3_000, -500_000] {
            let mut rig = in_phase(phase);
            let here = rig.position();
            let target = here + ahead;
            let speed = hertz(rig.chip.velocity().unsigned_abs());
            rig.write(XTARGET, target as u32);
            let from = rig.position();
            rig.settle();
            let name = format!("{} by {ahead}", phase.0);
            assert_eq!(rig.position(), target, "{name}");
            let highest = rig.stage.turns.iter().map(|(_, at)| *at).max().unwrap();
            // The way that braking takes from here: D1 below V1, DMAX above.
            let v1 = hertz(50_000).min(speed);
            let way = v1 * v1 / 2.0 / hertz_per_second(1_400) + (speed * speed - v1 * v1) / 2.0 / hertz_per_second(700);
            let reach = f64::from(from) + way;
            let overshoots = reach > f64::from(target) + 3.0;
            assert_eq!(rig.read(RAMP_STAT) >> 12 & 1, u32::from(overshoots), "{name}: second move");
            if overshoots {
                near(highest as f64, reach, 40.0);
            } else {
                assert_eq!(highest, i64::from(target.max(here)), "{name}: no overshoot");
            }
        }
    }
}

/// 12.2.4 b and 12.2.5: VMAX can be changed at any time; AMAX and A1 lead to it, and VSTOP is not used on the way to 0.
#[test]
fn vmax_that_changes_in_any_phase_is_reached_with_the_accelerations() {
    for phase in phases().into_iter().take(3) {
        for vmax in [150_000, 30_000, 0] {
            let mut rig = in_phase(phase);
            rig.write(VSTOP, 5_000);
            let (before, began) = (rig.chip.velocity(), rig.now);
            rig.write(VMAX, vmax);
            rig.until(TICK, |rig| rig.chip.velocity() == vmax.cast_signed());
            let phase_time = |from: i32, to: i32, rate: u32| {
                (f64::from(from) - f64::from(to)).max(0.0) / f64::from(rate) * 256.0 * 32e-6
            };
            let (from, to) = (before.min(vmax as i32), before.max(vmax as i32));
            let expected =
                phase_time(to.max(50_000), from.max(50_000), 500) + phase_time(to.min(50_000), from.min(50_000), 1_000);
            near((rig.now - began) as f64 / 1e9, expected, 150e-6);
            rig.write(VMAX, 200_000);
            rig.write(VSTOP, 10);
            rig.settle();
            assert_eq!(rig.position(), 1_000_000);
            assert_eq!(rig.stage.turns.iter().map(|(_, at)| *at).max(), Some(1_000_000), "no overshoot");
        }
    }
}

/// 12.2.4 c: "trigger the deceleration phase by copying XACTUAL to XTARGET". The motor stops with D1 and DMAX, and
/// comes back after TZEROWAIT.
#[test]
fn a_target_where_the_motor_is_brakes_it_with_dmax_and_d1() {
    let mut rig = in_phase(phases()[2]);
    rig.write(TZEROWAIT, 0xFFFF);
    let (from, began) = (rig.position(), rig.now);
    rig.write(XTARGET, from as u32);
    rig.until(TICK, |rig| rig.chip.velocity() == 0);
    let took = (rig.now - began) as f64 / 1e9;
    let (v1, vmax) = (hertz(50_000), hertz(200_000));
    near(took, (vmax - v1) / hertz_per_second(700) + v1 / hertz_per_second(1_400), 100e-6);
    assert_eq!(rig.read(RAMP_STAT) >> 10 & 0b111, 0b11, "at rest and waiting, not yet a second move");
    rig.settle();
    rig.run(3 * SECOND);
    assert_eq!((rig.position(), rig.read(RAMP_STAT) >> 12 & 1), (from, 1));
}

/// 12.2.4 a: velocity mode with VMAX 0 stops a motion with AMAX alone.
#[test]
fn velocity_mode_with_vmax_0_stops_with_amax() {
    let mut rig = in_phase(phases()[2]);
    rig.write(VMAX, 0);
    rig.write(AMAX, 1_000);
    let began = rig.now;
    rig.write(RAMPMODE, 1);
    rig.until(TICK, |rig| rig.chip.velocity() == 0);
    near((rig.now - began) as f64, 200.0 * 256.0 * TICK as f64, 2.0 * TICK as f64);
}

/// 6.3.1, "Hint" of XTARGET: a motor that brakes for its target does not accelerate because it could now brake faster,
/// but does when the target is written again.
#[test]
fn a_braking_motor_accelerates_again_only_with_its_target_written() {
    let speed_after = |rewritten| {
        let mut rig = in_phase(phases()[3]);
        rig.write(DMAX, 7_000);
        rig.write(D1, 14_000);
        if rewritten {
            rig.write(XTARGET, 1_000_000);
        }
        let before = rig.chip.velocity();
        rig.run(20 * MILLISECOND);
        let after = rig.chip.velocity();
        rig.settle();
        assert_eq!(rig.position(), 1_000_000);
        after - before
    };
    assert!(speed_after(false) <= 0);
    assert!(speed_after(true) > 1_000);
}

/// position_reached is a comparison, also in velocity mode; event_pos_reached its rising edge.
#[test]
fn passing_the_target_is_an_event() {
    let mut rig = Rig::with(&[(AMAX, 1_000), (VMAX, 100_000), (RAMPMODE, 1), (XTARGET, 5_000), (X_COMPARE, 4_000)]);
    rig.write(RAMP_STAT, 0x80);
    let mut compared = false;
    while rig.position() < 5_000 {
        assert!(!rig.chip.interrupt_pin());
        compared |= rig.chip.position_compare_pin();
        rig.run(MICROSECOND);
    }
    assert!(compared && rig.chip.interrupt_pin());
    assert!(rig.chip.ramp.at_target());
    rig.run(SECOND);
    assert_eq!(rig.read(RAMP_STAT) & 0x280, 0x80);
    rig.write(RAMP_STAT, 0x80);
    assert!(!rig.chip.interrupt_pin());
}

/// 22, "Moving the motor using the motion controller": velocity mode with AMAX 1000 and VMAX 100 000.
#[test]
fn example_of_22_moving_the_motor_in_velocity_mode() {
    let mut rig = Rig::with(&[(RAMPMODE, 1), (AMAX, 1_000), (VMAX, 100_000)]);
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(), 100_000);
    rig.write(VMAX, 40_000);
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(), 40_000);
}

/// 22, "Move to target": with a new target on the fly, until event_pos_reached is active.
#[test]
fn example_of_22_moving_to_a_target() {
    let mut rig = Rig::with(&EXAMPLE);
    rig.write(XTARGET, 100_000);
    rig.run(SECOND / 10);
    rig.write(XTARGET, 150_000);
    while rig.read(RAMP_STAT) & 0x80 == 0 {
        assert!(rig.now < 10 * SECOND);
        rig.run(MILLISECOND);
    }
    assert_eq!((rig.position(), rig.chip.velocity()), (150_000, 0));
}

/// 12.1: "Setting the CHOPCONF options intpol=1 and MRES=%0001 will double the motor velocity for the same speed
/// setting and thus also double effective acceleration and deceleration."
#[test]
fn example_of_12_1_half_of_the_resolution_is_twice_the_speed() {
    let turns = |resolution: u32| {
        let mut rig = Rig::with(&EXAMPLE);
        rig.write(CHOPCONF, 1 << 28 | resolution << 24 | 0xC3);
        rig.write(XTARGET, 1_000_000);
        let began = rig.now;
        let took = rig.settle();
        let half = rig.stage.turns.partition_point(|(at, _)| *at < began + took / 10);
        (took, rig.stage.turns[half].1, rig.stage.field)
    };
    let ((whole, early, end), (twice, twice_early, twice_end)) = (turns(0), turns(1));
    assert_eq!((whole, end, twice_end), (twice, 1_000_000, 2_000_001));
    assert_eq!(twice_early, 2 * early + 1);
}

/// 12.2.4 b: "set VSTART=0 and VMAX=0 ... unless the ramp is already in the deceleration phase to stop at the target":
/// then the motor gets there no later than it would have.
#[test]
fn example_of_12_2_4_vmax_0_while_braking_stops_on_the_target_at_the_latest() {
    let mut rig = in_phase(phases()[3]);
    rig.write(AMAX, 100);
    rig.write(A1, 100);
    rig.write(VMAX, 0);
    rig.settle();
    assert_eq!(rig.position(), 1_000_000);
    assert_eq!(rig.stage.turns.iter().map(|(_, at)| *at).max(), Some(1_000_000), "no overshoot");
}

/// 12.2.4 d: a stop switch that is tied to a fixed level, activated by its polarity; hard and soft.
#[test]
fn example_of_12_2_4_a_stop_by_the_polarity_of_a_switch() {
    for soft in [0, 1 << mode::SOFT] {
        let mut rig = in_phase(phases()[2]);
        rig.write(SW_MODE, soft | 0b11);
        assert_eq!(rig.chip.velocity(), 200_000);
        let began = rig.now;
        rig.write(SW_MODE, soft | 0b1111);
        rig.until(TICK, |rig| rig.chip.velocity() == 0);
        let (v1, vmax) = (hertz(50_000), hertz(200_000));
        let braking = (vmax - v1) / hertz_per_second(700) + v1 / hertz_per_second(1_400);
        near((rig.now - began) as f64 / 1e9, if soft == 0 { 0.0 } else { braking }, 100e-6);
        rig.run(SECOND);
        assert_eq!((rig.chip.velocity(), rig.read(RAMP_STAT) & 0x30), (0, 0x20));
        rig.write(SW_MODE, soft);
        rig.settle();
        assert_eq!(rig.position(), 1_000_000);
    }
}

/// 12.2.5: positioning mode sets the limit, VMAX the speed, 0 stands.
#[test]
fn example_of_12_2_5_joystick_control() {
    let mut rig = Rig::with(&EXAMPLE);
    rig.write(XTARGET, 1_500_000);
    for vmax in [10_000, 0, 80_000, 20_000, 150_000, 0] {
        rig.write(VMAX, vmax);
        // From 150 000 to 0 takes 2.05 s.
        rig.run(3 * SECOND);
        assert!(rig.position() <= 1_500_000);
        assert_eq!(rig.chip.velocity(), vmax.cast_signed());
    }
    rig.write(VMAX, 200_000);
    rig.settle();
    assert_eq!(rig.position(), 1_500_000);
}
