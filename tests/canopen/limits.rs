//! Functions that keep the motor within its limits: software limits, limit switches, and stop on stall.

use crate::driving::{
    ENABLE, HM, INTERNAL_LIMIT, MODE_SPECIFIC, MOVES, OPERATION_ENABLED, PP, PV, START, TARGET_REACHED, VL,
};
use crate::rig::Rig;

/// An error that needs no reset is over.
const OVER: (u16, [u8; 2]) = (0, [0, 0]);
/// Emergencies of the limits: code and first byte.
const POSITIVE_LIMIT: (u16, [u8; 2]) = (0xFF01, [1, 0]);
const NEGATIVE_LIMIT: (u16, [u8; 2]) = (0xFF01, [2, 0]);
const POSITIVE_SWITCH: (u16, [u8; 2]) = (0xFF01, [3, 0]);
const NEGATIVE_SWITCH: (u16, [u8; 2]) = (0xFF01, [4, 0]);
const STALL: (u16, [u8; 2]) = (0x3230, [0, 0]);

/// A motor with limit switches at both ends, in use, in a mode.
fn between_switches(mode: u32) -> Rig {
    let mut rig = Rig::in_world("[stage]\nleft = -20000\nright = 20000\n");
    rig.command(1);
    rig.wait(2);
    rig.set(0x6060, 0, mode);
    rig.enable();
    rig.frames();
    rig
}

fn turn(rig: &mut Rig, velocity: i32) {
    rig.set(0x60FF, 0, velocity as u32);
    rig.set(0x6042, 0, velocity as u32 & 0xFFFF);
}

/// A velocity of 1000 and an acceleration of 1000 need a ramp of 30 518^2 / (2 * 465 661) = 1000 microsteps. In a
/// millisecond the motor goes 31 microsteps.
#[test]
fn software_limits_stop_the_motor() {
    for mode in [VL, PV] {
        for (direction, emergency) in [(1, POSITIVE_LIMIT), (-1, NEGATIVE_LIMIT)] {
            let mut rig = Rig::enabled(mode);
            rig.set(0x607C, 0, 500);
            rig.set(0x607D, 1, (-9_500_i32) as u32);
            rig.set(0x607D, 2, 10_500);
            turn(&mut rig, 1000 * direction);
            rig.wait(1_000);
            let status = rig.status();
            assert_eq!((status & MOVES, status & INTERNAL_LIMIT), (0, INTERNAL_LIMIT));
            assert_eq!((rig.emergencies(), rig.drive_state()), (vec![emergency], OPERATION_ENABLED));
            let over = rig.rotor() * i64::from(direction) - 10_000;
            assert!((900..1_100).contains(&over), "{over}");
            assert_eq!(rig.read(0x1001, 0), 0x81);
            // The same velocity again, or another one that leads out, moves nothing.
            for velocity in [1000, 500] {
                turn(&mut rig, velocity * direction);
                rig.wait(50);
                assert_eq!(rig.rotor() * i64::from(direction), 10_000 + over);
            }
            assert!(rig.emergencies().is_empty());
            // Back is free, and ends the limit, which is told; the error register forgets it.
            turn(&mut rig, -200 * direction);
            rig.wait(500);
            assert_eq!(rig.status() & INTERNAL_LIMIT, 0);
            assert!(rig.rotor() * i64::from(direction) < 10_000);
            assert_eq!((rig.emergencies(), rig.read(0x1001, 0)), (vec![OVER], 0));
        }
    }
}

/// Limits that are set so that the motor is outside: it may move back, and not further out.
#[test]
fn limits_on_the_wrong_side_of_the_motor() {
    let mut rig = Rig::enabled(PP);
    rig.go(5_000);
    rig.until(TARGET_REACHED, 5_000);
    rig.set(0x607D, 2, 1_000);
    rig.wait(2);
    assert_eq!((rig.emergencies(), rig.status() & INTERNAL_LIMIT), (vec![POSITIVE_LIMIT], INTERNAL_LIMIT));
    rig.go(6_000);
    rig.wait(50);
    assert_eq!((rig.rotor(), rig.emergencies()), (5_000, vec![(0x6320, [0, 255])]));
    rig.go(900);
    rig.until(TARGET_REACHED, 5_000);
    assert_eq!((rig.rotor(), rig.status() & INTERNAL_LIMIT, rig.emergencies()), (900, 0, vec![OVER]));
    // And one that is set in the way of a motor on its way stops it.
    rig.set(0x607D, 2, i32::MAX as u32);
    rig.go(100_000);
    rig.wait(200);
    let here = rig.rotor();
    rig.set(0x607D, 2, 2_000);
    rig.wait(500);
    assert!(here > 2_000 && rig.rotor() - here < 1_200, "{here} {}", rig.rotor());
    assert_eq!((rig.emergencies(), rig.status() & TARGET_REACHED), (vec![POSITIVE_LIMIT], 0));
}

#[test]
fn limit_switches_stop_the_motor() {
    for (direction, emergency) in [(1, POSITIVE_SWITCH), (-1, NEGATIVE_SWITCH)] {
        for mode in [PP, VL, PV] {
            let mut rig = between_switches(mode);
            turn(&mut rig, 1000 * direction);
            rig.go(100_000 * direction);
            rig.wait(2_000);
            let place = rig.rotor() * i64::from(direction);
            assert!((20_000..20_100).contains(&place), "{place}");
            let status = rig.status();
            assert_eq!((status & (MOVES | TARGET_REACHED), status & INTERNAL_LIMIT), (0, INTERNAL_LIMIT), "{mode}");
            assert_eq!((rig.emergencies(), rig.drive_state()), (vec![emergency], OPERATION_ENABLED));
            // Back is free.
            turn(&mut rig, -300 * direction);
            rig.go(0);
            rig.wait(1_000);
            assert_eq!((rig.status() & INTERNAL_LIMIT, rig.emergencies()), (0, vec![OVER]));
            assert!(rig.rotor() * i64::from(direction) < 19_900, "{}", rig.rotor());
        }
    }
}

/// A switch that is closed already is told when the motor is to go to it; each touch is told once.
#[test]
fn each_touch_is_told_once() {
    let mut rig = between_switches(PP);
    rig.control("press right");
    rig.wait(20);
    assert!(rig.emergencies().is_empty());
    for _ in 0..3 {
        rig.go(5_000);
        rig.wait(50);
    }
    assert_eq!((rig.rotor(), rig.emergencies()), (0, vec![POSITIVE_SWITCH]));
    rig.control("release right");
    rig.wait(20);
    assert_eq!((rig.status() & INTERNAL_LIMIT, rig.emergencies()), (0, vec![OVER]));
    rig.control("press right");
    rig.wait(20);
    rig.go(5_000);
    rig.wait(50);
    assert_eq!((rig.rotor(), rig.emergencies()), (0, vec![POSITIVE_SWITCH]));
    // Released, it does not let the motor go on by itself.
    rig.control("release right");
    rig.wait(50);
    assert_eq!(rig.rotor(), 0);
    rig.go(5_000);
    rig.until(TARGET_REACHED, 5_000);
    assert_eq!(rig.rotor(), 5_000);
}

/// A switch that 2005h has off does nothing.
#[test]
fn switches_that_are_off() {
    let mut rig = Rig::in_world("[stage]\nleft = -2000\nright = 2000\n");
    rig.command(1);
    rig.wait(2);
    rig.set(0x2005, 0, 0b11);
    rig.set(0x6060, 0, PP);
    rig.enable();
    for target in [5_000, -5_000] {
        rig.go(target);
        rig.until(TARGET_REACHED, 5_000);
        assert_eq!((rig.rotor(), rig.emergencies()), (target.into(), vec![]));
    }
}

/// A stall stops the motor; the same velocity, as cyclic masters write it, does not start it again, but another one
/// does.
#[test]
fn stop_on_stall() {
    let mut rig = Rig::enabled(PV);
    rig.set(0x209E, 0, 1);
    rig.set(0x209D, 0, 1);
    rig.set(0x20A4, 0, 500);
    turn(&mut rig, 1000);
    rig.wait(500);
    assert!(rig.emergencies().is_empty());
    rig.control("load 1");
    rig.wait(200);
    assert_eq!((rig.emergencies(), rig.drive_state()), (vec![STALL], OPERATION_ENABLED));
    let status = rig.status();
    assert_eq!((status & MOVES, status & INTERNAL_LIMIT), (0, INTERNAL_LIMIT));
    rig.control("load 0");
    let here = rig.signed(0x6062);
    turn(&mut rig, 1000);
    rig.wait(100);
    assert_eq!(rig.signed(0x6062), here);
    turn(&mut rig, 0);
    turn(&mut rig, 1000);
    rig.wait(100);
    assert!(rig.signed(0x6062) > here);
    assert_eq!((rig.status() & INTERNAL_LIMIT, rig.emergencies()), (0, vec![OVER]));
    // Without 20A4h a load is no matter.
    rig.set(0x20A4, 0, 0);
    rig.control("load 1");
    rig.wait(200);
    assert!(rig.emergencies().is_empty());
}

/// The least and the largest number of 607Dh are no limits, whatever the home offset is.
#[test]
fn no_limits_with_the_ends_of_the_numbers() {
    for offset in [i32::MIN, -1, 1, i32::MAX] {
        let mut rig = Rig::enabled(PP);
        rig.set(0x607C, 0, offset as u32);
        rig.go(5_000);
        rig.until(TARGET_REACHED, 5_000);
        rig.go(-5_000);
        rig.until(TARGET_REACHED, 5_000);
        assert_eq!((rig.rotor(), rig.emergencies(), rig.status() & INTERNAL_LIMIT), (-5_000, vec![], 0), "{offset}");
    }
}

/// In homing mode the limits act as well as long as no homing is under way.
#[test]
fn limits_in_homing_mode() {
    let mut rig = Rig::enabled(HM);
    rig.set(0x607D, 2, (-1_i32) as u32);
    rig.wait(2);
    assert_eq!((rig.emergencies(), rig.status() & INTERNAL_LIMIT), (vec![POSITIVE_LIMIT], INTERNAL_LIMIT));
    rig.word(START);
    rig.word(ENABLE);
}

/// Software limits the wrong way round, as they are between two writes of a master that writes the lower one first. No
/// target is within them, so a set-point is refused with a message that names them. Nothing else becomes of it.
#[test]
fn limits_the_wrong_way_round() {
    let mut rig = Rig::enabled(PP);
    rig.go(100_000);
    rig.wait(200);
    rig.set(0x607D, 2, 1_000);
    rig.wait(2);
    assert_eq!(rig.emergencies(), [POSITIVE_LIMIT]);
    rig.set(0x607D, 1, 2_000);
    rig.wait(50);
    assert_eq!((rig.of(0x81), rig.status() & INTERNAL_LIMIT), (vec![vec![0, 0, 0, 0, 0, 0, 0, 0]], 0));
    rig.set(0x607A, 0, 1_500);
    rig.word(START);
    assert_eq!(rig.of(0x81), [[0x20, 0x63, 0x21, 0, 255, 0x7D, 0x60, 1]]);
    assert_eq!((rig.status() & MODE_SPECIFIC, rig.drive_state()), (0, OPERATION_ENABLED));
    // The right way round they hold.
    rig.word(ENABLE);
    rig.go(4_000);
    assert_eq!(rig.of(0x81), [[0x20, 0x63, 0x21, 0, 255, 0x7D, 0x60, 1]]);
    rig.set(0x607D, 2, 3_000);
    rig.frames();
    rig.go(4_000);
    assert_eq!(rig.of(0x81), [[0x20, 0x63, 0x21, 0, 255, 0, 0, 0]]);
}

/// Two limits that are equal leave one position.
#[test]
fn equal_limits_are_limits() {
    let mut rig = Rig::enabled(PV);
    rig.set(0x607D, 1, 0);
    rig.set(0x607D, 2, 0);
    assert_eq!(rig.status() & 1 << 11, 0);
    rig.set(0x60FF, 0, 200);
    rig.wait(500);
    assert_eq!(rig.emergencies(), [(0xFF01, [1, 0])]);
    assert_eq!((rig.status() & 1 << 11, rig.read(0x606C, 0)), (1 << 11, 0));
}

/// In TMCL mode there are no limits: one that was reached is over.
#[test]
fn a_limit_ends_with_tmcl_mode() {
    let mut rig = Rig::enabled(PV);
    rig.set(0x607D, 2, 1000);
    rig.set(0x60FF, 0, 500);
    rig.wait(500);
    assert_eq!(rig.read(0x603F, 0), 0xFF01);
    rig.set(0x2700, 0, u32::from_le_bytes(*b"make"));
    rig.wait(50);
    assert_eq!((rig.read(0x1001, 0), rig.read(0x603F, 0)), (0, 0));
}
