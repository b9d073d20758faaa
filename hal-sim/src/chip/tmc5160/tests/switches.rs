//! Reference switches, stalls and latches (12.4, 6.3.2).

use super::*;

/// Positions 1000 to the right and to the left, in velocity mode.
fn stage(sw_mode: u32, ramp_mode: u32) -> Rig {
    let mut rig = Rig::with(&[(AMAX, 5_000), (DMAX, 2_000), (D1, 2_000), (VSTOP, 10), (VMAX, 100_000)]);
    rig.stage.left = Some(-1_000);
    rig.stage.right = Some(1_000);
    rig.write(SW_MODE, sw_mode);
    rig.write(RAMPMODE, ramp_mode);
    rig
}

const BOTH: u32 = 0b11;
const SOFT: u32 = 1 << mode::SOFT;

#[test]
fn an_enabled_switch_stops_the_motor_at_once_in_its_direction_only() {
    for (ramp_mode, end, status) in [(1, 1_000, 0x22), (2, -1_000, 0x11)] {
        let mut rig = stage(BOTH, ramp_mode);
        rig.run(SECOND);
        assert_eq!((rig.position(), rig.chip.velocity()), (end, 0));
        assert_eq!(rig.read(RAMP_STAT) & 0x33, status, "status and event");
        assert!(rig.chip.interrupt_pin());
        assert_eq!(rig.status() & 0xC0, if end > 0 { 0x80 } else { 0x40 });
        // "The stop condition can be removed by setting RAMP_MODE to hold mode", and the motor stays.
        rig.write(RAMPMODE, 3);
        assert_eq!(rig.read(RAMP_STAT) & 0x30, 0);
        rig.write(RAMPMODE, ramp_mode);
        rig.run(SECOND / 10);
        assert_eq!((rig.position(), rig.read(RAMP_STAT) & 0x33), (end, status));
        // "Or by commanding a move to the opposite direction".
        rig.write(RAMPMODE, 3 - ramp_mode);
        assert_eq!(rig.read(RAMP_STAT) & 0x30, 0);
        rig.run(SECOND);
        assert_eq!(rig.position(), -end);
    }
    let mut rig = stage(0, 1);
    rig.run(SECOND / 10);
    assert!(rig.position() > 1_000, "not enabled");
    assert_eq!(rig.read(RAMP_STAT) & 0x33, 0x02);
}

/// "The motor restarts in case the stop switch becomes released", and "disabling the stop function also clears the
/// flag, but the motor will continue motion"; both after TZEROWAIT.
#[test]
fn the_motor_goes_on_when_the_switch_lets_it() {
    let releases: [fn(&mut Rig); 3] =
        [|rig| rig.stage.right = None, |rig| rig.write(SW_MODE, 0), |rig| rig.write(SW_MODE, BOTH | 1 << mode::POL_R)];
    for release in releases {
        let mut rig = stage(BOTH, 1);
        rig.write(TZEROWAIT, 1_000);
        rig.run(SECOND);
        assert_eq!(rig.position(), 1_000);
        release(&mut rig);
        rig.sense();
        assert_eq!(rig.read(RAMP_STAT) & 0x30, 0);
        rig.run(SECOND / 5);
        assert!(rig.position() > 10_000);
    }
    let mut rig = stage(BOTH, 1);
    rig.write(TZEROWAIT, 31_250);
    rig.until(MICROSECOND, |rig| rig.chip.velocity() == 0 && rig.chip.position() == 1_000);
    let stopped = rig.now;
    rig.stage.right = None;
    rig.sense();
    rig.run(stopped + 999 * MILLISECOND - rig.now);
    assert_eq!((rig.position(), rig.read(RAMP_STAT) >> 11 & 1), (1_000, 1), "a hard stop also uses TZEROWAIT");
    rig.run(3 * MILLISECOND);
    assert_ne!(rig.chip.velocity(), 0);
}

#[test]
fn a_soft_stop_brakes_with_dmax_in_every_mode() {
    for ramp_mode in [0, 1] {
        let mut rig = stage(BOTH | SOFT, 3);
        rig.write(XTARGET, 1_000_000);
        rig.write(RAMPMODE, ramp_mode);
        rig.until(MICROSECOND, |rig| rig.chip.position() >= 1_000);
        let (began, speed) = (rig.now, hertz(rig.chip.velocity().unsigned_abs()));
        assert!(speed > 20_000.0);
        while rig.chip.velocity() != 0 {
            assert_eq!(rig.chip.switches.stopping(), Pair { left: false, right: true });
            rig.run(TICK);
        }
        let d = hertz_per_second(2_000);
        near((rig.now - began) as f64 / 1e9, speed / d, 100e-6);
        near(f64::from(rig.position()), 1_000.0 + speed * speed / 2.0 / d, 3.0);
        rig.run(SECOND);
        assert_eq!(rig.chip.velocity(), 0);
        assert_eq!(rig.read(RAMP_STAT) & 0x20, 0x20, "the motor still wants to go there");
    }
}

#[test]
fn a_switch_holds_a_motor_that_stands_and_one_in_hold_mode() {
    let mut rig = stage(BOTH, 0);
    rig.stage.right = Some(0);
    rig.sense();
    rig.write(XTARGET, 5_000);
    rig.run(SECOND);
    assert_eq!((rig.position(), rig.read(RAMP_STAT) & 0x22), (0, 0x22));
    assert_eq!(rig.chip.next_event(), None);
    rig.write(XTARGET, -500_i32 as u32);
    rig.run(SECOND);
    assert_eq!(rig.position(), -500);
    // "Velocity remains unchanged, unless stop event occurs."
    let mut rig = stage(BOTH, 1);
    rig.run(5 * MILLISECOND);
    rig.write(RAMPMODE, 3);
    rig.run(SECOND);
    assert_eq!((rig.position(), rig.chip.velocity()), (1_000, 0));
}

#[test]
fn polarity_and_swapping() {
    let active = |rig: &mut Rig| rig.read(RAMP_STAT) & 3;
    for (sw_mode, left_pin, right_pin) in [
        (0, 1, 2),
        (1 << mode::POL_L, 1, 2),
        (1 << mode::POL_R, 1, 2),
        (1 << mode::SWAP, 2, 1),
        (1 << mode::SWAP | 1 << mode::POL_L, 2, 1),
    ] {
        let inverted = sw_mode >> mode::POL_L & 3;
        for levels in 0..4 {
            let mut rig = Rig::with(&[(SW_MODE, sw_mode)]);
            rig.stage.left = (levels & 1 != 0).then_some(0);
            rig.stage.right = (levels & 2 != 0).then_some(0);
            rig.sense();
            let seen = u32::from(levels & left_pin != 0) | u32::from(levels & right_pin != 0) << 1;
            assert_eq!(active(&mut rig), seen ^ inverted, "{sw_mode:#x} {levels}");
            assert_eq!(rig.read(IOIN) & 3, levels);
        }
    }
}

/// Each of the four edges latches XACTUAL if its bit says so, and nothing else.
#[test]
fn edges_latch_the_position() {
    for bit in 0..4 {
        let mut rig = stage(1 << (mode::LATCH + bit), 0);
        rig.write(RAMP_STAT, u32::MAX);
        rig.write(X_ENC, 77);
        // Active going right at 1000, inactive at 999; active going left at -1000, inactive at -999.
        let mut latched = Vec::new();
        for target in [2_000, -2_000, 0_i32] {
            rig.write(XTARGET, target as u32);
            rig.settle();
            let flags = rig.read(RAMP_STAT) >> 2 & 3;
            if flags != 0 {
                latched.push((flags, rig.read(XLATCH).cast_signed()));
                rig.write(RAMP_STAT, flags << 2);
                assert_eq!(rig.read(RAMP_STAT) >> 2 & 3, 0);
            }
        }
        let expected = [(0b01, -1_000), (0b01, -999), (0b10, 1_000), (0b10, 999)][bit as usize];
        assert_eq!(latched, [expected], "bit {bit}");
        assert_eq!(rig.read(ENC_LATCH), 0);
    }
    let mut rig = stage(1 << (mode::LATCH + 2) | 1 << mode::LATCH_ENCODER, 0);
    rig.write(X_ENC, 77);
    rig.write(XTARGET, 2_000);
    rig.settle();
    assert_eq!((rig.read(XLATCH), rig.read(ENC_LATCH)), (1_000, 77));
    // A polarity that changes is no edge.
    rig.write(RAMP_STAT, 0xC);
    rig.write(SW_MODE, 1 << (mode::LATCH + 3) | 1 << mode::POL_R);
    assert_eq!(rig.read(RAMP_STAT) & 0xC, 0);
}

/// A motor at 39 000 microsteps per second, with stop on stall above about half of that.
fn with_stall_stop() -> Rig {
    let mut rig = Rig::with(&[(AMAX, 5_000), (VMAX, 40_000), (TCOOLTHRS, 800), (COOLCONF, 13 << 16)]);
    rig.write(SW_MODE, 1 << mode::SG_STOP);
    rig.write(RAMPMODE, 1);
    rig
}

/// 13.4: a stall sets VACTUAL to zero, and shows in RAMP_STAT and DRV_STATUS; clearing the flag lets the motor go on.
#[test]
fn a_stall_stops_the_motor_until_its_flag_is_cleared_or_the_stop_disabled() {
    let releases: [fn(&mut Rig); 2] = [|rig| rig.write(RAMP_STAT, 1 << 6), |rig| rig.write(SW_MODE, 0)];
    for release in releases {
        let mut rig = with_stall_stop();
        rig.run(SECOND);
        assert_eq!((rig.read(RAMP_STAT) >> 6 & 1, rig.read(DRV_STATUS) & 0x3FF), (0, 512));
        rig.stage.load = crate::chip::load::FULL_LOAD;
        rig.run(20 * MILLISECOND);
        assert_eq!(rig.chip.velocity(), 0);
        assert_eq!((rig.read(RAMP_STAT) >> 6 & 1, rig.read(DRV_STATUS) >> 24 & 1), (1, 1));
        assert_eq!(rig.status() >> 2 & 1, 1);
        assert!(rig.chip.interrupt_pin());
        rig.run(SECOND);
        assert_eq!(rig.chip.velocity(), 0);
        rig.stage.load = 0;
        release(&mut rig);
        rig.run(SECOND);
        assert_eq!(rig.chip.velocity(), 40_000);
    }
}

/// 6.2: below TCOOLTHRS stop on stall is off.
#[test]
fn a_stall_below_the_threshold_does_not_stop_the_motor() {
    let mut rig = with_stall_stop();
    rig.write(TCOOLTHRS, 400);
    rig.stage.load = crate::chip::load::FULL_LOAD;
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(), 40_000);
    assert_eq!((rig.read(RAMP_STAT) >> 13, rig.read(DRV_STATUS) >> 24 & 1), (0, 1));
}

/// 12.4, "Implementing a homing procedure", step by step: in the end position 0 is where the switch closed.
#[test]
fn example_of_12_4_homing() {
    let mut rig = stage(1 << mode::STOP_L | 1 << mode::LATCH | SOFT, 3);
    rig.write(RAMPMODE, 2);
    rig.until(MILLISECOND, |rig| rig.chip.position() < -900 && rig.chip.velocity() == 0);
    rig.write(RAMPMODE, 3);
    let (latched, actual) = (rig.read(XLATCH).cast_signed(), rig.read(XACTUAL).cast_signed());
    assert!(latched == -1_000 && actual < -1_500, "{latched}, {actual}");
    rig.write(XACTUAL, (actual - latched) as u32);
    rig.write(XTARGET, 0);
    rig.write(RAMPMODE, 0);
    rig.settle();
    assert_eq!((rig.position(), rig.stage.field), (0, -1_000));
}

/// 6.2: passing THIGH switches the stall detection off for 2 to 3 electrical periods. A motor that is stalled all the
/// time, but does not stop because its threshold is below, stops 12 full steps after the two thresholds are passed.
#[test]
fn stalls_are_not_seen_right_after_passing_thigh() {
    let mut rig = with_stall_stop();
    rig.write(TCOOLTHRS, 0);
    rig.stage.load = crate::chip::load::FULL_LOAD;
    rig.run(SECOND);
    let field = rig.stage.field;
    rig.write(TCOOLTHRS, 800);
    rig.write(THIGH, 800);
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(), 0);
    let full_steps = (rig.stage.field - field) / 256;
    assert!((8..=13).contains(&full_steps), "{full_steps}");
}
