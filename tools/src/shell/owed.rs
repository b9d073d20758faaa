//! A speed of positioning that a jog has changed, and that the module has to get back.

use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode};

use crate::conversation::{Conversation, Error};
use crate::product::axis_number;

/// A speed of positioning (axis parameter 4), in the module's unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Owed {
    /// Of which axis.
    pub axis: u8,
    /// The speed that the axis has to get back.
    pub speed: i32,
}

impl Owed {
    /// Gives it to the module.
    pub fn pay(self, module: &mut Conversation) -> Result<(), Error> {
        let number = axis_number(module.product()?, AxisParameter::MaximumSpeed).unwrap_or_default();
        module.request(Command::new(Opcode::Sap as u8, number, self.axis, self.speed)).map(drop)
    }
}
