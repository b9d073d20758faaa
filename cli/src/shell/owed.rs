//! A speed of positioning that a jog has changed, and that the module has to get back.

use tmcl_tools::conversation::{Conversation, Error};
use tmcl_tools::product::axis_number;
use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode};

/// A speed of positioning (axis parameter 4), in the module's unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Owed {
    /// Of which axis.
    pub(super) axis: u8,
    /// What it has to be.
    pub(super) speed: i32,
}

impl Owed {
    /// Gives it to the module.
    pub(super) fn pay(self, module: &mut Conversation) -> Result<(), Error> {
        let number = axis_number(module.product()?, AxisParameter::MaximumSpeed).unwrap_or_default();
        module.request(Command::new(Opcode::Sap as u8, number, self.axis, self.speed)).map(drop)
    }
}
