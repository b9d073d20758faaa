//! The states of the drive: each state that lasts with every command, by SDO and PDO; and what happens on the way.

use crate::driving::{
    DISABLE_VOLTAGE, ENABLE, FAULT, FAULT_REACTION_ACTIVE, FAULT_RESET, HALT, HM, INTERNAL_LIMIT, LASTING,
    MODE_SPECIFIC, MOVES, OPERATION_ENABLED, PP, PV, QUICK_STOP, QUICK_STOP_ACTIVE, READY_TO_SWITCH_ON, SHUTDOWN,
    STATE, SWITCH_ON, SWITCH_ON_DISABLED, SWITCHED_ON, TARGET_REACHED, VL,
};
use crate::rig::Rig;
use common::random::Random;

/// The state that follows, by figure 8 and table 185 of the manual; `reset` is true for a rising edge of bit 7.
fn expected(state: u32, word: u16, reset: bool) -> u32 {
    let bit = |n: u16| word >> n & 1 != 0;
    if state == FAULT {
        return if reset { SWITCH_ON_DISABLED } else { FAULT };
    }
    if bit(7) {
        return state;
    }
    let (switch_on, voltage, no_stop, operate) = (bit(0), bit(1), bit(2), bit(3));
    match state {
        SWITCH_ON_DISABLED if voltage && no_stop && !switch_on => READY_TO_SWITCH_ON,
        SWITCH_ON_DISABLED => SWITCH_ON_DISABLED,
        QUICK_STOP_ACTIVE if !voltage => SWITCH_ON_DISABLED,
        QUICK_STOP_ACTIVE if no_stop && switch_on && operate => OPERATION_ENABLED,
        QUICK_STOP_ACTIVE => QUICK_STOP_ACTIVE,
        _ if !voltage => SWITCH_ON_DISABLED,
        OPERATION_ENABLED if !no_stop => QUICK_STOP_ACTIVE,
        _ if !no_stop => SWITCH_ON_DISABLED,
        _ if !switch_on => READY_TO_SWITCH_ON,
        _ if operate => OPERATION_ENABLED,
        READY_TO_SWITCH_ON | SWITCHED_ON | OPERATION_ENABLED => SWITCHED_ON,
        _ => panic!("state {state:X}h"),
    }
}

/// Sends a controlword in RPDO1.
fn by_pdo(rig: &mut Rig, word: u16) {
    rig.send(0x201, &word.to_le_bytes());
}

#[test]
fn every_command_in_every_state_that_lasts() {
    let mut random = Random(17);
    for (state, words) in LASTING {
        for mode in [0, PP, VL, PV, HM] {
            for command in 0..32_u16 {
                let (low, reset) = (command & 0xF, command >> 4 != 0);
                for by_sdo in [false, true] {
                    let mut rig = Rig::in_state(state, words);
                    rig.set(0x6060, 0, mode);
                    // The other bits are free, but for halt and, in modes that know it, the start of something.
                    let free = if mode == 0 { 0xFF70 } else { 0xFE60 };
                    let word = low | u16::from(reset) << 7 | random.next() as u16 & free;
                    if by_sdo {
                        rig.word(word)
                    } else {
                        by_pdo(&mut rig, word)
                    }
                    rig.wait(20);
                    let next = expected(state, word, reset);
                    let case = format!("{state:X}h with {word:04X}h in mode {mode}");
                    assert_eq!(rig.drive_state(), next, "{case}");
                    assert_eq!(rig.is_energised(), matches!(next, OPERATION_ENABLED | QUICK_STOP_ACTIVE), "{case}");
                    // The motor stands: bit 10 tells that wherever it tells something, and in homing mode always.
                    let reached = next == QUICK_STOP_ACTIVE || mode == HM || next == OPERATION_ENABLED && mode != 0;
                    let bits = if reached { TARGET_REACHED } else { 0 };
                    assert_eq!(
                        rig.status() & (TARGET_REACHED | MODE_SPECIFIC | INTERNAL_LIMIT | MOVES),
                        bits,
                        "{case}"
                    );
                    let emergencies = rig.emergencies();
                    let told = state == FAULT && reset;
                    assert_eq!(emergencies.iter().any(|(code, _)| *code == 0), told, "{emergencies:?}");
                }
            }
        }
    }
}

/// The change of the state is in the TPDO1 that leaves before the reply to the next request.
#[test]
fn a_change_is_told_before_the_next_reply() {
    let mut rig = Rig::operational();
    for (word, state) in [(SHUTDOWN, READY_TO_SWITCH_ON), (SWITCH_ON, SWITCHED_ON), (ENABLE, OPERATION_ENABLED)] {
        by_pdo(&mut rig, word);
        rig.send(0x601, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
        let frames = rig.frames();
        let (id, data) = &frames[0];
        assert_eq!((*id, u32::from(data[0]) & STATE), (0x181, state), "{frames:?}");
        assert_eq!(frames.last().map(|(id, _)| *id), Some(0x581), "{frames:?}");
    }
}

/// Bit 7 resets a fault when it rises, not while it is set.
#[test]
fn a_fault_is_reset_by_the_edge() {
    let mut rig = Rig::in_state(FAULT, &[]);
    rig.control("supply 7");
    rig.wait(20);
    rig.word(FAULT_RESET);
    rig.control("supply 24");
    rig.wait(20);
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), FAULT);
    rig.word(0);
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
    assert_eq!(rig.read(0x1001, 0), 0);
}

/// The option codes of quick stop: the ramp of the mode (1, 5) or its own (2, 6), then SWITCH ON DISABLED (1, 2) or
/// QUICK STOP ACTIVE (5, 6). From 1000 internal units the ramp of acceleration 100 takes some 650 ms, that of 2047 some
/// 32 ms. These are 1000 / 2^(PULSE_DIV 3) pulses of 16 MHz / 2^13 in a ramp of A * 16 MHz / 2^(RAMP_DIV 7 + 13) a
/// second.
#[test]
fn quick_stop_option_codes() {
    for (code, slow, lasts) in [(1, true, false), (2, false, false), (5, true, true), (6, false, true)] {
        let mut rig = Rig::enabled(PV);
        rig.set(0x6083, 0, 100);
        rig.set(0x60FF, 0, 1000);
        rig.wait(1_500);
        rig.set(0x605A, 0, code);
        let from = rig.rotor();
        rig.word(QUICK_STOP);
        assert_eq!(rig.drive_state(), QUICK_STOP_ACTIVE);
        rig.wait(100);
        assert_eq!(rig.drive_state(), if slow || lasts { QUICK_STOP_ACTIVE } else { SWITCH_ON_DISABLED }, "{code}");
        let way = rig.rotor() - from;
        assert_eq!(way > 2_000, slow, "{code}: {way}");
        rig.wait(900);
        assert_eq!(rig.drive_state(), if lasts { QUICK_STOP_ACTIVE } else { SWITCH_ON_DISABLED }, "{code}");
        assert_eq!(rig.is_energised(), lasts);
        let stood = rig.rotor();
        rig.wait(100);
        assert_eq!(rig.rotor(), stood);
        // Transition 16: the target velocity is in force again.
        rig.word(ENABLE);
        rig.wait(100);
        assert_eq!((rig.drive_state() == OPERATION_ENABLED, rig.rotor() > stood), (lasts, lasts), "{code}");
    }
}

/// Disable operation goes the ramp of the mode before the bridges go off; shutdown and disable voltage stop at once.
#[test]
fn ways_to_the_end_of_operation() {
    for (word, end, ramp) in [
        (SWITCH_ON, SWITCHED_ON, true),
        (SHUTDOWN, READY_TO_SWITCH_ON, false),
        (DISABLE_VOLTAGE, SWITCH_ON_DISABLED, false),
    ] {
        let mut rig = Rig::enabled(PV);
        rig.set(0x6083, 0, 100);
        rig.set(0x60FF, 0, (-1000_i32) as u32);
        rig.wait(1_500);
        let from = rig.rotor();
        rig.word(word);
        assert_eq!(rig.drive_state(), if ramp { OPERATION_ENABLED } else { end });
        assert_eq!(rig.is_energised(), ramp);
        rig.wait(1_000);
        assert_eq!((rig.drive_state(), rig.is_energised()), (end, false));
        assert_eq!(from - rig.rotor() > 2_000, ramp, "{word:X}h");
    }
}

/// A command that comes on the way is obeyed at its end, and one that stops the motor at once.
#[test]
fn commands_on_the_way() {
    let turning = || {
        let mut rig = Rig::enabled(PV);
        rig.set(0x6083, 0, 100);
        rig.set(0x60FF, 0, 1000);
        rig.wait(1_500);
        rig.word(SWITCH_ON);
        rig.wait(50);
        rig
    };
    let mut rig = turning();
    rig.word(ENABLE | HALT);
    assert_eq!(rig.drive_state(), OPERATION_ENABLED);
    rig.wait(200);
    let far = rig.rotor();
    rig.wait(1_000);
    assert!(rig.rotor() > far, "the ramp is gone to its end");
    // Enabled again, the motor halts.
    assert_eq!((rig.drive_state(), rig.is_energised()), (OPERATION_ENABLED, true));
    let mut rig = turning();
    rig.word(QUICK_STOP);
    assert_eq!(rig.drive_state(), QUICK_STOP_ACTIVE);
    rig.wait(100);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
    let mut rig = turning();
    rig.word(DISABLE_VOLTAGE);
    assert_eq!((rig.drive_state(), rig.is_energised()), (SWITCH_ON_DISABLED, false));
}

/// Settings that are changed in SWITCH ON DISABLED only.
#[test]
fn settings_of_switch_on_disabled() {
    let objects = [
        (0x2005, 0, 1),
        (0x200B, 1, 1),
        (0x200B, 2, 1),
        (0x200B, 3, 0),
        (0x200C, 1, 1),
        (0x200C, 2, 1),
        (0x2085, 0, 5),
        (0x2086, 0, 5),
        (0x2087, 0, 2047),
        (0x2088, 0, 2047),
        (0x208C, 0, 181),
    ];
    for (state, words) in LASTING {
        let mut rig = Rig::in_state(state, words);
        for (index, sub, value) in objects {
            let written = rig.write(index, sub, value);
            let allowed = if state == SWITCH_ON_DISABLED { Ok(()) } else { Err(0x0800_0022) };
            assert_eq!(written, allowed, "{index:04X}h:{sub} in {state:X}h");
        }
    }
}

/// The brake at OUT0, with 128 as the current that releases it: bridges, 200Ah, brake, 2002h.2, OPERATION ENABLED; and
/// back: ramp, brake, 2002h.1, bridges.
#[test]
fn the_brake_and_its_times() {
    let mut rig = Rig::operational();
    let out = |rig: &Rig| rig.board.borrow().world().outputs().digital & 1;
    rig.set(0x200C, 2, 128);
    rig.set(0x200A, 0, 30);
    rig.set(0x2002, 1, 40);
    rig.set(0x2002, 2, 50);
    rig.set(0x2703, 2, 3 << 16);
    rig.set(0x2703, 1, 1 << 16);
    assert_eq!(out(&rig), 0, "OUT0 is the brake's");
    rig.word(SHUTDOWN);
    rig.word(SWITCH_ON);
    assert!(!rig.is_energised());
    rig.word(ENABLE);
    let seen = |rig: &mut Rig| (rig.is_energised(), out(rig), rig.drive_state());
    assert_eq!(seen(&mut rig), (true, 0, SWITCHED_ON));
    rig.wait(28);
    assert_eq!(seen(&mut rig), (true, 0, SWITCHED_ON));
    rig.wait(4);
    assert_eq!(seen(&mut rig), (true, 1, SWITCHED_ON));
    rig.wait(46);
    assert_eq!(seen(&mut rig), (true, 1, SWITCHED_ON));
    rig.wait(6);
    assert_eq!(seen(&mut rig), (true, 1, OPERATION_ENABLED));
    rig.word(SWITCH_ON);
    rig.wait(1);
    assert_eq!(seen(&mut rig), (true, 0, OPERATION_ENABLED));
    rig.wait(37);
    assert_eq!(seen(&mut rig), (true, 0, OPERATION_ENABLED));
    rig.wait(4);
    assert_eq!(seen(&mut rig), (false, 0, SWITCHED_ON));
    // On the way back any other command turns round.
    rig.word(ENABLE);
    rig.wait(40);
    assert_eq!(seen(&mut rig), (true, 1, SWITCHED_ON));
    rig.word(SHUTDOWN);
    rig.wait(20);
    assert_eq!(seen(&mut rig), (true, 0, SWITCHED_ON));
    rig.wait(25);
    assert_eq!(seen(&mut rig), (false, 0, READY_TO_SWITCH_ON));
    // A fault on the way leads to FAULT by way of the brake as well.
    rig.word(SWITCH_ON);
    rig.word(ENABLE);
    rig.wait(40);
    rig.control("supply 7");
    rig.wait(5);
    assert_eq!(seen(&mut rig).1, 0);
    assert_eq!(rig.drive_state(), FAULT_REACTION_ACTIVE);
    rig.wait(45);
    assert_eq!(seen(&mut rig), (false, 0, FAULT));
}

/// A brake that is released without current, and one with no automatic control.
#[test]
fn other_brakes() {
    let mut rig = Rig::operational();
    let out = |rig: &Rig| rig.board.borrow().world().outputs().digital & 1;
    rig.set(0x200C, 1, 200);
    rig.wait(2);
    assert_eq!(out(&rig), 1);
    rig.enable();
    rig.wait(2);
    assert_eq!(out(&rig), 0);
    rig.word(DISABLE_VOLTAGE);
    rig.wait(2);
    assert_eq!(out(&rig), 1);
    rig.set(0x200C, 1, 0);
    rig.set(0x2703, 2, 1 << 16);
    rig.set(0x2703, 1, 0);
    rig.wait(2);
    assert_eq!(out(&rig), 0);
    rig.enable();
    rig.wait(2);
    assert_eq!(out(&rig), 0);
    rig.set(0x2703, 1, 1 << 16);
    rig.wait(2);
    assert_eq!(out(&rig), 1);
}
