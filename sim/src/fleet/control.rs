//! The commands of the control protocol that concern the modules of a fleet.

use hal_sim::control::{Control, Line, State};

use super::Fleet;
use crate::module::VirtualModule;

impl<M: VirtualModule> Fleet<M> {
    /// Carries out a command of the control protocol; gives the state if that was asked for.
    ///
    /// # Errors
    /// There is no such module, or its board has not what the command speaks of.
    pub fn control(&mut self, line: &Line) -> Result<Option<State>, String> {
        let index = self.check(line)?;
        match line.control {
            Control::Power { on } => self.set_power(index, on),
            Control::Can { state } => self.set_can(index, state),
            Control::Usb { on } => self.plug_usb(index, on),
            Control::HangUp => self.hang_up_usb(index),
            Control::Reply { fault } => self.replies.set(index, fault),
            control => return self.modules.get_mut(index).map_or(Ok(None), |module| module.control(control)),
        }
        Ok(None)
    }

    /// The index of the module that a command is for; its board has what the command speaks of.
    pub(super) fn check(&mut self, line: &Line) -> Result<usize, String> {
        let (number, count) = (line.module, self.modules.len());
        let index = number.wrapping_sub(1);
        let Some(module) = self.modules.get_mut(index) else {
            let there_are = if count == 1 { "there is 1 module".into() } else { format!("there are {count} modules") };
            return Err(format!("no module {number}: {there_are}"));
        };
        line.control.check(module.board_mut().kind())?;
        Ok(index)
    }
}
