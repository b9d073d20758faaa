//! The entries about a command in the tables of a product: the parameter that it is about, and the units of values.

use tmcm::module::Spec;
use tmcm::param::{AxisParameter, Interrupt, Row, Unit};
use tmcm::tmcl::{Command, Opcode};

use crate::native::Product;

/// A parameter with its full name, which for a parameter of bank 3 includes the timer, axis or input.
#[derive(Clone, Debug)]
pub struct Named {
    /// The row of the parameter's table.
    pub row: &'static Row,
    /// The name.
    pub name: String,
}

impl From<&'static Row> for Named {
    fn from(row: &'static Row) -> Self {
        Named { row, name: row.name.into() }
    }
}

/// The parameter that a command reads, writes or stores; `None` for other commands and unknown parameters.
pub fn parameter(spec: &Spec, opcode: Opcode, command: Command) -> Option<Named> {
    let number = command.kind;
    match opcode {
        Opcode::Gap | Opcode::Sap | Opcode::Aap | Opcode::Stap | Opcode::Rsap => {
            spec.axis.find(number).map(|found| Named::from(&found.row))
        }
        Opcode::Ggp | Opcode::Sgp | Opcode::Agp | Opcode::Stgp | Opcode::Rsgp => match command.motor {
            0 => spec.global.find(number).map(|found| Named::from(&found.row)),
            3 => {
                let (numbered, index) = Interrupt::find(number, spec.axes, spec.inputs)?;
                let name = numbered.parameter_name(index)?.to_string();
                numbered.row.as_ref().map(|row| Named { row, name })
            }
            _ => None,
        },
        _ => None,
    }
}

/// The unit of speeds on a product, as its numbers are at first.
pub fn speed_unit(product: Product) -> Unit {
    product.spec().axis.row(AxisParameter::TargetSpeed).map_or(Unit::Number, |row| row.unit)
}

/// A unit as it is printed behind a value. `in_chip` says that the axis has its speeds and accelerations in units of
/// its chip, by its unit mode.
pub fn symbol(unit: Unit, in_chip: bool) -> &'static str {
    match unit {
        Unit::Pps | Unit::Pps2 if in_chip => "chip",
        unit => unit.symbol(),
    }
}

/// A value with its unit, if that is not empty.
pub fn with_unit(value: i32, unit: &str) -> String {
    if unit.is_empty() { value.to_string() } else { format!("{value} {unit}") }
}
