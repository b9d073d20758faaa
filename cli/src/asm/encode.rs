//! A command as it is written, made into the command that it is.

use tmcm::tmcl::{Command, Field, Instruction, text};

use super::check::Part;
use super::expression::evaluate;
use super::source::{Problem, Span};
use super::statement::{CommandLine, Head, Operand};
use super::suggest::suggestion;
use super::symbol::Symbols;
use super::token::{Kind, Token};

/// Makes the command; `text` is the line it is in.
pub(super) fn command(line: &CommandLine, text: &str, symbols: &Symbols) -> Result<Command, Problem> {
    match line.head {
        Head::Instruction(instruction) => mnemonic(line, instruction, text, symbols),
        Head::Number(number) => numeric(line, number, symbols),
        Head::Nop => match line.operands.first() {
            Some(operand) => Err(Problem::new(operand.span, "NOP stands alone")),
            None => Ok(Command::default()),
        },
    }
}

/// The place of a part of the command; of one that is not written, the mnemonic's.
pub(super) fn span(line: &CommandLine, part: Part) -> Span {
    let place = match line.head {
        Head::Instruction(instruction) => instruction.fields.iter().position(|field| {
            matches!(
                (part, field),
                (Part::Kind, Field::Kind | Field::Named(_)) | (Part::Motor, Field::Motor) | (Part::Value, Field::Value)
            )
        }),
        Head::Nop => None,
        Head::Number(_) => [Part::Kind, Part::Motor, Part::Value].iter().position(|other| *other == part),
    };
    place.and_then(|place| line.operands.get(place)).map_or(line.span, |operand| operand.span)
}

fn mnemonic(
    line: &CommandLine,
    instruction: &'static Instruction,
    text: &str,
    symbols: &Symbols,
) -> Result<Command, Problem> {
    let mut command = Command { opcode: instruction.opcode as u8, ..Command::default() };
    for (operand, field) in line.operands.iter().zip(instruction.fields) {
        match *field {
            Field::Kind => command.kind = byte(operand, symbols)?,
            Field::Named(names) => command.kind = named(operand, names, symbols)?,
            Field::Motor => command.motor = byte(operand, symbols)?,
            Field::Value => command.value = value(operand, symbols)?,
            Field::Zero => {}
        }
    }
    if let Some(operand) = surplus(line, instruction, symbols)? {
        if operand.tokens.is_empty() {
            return Err(Problem::new(operand.span, "nothing follows this comma; it is one too many"));
        }
        let Span { start, end } = operand.span;
        let word: String = text.chars().take(end).skip(start).collect();
        return Err(Problem::new(operand.span, text::Error::Unexpected(instruction, &word).to_string()));
    }
    match instruction.fields.get(line.operands.len()) {
        Some(field) if line.operands.len() < instruction.required() => {
            let end = line.operands.last().map_or(line.span, |operand| operand.span).behind();
            Err(Problem::new(end, text::Error::Missing(instruction, *field).to_string()))
        }
        _ => Ok(command),
    }
}

/// The first operand that is too many: one behind the last field, or one that is not 0 where only that may stand.
fn surplus<'a>(
    line: &'a CommandLine,
    instruction: &Instruction,
    symbols: &Symbols,
) -> Result<Option<&'a Operand>, Problem> {
    let place = instruction.operands().len();
    let zero = match line.operands.get(place) {
        Some(operand) if place < instruction.fields.len() && !operand.tokens.is_empty() => {
            number(operand, symbols)? == 0
        }
        _ => false,
    };
    Ok(line.operands.get(place + usize::from(zero)))
}

/// Four numbers: command, type, motor or bank, value; those left out are zero.
fn numeric(line: &CommandLine, number: i64, symbols: &Symbols) -> Result<Command, Problem> {
    let mut operands = line.operands.iter();
    let opcode = u8::try_from(number).map_err(|_| Problem::new(line.span, "command numbers are 0..255"))?;
    let mut byte = || operands.next().map_or(Ok(0), |operand| byte(operand, symbols));
    let (kind, motor) = (byte()?, byte()?);
    let value = operands.next().map_or(Ok(0), |operand| value(operand, symbols))?;
    match operands.next() {
        Some(operand) => {
            let message = "one operand too many; after a command number there are type, motor or bank, and value";
            Err(Problem::new(operand.span, message))
        }
        None => Ok(Command { opcode, kind, motor, value }),
    }
}

fn number(operand: &Operand, symbols: &Symbols) -> Result<i64, Problem> {
    evaluate(&operand.tokens, operand.span, &|name| symbols.resolve(name))
}

fn byte(operand: &Operand, symbols: &Symbols) -> Result<u8, Problem> {
    let number = number(operand, symbols)?;
    u8::try_from(number).map_err(|_| Problem::new(operand.span, format!("{number} is out of range; 0..255 fits here")))
}

/// The value field, signed or unsigned; expressions are within either.
fn value(operand: &Operand, symbols: &Symbols) -> Result<i32, Problem> {
    number(operand, symbols).map(|number| number as u32 as i32)
}

/// One of the names that the instruction knows, or a number. These names go before labels and constants.
fn named(operand: &Operand, names: &[&str], symbols: &Symbols) -> Result<u8, Problem> {
    let Some((Token { kind: Kind::Name(word), span }, rest)) = operand.tokens.split_first() else {
        return byte(operand, symbols);
    };
    let place = (0..=u8::MAX).zip(names).find(|(_, name)| name.eq_ignore_ascii_case(word));
    match (place, rest.first()) {
        (Some((place, _)), None) => Ok(place),
        (Some(_), Some(next)) if symbols.value(word).is_none() => {
            Err(Problem::new(next.span, format!("a comma is missing between {word} and this")))
        }
        (None, None) if symbols.value(word).is_none() => {
            let suggestion = suggestion(word, names.iter().copied());
            Err(Problem::new(*span, format!("'{word}' is none of {}{suggestion}", names.join(", "))))
        }
        _ => byte(operand, symbols),
    }
}
