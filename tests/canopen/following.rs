//! The following error: only while the motor is held, and gone with a fault reset, because the counter then follows the
//! encoder. The world's motor has 256 positions to a full step, as the node has microsteps.

use crate::driving::{
    ENABLE, FAULT, FAULT_RESET, HM, OPERATION_ENABLED, PP, PV, SHUTDOWN, START, SWITCH_ON, SWITCH_ON_DISABLED,
    SWITCHED_ON,
};
use crate::rig::Rig;

const FOLLOWING_ERROR: (u16, [u8; 2]) = (0x8611, [0, 0]);
/// Bit of the statusword in profile position mode.
const BIT_13: u32 = 1 << 13;
/// 12 full steps are 3 072 microsteps, of which the encoder with its 1 024 counts, 50 microsteps each, sees 61 counts.
const TURNED: i32 = 61 * 50;
const ROTOR: i64 = 12 * 256;

/// A drive in profile position mode that is SWITCHED ON, with a window of two full steps.
fn watched() -> Rig {
    let mut rig = Rig::operational();
    rig.set(0x2005, 0, 0b11);
    rig.set(0x6060, 0, PP);
    rig.set(0x6065, 0, 512);
    for word in [SHUTDOWN, SWITCH_ON] {
        rig.word(word);
    }
    assert_eq!(rig.drive_state(), SWITCHED_ON);
    rig.frames();
    rig
}

/// A shaft that is turned by hand while the bridges are off is no following error, and neither is it when they are on
/// again. After 50 ms the counter is where the encoder is, and only then there is OPERATION ENABLED. Twelve full steps
/// are three times the four after which the coils look the same, so the rotor stays where the hand has left it.
#[test]
fn a_shaft_is_turned_while_nothing_holds_it() {
    let mut rig = watched();
    rig.control("slip 12");
    rig.wait(100);
    assert_eq!((rig.emergencies(), rig.signed(0x60F4), rig.signed(0x6064)), (vec![], -TURNED, 0));
    rig.word(ENABLE);
    rig.wait(48);
    assert_eq!((rig.drive_state(), rig.signed(0x6064)), (SWITCHED_ON, 0));
    rig.wait(4);
    assert_eq!((rig.drive_state(), rig.signed(0x6064), rig.signed(0x60F4)), (OPERATION_ENABLED, TURNED, 0));
    rig.wait(200);
    assert_eq!((rig.emergencies(), rig.rotor()), (vec![], ROTOR));
    // From there it goes where it is told to.
    rig.go(TURNED + 2_000);
    rig.wait(500);
    assert_eq!((rig.rotor(), rig.signed(0x6064)), (ROTOR + 2_000, TURNED + 2_000));
}

/// A shaft that is not turned by more than a full step is drawn back by the current: the counter stays, and nothing is
/// waited for. So it is without a window, and without an encoder.
#[test]
fn what_does_not_deviate_changes_nothing() {
    let mut rig = watched();
    rig.control("slip 1");
    rig.wait(20);
    rig.word(ENABLE);
    assert_eq!(rig.drive_state(), OPERATION_ENABLED);
    rig.wait(100);
    assert_eq!((rig.emergencies(), rig.signed(0x6064), rig.rotor()), (vec![], 0, 0));
    let mut rig = watched();
    rig.set(0x6065, 0, 0);
    rig.control("slip 12");
    rig.wait(20);
    rig.word(ENABLE);
    rig.wait(100);
    assert_eq!((rig.drive_state(), rig.emergencies(), rig.signed(0x6064)), (OPERATION_ENABLED, vec![], 0));
    assert_eq!(rig.signed(0x60F4), -TURNED);
    let mut rig = Rig::without_encoder(&Rig::new().eeprom());
    rig.command(1);
    rig.set(0x2005, 0, 0b11);
    assert_eq!(rig.write(0x6065, 0, 512), Err(0x0800_0022));
    rig.control("slip 12");
    rig.enable();
    rig.wait(100);
    assert_eq!((rig.emergencies(), rig.signed(0x6064), rig.signed(0x60F4)), (vec![], 0, 0));
}

/// A blow to a motor that is held is a following error: it shows in bit 13 of profile position mode, in 603Fh and
/// 60F4h. The fault reset takes the encoder's position over and clears all of them; a homed drive stays homed.
#[test]
fn a_fault_reset_clears_it() {
    let mut rig = watched();
    rig.set(0x6060, 0, HM);
    rig.set(0x6098, 0, 35);
    rig.word(ENABLE);
    rig.word(START);
    rig.wait(5);
    rig.word(ENABLE);
    assert_ne!(rig.status() & 1 << 12, 0);
    rig.set(0x6060, 0, PP);
    rig.go(1_000);
    rig.wait(500);
    assert_eq!(rig.status() & BIT_13, 0);
    rig.control("slip 12");
    rig.wait(50);
    assert_eq!((rig.emergencies(), rig.drive_state()), (vec![FOLLOWING_ERROR], FAULT));
    assert_eq!((rig.read(0x603F, 0), rig.signed(0x60F4), rig.read(0x1001, 0)), (0x8611, 1_000 - 4_050, 0x21));
    assert_ne!(rig.status() & BIT_13, 0);
    rig.word(FAULT_RESET);
    assert_eq!((rig.drive_state(), rig.status() & BIT_13, rig.read(0x603F, 0)), (SWITCH_ON_DISABLED, 0, 0));
    // 1 000 microsteps and 12 full steps are 81 counts.
    assert_eq!((rig.signed(0x60F4), rig.signed(0x6064)), (0, 4_050));
    assert_eq!((rig.emergencies(), rig.read(0x1001, 0)), (vec![(0, [0, 0])], 0));
    rig.set(0x6060, 0, HM);
    assert_ne!(rig.status() & 1 << 12, 0, "it is homed");
    rig.enable();
    rig.wait(100);
    assert_eq!((rig.drive_state(), rig.emergencies()), (OPERATION_ENABLED, vec![]));
}

/// An error (60F4h) as large as the window is none yet, to either side.
#[test]
fn a_following_error_is_one_beyond_its_window() {
    for blow in ["slip 12", "slip -12"] {
        let mut rig = watched();
        rig.set(0x6065, 0, 1 << 20);
        rig.word(ENABLE);
        rig.wait(100);
        rig.control(blow);
        rig.wait(20);
        let error = rig.signed(0x60F4).unsigned_abs();
        assert!(error.abs_diff(12 * 256) < 50, "{blow}: {error}");
        rig.set(0x6065, 0, error);
        rig.wait(20);
        assert_eq!((rig.drive_state(), rig.emergencies()), (OPERATION_ENABLED, vec![]), "{blow}");
        rig.set(0x6065, 0, error - 1);
        rig.wait(20);
        assert_eq!((rig.drive_state(), rig.emergencies()), (FAULT, vec![FOLLOWING_ERROR]), "{blow}");
    }
}

/// Outside profile position mode bit 13 has no such meaning.
#[test]
fn bit_13_is_of_profile_position_mode() {
    let mut rig = watched();
    rig.set(0x6060, 0, PV);
    rig.word(ENABLE);
    rig.wait(60);
    rig.control("slip 12");
    rig.wait(50);
    assert_eq!((rig.drive_state(), rig.status() & BIT_13), (FAULT, 0));
    rig.set(0x6060, 0, PP);
    assert_ne!(rig.status() & BIT_13, 0);
}

/// With an off time of 0 (2097h) the bridges are off, and the shaft may be turned.
#[test]
fn no_following_error_without_an_off_time() {
    let mut rig = Rig::operational();
    rig.set(0x6065, 0, 100);
    rig.set(0x6060, 0, PV);
    rig.enable();
    rig.wait(100);
    rig.set(0x2097, 0, 0);
    rig.wait(100);
    rig.control("slip 12");
    rig.wait(100);
    assert!(!rig.is_energised());
    assert_eq!(rig.of(0x81).len(), 0);
}
