//! Profile position mode: set-points, their handshake, halt, position windows and limits of the target.

use crate::driving::{
    DISABLE_VOLTAGE, ENABLE, HALT, HM, MODE_SPECIFIC, MOVES, NEGATIVE, OPERATION_ENABLED, PP, PV, START, TARGET_REACHED,
};
use crate::rig::Rig;

/// Controlword: a new relative set-point.
const RELATIVE: u16 = START | 1 << 6;
const REFUSED: (u16, [u8; 2]) = (0x6320, [0, 255]);

/// The bits of the handshake: target reached, and set-point acknowledged.
fn handshake(rig: &mut Rig) -> (bool, bool) {
    let status = rig.status();
    (status & TARGET_REACHED != 0, status & MODE_SPECIFIC != 0)
}

#[test]
fn a_move_and_its_handshake() {
    let mut rig = Rig::enabled(PP);
    assert_eq!(handshake(&mut rig), (false, false), "the first turn has not come");
    rig.wait(2);
    assert_eq!(handshake(&mut rig), (true, false));
    rig.set(0x607A, 0, 51_200);
    rig.wait(20);
    assert_eq!((rig.rotor(), rig.status() & MOVES), (0, 0), "the target alone moves nothing");
    rig.word(START);
    assert_eq!(handshake(&mut rig), (false, true));
    rig.wait(50);
    let status = rig.status();
    assert_eq!((status & MOVES, status & NEGATIVE), (MOVES, 0));
    rig.word(START);
    assert_eq!(handshake(&mut rig), (false, true), "bit 12 follows bit 4");
    rig.word(ENABLE);
    assert_eq!(handshake(&mut rig), (false, false));
    rig.until(TARGET_REACHED, 5_000);
    assert_eq!((rig.rotor(), rig.signed(0x6064), rig.signed(0x6062)), (51_200, 51_200, 51_200));
    // And back.
    rig.go(-1_000);
    rig.wait(50);
    let status = rig.status();
    assert_eq!((status & MOVES, status & NEGATIVE), (MOVES, NEGATIVE));
    rig.until(TARGET_REACHED, 5_000);
    assert_eq!(rig.rotor(), -1_000);
    // To where it is: bit 10 goes with the edge all the same, and comes when the motor is seen to stand.
    rig.set(0x607A, 0, (-1_000_i32) as u32);
    rig.word(START);
    assert_eq!(handshake(&mut rig), (false, true));
    rig.wait(10);
    assert_eq!(handshake(&mut rig), (true, true));
}

/// The manual's example: everything but the mode and the target as after a reset.
#[test]
fn the_example_of_the_manual() {
    let mut rig = Rig::new();
    rig.set(0x2005, 0, 3);
    rig.set(0x6060, 0, 1);
    for word in [6, 7, 15] {
        rig.word(word);
    }
    rig.set(0x607A, 0, 500_000);
    rig.word(31);
    rig.word(15);
    rig.until(TARGET_REACHED, 30_000);
    assert_eq!(rig.rotor(), 500_000);
}

/// A set-point while the motor moves acts at once; a relative one counts from the target before.
#[test]
fn set_points_on_the_way() {
    let mut rig = Rig::enabled(PP);
    rig.go(100_000);
    rig.wait(500);
    assert!((5_000..90_000).contains(&rig.rotor()));
    rig.go(-20_000);
    rig.until(TARGET_REACHED, 20_000);
    assert_eq!(rig.rotor(), -20_000);
    for (target, end) in [(30_000, 10_000), (-5_000, 5_000), (0, 5_000)] {
        rig.set(0x607A, 0, target as u32);
        rig.word(RELATIVE);
        rig.word(ENABLE);
        rig.until(TARGET_REACHED, 20_000);
        assert_eq!(rig.rotor(), end);
    }
    rig.go(50_000);
    rig.wait(200);
    rig.set(0x607A, 0, 1_000);
    rig.word(RELATIVE);
    rig.until(TARGET_REACHED, 20_000);
    assert_eq!(rig.rotor(), 51_000);
    // Without a target since the mode was changed, from where the motor stands.
    rig.set(0x6060, 0, PV);
    rig.set(0x6060, 0, PP);
    rig.set(0x607A, 0, 500);
    rig.word(ENABLE);
    rig.word(RELATIVE);
    rig.until(TARGET_REACHED, 20_000);
    assert_eq!(rig.rotor(), 51_500);
}

/// Bits 5 and 9 are ignored; edges count in OPERATION ENABLED alone.
#[test]
fn bits_that_do_nothing() {
    let mut rig = Rig::enabled(PP);
    rig.set(0x607A, 0, 5_000);
    for bit in [5, 9, 11, 12, 13, 14, 15] {
        rig.word(ENABLE | 1 << bit);
        rig.wait(20);
        assert_eq!(rig.rotor(), 0, "bit {bit}");
    }
    rig.word(START | 1 << 5 | 1 << 9);
    rig.until(TARGET_REACHED, 5_000);
    assert_eq!(rig.rotor(), 5_000);
    rig.word(DISABLE_VOLTAGE);
    rig.set(0x607A, 0, 9_000);
    for word in [6, 7, 7 | 1 << 4, START] {
        rig.word(word);
    }
    rig.wait(100);
    assert_eq!((rig.drive_state(), rig.rotor()), (OPERATION_ENABLED, 5_000));
    rig.word(ENABLE);
    rig.word(START);
    rig.until(TARGET_REACHED, 5_000);
    assert_eq!(rig.rotor(), 9_000);
}

/// Halt stops along the ramp; bit 10 then tells that the motor stands. Without it the motor goes on.
#[test]
fn halt_and_on() {
    let mut rig = Rig::enabled(PP);
    rig.set(0x6083, 0, 100);
    rig.go(200_000);
    rig.wait(1_500);
    rig.word(HALT);
    let from = rig.rotor();
    rig.wait(2);
    assert_eq!(rig.status() & TARGET_REACHED, 0);
    rig.until(TARGET_REACHED, 2_000);
    let stood = rig.rotor();
    assert!(stood - from > 2_000, "a ramp, not a stop: {}", stood - from);
    assert_eq!(rig.drive_state(), OPERATION_ENABLED);
    rig.wait(100);
    assert_eq!(rig.rotor(), stood);
    // A set-point at a halt is taken, and begins with its end.
    rig.set(0x607A, 0, 150_000);
    rig.word(HALT | START);
    assert_eq!(rig.status() & MODE_SPECIFIC, MODE_SPECIFIC);
    rig.wait(100);
    assert_eq!(rig.rotor(), stood);
    rig.word(ENABLE);
    assert_eq!(rig.status() & TARGET_REACHED, 0);
    rig.until(TARGET_REACHED, 20_000);
    assert_eq!(rig.rotor(), 150_000);
}

/// A target outside 607Dh less 607Ch is refused, and a motor on its way goes on to its old target.
#[test]
fn targets_outside_the_limits() {
    let mut rig = Rig::enabled(PP);
    rig.set(0x607C, 0, 1_000);
    rig.set(0x607D, 1, (-4_000_i32) as u32);
    rig.set(0x607D, 2, 40_000);
    rig.go(39_000);
    rig.wait(100);
    assert!(rig.emergencies().is_empty());
    for target in [39_001, -5_001, i32::MAX, i32::MIN] {
        rig.set(0x607A, 0, target as u32);
        rig.word(START);
        assert_eq!(rig.status() & MODE_SPECIFIC, 0, "{target} is not acknowledged");
        rig.word(ENABLE);
        assert_eq!(rig.emergencies(), [REFUSED]);
    }
    // So is a relative one that leads out.
    rig.set(0x607A, 0, 1);
    rig.word(RELATIVE);
    rig.word(ENABLE);
    assert_eq!(rig.emergencies(), [REFUSED]);
    rig.until(TARGET_REACHED, 10_000);
    assert_eq!(rig.rotor(), 39_000);
    rig.go(-5_000);
    rig.until(TARGET_REACHED, 10_000);
    assert_eq!((rig.rotor(), rig.emergencies()), (-5_000, vec![]));
}

/// Relative targets that leave the numbers are refused.
#[test]
fn relative_targets_do_not_wrap() {
    let mut rig = Rig::enabled(PP);
    rig.go(10_000);
    rig.until(TARGET_REACHED, 5_000);
    rig.set(0x607A, 0, i32::MAX as u32);
    rig.word(RELATIVE);
    assert_eq!(rig.emergencies(), [REFUSED]);
    rig.wait(50);
    assert_eq!(rig.rotor(), 10_000);
}

/// The window around the target, in which the motor has to be for 6068h ms.
#[test]
fn position_windows() {
    for (window, time) in [(0, 0), (u32::MAX, 0), (0, 50), (2_000, 0), (2_000, 100)] {
        let mut rig = Rig::enabled(PP);
        rig.set(0x6083, 0, 100);
        rig.set(0x6067, 0, window);
        rig.set(0x6068, 0, time);
        rig.go(30_000);
        let (mut entered, mut reached) = (None, None);
        for ms in 0..5_000_i32 {
            let close = (28_000..=32_000).contains(&rig.signed(0x6064));
            entered = entered.or(close.then_some(ms));
            reached = reached.or((rig.status() & TARGET_REACHED != 0).then_some((ms, rig.signed(0x6062))));
            rig.wait(1);
        }
        let (entered, (at, position)) = (entered.unwrap(), reached.unwrap());
        if matches!(window, 0 | u32::MAX) {
            assert_eq!(position, 30_000);
        } else {
            assert!(position < 30_000 || time > 0, "{position}");
            assert!((at - entered).abs_diff(time as i32) <= 2, "{entered} {at}");
        }
    }
}

/// With a speed of 0 nothing moves; more than the largest speed works as that.
#[test]
fn profile_velocities() {
    let mut rig = Rig::enabled(PP);
    rig.set(0x6081, 0, 0);
    rig.go(5_000);
    rig.wait(200);
    assert_eq!((rig.rotor(), rig.status() & TARGET_REACHED), (0, 0));
    rig.set(0x6081, 0, 50_000);
    rig.go(200_000);
    rig.wait(1_500);
    assert_eq!((rig.signed(0x606C), rig.read(0x6081, 0)), (2047, 50_000));
    rig.until(TARGET_REACHED, 10_000);
    assert_eq!(rig.rotor(), 200_000);
}

/// In another mode, or without one, set-points move nothing.
#[test]
fn set_points_in_other_modes() {
    for mode in [0, PV, HM] {
        let mut rig = Rig::enabled(mode);
        rig.go(5_000);
        rig.wait(100);
        assert_eq!(rig.rotor(), 0, "mode {mode}");
    }
}

/// A motor that runs past a target that it cannot stop at has not reached it.
#[test]
fn a_target_that_is_run_past() {
    for k in 0..80 {
        let mut rig = Rig::enabled(PP);
        rig.set(0x6083, 0, 100);
        rig.go(300_000);
        rig.wait(1_500);
        let target = rig.signed(0x6064) + 300 + k;
        rig.go(target);
        for _ in 0..40 {
            rig.wait(1);
            let status = rig.status();
            assert!(status & (TARGET_REACHED | MOVES) != TARGET_REACHED | MOVES, "{k}: {status:04X}h");
        }
        rig.until(TARGET_REACHED, 10_000);
        assert_eq!(rig.rotor(), i64::from(target));
    }
}

/// A target so far away that the 32 bits of positions would lead there the other way round is refused.
#[test]
fn targets_on_the_other_side_of_the_numbers() {
    let mut rig = Rig::enabled(PP);
    rig.set(0x607D, 2, 20_000);
    rig.go(1_000);
    rig.until(TARGET_REACHED, 5_000);
    rig.go(i32::MIN);
    rig.wait(200);
    assert_eq!((rig.rotor(), rig.emergencies()), (1_000, vec![REFUSED]));
    rig.go(i32::MIN + 1_001);
    rig.wait(200);
    assert!(rig.rotor() < 1_000);
    assert!(rig.emergencies().is_empty());
}

/// An edge of bit 4 in the word that enables operation moves nothing, whether the way there takes time or not.
#[test]
fn an_edge_that_comes_with_the_enabling() {
    for delay in [0, 5] {
        for mode in [PP, HM] {
            let mut rig = Rig::operational();
            rig.set(0x2005, 0, 3);
            rig.set(0x200A, 0, delay);
            rig.set(0x6060, 0, mode);
            rig.set(0x6098, 0, 19);
            rig.set(0x607A, 0, 5_000);
            for word in [6, 7, START] {
                rig.word(word);
            }
            rig.wait(200);
            assert_eq!((rig.rotor(), rig.drive_state()), (0, OPERATION_ENABLED), "{delay} ms, mode {mode}");
            rig.word(ENABLE);
            rig.word(START);
            rig.wait(200);
            assert!(rig.rotor() > 0, "{delay} ms, mode {mode}");
        }
    }
}

/// The time of 6068h is counted from when the window is there. A motor that stands at its target is in a new window for
/// as long before it has reached that.
#[test]
fn the_time_in_a_window_begins_with_the_window() {
    let mut rig = Rig::enabled(PP);
    rig.set(0x6068, 0, 200);
    rig.go(2_000);
    rig.until(TARGET_REACHED, 1_000);
    rig.wait(500);
    rig.set(0x6067, 0, 100);
    rig.wait(2);
    assert_eq!(rig.status() & TARGET_REACHED, 0);
    rig.wait(190);
    assert_eq!(rig.status() & TARGET_REACHED, 0);
    rig.wait(15);
    assert_ne!(rig.status() & TARGET_REACHED, 0);
}
