//! The way into TMCL mode, from each state of the drive, what holds while it lasts, and the way out.

use super::{enter, parsed, refused, rig, tmcl, value_of};
use crate::driving::{
    ENABLE, HM, INTERNAL_LIMIT, LASTING, OPERATION_ENABLED, PP, PV, SHUTDOWN, START, SWITCH_ON, SWITCH_ON_DISABLED,
};
use crate::rig::Rig;
use crate::sdo::{STATE, VALUE, write_in_segments};
use tmcm::canopen::{BusState, Nmt};

/// Emergency: an RPDO was refused.
const REFUSED: [u8; 8] = [0x20, 0x63, 0x21, 0, 255, 0, 0, 0];

/// The values that the objects have set are those of the parameters.
#[test]
fn the_settings_of_the_motor_stay() {
    let mut rig = Rig::new();
    for (index, value) in
        [(0x2000, 4), (0x2003, 77), (0x2004, 5), (0x2089, 30), (0x2097, 7), (0x2085, 6), (0x20A6, 50), (0x2005, 0xE)]
    {
        rig.set(index, 0, value);
    }
    enter(&mut rig);
    for (parameter, value) in [(140, 4), (6, 77), (7, 5), (214, 30), (167, 7), (153, 6), (183, 50)] {
        assert_eq!(value_of(&mut rig, parameter), value, "{parameter}");
    }
    assert_eq!(tmcl(&mut rig, "GGP 79, 0"), 1);
    rig.set(0x2003, 0, 66);
    assert_eq!(value_of(&mut rig, 6), 66);
    // What changes while the motor stands alone does not change in a mode in which it may move.
    for (index, value) in [(0x2005, 3), (0x2085, 7), (0x208C, 164), (0x200C, 0)] {
        let sub = u8::from(index == 0x200C);
        assert_eq!(rig.write(index, sub, value), Err(STATE), "{index:04X}h");
    }
}

/// From each state that lasts, and on the way: the bridges are on, and the motor moves.
#[test]
fn from_each_state_of_the_drive() {
    for (state, words) in LASTING {
        let mut rig = Rig::in_state(state, words);
        enter(&mut rig);
        assert!(rig.is_energised());
        tmcl(&mut rig, "MVP REL, 0, 5120");
        rig.wait(1_000);
        assert_eq!((rig.rotor(), rig.drive_state()), (5_120, SWITCH_ON_DISABLED), "{state:X}h");
    }
}

/// A motor on its way stops by the quick stop ramp and loses no step.
#[test]
fn a_motor_that_moves_is_stopped() {
    for mode in [PP, PV] {
        let mut rig = Rig::enabled(mode);
        rig.set(0x6085, 0, 1_000);
        if mode == PV {
            rig.set(0x60FF, 0, 1_500);
        } else {
            rig.set(0x6081, 0, 1_500);
            rig.go(2_000_000);
        }
        rig.wait(2_000);
        assert_eq!(rig.read(0x606C, 0), 1_500);
        enter(&mut rig);
        assert!(rig.is_energised());
        rig.wait(20);
        assert!((1..1_500).contains(&rig.signed(0x606C)), "on its ramp");
        rig.wait(1_000);
        let stopped = rig.rotor();
        rig.wait(100);
        assert_eq!((rig.rotor(), value_of(&mut rig, 3), value_of(&mut rig, 2)), (stopped, 0, 0));
        assert_eq!(i64::from(value_of(&mut rig, 1)), stopped);
        assert_eq!(rig.board.borrow().world().axis(0).motor().lost_steps(), 0);
        tmcl(&mut rig, "MVP ABS, 0, 0");
        rig.wait(20_000);
        assert_eq!(rig.rotor(), 0);
    }
}

/// A homing ends, and does not go on.
#[test]
fn a_homing_is_stopped() {
    let mut rig = Rig::operational();
    rig.set(0x6098, 0, 17);
    rig.set(0x6099, 1, 500);
    rig.set(0x6060, 0, HM);
    rig.enable();
    rig.word(START);
    rig.wait(500);
    assert_eq!(rig.signed(0x606C), -500);
    enter(&mut rig);
    rig.wait(1_000);
    let stopped = rig.rotor();
    rig.control("press left");
    rig.wait(1_000);
    assert_eq!((rig.rotor(), tmcl(&mut rig, "RFS STATUS, 0"), tmcl(&mut rig, "GAP 3, 0")), (stopped, 0, 0));
}

/// The brake is released as on the way to OPERATION ENABLED; before that no motion is started.
#[test]
fn the_brake_is_released() {
    let brake = |rig: &Rig| rig.board.borrow().world().outputs().is_on(0);
    for enabled in [false, true] {
        let mut rig = Rig::operational();
        for (index, sub, value) in [(0x200C, 2, 255), (0x200A, 0, 50), (0x2002, 2, 30)] {
            rig.set(index, sub, value);
        }
        if enabled {
            for word in [SHUTDOWN, SWITCH_ON, ENABLE] {
                rig.word(word);
            }
            rig.wait(100);
            assert_eq!(rig.drive_state(), OPERATION_ENABLED);
        }
        enter(&mut rig);
        assert_eq!((brake(&rig), rig.is_energised()), (enabled, true));
        if !enabled {
            rig.wait(45);
            assert!(!brake(&rig));
            refused(&mut rig, parsed("ROR 0, 500"), 6);
            rig.wait(8);
            assert!(brake(&rig));
            refused(&mut rig, parsed("MVP ABS, 0, 500"), 6);
            rig.wait(30);
        }
        tmcl(&mut rig, "MVP ABS, 0, 500");
        rig.wait(1_000);
        assert_eq!((rig.rotor(), brake(&rig)), (500, true));
        rig.command(0x81);
        rig.wait(2);
        assert!(!brake(&rig) && !rig.is_energised());
    }
}

/// While the cause of a fault lasts, the motor is stopped and no motion is started.
#[test]
fn a_fault_stops_the_motor() {
    let mut rig = Rig::operational();
    rig.control("input 0 1");
    rig.wait(2);
    rig.set(0x2005, 0, 0x43);
    enter(&mut rig);
    tmcl(&mut rig, "ROR 0, 1000");
    rig.wait(1_000);
    rig.frames();
    rig.control("input 0 0");
    rig.wait(2);
    assert_eq!(rig.emergencies(), [(0x5441, [0, 255])]);
    rig.wait(2_000);
    let stopped = rig.rotor();
    for line in ["ROR 0, 100", "MVP REL, 0, 100", "RFS START, 0", "SAP 0, 0, 77"] {
        refused(&mut rig, parsed(line), 6);
    }
    tmcl(&mut rig, "MST 0");
    rig.wait(500);
    assert_eq!((rig.rotor(), rig.drive_state(), rig.is_energised()), (stopped, SWITCH_ON_DISABLED, true));
    rig.control("input 0 1");
    rig.wait(2);
    tmcl(&mut rig, "MVP REL, 0, 100");
    rig.wait(500);
    assert_eq!(rig.rotor(), stopped + 100);
}

/// A master that can command nothing any more leaves no motor running.
#[test]
fn a_motor_without_a_master_stops() {
    type End = (&'static str, fn(&mut Rig));
    let ends: [End; 3] = [
        ("stopped", |rig| rig.command(2)),
        ("lost", |rig| {
            rig.send(0x77F, &[5]);
            rig.wait(30);
        }),
        ("off the bus", |rig| {
            let now = rig.now();
            rig.node.bus(now, BusState::Off);
        }),
    ];
    for (name, end) in ends {
        let mut rig = Rig::operational();
        rig.set(0x1016, 1, 0x007F_0014);
        enter(&mut rig);
        tmcl(&mut rig, "ROR 0, 1000");
        rig.wait(1_000);
        assert!(rig.rotor() > 20_000);
        end(&mut rig);
        rig.wait(2_000);
        let stopped = rig.rotor();
        rig.wait(200);
        assert_eq!(rig.rotor(), stopped, "{name}");
    }
}

#[test]
fn the_signature_alone_opens_it() {
    let mut rig = Rig::new();
    let bytes = parsed("MVP ABS, 0, 51200").to_bytes();
    for value in [0, 1, u32::from_le_bytes(*b"kill"), u32::from_le_bytes(*b"save")] {
        assert_eq!(rig.download(0x2700, 0, &value.to_le_bytes()), Err(VALUE));
    }
    assert_eq!(write_in_segments(&mut rig, (0x1023, 1), Some(7), &[&bytes]), Err(STATE));
    rig.wait(100);
    assert!(!rig.is_energised());
    assert_eq!((rig.read(0x2700, 0), rig.rotor()), (0, 0));
    // Written again it stops nothing.
    enter(&mut rig);
    tmcl(&mut rig, "ROR 0, 300");
    rig.wait(500);
    enter(&mut rig);
    rig.wait(500);
    assert_eq!(tmcl(&mut rig, "GAP 3, 0"), 300);
}

/// A controlword is refused, and so is a received PDO, when it would act. The rest of the node goes on.
#[test]
fn controlwords_and_pdos_are_refused() {
    let mut rig = Rig::operational();
    rig.set(0x1401, 2, 1);
    // Is still to act when TMCL mode begins.
    rig.send(0x301, &[0, 0, 1]);
    enter(&mut rig);
    rig.frames();
    for word in [0, 6, 7, 15, 128] {
        assert_eq!(rig.download(0x6040, 0, &[word, 0]), Err(STATE));
    }
    assert_eq!((rig.read(0x6040, 0), rig.of(0x81).len()), (0, 0));
    rig.send(0x80, &[]);
    rig.wait(2);
    assert_eq!(rig.of(0x81), [REFUSED]);
    rig.send(0x201, &[6, 0]);
    rig.send(0x401, &[6, 0, 0, 0, 1, 0]);
    assert_eq!(rig.of(0x81), [REFUSED, REFUSED]);
    rig.send(0x301, &[6, 0, 1]);
    assert!(rig.of(0x81).is_empty());
    rig.send(0x80, &[]);
    rig.wait(2);
    assert_eq!(rig.of(0x81), [REFUSED]);
    assert_eq!((rig.read(0x6040, 0), rig.read(0x6060, 0), rig.read(0x607A, 0)), (0, 0, 0));
    rig.set(0x1802, 2, 1);
    tmcl(&mut rig, "MVP ABS, 0, 25600");
    rig.wait(2_000);
    rig.frames();
    rig.send(0x80, &[]);
    rig.wait(2);
    assert_eq!(rig.of(0x381), [[0x50, 2, 0, 0x64, 0, 0]], "a PDO that is sent has status word and position");
    assert_eq!(rig.write(0x1017, 0, 5), Ok(()));
    rig.wait(20);
    assert!(rig.of(0x701).len() >= 3);
}

/// PRE-OPERATIONAL and OPERATIONAL change nothing, a reset of communication stops the motor, and the reset of the node
/// leads back.
#[test]
fn only_a_reset_of_the_node_leads_back() {
    let mut rig = rig();
    tmcl(&mut rig, "SAP 5, 0, 500");
    tmcl(&mut rig, "ROR 0, 1000");
    rig.wait(1_000);
    for command in [1, 0x80, 1] {
        rig.command(command);
        rig.wait(10);
    }
    assert_eq!(tmcl(&mut rig, "GAP 3, 0"), 1_000);
    rig.command(0x82);
    rig.wait(500);
    rig.frames();
    assert_eq!((rig.node.state(), rig.read(0x2700, 0)), (Nmt::PreOperational, 1));
    assert_eq!((tmcl(&mut rig, "GAP 3, 0"), tmcl(&mut rig, "GAP 5, 0")), (0, 500));
    rig.command(0x81);
    rig.wait(2);
    assert_eq!((rig.starts, rig.of(0x701)), (2, vec![vec![0]]));
    let stopped = rig.rotor();
    assert!(!rig.is_energised() && stopped > 10_000);
    assert_eq!(rig.read(0x2700, 0), 0);
    assert_eq!((rig.read(0x1023, 2), rig.upload(0x1023, 3)), (0, Ok(vec![0; 7])));
    assert_eq!(write_in_segments(&mut rig, (0x1023, 1), Some(7), &[&[6, 1, 0, 0, 0, 0, 0]]), Err(STATE));
    rig.wait(500);
    assert_eq!((rig.rotor(), rig.is_energised()), (stopped, false));
    assert_eq!(rig.download(0x6040, 0, &[0, 0]), Ok(()));
}

/// A limit that the drive has told of does not show any more: in TMCL mode there is no drive.
#[test]
fn limits_of_the_drive_are_over() {
    let mut rig = Rig::in_world("[stage]\nright = 5000\n");
    rig.command(1);
    rig.set(0x6060, 0, PV);
    rig.set(0x607D, 2, 1_000);
    rig.enable();
    rig.set(0x60FF, 0, 1000);
    rig.wait(50);
    rig.set(0x607D, 2, i32::MAX as u32);
    rig.set(0x60FF, 0, 999);
    rig.wait(500);
    rig.set(0x607D, 2, 1_000);
    rig.wait(2);
    assert_eq!(rig.status() & INTERNAL_LIMIT, INTERNAL_LIMIT);
    enter(&mut rig);
    assert_eq!(rig.status() & INTERNAL_LIMIT, 0);
}
