//! Replies of other modules, which a module hears if its own address is the one that replies go to: the host's
//! (parameter 76 on RS485, 70 on CAN). It must not take them for requests.
//!
//! A telegram does not say who has sent it. A reply (address, status, command number, value) has the form of a request
//! (command number, type, motor or bank, value). But where a reply has the number of a command, a request has a motor
//! or a bank, of which there are few. So most replies are known by their shape alone, however many hosts ask however
//! many modules at once. For the other replies the module remembers the requests to other modules:
//!
//! - A reply to one of the commands whose numbers could be motors or banks (0 to 3, and 255 for all motors) carries
//!   the value of its request.
//! - Where there are motors 4 and 5, so does a refusal of MVP and SAP; that these were executed is known by the shape.
//!   And where MVP COORD takes a set of axes, so does the refusal of a command from 64 on by module 4, the number of
//!   MVP.
//! - A command out of program memory, and the version in characters, have no shape. As long as a module has been asked
//!   for one and has not answered, a telegram is taken for this reply, unless it stops a motor or a program.
//!
//! Two cases remain in which the module is wrong. A request to this module that has the shape of a reply is lost. Its
//! type is the number of a status, and its motor or bank is of one of three kinds. It may not exist, so that the answer
//! would be status 4. It may be the number of a command that another module was asked to execute with the same value a
//! moment ago. That module has not answered, or several modules have its address in common. Or it is motor 4 or 5 with
//! type 100, 101 or 128, which no command has. And a reply to command 0, or to a telegram with a wrong checksum, is
//! taken for a request if its module was addressed by its second address. Neither can happen where the host has an
//! address of its own.

use heapless::Deque;

use crate::tmcl::{Command, FIRST_SET, Opcode, Status};
use crate::units::Micros;

/// How long a reply may keep the bus waiting: the longest telegram pause, some EEPROM pages, and the wire.
const PATIENCE: Micros = Micros::from_millis(400);

/// The number of requests that are remembered; of more the oldest are forgotten.
const OPEN: usize = 8;

/// Banks, and the motors of most products, have numbers below this: a request has one of 0 to 3 where a reply has the
/// number of a command.
const MOTORS: u8 = 4;

/// In place of a motor, 255 stands for all motors.
const ALL: u8 = 255;

/// A request to another module.
#[derive(Clone, Copy, Debug)]
struct Asked {
    at: Micros,
    /// The address that the request went to, on CAN the low byte of its identifier. The reply carries the same address,
    /// unless this is a second address, which several modules may have in common.
    address: u8,
    /// The command of the request; `None` if its checksum was wrong, so that nothing in it can be trusted.
    command: Option<Command>,
}

/// The requests to other modules whose replies could not be told from requests.
#[derive(Clone, Debug, Default)]
pub(super) struct Overheard {
    open: Deque<Option<Asked>, OPEN>,
}

/// How well a reply fits a request, in ascending order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    /// The telegram is no reply to this request.
    Not,
    /// The telegram may be a reply: the reply to this request can have any contents.
    Anything,
    /// The telegram is a reply, and may not be the only one: several modules may share the address of the request.
    Shared,
    /// The telegram is a reply, and comes from the address that the request went to.
    Own,
}

impl Overheard {
    /// Remembers a request to other modules; `None` stands for a command with a wrong checksum.
    pub(super) fn asked<const AXES: usize>(&mut self, now: Micros, address: u8, command: Option<Command>) {
        let unclear = |opcode| is_place(opcode) || is_motors::<AXES>(address, opcode);
        if command.is_some_and(|command| !unclear(command.opcode) && !is_special(command)) {
            return;
        }
        if self.open.is_full() {
            self.open.pop_front();
        }
        // The queue has room: if it was full, its oldest entry has just gone.
        let _ = self.open.push_back(Some(Asked { at: now, address, command }));
    }

    /// Whether the seven bytes that came to the host's address are another module's reply - address, status, command
    /// number and value - or its event of command 138. They are given as the command that they would be for this
    /// module, which has `AXES` axes. If they are no reply, they are a request.
    pub(super) fn is_reply<const AXES: usize>(&mut self, now: Micros, content: Command) -> bool {
        let Command { opcode: module, motor: opcode, .. } = content;
        let shaped = is_shaped::<AXES>(content);
        // Where its request was not remembered, the shape is all there is.
        if shaped && !is_motors::<AXES>(module, opcode) {
            return true;
        }
        let fit = |open: &Option<Asked>| open.map_or(Fit::Not, |asked| asked.fit(now, content));
        let Some(open) = self.open.iter_mut().max_by_key(|open| fit(open)) else { return shaped };
        let fit = fit(open);
        // The module that was asked answers once.
        if matches!(fit, Fit::Anything | Fit::Own) {
            *open = None;
        }
        shaped || fit != Fit::Not
    }
}

impl Asked {
    fn fit(&self, now: Micros, content: Command) -> Fit {
        let Command { opcode: module, kind: status, motor: opcode, value } = content;
        let Asked { at, address, command } = *self;
        // MVP has the target for an answer, which is not always what was asked for.
        let echo = |asked: Command| opcode == asked.opcode && (value == asked.value || opcode == Opcode::Mvp as u8);
        let plain = match command {
            None => status == Status::WrongChecksum as u8 && echo(Command::default()),
            Some(command) => Status::from_number(status).is_some() && echo(command),
        };
        match command {
            _ if now.since(at) > PATIENCE => Fit::Not,
            _ if plain && module == address => Fit::Own,
            // Nearly every request has motor 0, so 0 in the place of a command's number shows nothing.
            _ if plain && opcode != 0 => Fit::Shared,
            // A command that stops something is obeyed, even if it may have been read out of another module's program.
            Some(Command { opcode, .. }) if opcode == Opcode::ReadMemory as u8 && !stops(content) => Fit::Anything,
            Some(command) if is_special(command) && content.to_bytes().iter().all(u8::is_ascii_graphic) => Fit::Shared,
            _ => Fit::Not,
        }
    }
}

/// Whether a command stops something: MST, RFS STOP, stop application.
const fn stops(command: Command) -> bool {
    let Command { opcode, kind, .. } = command;
    opcode == Opcode::Mst as u8 || opcode == Opcode::StopApplication as u8 || opcode == Opcode::Rfs as u8 && kind == 1
}

/// Whether seven bytes have the shape of a reply, and cannot be a request to a module of `AXES` axes.
const fn is_shaped<const AXES: usize>(content: Command) -> bool {
    let Command { opcode: module, kind: status, motor: opcode, .. } = content;
    match Status::from_number(status) {
        None => false,
        _ if is_place(opcode) => false,
        // No command for a motor has a type of such a number.
        Some(Status::Ok | Status::Loaded | Status::PositionReached) => true,
        // The only command for a set of axes is MVP COORD, whose type, 2, is the number of this status.
        Some(Status::InvalidCommand) => !is_motors::<AXES>(module, opcode),
        Some(_) => !is_motor::<AXES>(opcode),
    }
}

/// Whether this number of a command could be that of a motor above those that all products have. In the place of the
/// motor in MVP, which the number of the module would be, it could also be a set of axes.
const fn is_motors<const AXES: usize>(module: u8, opcode: u8) -> bool {
    is_motor::<AXES>(opcode) || AXES > 1 && module == Opcode::Mvp as u8 && opcode >= FIRST_SET
}

/// Whether this number of a command could be that of a motor above those that all products have.
const fn is_motor<const AXES: usize>(opcode: u8) -> bool {
    opcode >= MOTORS && (opcode as usize) < AXES
}

/// Whether this number of a command could be that of a motor or a bank.
const fn is_place(opcode: u8) -> bool {
    opcode < MOTORS || opcode == ALL
}

/// Whether the reply to this command does not have the form of others.
fn is_special(command: Command) -> bool {
    let Command { opcode, kind, .. } = command;
    opcode == Opcode::ReadMemory as u8 || opcode == Opcode::FirmwareVersion as u8 && kind == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    const AT: fn(u64) -> Micros = Micros::from_millis;

    fn is_reply(overheard: &mut Overheard, at: Micros, content: [u8; Command::SIZE]) -> bool {
        overheard.is_reply::<1>(at, Command::from_bytes(content))
    }

    #[test]
    fn most_replies_have_a_shape() {
        let mut overheard = Overheard::default();
        for reply in [[3, 100, 6, 0, 0, 0, 9], [3, 2, 17, 0, 0, 0, 0], [3, 128, 138, 0, 0, 0, 1], [3, 4, 4, 0, 0, 0, 0]]
        {
            assert!(is_reply(&mut overheard, AT(0), reply));
        }
        // MVP REL, GAP 100, SIO 1 of bank 2, SCO 1 of all motors, and what asks for the boot loader.
        for request in [
            [4, 1, 0, 0, 0, 0, 9],
            [6, 100, 0, 0, 0, 0, 0],
            [14, 1, 2, 0, 0, 0, 1],
            [30, 1, 255, 0, 0, 0, 0],
            [242, 129, 146, 0xA3, 0xB4, 0xC5, 0xD6],
        ] {
            assert!(!is_reply(&mut overheard, AT(0), request));
        }
    }

    /// With six axes there are requests where with one there are replies.
    #[test]
    fn with_six_axes_refusals_of_mvp_and_sap_have_no_shape() {
        let mut overheard = Overheard::default();
        // Who has been asked nothing does not refuse anything: these are SAP 4 and MVP REL of axes 4 and 5, and MVP
        // COORD of sets of axes.
        for request in
            [[5, 4, 5, 0, 0, 3, 4], [4, 1, 4, 0, 0, 0, 9], [4, 2, 0x47, 0, 0, 0, 1], [4, 2, 0x87, 0, 0, 0, 1]]
        {
            let content = Command::from_bytes(request);
            assert!(overheard.is_reply::<1>(AT(0), content) && !overheard.is_reply::<6>(AT(0), content), "{request:?}");
        }
        // What was executed is known, and so is what is no set of axes.
        for reply in
            [[5, 100, 5, 0, 0, 3, 4], [4, 101, 4, 0, 0, 0, 9], [4, 4, 0x47, 0, 0, 0, 1], [3, 2, 0x47, 0, 0, 0, 1]]
        {
            assert!(overheard.is_reply::<6>(AT(1), Command::from_bytes(reply)), "{reply:?}");
        }
        for (address, asked, reply) in [
            (5, Command::new(5, 0, 0, 772), [5, 4, 5, 0, 0, 3, 4]),
            (4, Command::new(4, 1, 0, -9), [4, 1, 4, 0, 0, 0, 9]),
            (4, Command::new(0x47, 0, 0, 1), [4, 2, 0x47, 0, 0, 0, 1]),
        ] {
            overheard.asked::<6>(AT(2), address, Some(asked));
            let content = Command::from_bytes(reply);
            assert!(overheard.is_reply::<6>(AT(3), content), "{reply:?}");
            assert!(!overheard.is_reply::<6>(AT(4), content), "it has answered: {reply:?}");
        }
        // What was executed is an answer, too.
        overheard.asked::<6>(AT(5), 5, Some(Command::new(5, 0, 0, 772)));
        assert!(overheard.is_reply::<6>(AT(6), Command::from_bytes([5, 100, 5, 0, 0, 3, 4])));
        assert!(!overheard.is_reply::<6>(AT(7), Command::from_bytes([5, 4, 5, 0, 0, 3, 4])));
    }

    #[test]
    fn the_others_fit_what_was_asked() {
        let mut overheard = Overheard::default();
        let reply = |module, value| [module, 100, 2, 0, 0, 0, value];
        overheard.asked::<1>(AT(0), 9, Some(Command::new(2, 0, 0, 100)));
        overheard.asked::<1>(AT(1), 8, Some(Command::new(2, 0, 0, 100)));
        assert!(!is_reply(&mut overheard, AT(2), reply(9, 99)), "another value");
        assert!(is_reply(&mut overheard, AT(3), reply(9, 100)));
        assert!(is_reply(&mut overheard, AT(4), reply(7, 100)), "7 may have 8 for a second address");
        assert!(is_reply(&mut overheard, AT(5), reply(8, 100)));
        assert!(!is_reply(&mut overheard, AT(6), reply(9, 100)), "both have answered");
        overheard.asked::<1>(AT(10), 9, Some(Command::new(2, 0, 0, 100)));
        assert!(!is_reply(&mut overheard, AT(411), reply(9, 100)), "nobody waits that long");
    }

    #[test]
    fn the_reply_to_nothing_comes_from_who_was_asked() {
        let mut overheard = Overheard::default();
        overheard.asked::<1>(AT(0), 3, None);
        for request in [[6, 1, 0, 0, 0, 0, 0], [3, 2, 0, 0, 0, 0, 0], [3, 1, 0, 0, 0, 0, 1]] {
            assert!(!is_reply(&mut overheard, AT(1), request));
        }
        assert!(is_reply(&mut overheard, AT(2), [3, 1, 0, 0, 0, 0, 0]));
        overheard.asked::<1>(AT(3), 6, Some(Command::new(0, 0, 0, 0)));
        assert!(!is_reply(&mut overheard, AT(4), [5, 4, 0, 0, 0, 0, 0]));
        assert!(is_reply(&mut overheard, AT(5), [6, 2, 0, 0, 0, 0, 0]));
    }

    #[test]
    fn special_replies_are_expected() {
        let mut overheard = Overheard::default();
        assert!(!is_reply(&mut overheard, AT(0), *b"1234V14"));
        overheard.asked::<1>(AT(1), 3, Some(Command::new(136, 0, 0, 0)));
        assert!(is_reply(&mut overheard, AT(2), *b"1234V14"));
        assert!(!is_reply(&mut overheard, AT(4), [136, 0, 0, 0, 0, 0, 0]), "it scans the bus");
        overheard.asked::<1>(AT(5), 3, Some(Command::new(134, 0, 0, 0)));
        for stop in [[3, 0, 0, 0, 0, 0, 0], [13, 1, 0, 0, 0, 0, 0], [128, 0, 0, 0, 0, 0, 0]] {
            assert!(!is_reply(&mut overheard, AT(5), stop));
        }
        assert!(is_reply(&mut overheard, AT(6), [5, 4, 0, 0, 0, 0, 9]));
        assert!(!is_reply(&mut overheard, AT(7), [5, 4, 0, 0, 0, 0, 9]));
    }
}
