//! The commands of the control protocol that concern the modules of a fleet: carried out now, or at a time to come.

use hal_sim::clock::Nanos;
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

    /// Lets a command be carried out when `delay` nanoseconds of virtual time have passed from now, however they pass. At
    /// that time all that has arrived by then is delivered first, and replies that are on the wire stay there: `power off`
    /// loses none of them. Commands for the same time are carried out in the order in which they were given.
    ///
    /// # Errors
    /// Those of [`Fleet::control`], or the command changes nothing. Nothing has been noted then.
    pub fn at(&mut self, delay: Nanos, line: Line) -> Result<(), String> {
        self.check(&line)?;
        if line.control == Control::State {
            return Err("'state' changes nothing, so it cannot be put off; 'at' takes a command that does".into());
        }
        self.agenda.add(self.now + delay, line);
        self.carry_out();
        Ok(())
    }

    /// Carries out what is due on the agenda.
    pub(super) fn carry_out(&mut self) {
        while self.agenda.next().is_some_and(|at| at <= self.now) {
            self.exchange();
            if let Some(line) = self.agenda.take(self.now) {
                // Nothing can be wrong with it: it was checked when it was noted, and no board becomes another.
                let _ = self.control(&line);
            }
        }
    }

    /// The index of the module that a command is for; its board has what the command speaks of.
    fn check(&mut self, line: &Line) -> Result<usize, String> {
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
