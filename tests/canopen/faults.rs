//! Faults of the drive: emergency message, reaction, and reset, each by what the board or the bus does.

use crate::driving::{
    ENABLE, FAULT, FAULT_RESET, LASTING, MOVES, OPERATION_ENABLED, PV, READY_TO_SWITCH_ON, SHUTDOWN, SWITCH_ON,
    SWITCH_ON_DISABLED,
};
use crate::rig::Rig;
use tmcm::canopen::{BusState, Emergency, Nmt, Overflow, Reaction};

/// A motor that turns at 500 internal units.
fn turning() -> Rig {
    let mut rig = Rig::enabled(PV);
    rig.set(0x60FF, 0, 500);
    rig.wait(300);
    rig.frames();
    assert!(rig.status() & MOVES != 0);
    rig
}

/// A disturbance that begins and ends by the control port.
struct Disturbance {
    begin: &'static str,
    end: &'static str,
    emergencies: &'static [(u16, [u8; 2])],
    register: u32,
}

/// Disturbances that lead to FAULT.
const FAULTS: [Disturbance; 4] = [
    Disturbance {
        begin: "fault short-a on",
        end: "fault short-a off",
        emergencies: &[(0x2312, [0, 0])],
        register: 0x03,
    },
    Disturbance {
        begin: "fault short-b on",
        end: "fault short-b off",
        emergencies: &[(0x2311, [0, 0])],
        register: 0x03,
    },
    Disturbance {
        begin: "fault overtemperature on",
        end: "fault overtemperature off",
        emergencies: &[(0x4310, [1, 0]), (0x4310, [2, 0])],
        register: 0x09,
    },
    Disturbance { begin: "supply 7", end: "supply 24", emergencies: &[(0xFF00, [0, 0])], register: 0x05 },
];

#[test]
fn faults_stop_the_motor_and_are_reset_when_they_are_gone() {
    for Disturbance { begin, end, emergencies, register } in FAULTS {
        let mut rig = turning();
        rig.control(begin);
        rig.wait(60);
        assert_eq!(rig.emergencies(), emergencies, "{begin}");
        assert_eq!((rig.drive_state(), rig.is_energised()), (FAULT, false), "{begin}");
        assert_eq!(rig.read(0x1001, 0), register);
        let here = rig.rotor();
        rig.wait(100);
        assert_eq!(rig.rotor(), here);
        // A short shows only while the bridges are on, so its end shows with the next enabling.
        if !begin.contains("short") {
            rig.word(FAULT_RESET);
            rig.word(0);
            assert_eq!(rig.drive_state(), FAULT, "{begin}: the cause is there");
        }
        rig.control(end);
        rig.wait(50);
        // The warning of a driver that has become too hot needs no reset.
        let over = if begin.contains("temperature") { vec![(0, [0, 0])] } else { vec![] };
        assert_eq!(rig.emergencies(), over, "{begin}");
        assert_eq!(rig.read(0x1001, 0), register, "{begin}");
        rig.word(FAULT_RESET);
        assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED, "{begin}");
        assert_eq!((rig.emergencies(), rig.read(0x1001, 0)), (vec![(0, [0, 0])], 0));
        rig.enable();
        rig.wait(300);
        assert!(rig.rotor() > here, "{begin}: the target velocity is in force again");
        assert!(rig.emergencies().is_empty());
    }
}

/// A short that is still there at the next enabling is a fault again.
#[test]
fn a_short_that_lasts() {
    let mut rig = turning();
    rig.control("fault short-b on");
    rig.wait(60);
    rig.word(FAULT_RESET);
    rig.frames();
    for word in [SHUTDOWN, SWITCH_ON, ENABLE] {
        rig.word(word);
    }
    rig.wait(60);
    assert_eq!((rig.drive_state(), rig.emergencies()), (FAULT, vec![(0x2311, [0, 0])]));
}

/// Faults lead from every state to FAULT; the driver's supply is the one that shows in all of them.
#[test]
fn a_fault_in_every_state() {
    for (state, words) in LASTING.into_iter().filter(|(state, _)| *state != FAULT) {
        let mut rig = Rig::in_state(state, words);
        rig.control("supply 7");
        rig.wait(20);
        assert_eq!((rig.drive_state(), rig.emergencies()), (FAULT, vec![(0xFF00, [0, 0])]));
        assert!(!rig.is_energised());
    }
}

/// Messages change nothing: an open coil is told once the motor has moved with it for a while, and the warning of the
/// driver shows in bit 7.
#[test]
fn messages_leave_the_drive_as_it_is() {
    for (begin, end, emergency) in [
        ("fault open-a on", "fault open-a off", (0x1000, [1, 0])),
        ("fault open-b on", "fault open-b off", (0x1000, [2, 0])),
        ("temperature 120", "temperature 25", (0x4310, [1, 0])),
    ] {
        let mut rig = turning();
        rig.control(begin);
        rig.wait(100);
        assert_eq!((rig.emergencies(), rig.drive_state()), (vec![emergency], OPERATION_ENABLED), "{begin}");
        let status = rig.status();
        assert_eq!((status & MOVES, status & 1 << 7 != 0), (MOVES, emergency.0 == 0x4310));
        rig.control(end);
        rig.wait(100);
        // That it is over is told, and the register forgets it.
        assert_eq!((rig.emergencies(), rig.read(0x1001, 0), rig.read(0x603F, 0)), (vec![(0, [0, 0])], 0, 0));
        assert_eq!(rig.status() & 1 << 7, 0);
    }
    // The slowest motor tells it as well.
    let mut rig = Rig::enabled(PV);
    rig.set(0x60FF, 0, 1);
    rig.control("fault open-a on");
    rig.wait(2_000);
    assert_eq!(rig.emergencies(), [(0x1000, [1, 0])]);
    // A motor that stands tells no open coil, because the driver's flags are not right then.
    let mut rig = Rig::enabled(PV);
    rig.control("fault open-a on");
    rig.wait(200);
    assert!(rig.emergencies().is_empty());
}

/// An open coil counts in the twentieth turn in a row in which the driver has told of it (2102h) while the motor moves.
/// A coil that has a contact in between counts from the beginning again.
#[test]
fn an_open_coil_is_told_in_the_twentieth_turn() {
    for (coil, flag, detail) in [("open-a", 4, 1), ("open-b", 8, 2)] {
        for (before, turns) in [(0, 19), (0, 20), (10, 19), (10, 20)] {
            let mut rig = turning();
            let shows = |rig: &mut Rig| rig.read(0x2102, 0) & flag != 0;
            if before > 0 {
                rig.control(&format!("fault {coil} on"));
                while !shows(&mut rig) {
                    rig.wait(1);
                }
                rig.wait(before - 1);
                rig.control(&format!("fault {coil} off"));
                while shows(&mut rig) {
                    rig.wait(1);
                }
            }
            rig.control(&format!("fault {coil} on"));
            while !shows(&mut rig) {
                rig.wait(1);
            }
            rig.wait(turns - 1);
            let told = if turns == 20 { vec![(0x1000, [detail, 0])] } else { Vec::new() };
            assert_eq!(rig.emergencies(), told, "{coil}: {turns} turns");
        }
    }
}

/// A rotor that has slipped deviates from its encoder.
#[test]
fn following_error() {
    let mut rig = turning();
    rig.set(0x6065, 0, 2_000);
    rig.wait(100);
    assert!(rig.emergencies().is_empty());
    rig.control("slip 12");
    rig.wait(100);
    assert_eq!((rig.emergencies(), rig.drive_state()), (vec![(0x8611, [0, 0])], FAULT));
    assert_eq!((rig.read(0x1001, 0), rig.read(0x603F, 0)), (0x21, 0x8611));
    rig.word(FAULT_RESET);
    assert_eq!((rig.drive_state(), rig.read(0x603F, 0)), (SWITCH_ON_DISABLED, 0));
}

/// The shutdown input is IN0: low means shutdown, if bit 6 of 2005h is set.
#[test]
fn shutdown_input() {
    let mut rig = Rig::operational();
    rig.control("input 0 1");
    rig.wait(2);
    rig.set(0x2005, 0, 0x43);
    rig.set(0x6060, 0, PV);
    rig.set(0x6085, 0, 50);
    rig.enable();
    rig.set(0x60FF, 0, 500);
    rig.wait(300);
    assert!(rig.emergencies().is_empty());
    rig.control("input 0 0");
    rig.wait(3);
    assert_eq!(rig.emergencies(), [(0x5441, [0, 255])]);
    // The motor slows down on the quick stop ramp: 15 259 / 23 283 s.
    assert_eq!(rig.drive_state(), crate::driving::FAULT_REACTION_ACTIVE);
    let from = rig.rotor();
    rig.wait(600);
    assert_eq!(rig.drive_state(), crate::driving::FAULT_REACTION_ACTIVE);
    rig.wait(100);
    assert_eq!((rig.drive_state(), rig.is_energised()), (FAULT, false));
    assert!((4_500..5_500).contains(&(rig.rotor() - from)), "{}", rig.rotor() - from);
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), FAULT);
    rig.control("input 0 1");
    rig.wait(2);
    rig.word(0);
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
    // Without bit 6 the input is only an input.
    rig.set(0x2005, 0, 3);
    rig.enable();
    rig.frames();
    rig.control("input 0 0");
    rig.wait(20);
    assert!(rig.emergencies().is_empty());
}

/// A motion controller that is silent is given up until the node starts anew.
#[test]
fn a_silent_motion_controller() {
    let mut rig = turning();
    rig.control("fault tmc429 on");
    rig.wait(20);
    assert_eq!((rig.emergencies(), rig.drive_state()), (vec![(0x5000, [0, 255])], FAULT));
    assert!(!rig.is_energised());
    rig.control("fault tmc429 off");
    rig.wait(50);
    rig.word(FAULT_RESET);
    assert_eq!((rig.drive_state(), rig.is_energised()), (FAULT, false));
    rig.command(0x81);
    rig.wait(50);
    assert_eq!((rig.starts, rig.drive_state()), (2, SWITCH_ON_DISABLED));
    // One that is silent from the start is told after the boot-up.
    rig.control("fault tmc429 on");
    rig.command(0x81);
    rig.wait(50);
    let frames = rig.frames();
    let boot_up = frames.iter().rposition(|(id, _)| *id == 0x701).unwrap();
    assert_eq!(frames[boot_up + 1..], [(0x81, vec![0x00, 0x50, 0x81, 0, 255, 0, 0, 0])]);
    assert_eq!(rig.drive_state(), FAULT);
}

/// A master that falls silent stops the motor on the quick stop ramp; the fault is reset when it is heard again.
#[test]
fn a_lost_master() {
    for behaviour in [0, 1] {
        let mut rig = Rig::operational();
        rig.set(0x1029, 1, behaviour);
        rig.set(0x1016, 1, 0x0005_0032);
        rig.send(0x705, &[5]);
        rig.set(0x2005, 0, 3);
        rig.set(0x6060, 0, PV);
        rig.set(0x60FF, 0, 500);
        rig.enable();
        for _ in 0..10 {
            rig.send(0x705, &[5]);
            rig.wait(30);
        }
        assert!(rig.emergencies().is_empty());
        rig.wait(100);
        assert_eq!(rig.emergencies(), [(0x8130, [0, 255])]);
        assert_eq!(rig.node.state(), if behaviour == 1 { Nmt::Operational } else { Nmt::Stopped });
        rig.command(0x80);
        assert_eq!((rig.drive_state(), rig.is_energised()), (FAULT, false));
        rig.word(FAULT_RESET);
        assert_eq!(rig.drive_state(), FAULT);
        rig.send(0x705, &[127]);
        rig.wait(2);
        rig.word(0);
        rig.word(FAULT_RESET);
        assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
    }
}

/// Off the bus the motor stops at once and the bridges are off; that is told when the bus is back. As 1029h.1 says, the
/// node goes on, or is stopped: then it tells of it after its start.
#[test]
fn off_the_bus() {
    for (behaviour, state) in [(0, Nmt::Stopped), (1, Nmt::Operational), (2, Nmt::Stopped)] {
        let mut rig = turning();
        rig.set(0x1029, 1, behaviour);
        rig.set(0x1029, 2, 1);
        let now = rig.now();
        rig.node.bus(now, BusState::Off);
        rig.wait(20);
        let now = rig.now();
        rig.node.bus(now, BusState::Active);
        rig.wait(2);
        assert_eq!(rig.node.state(), state, "{behaviour}");
        let told = rig.of(0x81).len();
        assert_eq!(told, usize::from(behaviour == 1), "{behaviour}");
        rig.command(1);
        rig.wait(2);
        assert_eq!(rig.of(0x81).len() + told, 1, "{behaviour}");
    }
    let mut rig = turning();
    rig.set(0x1029, 1, 1);
    rig.set(0x6085, 0, 1);
    let now = rig.now();
    rig.node.bus(now, BusState::Off);
    let here = rig.rotor();
    rig.wait(20);
    assert!(rig.rotor() - here < 50 && !rig.is_energised(), "{}", rig.rotor() - here);
    let now = rig.now();
    rig.node.bus(now, BusState::Active);
    rig.wait(2);
    assert_eq!((rig.emergencies(), rig.drive_state()), (vec![(0x8140, [0, 255])], FAULT));
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
}

/// A node that is stopped while the motor may move can be commanded no more: FAULT, and no message.
#[test]
fn stopped_in_operation() {
    let mut rig = turning();
    rig.command(2);
    rig.wait(100);
    assert!(rig.frames().is_empty());
    let here = rig.rotor();
    rig.command(0x80);
    assert_eq!((rig.drive_state(), rig.is_energised()), (FAULT, false));
    rig.wait(100);
    assert_eq!((rig.rotor(), rig.emergencies()), (here, vec![]));
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
    // In other states it is none.
    rig.word(SHUTDOWN);
    rig.command(2);
    rig.command(1);
    assert_eq!(rig.drive_state(), READY_TO_SWITCH_ON);
}

/// The same on the way to OPERATION ENABLED, and with a command that waits for the end of a way.
#[test]
fn stopped_on_the_way() {
    let enabled_with_delays = |words: &[u16]| {
        let mut rig = Rig::operational();
        rig.set(0x2005, 0, 3);
        rig.set(0x6060, 0, PV);
        rig.set(0x60FF, 0, 500);
        rig.set(0x200A, 0, 50);
        rig.set(0x2002, 1, 50);
        for word in words {
            rig.word(*word);
        }
        rig
    };
    for words in [&[SHUTDOWN, SWITCH_ON, ENABLE][..], &[SHUTDOWN, SWITCH_ON, ENABLE, SWITCH_ON, ENABLE]] {
        for command in [2, 0x82] {
            let mut rig = enabled_with_delays(words);
            rig.command(command);
            rig.wait(500);
            assert_eq!((rig.rotor(), rig.is_energised()), (0, false), "{words:X?}, {command:X}h");
            rig.command(0x80);
            assert_eq!(rig.drive_state(), FAULT);
        }
    }
}

/// After a reset of communication nobody watches over the master, so a motor that turns is stopped.
#[test]
fn communication_is_reset_in_operation() {
    let mut rig = turning();
    rig.command(0x82);
    rig.wait(100);
    assert_eq!((rig.drive_state(), rig.is_energised(), rig.read(0x1001, 0)), (FAULT, false, 0));
    assert!(rig.emergencies().is_empty());
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
}

/// A node that is stopped sends no emergencies; those that wait for the inhibit time then, and those that come up, are
/// sent after its start.
#[test]
fn no_emergency_when_stopped() {
    let mut rig = Rig::operational();
    rig.set(0x1015, 0, 500);
    rig.send(0x201, &[0]);
    rig.send(0x201, &[0]);
    rig.command(2);
    rig.frames();
    let now = rig.now();
    rig.node.lost(now, Overflow::Receive);
    rig.wait(200);
    assert!(rig.frames().is_empty());
    rig.command(1);
    rig.wait(200);
    assert_eq!(rig.emergencies(), [(0x8210, [0, 255]), (0x8110, [3, 255])]);
}

/// 1029h.2: a fault of the drive stops the node, or it stays operational.
#[test]
fn application_errors() {
    for (behaviour, state) in [(0, Nmt::Stopped), (1, Nmt::Operational), (2, Nmt::Stopped)] {
        let mut rig = turning();
        rig.set(0x1029, 2, behaviour);
        rig.control("fault short-a on");
        rig.wait(60);
        assert_eq!((rig.emergencies(), rig.node.state()), (vec![(0x2312, [0, 0])], state));
    }
}

/// The other faults of the control port: emergencies, whether they lead to FAULT, and whether a reset is possible when
/// they are over.
#[test]
fn parts_that_do_not_answer() {
    const SILENT: &[(u16, [u8; 2])] = &[(0x5000, [0, 255])];
    // The readings of a driver that is silent are all ones, with every flag set.
    const ALL: &[(u16, [u8; 2])] = &[(0x2312, [0, 0]), (0x2311, [0, 0]), (0x4310, [1, 0]), (0x4310, [2, 0])];
    for (fault, emergencies, resets) in [
        ("eeprom", &[][..], None),
        ("encoder", &[], None),
        ("spi", SILENT, Some(false)),
        ("spi-low", SILENT, Some(false)),
        ("tmc262", ALL, Some(true)),
    ] {
        let mut rig = turning();
        rig.control(&format!("fault {fault} on"));
        rig.wait(200);
        assert_eq!(rig.emergencies(), emergencies, "{fault}");
        let faulty = resets.is_some();
        assert_eq!((rig.drive_state() == FAULT, rig.is_energised()), (faulty, !faulty), "{fault}");
        let here = rig.rotor();
        rig.wait(100);
        assert_eq!(rig.rotor() == here, faulty, "{fault}");
        rig.control(&format!("fault {fault} off"));
        rig.wait(100);
        rig.word(FAULT_RESET);
        assert_eq!(rig.drive_state() == SWITCH_ON_DISABLED, resets == Some(true), "{fault}");
    }
}

/// A rotor that a load holds, and an encoder that has stopped, deviate from the counter as well.
#[test]
fn other_following_errors() {
    for begin in ["load 1", "fault encoder on"] {
        let mut rig = turning();
        rig.control(begin);
        rig.wait(200);
        assert!(rig.emergencies().is_empty(), "{begin}");
        rig.set(0x6065, 0, 2_000);
        rig.wait(100);
        assert_eq!((rig.emergencies(), rig.drive_state()), (vec![(0x8611, [0, 0])], FAULT), "{begin}");
        assert!(!rig.is_energised());
        // The fault reset brings the counter to the encoder.
        assert_ne!(rig.signed(0x60F4), 0);
        rig.word(FAULT_RESET);
        assert_eq!((rig.drive_state(), rig.signed(0x60F4)), (SWITCH_ON_DISABLED, 0), "{begin}");
    }
}

/// The reactions are those of the list.
#[test]
fn reactions() {
    let of = |reaction| Emergency::ALL.iter().filter(move |emergency| emergency.reaction() == reaction);
    let codes =
        |reaction| of(reaction).map(|emergency| (emergency.data().0, emergency.data().1[0])).collect::<Vec<_>>();
    assert_eq!(codes(Reaction::Stop), [(0x3230, 0), (0xFF01, 1), (0xFF01, 2), (0xFF01, 3), (0xFF01, 4)]);
    let faults = [
        (0x2310, 0),
        (0x2311, 0),
        (0x2312, 0),
        (0x4310, 2),
        (0x5000, 0),
        (0x5441, 0),
        (0x5530, 0),
        (0x6310, 0),
        (0x8130, 0),
        (0x8140, 0),
        (0x8611, 0),
        (0xFF00, 0),
    ];
    assert_eq!(codes(Reaction::Fault), faults);
}
