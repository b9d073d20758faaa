//! The product whose parameters, interrupts and program memory the tools assume.

use tmcm::module::{Spec, TMCM_1140};
use tmcm::param::{AxisParameter, GlobalParameter, Interrupt, Row};
use tmcm::tmcl::{Command, Opcode};

/// The product that a module is assumed to be.
pub(crate) const PRODUCT: &Spec = &TMCM_1140;

/// A parameter with its full name, which for a parameter of bank 3 includes the timer, axis or input.
pub(crate) struct Named {
    pub(crate) row: &'static Row,
    pub(crate) name: String,
}

impl From<&'static Row> for Named {
    fn from(row: &'static Row) -> Self {
        Named { row, name: row.name.into() }
    }
}

/// The parameter that a command reads, writes or stores; `None` for other commands and unknown parameters.
pub(crate) fn parameter(spec: &Spec, opcode: Opcode, command: Command) -> Option<Named> {
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

/// The number of an axis parameter, if the product has it.
pub(crate) fn axis_number(spec: &Spec, parameter: AxisParameter) -> Option<u8> {
    spec.axis.row(parameter).map(|row| row.number)
}

/// The number of a global parameter, if the product has it.
pub(crate) fn global_number(spec: &Spec, parameter: GlobalParameter) -> Option<u8> {
    spec.global.row(parameter).map(|row| row.number)
}
