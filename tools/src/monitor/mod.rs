//! Samples of the axes' parameters, each with the time at which it was taken, in rows and in lines.

mod column;
mod line;
mod pace;
mod sample;

use tmcm::tmcl::{Command, Opcode};

use crate::conversation::{Conversation, Error};
pub use column::{Column, Usual, usual};
pub use line::{Shown, Speeds, line, named, short, status};
pub use pace::Pace;
pub use sample::{Object, Sample, headline, row, sample};

/// The columns to show: the usual ones, or those that are wanted.
///
/// # Errors
/// The module does not have one of them, or the link fails.
pub fn columns(module: &mut Conversation, axes: &[u8], wanted: &[u8]) -> Result<Vec<Column>, Error> {
    if wanted.is_empty() {
        return Ok(usual());
    }
    for &number in wanted {
        // A parameter that is asked for by number and does not exist is a mistake.
        module.value(Command::new(Opcode::Gap as u8, number, axes.first().copied().unwrap_or_default(), 0))?;
    }
    Ok(column::of(wanted, module.product()?))
}

/// How speeds are shown: in the unit that the first axis has them in, as long as it watches.
///
/// # Errors
/// The link fails.
pub fn speeds(module: &mut Conversation, axes: &[u8]) -> Result<Speeds, Error> {
    let in_chip = axes.first().map_or(Ok(false), |axis| module.is_in_chip_units(*axis))?;
    Ok(Speeds::of(module.product()?, in_chip))
}
