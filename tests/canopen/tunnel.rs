//! TMCL mode (2700h, 1023h): what the executor does in it, what it refuses, and what the node refuses while it lasts.

use crate::driving::{
    ENABLE, HM, INTERNAL_LIMIT, LASTING, OPERATION_ENABLED, PP, PV, SHUTDOWN, START, SWITCH_ON, SWITCH_ON_DISABLED,
};
use crate::random::Random;
use crate::rig::Rig;
use crate::sdo::{LENGTH, STATE, TOO_LONG, TOO_SHORT, VALUE, write_in_segments};
use tmcm::canopen::{BusState, Nmt};
use tmcm::tmcl::{Command, Opcode, text};
use tmcm_sim::native::{FirmwareKind, Model};

/// Emergency: an RPDO was refused.
const REFUSED: [u8; 8] = [0x20, 0x63, 0x21, 0, 255, 0, 0, 0];

/// A node that has just entered TMCL mode.
fn rig() -> Rig {
    let mut rig = Rig::new();
    enter(&mut rig);
    rig
}

fn enter(rig: &mut Rig) {
    assert_eq!(rig.sign(0x2700, 0, b"make"), Ok(()));
    assert_eq!(rig.read(0x2700, 0), 1);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
}

/// Has a command executed: 1023h.2, and the reply.
fn execute(rig: &mut Rig, command: Command) -> (u32, [u8; 7]) {
    let bytes = command.to_bytes();
    assert_eq!(write_in_segments(rig, (0x1023, 1), Some(7), &[&bytes]), Ok(()));
    (rig.read(0x1023, 2), rig.upload(0x1023, 3).unwrap().try_into().unwrap())
}

fn parsed(line: &str) -> Command {
    text::parse(line).unwrap_or_else(|error| panic!("{line}: {error}"))
}

/// Has a command executed that must be refused, with this status.
fn refused(rig: &mut Rig, command: Command, status: u8) {
    let [a, b, c, d] = command.value.to_be_bytes();
    assert_eq!(execute(rig, command), (3, [1, status, command.opcode, a, b, c, d]), "{command}");
}

/// Has a command executed that must succeed: the value of its reply.
fn value(rig: &mut Rig, command: Command) -> i32 {
    let (status, [node, code, opcode, value @ ..]) = execute(rig, command);
    let expected = (1, u32::from(rig.node.node_id()), 100, command.opcode);
    assert_eq!((status, node.into(), code, opcode), expected, "{command}");
    i32::from_be_bytes(value)
}

/// The same for a command that is written with its mnemonic.
fn tmcl(rig: &mut Rig, line: &str) -> i32 {
    value(rig, parsed(line))
}

/// A command without a mnemonic.
fn control(opcode: u8, kind: u8, value: i32) -> Command {
    Command::new(opcode, kind, 0, value)
}

#[test]
fn the_executor_moves_the_motor() {
    let mut rig = rig();
    assert!(rig.is_energised());
    assert_eq!((rig.read(0x1023, 2), rig.upload(0x1023, 3)), (0, Ok(vec![0; 7])), "no command yet");
    let start = rig.rotor();
    assert_eq!(tmcl(&mut rig, "MVP ABS, 0, 51200"), 51_200);
    rig.wait(3_000);
    assert_eq!((rig.rotor() - start, tmcl(&mut rig, "GAP 1, 0"), tmcl(&mut rig, "GAP 8, 0")), (51_200, 51_200, 1));
    assert_eq!(rig.read(0x6064, 0), 51_200, "the objects show it");
    assert_eq!(tmcl(&mut rig, "MVP REL, 0, -1200"), 50_000);
    rig.wait(1_000);
    assert_eq!(rig.rotor() - start, 50_000);
    tmcl(&mut rig, "SAP 6, 0, 99");
    assert_eq!(tmcl(&mut rig, "GAP 6, 0"), 99);
    tmcl(&mut rig, "ROL 0, 300");
    rig.wait(1_000);
    assert_eq!((tmcl(&mut rig, "GAP 3, 0"), rig.read(0x606C, 0) as i32), (-300, -300));
    assert!(rig.rotor() - start < 45_000);
    tmcl(&mut rig, "MST 0");
    rig.wait(1_000);
    let stopped = rig.rotor();
    rig.wait(100);
    assert_eq!((tmcl(&mut rig, "GAP 3, 0"), rig.rotor()), (0, stopped));
    assert_eq!(rig.board.borrow().world().axis(0).motor().lost_steps(), 0);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
}

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

fn value_of(rig: &mut Rig, parameter: u8) -> i32 {
    value(rig, Command::new(6, parameter, 0, 0))
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

/// The reference search, which needs turns of the executor, and its switches.
#[test]
fn a_reference_search() {
    let mut rig = rig();
    rig.control("release left");
    tmcl(&mut rig, "SAP 193, 0, 1");
    tmcl(&mut rig, "SAP 194, 0, 300");
    tmcl(&mut rig, "RFS START, 0");
    rig.wait(100);
    assert_eq!(tmcl(&mut rig, "RFS STATUS, 0"), 1);
    rig.control("press left");
    rig.wait(1_000);
    rig.control("release left");
    rig.wait(500);
    assert_eq!(tmcl(&mut rig, "RFS STATUS, 0"), 3);
    rig.control("press left");
    rig.wait(1_000);
    assert_eq!(tmcl(&mut rig, "RFS STATUS, 0"), 0);
}

/// What needs neither the EEPROM nor program memory nor a link.
#[test]
fn commands_without_a_motor() {
    let mut rig = rig();
    tmcl(&mut rig, "SGP 7, 2, -5");
    assert_eq!(tmcl(&mut rig, "GGP 7, 2"), -5);
    tmcl(&mut rig, "SCO 3, 0, 1234");
    assert_eq!(tmcl(&mut rig, "GCO 3, 0"), 1234);
    tmcl(&mut rig, "CALC LOAD, 77");
    tmcl(&mut rig, "CALC MUL, 2");
    tmcl(&mut rig, "AGP 8, 2");
    assert_eq!(tmcl(&mut rig, "GGP 8, 2"), 154);
    assert_eq!(value(&mut rig, control(135, 2, 0)), 154);
    tmcl(&mut rig, "SIO 1, 2, 1");
    rig.wait(2);
    assert!(rig.board.borrow().world().outputs().is_on(1));
    rig.control("analog 0 2000");
    rig.wait(2);
    assert_eq!(tmcl(&mut rig, "GIO 0, 1"), 2000);
    for line in ["CLE 0", "EI 0", "DI 0", "SGP 0, 3, 100"] {
        tmcl(&mut rig, line);
    }
    assert_eq!(tmcl(&mut rig, "GGP 0, 3"), 100);
    let ticks = tmcl(&mut rig, "GGP 132, 0");
    rig.wait(500);
    assert!((500..510).contains(&(tmcl(&mut rig, "GGP 132, 0") - ticks)));
    assert_eq!(value(&mut rig, control(128, 0, 0)), 0);
    assert_eq!(value(&mut rig, control(131, 0, 0)), 0);
    assert_eq!(value(&mut rig, control(136, 1, 0)), 0x0474_0314);
    assert_eq!(execute(&mut rig, control(136, 0, 0)), (1, *b"1140V32"));
    // Whoever reads an object gets its value.
    tmcl(&mut rig, "SGP 255, 0, 1");
    assert_eq!(tmcl(&mut rig, "SGP 7, 2, 6"), 6);
}

#[test]
fn the_reply_carries_the_node_id() {
    let model = Model::from(FirmwareKind::Canopen);
    let mut rig = Rig::with_eeprom(&model.numbered_eeprom(42).unwrap(), 1);
    rig.frames();
    enter(&mut rig);
    assert_eq!(execute(&mut rig, parsed("GAP 140, 0")), (1, [42, 100, 6, 0, 0, 0, 8]));
}

/// Storing: status 5. It may be refused for another reason before, and it has no effect.
#[test]
fn nothing_is_stored() {
    let mut rig = rig();
    let before = rig.eeprom();
    tmcl(&mut rig, "SAP 6, 0, 77");
    for (line, status) in [
        ("STAP 6, 0, 0", 5),
        ("STAP 1, 0, 0", 3),
        ("STAP 6, 1, 0", 4),
        ("RSAP 6, 0, 0", 5),
        ("STGP 0, 2, 0", 5),
        ("STGP 56, 2, 0", 3),
        ("RSGP 0, 2, 0", 5),
        ("SGP 79, 0, 1", 5),
        ("SGP 79, 0, 2", 4),
        ("SGP 82, 0, 1", 5),
        ("SGP 81, 0, 1", 5),
        ("SGP 84, 0, 1", 5),
        ("SCO 1, 255, 0", 5),
        ("SCO 0, 255, 0", 5),
        ("GCO 1, 255, 0", 5),
        ("GCO 21, 255, 0", 4),
    ] {
        refused(&mut rig, parsed(line), status);
    }
    refused(&mut rig, control(137, 0, 1234), 5);
    refused(&mut rig, control(137, 0, 0), 4);
    assert_eq!((tmcl(&mut rig, "GGP 79, 0"), tmcl(&mut rig, "GGP 82, 0"), tmcl(&mut rig, "GAP 6, 0")), (0, 0, 77));
    rig.wait(500);
    assert!(rig.eeprom() == before);
    assert_eq!(rig.starts, 1);
}

/// Programs, and what needs a link or restarts the firmware.
#[test]
fn nothing_is_loaded_or_run() {
    let mut rig = rig();
    let magic = Command::ENTER_BOOTLOADER;
    for command in [
        control(129, 0, 0),
        control(129, 1, 0),
        control(130, 0, 0),
        control(132, 0, 0),
        control(132, 0, 5000),
        control(133, 0, 0),
        control(134, 0, 0),
        control(138, 0, 1),
        control(139, 0, 0),
        control(255, 0, 1234),
        magic,
        control(magic.opcode, 0, 0),
        parsed("VECT 0, 5"),
        parsed("COMP 1"),
        parsed("WAIT TICKS, 0, 1"),
        parsed("STOP"),
        control(64, 0, 0),
    ] {
        refused(&mut rig, command, 6);
    }
    refused(&mut rig, control(99, 0, 0), 2);
    assert_eq!((tmcl(&mut rig, "GGP 128, 0"), tmcl(&mut rig, "GGP 129, 0")), (0, 0));
    tmcl(&mut rig, "MVP ABS, 0, 100");
    rig.wait(2_000);
    assert_eq!((tmcl(&mut rig, "GAP 1, 0"), rig.starts), (100, 1));
}

/// A command has seven bytes; what has not is not executed.
#[test]
fn commands_of_other_lengths() {
    let mut rig = rig();
    let bytes = &parsed("SGP 0, 2, 5").to_bytes()[..];
    for (length, segments, code) in [
        (Some(8), &[][..], TOO_LONG),
        (Some(4), &[][..], TOO_SHORT),
        (Some(7), &[&bytes[..3]][..], LENGTH),
        (None, &[&bytes[..6]][..], TOO_SHORT),
        (None, &[bytes, bytes][..], TOO_LONG),
    ] {
        // The last of two segments is the first that is too much.
        assert_eq!(write_in_segments(&mut rig, (0x1023, 1), length, segments), Err(code), "{length:?} {segments:?}");
    }
    assert_eq!(rig.download(0x1023, 1, &bytes[..4]), Err(TOO_SHORT));
    assert_eq!((rig.read(0x1023, 2), rig.upload(0x1023, 3)), (0, Ok(vec![0; 7])));
    assert_eq!(write_in_segments(&mut rig, (0x1023, 1), None, &[&bytes[..3], &bytes[3..]]), Ok(()));
    assert_eq!((rig.read(0x1023, 2), tmcl(&mut rig, "GGP 0, 2")), (1, 5));
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

/// Ten thousand commands of all kinds, most of them known ones with values that are in range now and then.
#[test]
fn each_command_gets_one_reply() {
    let mut random = Random(0x1023);
    let mut rig = rig();
    let before = rig.eeprom();
    let known: Vec<_> = (0..=u8::MAX).filter(|number| Opcode::from_number(*number).is_some()).collect();
    let (mut done, mut refused) = (0, 0);
    for _ in 0..10_000 {
        let opcode = if random.one_in(16) { random.next() as u8 } else { random.pick(&known) };
        let kind = if random.one_in(2) { random.next() as u8 } else { random.below(10) as u8 };
        let motor = if random.one_in(4) { random.next() as u8 } else { random.below(2) as u8 };
        let value = match random.below(4) {
            0 => random.next() as i32,
            1 => 1234,
            2 => random.below(3) as i32,
            _ => random.below(4096) as i32 - 2048,
        };
        let command = Command::new(opcode, kind, motor, value);
        let (status, reply) = execute(&mut rig, command);
        let text = opcode == 136 && reply.starts_with(b"1140");
        assert!(text || reply[0] == 1 && reply[2] == opcode, "{command}: {reply:?}");
        assert_eq!(status, if text || reply[1] == 100 { 1 } else { 3 }, "{command}: {reply:?}");
        if status == 1 {
            done += 1
        } else {
            refused += 1
        }
        rig.wait(random.below(3));
    }
    assert!(done > 1_000 && refused > 1_000, "{done} {refused}");
    assert!(rig.starts == 1 && rig.eeprom() == before);
    rig.command(0x81);
    rig.wait(2);
    assert_eq!((rig.starts, rig.is_energised(), rig.read(0x2700, 0)), (2, false, 0));
}
