//! Makes a command of the mnemonic and operands in a source line.

use tmcm::tmcl::{Command, Field, Instruction, text};

use super::check::Part;
use super::expression::evaluate;
use super::message::Message;
use super::source::{Problem, Span};
use super::statement::{CommandLine, Head, Operand};
use super::symbol::Symbols;
use super::token::{Kind, Token};

/// The command of a line; `text` is the line's text, which errors quote.
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

/// The characters of a line that fill a field of the command; the mnemonic's if the field is left out.
pub(super) fn span(line: &CommandLine, part: Part) -> Span {
    let index = match line.head {
        Head::Instruction(instruction) => instruction.fields.iter().position(|field| {
            matches!(
                (part, field),
                (Part::Kind, Field::Kind | Field::Named(_)) | (Part::Motor, Field::Motor) | (Part::Value, Field::Value)
            )
        }),
        Head::Nop => None,
        Head::Number(_) => [Part::Kind, Part::Motor, Part::Value].iter().position(|other| *other == part),
    };
    index.and_then(|index| line.operands.get(index)).map_or(line.span, |operand| operand.span)
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
            return Err(Problem::new(
                operand.span,
                Message::new("nothing follows this comma").advise("it is one too many"),
            ));
        }
        let Span { start, end } = operand.span;
        let word: String = text.chars().take(end).skip(start).collect();
        return Err(Problem::new(operand.span, text::Error::Unexpected(instruction, &word)));
    }
    match instruction.fields.get(line.operands.len()) {
        Some(field) if line.operands.len() < instruction.required() => {
            let end = line.operands.last().map_or(line.span, |operand| operand.span).behind();
            Err(Problem::new(end, text::Error::Missing(instruction, *field)))
        }
        _ => Ok(command),
    }
}

/// The first operand that is too many: an operand behind the last field, or another one than 0 for a [`Field::Zero`].
fn surplus<'a>(
    line: &'a CommandLine,
    instruction: &Instruction,
    symbols: &Symbols,
) -> Result<Option<&'a Operand>, Problem> {
    let count = instruction.operands().len();
    let zero = match line.operands.get(count) {
        Some(operand) if count < instruction.fields.len() && !operand.tokens.is_empty() => {
            number(operand, symbols)? == 0
        }
        _ => false,
    };
    Ok(line.operands.get(count + usize::from(zero)))
}

/// The command of a line that begins with a command number: type, motor or bank, and value follow; those left out are
/// 0.
fn numeric(line: &CommandLine, number: i64, symbols: &Symbols) -> Result<Command, Problem> {
    let mut operands = line.operands.iter();
    let opcode = u8::try_from(number).map_err(|_| Problem::new(line.span, "command numbers are 0..255"))?;
    let mut byte = || operands.next().map_or(Ok(0), |operand| byte(operand, symbols));
    let (kind, motor) = (byte()?, byte()?);
    let value = operands.next().map_or(Ok(0), |operand| value(operand, symbols))?;
    match operands.next() {
        Some(operand) => {
            let message = Message::new("one operand too many")
                .advise("after a command number there are type, motor or bank, and value");
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
    u8::try_from(number).map_err(|_| {
        Problem::new(operand.span, Message::new(format!("{number} is out of range")).advise("0..255 fits here"))
    })
}

/// The value field for an operand. An expression has at most 32 bits, signed or unsigned, so the conversion loses none.
fn value(operand: &Operand, symbols: &Symbols) -> Result<i32, Problem> {
    number(operand, symbols).map(|number| number as u32 as i32)
}

/// The type field for an operand: one of the instruction's own names, which hide labels and constants, or a number.
fn named(operand: &Operand, names: &[&str], symbols: &Symbols) -> Result<u8, Problem> {
    let Some((Token { kind: Kind::Name(word), span }, rest)) = operand.tokens.split_first() else {
        return byte(operand, symbols);
    };
    let found = (0..=u8::MAX).zip(names).find(|(_, name)| name.eq_ignore_ascii_case(word));
    match (found, rest.first()) {
        (Some((number, _)), None) => Ok(number),
        (Some(_), Some(next)) if symbols.value(word).is_none() => {
            Err(Problem::new(next.span, format!("a comma is missing between {word} and this")))
        }
        (None, None) if symbols.value(word).is_none() => {
            let message = Message::new(format!("'{word}' is none of {}", names.join(", ")));
            Err(Problem::new(*span, message.suggest(word, names.iter().copied())))
        }
        _ => byte(operand, symbols),
    }
}
