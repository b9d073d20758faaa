//! The ASCII interface (manual section 3.4): lines that a person types at a terminal, and replies as text.
//!
//! A line starts with the address character and ends with CR: `AGAP 0, 1`. [`Editor`] makes lines out of
//! characters and gives the echo; [`Line::parse`] decodes a line; [`encode_reply`] writes the reply to it.
//!
//! Where the manual leaves the behaviour open, it is as follows. BIN is answered, as text, because it was sent as text.
//! RUN and STOP are commands 129 and 128. A line with a command number in place of the mnemonic is refused. The reply
//! to a line that cannot be read has the value 0.

use core::fmt::Write;

use heapless::Vec;

use super::text::{self, Error};
use super::{Command, Field, Opcode, Reply, Status};

/// Longest line in characters, with its address character and without its CR.
pub const LINE: usize = 80;

/// Length of the longest reply in characters: `BA 100 -2147483648` and CR.
pub const REPLY: usize = 19;

const BACKSPACE: u8 = 0x08;
const DELETE: u8 = 0x7F;
/// Echo that makes a terminal delete the last character: back, a space, back.
const RUB_OUT: &[u8] = b"\x08 \x08";

/// The character of an address: A for 1, B for 2 and so on to `~` for 62. The manual has no characters for higher
/// addresses; they share the question mark.
pub const fn letter(address: u8) -> u8 {
    if address <= b'~' - b'@' { b'@'.wrapping_add(address) } else { b'?' }
}

/// True when a character addresses a module with one of these two addresses; 0 stands for no address. Addresses 1 to 26
/// also accept their letter in lower case, which is the character of the address 32 higher. On a bus with modules of
/// both addresses a host has to use the upper-case letter.
fn addresses(character: u8, addresses: [u8; 2]) -> bool {
    let mut letters = addresses.into_iter().filter(|address| *address != 0).map(letter);
    letters.any(|letter| letter == character || letter == character.to_ascii_uppercase())
}

/// A line in ASCII mode, decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// A command; RUN and STOP give commands 129 and 128.
    Command(Command),
    /// BIN: the link goes back to binary mode.
    Leave,
    /// The line is refused.
    Wrong {
        /// Status of the reply.
        status: Status,
        /// Number of the command if the mnemonic was recognised, else 0.
        opcode: u8,
    },
}

impl Line {
    /// A line whose command is unknown.
    const UNKNOWN: Line = Line::Wrong { status: Status::InvalidCommand, opcode: 0 };

    /// Decodes a line from which the address character has been removed.
    pub fn parse(text: &[u8]) -> Self {
        let Ok(text) = core::str::from_utf8(text).map(str::trim) else { return Line::UNKNOWN };
        let special = |word: &str| text.eq_ignore_ascii_case(word);
        if special("BIN") {
            return Line::Leave;
        }
        if special("RUN") {
            return Line::Command(Command::new(Opcode::RunApplication as u8, 0, 0, 0));
        }
        if special("STOP") {
            return Line::Command(Command::new(Opcode::StopApplication as u8, 0, 0, 0));
        }
        // `text::parse` would accept a command number in place of the mnemonic, which the ASCII interface does not
        // have.
        if !text.starts_with(|c: char| c.is_ascii_alphabetic()) {
            return Line::UNKNOWN;
        }
        match text::parse(text) {
            Ok(command) if Opcode::from_number(command.opcode).is_some_and(|o| o.instruction().ascii) => {
                Line::Command(command)
            }
            Ok(Command { opcode, .. }) => Line::Wrong { status: Status::NotAvailable, opcode },
            Err(error) => wrong(&error),
        }
    }
}

/// The refusal of a line that cannot be read. Its status is 2 for an unknown command, 6 for a command that the ASCII
/// command line does not have, 3 for a wrong type. It is 4 for a wrong motor, bank or value, and for an operand too
/// many.
fn wrong(error: &Error<'_>) -> Line {
    let (instruction, field) = match *error {
        Error::Empty | Error::UnknownMnemonic(_) => return Line::UNKNOWN,
        Error::Missing(instruction, field)
        | Error::BadOperand(instruction, field, _)
        | Error::OutOfRange(instruction, field, _) => (instruction, field),
        Error::Unexpected(instruction, _) => (instruction, Field::Value),
    };
    let status = match field {
        _ if !instruction.ascii => Status::NotAvailable,
        Field::Kind | Field::Named(_) => Status::WrongType,
        Field::Motor | Field::Value | Field::Zero => Status::InvalidValue,
    };
    Line::Wrong { status, opcode: instruction.opcode as u8 }
}

/// A reply as text: the characters of host and module, status, value, CR (manual section 3.4.3).
pub fn encode_reply(host: u8, module: u8, reply: &Reply) -> Vec<u8, REPLY> {
    let (status, value) = match *reply {
        Reply::Plain { status, value, .. } => (status, value),
        // These replies belong to commands that the ASCII command line does not have.
        Reply::Version(_) | Reply::Memory(_) => (Status::NotAvailable, 0),
    };
    let mut text = Vec::new();
    // Writing cannot fail, because no reply has more than REPLY characters.
    let _ = text.extend_from_slice(&[letter(host), letter(module)]);
    let _ = write!(text, " {} {value}\r", status as u8);
    text
}

/// True for a module's reply from which the host's address character has been removed. A module that has the host's
/// address on a shared bus receives the replies of other modules as lines addressed to itself, and must ignore them.
fn is_reply(text: &[u8]) -> bool {
    let digits = |word: &[u8]| !word.is_empty() && word.iter().all(u8::is_ascii_digit);
    let [_, b' ', numbers @ ..] = text else { return false };
    let mut words = numbers.split(|byte| *byte == b' ');
    let (Some(status), Some(value), None) = (words.next(), words.next(), words.next()) else { return false };
    digits(status) && digits(value.strip_prefix(b"-").unwrap_or(value))
}

/// The echo of a module: bits 4 and 5 of global parameter 67 (manual section 3.4.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Echo {
    /// Each character as it arrives.
    #[default]
    Characters,
    /// The whole line, after its CR.
    Line,
    /// Nothing.
    None,
}

impl Echo {
    /// The echo that parameter 67 with this value asks for. Both bits set, which the manual leaves open, give no echo.
    pub const fn from_parameter(value: i32) -> Self {
        match value >> 4 & 3 {
            0 => Echo::Characters,
            1 => Echo::Line,
            _ => Echo::None,
        }
    }

    /// The echo of a module with the addresses `own` on a bus with other modules. If one of them is the host's
    /// address, a reply of another module looks like a line for this module until the CR, so nothing is echoed before
    /// the CR.
    #[must_use]
    pub fn among_others(self, own: [u8; 2], host: u8) -> Self {
        if self == Echo::Characters && addresses(letter(host), own) { Echo::Line } else { self }
    }
}

/// The effect of a character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Typed<'a> {
    /// Characters to be sent back.
    pub echo: &'a [u8],
    /// The line, if the character has completed one.
    pub line: Option<Line>,
}

/// Makes lines out of characters. Backspace and DEL delete the last character; LF and NUL are ignored. An empty line,
/// a line for another address and a reply of another module are neither returned nor echoed.
#[derive(Clone, Debug, Default)]
pub struct Editor {
    /// The first [`LINE`] characters of the line; with its CR once the line is complete.
    text: Vec<u8, { LINE + 1 }>,
    /// Number of characters in the line, also of those that did not fit `text`.
    length: usize,
    last: u8,
    complete: bool,
}

impl Editor {
    /// An editor with an empty line.
    pub const fn new() -> Self {
        Editor { text: Vec::new(), length: 0, last: 0, complete: false }
    }

    /// Takes one character that a module with the addresses `own` has received; 0 stands for no address.
    pub fn push(&mut self, character: u8, own: [u8; 2], echo: Echo) -> Typed<'_> {
        if core::mem::take(&mut self.complete) {
            self.text.clear();
            self.length = 0;
        }
        match character {
            b'\n' | 0 => return Typed::default(),
            b'\r' => return self.complete(own, echo),
            BACKSPACE | DELETE => {
                if self.length == 0 {
                    return Typed::default();
                }
                // Deleting the address character is echoed, too, although the line is then no longer for this module.
                let addressed = self.addressed(own);
                self.length = self.length.saturating_sub(1);
                self.text.truncate(self.length);
                let echo = if addressed && echo == Echo::Characters { RUB_OUT } else { &[] };
                return Typed { echo, line: None };
            }
            b'\t' => self.last = b' ',
            _ => self.last = character,
        }
        self.length = self.length.saturating_add(1);
        if self.text.len() < LINE {
            let _ = self.text.push(self.last);
        }
        let echoed = echo == Echo::Characters && self.addressed(own);
        Typed { echo: if echoed { core::slice::from_ref(&self.last) } else { &[] }, line: None }
    }

    fn addressed(&self, own: [u8; 2]) -> bool {
        self.text.first().is_some_and(|first| addresses(*first, own))
    }

    fn complete(&mut self, own: [u8; 2], echo: Echo) -> Typed<'_> {
        self.complete = true;
        let (Some((first, rest)), fits) = (self.text.split_first(), self.length <= LINE) else {
            return Typed::default();
        };
        if !addresses(*first, own) || is_reply(rest) {
            return Typed::default();
        }
        let line = if fits { Line::parse(rest) } else { Line::UNKNOWN };
        // The CR fits: `push` stores LINE characters at most, one less than the capacity.
        let _ = self.text.push(b'\r');
        let echo = match echo {
            Echo::Characters => b"\r",
            Echo::Line => self.text.as_slice(),
            Echo::None => &[],
        };
        Typed { echo, line: Some(line) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Types text at a module with address 1; returns all that was echoed, and the lines.
    fn typed(editor: &mut Editor, text: &[u8], echo: Echo) -> (std::vec::Vec<u8>, std::vec::Vec<Line>) {
        let (mut echoed, mut lines) = (std::vec::Vec::new(), std::vec::Vec::new());
        for character in text {
            let typed = editor.push(*character, [1, 0], echo);
            echoed.extend_from_slice(typed.echo);
            lines.extend(typed.line);
        }
        (echoed, lines)
    }

    fn lines(text: &[u8]) -> std::vec::Vec<Line> {
        typed(&mut Editor::new(), text, Echo::None).1
    }

    const GAP: Line = Line::Command(Command::new(6, 1, 0, 0));

    #[test]
    fn the_editor_edits() {
        assert_eq!(lines(b"AGAP 1, 0\r"), [GAP]);
        assert_eq!(lines(b"A   gap\t1,0 \r\naGAP, 1\r\n"), [GAP, GAP]);
        assert_eq!(lines(b"ASAO\x08\x7F\x08GAP 1, 9\x080\r"), [GAP]);
        // Backspace at the start of the line has no effect; it can also delete the address character.
        assert_eq!(lines(b"\x08\x08BSA\x08\x08\x08\x08\x08AGAP 1\r"), [GAP]);
        assert_eq!(lines(b"BGAP 1\r\r\n\r GAP 1\r A GAP 1\r@GAP 1\r"), []);
        // Replies of other modules to a host with this module's address, and lines that only look like replies.
        assert_eq!(lines(b"AB 100 -5000\rAB 2 0\r"), []);
        assert_eq!(lines(b"AB 100 -\rAB 100\rAB 1 2 3\r"), [Line::UNKNOWN; 3]);
        assert_eq!(lines(b"Abin\rA BIN \r"), [Line::Leave, Line::Leave]);
        assert_eq!(lines(b"ASTOP\r"), [Line::Command(Command::new(128, 0, 0, 0))]);
        assert_eq!(lines(b"ARUN\r"), [Line::Command(Command::new(129, 0, 0, 0))]);
    }

    #[test]
    fn long_lines_end_and_can_be_shortened() {
        let long = [b"AGAP 1".as_slice(), &[b' '; 200]].concat();
        let wrong = Line::UNKNOWN;
        assert_eq!(lines(&[&long, b"\rAGAP 1\r".as_slice()].concat()), [wrong, GAP]);
        assert_eq!(lines(&[&long, [0x7F; 200].as_slice(), b",0\r"].concat()), [GAP]);
        let longest = |spaces| [b"AGAP 1".as_slice(), &[b' '].repeat(spaces), b"\r"].concat();
        assert_eq!(lines(&longest(LINE - 6)), [GAP]);
        assert_eq!(lines(&longest(LINE - 5)), [wrong]);
        let (echo, _) = typed(&mut Editor::new(), &longest(LINE), Echo::Line);
        assert_eq!(echo.len(), LINE + 1);
    }

    #[test]
    fn echo_is_for_those_addressed() {
        let mut editor = Editor::new();
        let text = b"AGAQ\x08P 1\r\nBX\x08\x08\x08AB\x7F\x7FA\r\rBGAP 1\r";
        let (echo, _) = typed(&mut editor, text, Echo::Characters);
        assert_eq!(echo, b"AGAQ\x08 \x08P 1\rAB\x08 \x08\x08 \x08A\r");
        let (echo, _) = typed(&mut editor, text, Echo::Line);
        assert_eq!(echo, b"AGAP 1\rA\r");
        let (echo, _) = typed(&mut editor, text, Echo::None);
        assert_eq!(echo, b"");
        let modes = [0, 1, 16, 17, 32, 33, 48, 63].map(Echo::from_parameter);
        let [each, line, none] = [Echo::Characters, Echo::Line, Echo::None];
        assert_eq!(modes, [each, each, line, line, none, none, none, none]);
    }

    #[test]
    fn addresses_have_characters() {
        assert_eq!([1, 2, 26, 33, 62, 63, 255].map(letter), *b"ABZa~??");
        let mut editor = Editor::new();
        for (character, addressed) in [(b'B', true), (b'b', true), (b'E', true), (b'A', false), (b'@', false)] {
            assert_eq!(editor.push(character, [2, 5], Echo::Characters).echo.len(), usize::from(addressed));
            editor.push(b'\r', [2, 5], Echo::Characters);
        }
        assert!(editor.push(b'@', [1, 0], Echo::Characters).echo.is_empty(), "0 is no address");
    }

    #[test]
    fn a_mistake_in_a_line_has_its_status() {
        for (text, status) in [
            ("", Status::InvalidCommand),
            ("  ", Status::InvalidCommand),
            ("GOTO 1", Status::InvalidCommand),
            ("6, 1, 0", Status::InvalidCommand),
            ("-", Status::InvalidCommand),
            ("G\u{e4}P", Status::InvalidCommand),
            ("CALC ADD, 1", Status::NotAvailable),
            ("CALC", Status::NotAvailable),
            ("JA 5, 6", Status::NotAvailable),
            ("STOP 1", Status::NotAvailable),
            ("GAP", Status::WrongType),
            ("GAP x, 0", Status::WrongType),
            ("MVP UP, 0, 1", Status::WrongType),
            ("GAP 256, 0", Status::WrongType),
            ("GAP 1, x", Status::InvalidValue),
            ("GAP 1, 256", Status::InvalidValue),
            ("GAP 1, 0, 0", Status::InvalidValue),
            ("SAP 4, 0", Status::InvalidValue),
            ("SAP 4, 0, 4294967296", Status::InvalidValue),
        ] {
            let Line::Wrong { status: told, .. } = Line::parse(text.as_bytes()) else { panic!("{text}") };
            assert_eq!(told, status, "{text}");
        }
        assert_eq!(Line::parse(b"GAP\xFF"), Line::UNKNOWN);
        assert_eq!(Line::parse(b"GAP x"), Line::Wrong { status: Status::WrongType, opcode: 6 });
    }

    #[test]
    fn replies_in_digits() {
        let reply = |status, value| Reply::Plain { status, opcode: 6, value };
        assert_eq!(encode_reply(2, 1, &reply(Status::Ok, -5000)), *b"BA 100 -5000\r");
        assert_eq!(encode_reply(0, 26, &reply(Status::WrongType, 0)), *b"@Z 3 0\r");
        assert_eq!(encode_reply(2, 1, &reply(Status::PositionReached, i32::MIN)).len(), REPLY);
    }
}
