//! The names of a product: the constants of the built-in files, in words.

use tmcm::param::{Row, Storage};
use tmcm::tmcl::{Command, Field, Instruction, MotorField, Opcode};
use tmcm_sim::wire::names::Named;

use super::super::include::{self, Constant, Subject};
use crate::params::range;
use crate::product::Product;

/// The constants of the built-in files of a product; none for a product that is not known.
pub(super) struct BuiltIn {
    /// The product.
    pub(super) product: Option<Product>,
    /// The constants, each with the name of its file.
    pub(super) constants: Vec<(&'static str, Constant)>,
}

impl BuiltIn {
    /// Collects the built-in names of a product.
    pub(super) fn of(product: Option<Product>) -> Self {
        let constants = product.map(|product| include::constants(product.spec()).collect());
        BuiltIn { product, constants: constants.unwrap_or_default() }
    }

    /// The constant with this name. Upper and lower case are the same.
    pub(super) fn find(&self, name: &str) -> Option<&Constant> {
        self.constants.iter().map(|(_, constant)| constant).find(|constant| constant.name.eq_ignore_ascii_case(name))
    }

    /// Whether the product has a command.
    pub(super) fn has(&self, opcode: Opcode) -> bool {
        self.product.is_none_or(|product| !product.spec().lacks.contains(&opcode))
    }
}

/// Whether a constant fits a field of a command.
pub(super) fn fits(constant: &Constant, instruction: &Instruction, field: Field) -> bool {
    use Opcode::{Aap, Agp, Di, Ei, Gap, Ggp, Rsap, Sap, Sgp, Stap, Vect, Wait};
    match (constant.subject, field) {
        (Subject::Motor, Field::Motor) => instruction.motor != MotorField::Other || instruction.opcode == Wait,
        (Subject::Axis(row), Field::Kind) => match instruction.opcode {
            Gap => true,
            Sap | Aap => row.writable(),
            Stap | Rsap => row.stored(),
            _ => false,
        },
        (Subject::Global(row), Field::Kind) => match instruction.opcode {
            Ggp => true,
            Sgp | Agp => row.writable(),
            _ => false,
        },
        (Subject::Interrupt(parameter), Field::Kind) => match instruction.opcode {
            Ei | Di => true,
            Vect => constant.number != tmcm::param::ALL_INTERRUPTS,
            Sgp | Ggp | Agp => parameter.is_some(),
            _ => false,
        },
        _ => false,
    }
}

/// A constant in a few words.
pub(super) fn note(constant: &Constant) -> String {
    let Constant { number, note, subject, .. } = constant;
    match subject {
        Subject::Axis(row) => with_unit(format!("axis parameter {number}, {note}"), row),
        Subject::Global(row) => with_unit(format!("global parameter {number}, {note}"), row),
        Subject::Motor => note.clone(),
        Subject::Interrupt(_) => format!("interrupt {number}, {note}"),
    }
}

fn with_unit(words: String, row: &Row) -> String {
    match row.unit.symbol() {
        "" => words,
        unit => format!("{words} ({unit})"),
    }
}

/// All that the tables say about a constant.
pub(super) fn words(constant: &Constant) -> String {
    let row = match constant.subject {
        Subject::Axis(row) | Subject::Global(row) | Subject::Interrupt(Some(row)) => row,
        Subject::Motor | Subject::Interrupt(None) => return note(constant),
    };
    let (of, store) = match constant.subject {
        Subject::Axis(_) => ("", ["STAP", "SAP"]),
        Subject::Interrupt(_) => ("its parameter in bank 3 ", ["STGP", "SGP"]),
        _ => ("", ["STGP", "SGP"]),
    };
    row_words(note(constant), of, row, store)
}

/// All that the tables say about the parameter of a command.
pub(super) fn parameter_words(command: Command, instruction: &Instruction, Named { row, name }: &Named) -> String {
    let (what, store) = match (instruction.motor, command.motor) {
        (MotorField::Other, 0) => ("global parameter", ["STGP", "SGP"]),
        (MotorField::Other, _) => ("parameter of interrupt", ["STGP", "SGP"]),
        _ => ("axis parameter", ["STAP", "SAP"]),
    };
    row_words(with_unit(format!("{what} {}, {name}", command.kind), row), "", row, store)
}

fn row_words(mut words: String, of: &str, row: &Row, [store, set]: [&str; 2]) -> String {
    words += &match row.writable() {
        true => format!("; {of}takes {}, default {}", range(row), row.default),
        false => format!("; {of}{}", range(row)),
    };
    match row.storage {
        Storage::Volatile => {}
        Storage::OnCommand(_) => words += &format!(", stored by {store}"),
        Storage::Automatic(_) => words += &format!(", stored by {set} itself"),
    }
    if !row.note.is_empty() {
        words += &format!("; {}", row.note);
    }
    words
}
