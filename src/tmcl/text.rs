//! Commands as text, such as `MVP ABS, 0, 90000`: reading and writing of the form that the manual, the ASCII command
//! line and program listings use.

use core::fmt;

use super::{Command, Field, Instruction, Opcode};

/// The reason why a line cannot be read as a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<'a> {
    /// The line is empty.
    Empty,
    /// No command has this mnemonic.
    UnknownMnemonic(&'a str),
    /// The operand for this field is missing.
    Missing(&'static Instruction, Field),
    /// The operand is one too many.
    Unexpected(&'static Instruction, &'a str),
    /// The operand for this field is neither a number nor a name that the command knows.
    BadOperand(&'static Instruction, Field, &'a str),
    /// The number for this field is too large or too small.
    OutOfRange(&'static Instruction, Field, &'a str),
}

impl Error<'_> {
    /// The instruction whose usage helps, if there is one.
    pub fn usage(&self) -> Option<&'static Instruction> {
        match self {
            Error::Empty | Error::UnknownMnemonic(_) => None,
            Error::Missing(i, ..) | Error::Unexpected(i, ..) | Error::BadOperand(i, ..) | Error::OutOfRange(i, ..) => {
                Some(i)
            }
        }
    }
}

/// The message for the user; in its alternate form (`{:#}`) without the usage behind it.
impl fmt::Display for Error<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Empty => write!(f, "no command; try GAP 1, 0")?,
            Error::UnknownMnemonic(word) => write!(f, "unknown command '{word}'")?,
            Error::Missing(i, field) => write!(f, "{}: missing {}", i.mnemonic, FieldName(*field))?,
            Error::Unexpected(i, word) => write!(f, "{}: '{word}' is one operand too many", i.mnemonic)?,
            Error::BadOperand(i, _, word) => {
                write!(f, "{}: '{word}' is neither a number nor a known name", i.mnemonic)?;
            }
            Error::OutOfRange(i, _, word) => write!(f, "{}: {word} is out of range", i.mnemonic)?,
        }
        match self.usage().filter(|_| !f.alternate()) {
            Some(usage) => write!(f, "; usage: {usage}"),
            None => Ok(()),
        }
    }
}

impl core::error::Error for Error<'_> {}

/// A field as usage lines show it.
struct FieldName(Field);

impl fmt::Display for FieldName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Field::Kind => f.write_str("<type>"),
            Field::Motor => f.write_str("<motor or bank>"),
            Field::Value => f.write_str("<value>"),
            Field::Zero => f.write_str("0"),
            Field::Named(names) => {
                f.write_str("<")?;
                for (i, name) in names.iter().enumerate() {
                    write!(f, "{}{name}", if i == 0 { "" } else { "|" })?;
                }
                f.write_str(">")
            }
        }
    }
}

/// The usage line of an instruction: mnemonic and operands.
impl fmt::Display for Instruction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.mnemonic)?;
        for (i, field) in self.operands().iter().enumerate() {
            write!(f, "{}{}", if i == 0 { " " } else { ", " }, FieldName(*field))?;
        }
        Ok(())
    }
}

/// The mnemonic form of a command. A command without a mnemonic, or with a value in a field that the mnemonic form does
/// not show, is written as four numbers. Both forms read back as the same command.
impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let instruction = Opcode::from_number(self.opcode).map(Opcode::instruction).filter(|i| i.tells(self));
        let Some(instruction) = instruction else {
            return write!(f, "{}, {}, {}, {}", self.opcode, self.kind, self.motor, self.value);
        };
        f.write_str(instruction.mnemonic)?;
        for (i, field) in instruction.operands().iter().enumerate() {
            f.write_str(if i == 0 { " " } else { ", " })?;
            match field {
                Field::Kind => write!(f, "{}", self.kind)?,
                Field::Motor => write!(f, "{}", self.motor)?,
                Field::Value => write!(f, "{}", self.value)?,
                Field::Zero => {}
                Field::Named(names) => match names.get(usize::from(self.kind)) {
                    Some(name) => f.write_str(name)?,
                    None => write!(f, "{}", self.kind)?,
                },
            }
        }
        Ok(())
    }
}

/// Reads one command. Operands are separated by commas, with any spaces around them; a comma right after the mnemonic
/// is tolerated. A motor at the end may be left out (`MST` means `MST 0`). The 0 that the manual prints behind the
/// operands of some commands may be written (`STAP 4, 0, 0`). A user function takes up to three operands. Numbers are
/// decimal, or hexadecimal after `$` or `0x`. A line may also have the command number in place of the mnemonic,
/// followed by up to three numbers for type, motor and value; numbers left out are 0.
///
/// # Errors
/// The line is no command; see [`Error`].
pub fn parse(line: &str) -> Result<Command, Error<'_>> {
    let line = line.trim();
    let end = line.find(|c: char| c.is_whitespace() || c == ',');
    let (mnemonic, rest) = end.and_then(|end| line.split_at_checked(end)).unwrap_or((line, ""));
    if mnemonic.is_empty() {
        return Err(Error::Empty);
    }
    let rest = rest.trim_start();
    let rest = rest.strip_prefix(',').unwrap_or(rest).trim();
    // The separator is a set of one character, because splitting at a plain `char` compiles to code that can panic, and
    // the core must not contain any.
    let mut operands = rest.split([',']).map(str::trim).filter(|_| !rest.is_empty());
    if let Some(number) = number(mnemonic) {
        return numeric(mnemonic, number, operands);
    }
    let instruction = Instruction::by_mnemonic(mnemonic).ok_or(Error::UnknownMnemonic(mnemonic))?;
    let mut command = Command { opcode: instruction.opcode as u8, ..Command::default() };
    for (i, field) in instruction.fields.iter().enumerate() {
        let Some(word) = operands.next() else {
            if i >= instruction.required() {
                break;
            }
            return Err(Error::Missing(instruction, *field));
        };
        fill(&mut command, instruction, *field, word)?;
    }
    match operands.next() {
        Some(word) => Err(Error::Unexpected(instruction, word)),
        None => Ok(command),
    }
}

/// Sets a field of the command to the value of an operand.
fn fill<'a>(
    command: &mut Command,
    instruction: &'static Instruction,
    field: Field,
    word: &'a str,
) -> Result<(), Error<'a>> {
    let named = match field {
        Field::Named(names) => names.iter().position(|name| name.eq_ignore_ascii_case(word)),
        Field::Kind | Field::Motor | Field::Value | Field::Zero => None,
    };
    let value = match named {
        Some(position) => position as i64,
        None => number(word).ok_or(Error::BadOperand(instruction, field, word))?,
    };
    let out_of_range = Error::OutOfRange(instruction, field, word);
    match field {
        Field::Kind | Field::Named(_) => command.kind = u8::try_from(value).map_err(|_| out_of_range)?,
        Field::Motor => command.motor = u8::try_from(value).map_err(|_| out_of_range)?,
        Field::Value => command.value = value_field(value).ok_or(out_of_range)?,
        Field::Zero if value == 0 => {}
        Field::Zero => return Err(Error::Unexpected(instruction, word)),
    }
    Ok(())
}

/// Reads a command whose four fields are numbers; `word` is the first number as it is written.
fn numeric<'a>(word: &'a str, opcode: i64, operands: impl Iterator<Item = &'a str>) -> Result<Command, Error<'a>> {
    let mut fields = [opcode, 0, 0, 0];
    let mut rest = fields.iter_mut().skip(1);
    for operand in operands {
        let field = rest.next().ok_or(Error::UnknownMnemonic(word))?;
        *field = number(operand).ok_or(Error::UnknownMnemonic(word))?;
    }
    let [opcode, kind, motor, value] = fields;
    let byte = |n: i64| u8::try_from(n).map_err(|_| Error::UnknownMnemonic(word));
    Ok(Command {
        opcode: byte(opcode)?,
        kind: byte(kind)?,
        motor: byte(motor)?,
        value: value_field(value).ok_or(Error::UnknownMnemonic(word))?,
    })
}

/// The value field for a number, which may be written signed or unsigned: -2147483648..=4294967295.
fn value_field(value: i64) -> Option<i32> {
    i32::try_from(value).ok().or_else(|| u32::try_from(value).ok().map(u32::cast_signed))
}

/// The value of a decimal or hexadecimal number with at most one sign.
fn number(word: &str) -> Option<i64> {
    let (negative, digits) = match word.strip_prefix('-') {
        Some(rest) => (true, rest.trim_start()),
        None => (false, word.strip_prefix('+').unwrap_or(word)),
    };
    let hex = digits.strip_prefix('$').or_else(|| digits.strip_prefix("0x")).or_else(|| digits.strip_prefix("0X"));
    let magnitude = match hex {
        // `from_str_radix` would accept a second sign, so the digits are checked first.
        Some(hex) if hex.bytes().all(|digit| digit.is_ascii_hexdigit()) => u32::from_str_radix(hex, 16).ok()?,
        None if digits.bytes().all(|digit| digit.is_ascii_digit()) => digits.parse::<u32>().ok()?,
        _ => return None,
    };
    Some(if negative { i64::from(magnitude).wrapping_neg() } else { i64::from(magnitude) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_commands_in_all_their_spellings() {
        let gap = Command::new(6, 1, 0, 0);
        for line in ["GAP 1, 0", "gap 1,0", "GAP, 1, 0", "  GAP   1 ,0 ", "GAP 1", "6, 1, 0, 0", "6 1"] {
            assert_eq!(parse(line), Ok(gap), "{line}");
        }
        assert_eq!(parse("MVP REL, 0, -10000"), Ok(Command::new(4, 1, 0, -10_000)));
        assert_eq!(parse("MVP 1, 0, $FFFFD8F0"), Ok(Command::new(4, 1, 0, -10_000)));
        assert_eq!(parse("MST"), Ok(Command::new(3, 0, 0, 0)));
        assert_eq!(parse("UF0"), Ok(Command::new(64, 0, 0, 0)));
        assert_eq!(parse("UF7 1, 2"), Ok(Command::new(71, 1, 2, 0)));
        assert_eq!(parse("136, 1"), Ok(Command::new(136, 1, 0, 0)));
        assert_eq!(parse("JC ESD, 7"), Ok(Command::new(21, 12, 0, 7)));
    }

    /// The manual prints a third operand of 0 for five commands (sections 3.7.7, 3.7.8, 3.7.11, 3.7.12, 3.7.25).
    #[test]
    fn a_zero_that_the_manual_prints_may_follow() {
        for (line, command) in [
            ("STAP 4, 0, 0", Command::new(7, 4, 0, 0)),
            ("RSAP 4, 0, 0", Command::new(8, 4, 0, 0)),
            ("STGP 42, 2, 0", Command::new(11, 42, 2, 0)),
            ("RSGP 42, 2, $0", Command::new(12, 42, 2, 0)),
            ("GCO 1, 0, 0", Command::new(31, 1, 0, 0)),
        ] {
            assert_eq!(parse(line), Ok(command), "{line}");
        }
        let text = |line: &str| parse(line).unwrap_err().to_string();
        assert_eq!(text("STAP 4, 0, 1"), "STAP: '1' is one operand too many; usage: STAP <type>, <motor or bank>");
        assert_eq!(text("GCO 1, 0, 0, 0"), "GCO: '0' is one operand too many; usage: GCO <type>, <motor or bank>");
        assert!(text("GAP 1, 0, 0").contains("too many"));
    }

    #[test]
    fn errors_name_the_mistake_and_the_usage() {
        let text = |line: &str| parse(line).unwrap_err().to_string();
        assert_eq!(text(""), "no command; try GAP 1, 0");
        assert_eq!(text("GOTO 1"), "unknown command 'GOTO'");
        assert_eq!(text("SAP 4, 0"), "SAP: missing <value>; usage: SAP <type>, <motor or bank>, <value>");
        assert_eq!(text("MST 0, 1"), "MST: '1' is one operand too many; usage: MST <motor or bank>");
        assert_eq!(
            text("MVP UP, 0, 1"),
            "MVP: 'UP' is neither a number nor a known name; usage: MVP <ABS|REL|COORD>, <motor or bank>, <value>"
        );
        for word in ["$+10", "0x-1", "$", "0x", "+", "--1", "1+1", "$$1", "+-1"] {
            assert!(text(&format!("SAP 4, 0, {word}")).contains("neither a number"), "{word}");
        }
        assert_eq!(text("GAP 256, 0"), "GAP: 256 is out of range; usage: GAP <type>, <motor or bank>");
    }

    /// Each command with a mnemonic is read back as it was written.
    #[test]
    fn printing_and_reading_agree() {
        for instruction in Instruction::all().filter(|i| !i.mnemonic.is_empty()) {
            let fields = instruction.fields;
            let command = Command {
                opcode: instruction.opcode as u8,
                kind: if fields.iter().any(|f| matches!(f, Field::Kind | Field::Named(_))) { 3 } else { 0 },
                motor: if fields.contains(&Field::Motor) { 2 } else { 0 },
                value: if fields.contains(&Field::Value) { -7 } else { 0 },
            };
            let text = command.to_string();
            assert_eq!(parse(&text), Ok(command), "{text}");
        }
    }

    /// A value in a field that the mnemonic form does not show is written in the numeric form.
    #[test]
    fn fields_without_an_operand_are_printed() {
        for (command, text) in [
            (Command::new(28, 0, 0, 0), "STOP"),
            (Command::new(28, 0, 0, 5), "28, 0, 0, 5"),
            (Command::new(6, 1, 0, -1), "6, 1, 0, -1"),
            (Command::new(22, 7, 0, 12), "22, 7, 0, 12"),
            (Command::new(37, 0, 1, 12), "37, 0, 1, 12"),
            (Command::new(4, 9, 0, 1), "MVP 9, 0, 1"),
        ] {
            assert_eq!(command.to_string(), text);
            assert_eq!(parse(text), Ok(command));
        }
    }
}
