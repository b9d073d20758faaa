//! Velocity mode and profile velocity mode, and changes of the mode.

use crate::driving::{DISABLE_VOLTAGE, ENABLE, HALT, HM, MOVES, OPERATION_ENABLED, PP, PV, TARGET_REACHED, VL};
use crate::rig::Rig;

/// Sets the target velocity of a mode.
fn turn(rig: &mut Rig, mode: u32, velocity: i32) {
    rig.set(if mode == VL { 0x6042 } else { 0x60FF }, 0, velocity as u32 & if mode == VL { 0xFFFF } else { u32::MAX });
}

/// The way of the rotor in some milliseconds.
fn way(rig: &mut Rig, milliseconds: u64) -> i64 {
    let from = rig.rotor();
    rig.wait(milliseconds);
    rig.rotor() - from
}

/// 500 internal units are 500 * 16 MHz / 2^(16 + 3) = 15 259 microsteps a second.
#[test]
fn target_velocities() {
    for mode in [VL, PV] {
        let mut rig = Rig::enabled(mode);
        rig.wait(20);
        assert_eq!((rig.status() & TARGET_REACHED, rig.rotor()), (TARGET_REACHED, 0));
        for (velocity, expected) in [(500, 15_259), (-500, -15_259), (1000, 30_518), (0, 0)] {
            turn(&mut rig, mode, velocity);
            if velocity != 0 {
                assert_eq!(rig.status() & TARGET_REACHED, 0);
            }
            rig.wait(200);
            assert_eq!(rig.status() & TARGET_REACHED, TARGET_REACHED, "{velocity}");
            assert_eq!(rig.status() & MOVES != 0, velocity != 0);
            let way = way(&mut rig, 1_000);
            assert!((way - expected).abs() <= expected.abs() / 100, "{velocity}: {way}");
        }
        if mode == VL {
            assert_eq!((rig.read(0x6043, 0), rig.read(0x6044, 0)), (0, 0));
        }
    }
}

/// The ramps are 6048h.1 in velocity mode and 6083h in profile velocity mode, up and down.
/// An acceleration of 100 is 100 * (16 MHz)^2 / 2^(7 + 3 + 29) = 46 566 microsteps a second a second.
#[test]
fn ramps() {
    for (mode, object, other) in [(VL, (0x6048, 1), (0x6083, 0)), (PV, (0x6083, 0), (0x6048, 1))] {
        let mut rig = Rig::enabled(mode);
        rig.set(object.0, object.1, 100);
        rig.set(other.0, other.1, 2000);
        for velocity in [1000, 0] {
            turn(&mut rig, mode, velocity);
            // 30 518 / 46 566 s = 655 ms, whose half is 328 ms. The way of that half is 46 566 / 2 * 0.328^2 = 2505,
            // and the rest of the ramp down has the same.
            let half = way(&mut rig, 328);
            let expected = if velocity == 0 { 10_005 - 2_505 } else { 2_505 };
            assert!((half - expected).abs() < 150, "{mode}, {velocity}: {half}");
            rig.wait(500);
        }
        assert_eq!(rig.status() & MOVES, 0);
    }
}

#[test]
fn halt_and_on() {
    for mode in [VL, PV] {
        let mut rig = Rig::enabled(mode);
        turn(&mut rig, mode, -300);
        rig.wait(200);
        rig.word(HALT);
        rig.wait(200);
        assert_eq!((way(&mut rig, 100), rig.status() & TARGET_REACHED), (0, TARGET_REACHED));
        turn(&mut rig, mode, 300);
        assert_eq!(way(&mut rig, 100), 0);
        rig.word(ENABLE);
        rig.wait(100);
        assert!(way(&mut rig, 100) > 0);
    }
}

/// A mode may be changed in each state and on the move, which stops the motor first; 0 stops it. One that is set may be
/// written again.
#[test]
fn changes_of_the_mode() {
    for from in [PP, VL, PV] {
        for to in [0, PP, VL, PV, HM] {
            let mut rig = Rig::enabled(from);
            rig.set(0x6083, 0, 200);
            rig.set(0x6048, 1, 200);
            rig.set(0x60FF, 0, (-1000_i32) as u32);
            rig.set(0x6042, 0, (-1000_i32) as u32 & 0xFFFF);
            rig.go(-1_000_000);
            rig.wait(600);
            let here = rig.rotor();
            assert!(here < -5_000, "{from}");
            rig.set(0x6060, 0, to);
            assert_eq!(rig.read(0x6061, 0), to);
            rig.wait(20);
            assert!(rig.rotor() < here, "the ramp of {from}");
            let (turns, before) = (matches!(to, VL | PV), here);
            rig.wait(1_000);
            let here = rig.rotor();
            assert!(here < before);
            rig.wait(100);
            // The same mode goes on; a mode of velocity begins after the stop; others wait for a set-point.
            assert_eq!(rig.rotor() < here, turns || from == to, "{from} to {to}");
            assert_eq!(rig.drive_state(), OPERATION_ENABLED);
        }
    }
}

/// The mode is stopped before the next one begins: the motor comes to a stand between two modes of velocity.
#[test]
fn the_motor_stands_between_two_modes() {
    let mut rig = Rig::enabled(VL);
    turn(&mut rig, VL, 1000);
    turn(&mut rig, PV, 1000);
    rig.wait(200);
    rig.set(0x6060, 0, PV);
    let mut slowest = i32::MAX;
    for _ in 0..200 {
        rig.wait(1);
        slowest = slowest.min(rig.signed(0x606C));
    }
    assert_eq!((slowest, rig.signed(0x606C)), (0, 1000));
}

/// A move that was asked for before does not move a motor that is enabled anew, but a target velocity does.
#[test]
fn enabled_anew() {
    let mut rig = Rig::enabled(PP);
    rig.go(100_000);
    rig.wait(200);
    rig.word(DISABLE_VOLTAGE);
    rig.enable();
    let here = rig.rotor();
    assert_eq!(way(&mut rig, 200), 0, "from {here}");
    rig.set(0x6060, 0, PV);
    rig.set(0x60FF, 0, 100);
    rig.word(DISABLE_VOLTAGE);
    assert_eq!(way(&mut rig, 100), 0);
    rig.enable();
    assert!(way(&mut rig, 100) > 0);
}

/// Velocities beyond the largest work as that; an acceleration of 0 as the smallest there is, so that a motor can be
/// stopped in any case.
#[test]
fn extremes() {
    let mut rig = Rig::enabled(PV);
    rig.set(0x6083, 0, u32::MAX);
    turn(&mut rig, PV, i32::MAX);
    rig.wait(100);
    assert_eq!(rig.signed(0x606C), 2047);
    turn(&mut rig, PV, i32::MIN);
    rig.wait(200);
    assert_eq!(rig.signed(0x606C), -2047);
    rig.set(0x6083, 0, 0);
    turn(&mut rig, PV, 0);
    rig.wait(500);
    let speed = rig.signed(0x606C);
    assert!((-2047..-2000).contains(&speed), "{speed}");
    assert_eq!(rig.write(0x6042, 0, 2048), Err(0x0609_0031));
    assert_eq!(rig.write(0x6042, 0, 0xF7FF), Err(0x0609_0032));
}
