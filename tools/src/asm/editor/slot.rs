//! The purpose of a place in a line.

use tmcm::tmcl::{Field, Instruction};

use super::super::statement::labels;
use super::super::token::{Kind, Token};

/// The purpose of a place in a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    /// Nothing that has a name.
    Nothing,
    /// A command, a label, the name of a constant, or a directive: where a statement begins.
    Statement,
    /// The file of an `#include`.
    File,
    /// A part of the value of a constant.
    Value,
    /// A part of an operand.
    Operand(Place),
}

/// A place in an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// The command.
    pub(super) instruction: &'static Instruction,
    /// The field that the operand fills.
    pub(super) field: Field,
    /// Whether the operand begins there.
    pub(super) begins: bool,
}

/// The fields of a command that is written as numbers, behind its own number.
const NUMERIC: &[Field] = &[Field::Kind, Field::Motor, Field::Value];

impl Slot {
    /// Finds the purpose of a place behind these tokens of its line.
    pub(super) fn behind(tokens: &[Token]) -> Slot {
        let (_, tokens) = labels(tokens);
        let Some((first, rest)) = tokens.split_first() else { return Slot::Statement };
        let (instruction, fields) = match &first.kind {
            Kind::Directive(word) if word == "include" && rest.is_empty() => return Slot::File,
            Kind::Name(_) if rest.first().is_some_and(|token| token.is('=')) => {
                let wanted = wants_value(rest.last());
                return if wanted { Slot::Value } else { Slot::Nothing };
            }
            Kind::Name(name) => match Instruction::by_mnemonic(name) {
                Some(instruction) => (instruction, instruction.operands()),
                None => return Slot::Nothing,
            },
            Kind::Number(number) => match u8::try_from(*number).ok().and_then(Instruction::numbered) {
                Some(instruction) => (instruction, NUMERIC),
                None => return Slot::Nothing,
            },
            _ => return Slot::Nothing,
        };
        // A comma right after the mnemonic is tolerated.
        let rest = match rest.split_first() {
            Some((comma, others)) if comma.is(',') => others,
            _ => rest,
        };
        let index = rest.iter().filter(|token| token.is(',')).count();
        let begins = rest.last().is_none_or(|token| token.is(','));
        match fields.get(index) {
            Some(field) if begins || wants_value(rest.last()) => {
                Slot::Operand(Place { instruction, field: *field, begins })
            }
            _ => Slot::Nothing,
        }
    }
}

/// Whether an expression has to go on behind a token.
fn wants_value(last: Option<&Token>) -> bool {
    last.is_none_or(|token| matches!(token.kind, Kind::Symbol(symbol) if symbol != ')'))
}
