//! TMCL mode (2700h, 1023h): how it is entered and left, and what the executor does in it.

mod commands;
mod entering;

use crate::driving::SWITCH_ON_DISABLED;
use crate::rig::Rig;
use crate::sdo::write_in_segments;
use tmcm::tmcl::{Command, text};

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

fn value_of(rig: &mut Rig, parameter: u8) -> i32 {
    value(rig, Command::new(6, parameter, 0, 0))
}
