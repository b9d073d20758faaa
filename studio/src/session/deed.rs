//! Deeds, which reach a virtual module from outside: a telegram, or a line of its control port. Each has a time of the
//! module.

use std::fmt;

use hal_sim::board::BoardKind;
use hal_sim::clock::{MICROSECOND, Nanos};
use hal_sim::control::{Control, Line};
use tmcm::tmcl::{Command, Opcode, SEARCH_STATUS, text};
use tmcm_sim::VirtualModule;
use tmcm_sim::client::Client;
use tmcm_sim::fleet::Fleet;
use tmcm_sim::protocol::Request;

/// Something that is done to a module, and when. Its text has the microseconds of the module's time, and behind them
/// the command or the line: `34500 ROR 0, 500`, `2000000 press left`.
#[derive(Clone, Debug)]
pub struct Deed {
    /// When, in nanoseconds of the module's time: whole microseconds.
    pub at: Nanos,
    /// The action.
    pub what: What,
}

/// An action on a module.
#[derive(Clone, Debug)]
pub enum What {
    /// A command, over the USB link.
    Command(Command),
    /// A line of the control port: as it was written, and what it means.
    Around(String, Around),
}

/// A line of the control port that changes something.
#[derive(Clone, Copy, Debug)]
pub enum Around {
    /// At once.
    Now(Line),
    /// When so much time has passed, in nanoseconds.
    Later(Nanos, Line),
}

impl Around {
    /// The change that a line makes; `None` of one that asks, or is about time.
    pub fn of(request: &Request) -> Option<Self> {
        match request {
            Request::World(Line { control: Control::State, .. }) => None,
            Request::World(line) => Some(Around::Now(*line)),
            Request::At { delay, line } => Some(Around::Later(*delay, *line)),
            _ => None,
        }
    }

    fn line(&self) -> &Line {
        let (Around::Now(line) | Around::Later(_, line)) = self;
        line
    }
}

impl What {
    /// Reads a command or a line.
    ///
    /// # Errors
    /// It is neither, or the board of this kind has not what it speaks of.
    pub fn parse(text: &str, kind: &'static BoardKind) -> Result<Self, String> {
        if !text.starts_with(|letter: char| letter.is_ascii_lowercase()) {
            return text::parse(text).map(What::Command).map_err(|error| format!("{text}: {error}"));
        }
        let request = Request::parse(text, &[kind])?;
        let around = Around::of(&request).ok_or_else(|| format!("'{text}' changes nothing around the module"))?;
        let Line { module, control } = around.line();
        if *module != 1 || *control == Control::State {
            return Err(format!("'{text}' changes nothing around this module"));
        }
        control.check(kind)?;
        Ok(What::Around(text.into(), around))
    }

    /// Does it. Gives who waits for the reply, if it is a command.
    pub fn carry_out(&self, fleet: &mut Fleet<impl VirtualModule>) -> Option<Client> {
        let done = match self {
            What::Command(command) => return Some(fleet.ask(0, *command)),
            What::Around(_, Around::Now(line)) => fleet.control(line).map(drop),
            What::Around(_, Around::Later(delay, line)) => fleet.at(*delay, *line),
        };
        debug_assert!(done.is_ok(), "it was checked before: {done:?}");
        None
    }

    /// Whether it only asks for something.
    pub fn only_reads(&self) -> bool {
        let What::Command(Command { opcode, kind, .. }) = self else { return false };
        match Opcode::from_number(*opcode) {
            Some(Opcode::Rfs) => *kind == SEARCH_STATUS,
            Some(opcode) => matches!(
                opcode,
                Opcode::Gap
                    | Opcode::Ggp
                    | Opcode::Gio
                    | Opcode::ReadMemory
                    | Opcode::ApplicationStatus
                    | Opcode::FirmwareVersion
            ),
            None => false,
        }
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            What::Command(command) => command.fmt(f),
            What::Around(text, _) => f.write_str(text),
        }
    }
}

impl fmt::Display for Deed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.at / MICROSECOND, self.what)
    }
}

impl Deed {
    /// Reads the text of a deed.
    ///
    /// # Errors
    /// It is none.
    pub fn parse(text: &str, kind: &'static BoardKind) -> Result<Self, String> {
        let none = || format!("'{text}' has no time in microseconds before it, such as '34500 ROR 0, 500'");
        let (at, what) = text.split_once(' ').ok_or_else(none)?;
        let at: u64 = at.parse().ok().filter(|_| at.bytes().all(|byte| byte.is_ascii_digit())).ok_or_else(none)?;
        Ok(Deed { at: at.checked_mul(MICROSECOND).ok_or_else(none)?, what: What::parse(what, kind)? })
    }
}

#[cfg(test)]
mod tests {
    use hal_sim::board::{TMCM_1140, TMCM_6110};

    use super::*;

    /// Whatever command it is, its text is read as the same command.
    #[test]
    fn commands_are_read_as_they_are_written() {
        for opcode in 0..=255 {
            for (kind, motor, value) in
                [(0, 0, 0), (1, 0, 0), (2, 2, 5), (255, 255, i32::MIN), (9, 5, i32::MAX), (7, 0, -1), (0, 1, 0)]
            {
                let command = Command { opcode, kind, motor, value };
                let text = Deed { at: 34_500_000, what: What::Command(command) }.to_string();
                let read = Deed::parse(&text, &TMCM_1140).unwrap();
                assert_eq!(read.at, 34_500_000);
                let What::Command(same) = read.what else { panic!("{text}") };
                assert_eq!(same, command, "{text}");
            }
        }
    }

    #[test]
    fn what_changes_nothing_or_is_not_there_is_none() {
        for text in ["5 press left 5", "5 at 2.5 ms power off", "0 fault eeprom on", "18446744073709 usb off"] {
            assert_eq!(Deed::parse(text, &TMCM_6110).unwrap().to_string(), text);
        }
        for (text, why) in [
            ("5 press left 5", "no axis 5"),
            ("5 state", "changes nothing"),
            ("5 pause", "changes nothing"),
            ("5 at 5 ms state", "changes nothing"),
            ("5 module 2 press left", "changes nothing around this module"),
            ("5 send ROR 0, 5", "changes nothing"),
            ("5 GOTO 1", "GOTO"),
            ("5", "no time in microseconds"),
            ("-5 MST 0", "no time in microseconds"),
            ("+5 MST 0", "no time in microseconds"),
            ("18446744073709551615 MST 0", "no time in microseconds"),
            ("", "no time in microseconds"),
        ] {
            let told = Deed::parse(text, &TMCM_1140).unwrap_err();
            assert!(told.contains(why), "{text}: {told}");
        }
    }
}
