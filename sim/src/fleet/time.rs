//! Virtual time of a fleet: it passes, and what is on the agenda is carried out at its time.

use hal_sim::clock::Nanos;
use hal_sim::control::{Control, Line};

use super::Fleet;
use crate::module::VirtualModule;

impl<M: VirtualModule> Fleet<M> {
    /// Lets virtual time pass until `to`, in nanoseconds. What is on the agenda is carried out at its time.
    pub fn run_until(&mut self, to: Nanos) {
        let to = to.max(self.now);
        loop {
            self.advance(to);
            self.carry_out();
            if self.now == to {
                return self.exchange();
            }
        }
    }

    /// Lets `span` nanoseconds of virtual time pass.
    pub fn run(&mut self, span: Nanos) {
        self.run_until(self.now + span);
    }

    /// Lets a command be carried out when `delay` nanoseconds of virtual time have passed from now, however they pass.
    /// At that time all that has arrived by then is delivered first, and replies that are on the wire stay there:
    /// `power off` loses none of them. Commands for the same time are carried out in the order in which they were
    /// given.
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
    fn carry_out(&mut self) {
        while self.agenda.next().is_some_and(|at| at <= self.now) {
            self.exchange();
            if let Some(line) = self.agenda.take(self.now) {
                // Nothing can be wrong with it: it was checked when it was noted, and no board becomes another.
                let _ = self.control(&line);
            }
        }
    }
}
