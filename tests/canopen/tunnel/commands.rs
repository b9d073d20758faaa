//! The commands of TMCL mode: what the executor does, and what it refuses.

use super::{control, enter, execute, parsed, refused, rig, tmcl, value};
use crate::driving::SWITCH_ON_DISABLED;
use crate::rig::Rig;
use crate::sdo::{LENGTH, TOO_LONG, TOO_SHORT, write_in_segments};
use common::random::Random;
use tmcm::tmcl::{Command, Opcode};
use tmcm_sim::native::{FirmwareKind, Model};

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

/// Commands that need neither the EEPROM nor program memory nor a link.
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
