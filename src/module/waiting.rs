//! Commands that wait for the store: each is answered once what it stored would survive a power cut, or when the EEPROM
//! has failed.

use super::origin::{Due, Origin};
use super::outcome::Undo;
use super::{Module, Platform};
use crate::param::GlobalParameter as G;
use crate::store::{Finished, Need};
use crate::tmcl::{Command, Reply, Status};

/// The one who waits for a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Waiter {
    /// A host, for the reply.
    Link(Origin),
    /// The program, to go on.
    Program,
    /// The link of the host that waited has been cut.
    Nobody,
}

/// A command that waits for the store.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    pub(super) from: Waiter,
    pub(super) command: Command,
    /// The part of the EEPROM that has to be up to date.
    pub(super) need: Need,
    /// The value of the reply if all goes well.
    pub(super) value: i32,
    /// What to take back if writing the EEPROM fails.
    pub(super) undo: Option<Undo>,
    /// Global parameter 255 suppresses the reply.
    pub(super) suppressed: bool,
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Tells the module how the EEPROM job that it gave out last has gone. Commands that waited for it are answered: with
    /// status 100 if all they stored is written, with status 5 if it could not be; then their settings are not in force
    /// either.
    pub fn stored(&mut self, written: bool) {
        let Finished { failed, erased, .. } = self.device.store_mut().finish(written);
        // A factory reset puts the parameters back with the restart that follows it. Until then the program is still in
        // memory, and its protection has to stay.
        let resetting = self.device.restart().is_some();
        if let Some(protection) = erased.filter(|_| !resetting) {
            self.set_global_value(G::CodeProtection, protection);
        }
        let Some(failed) = failed else { return self.settle() };
        if failed == Need::Settings && !resetting {
            self.reload_globals();
            for waiting in self.waiting.clone().iter().rev() {
                let Some(Undo { axis, number, value }) = waiting.undo else { continue };
                if let Ok(cell) = self.coordinate_cell(axis, number) {
                    *cell = value;
                }
            }
            // If the motion controller does not answer either, its driver knows that it has to write this again.
            let _ = self.apply_polarity_and_direction();
        }
        // The state of the program is among the settings: if they cannot be written, it is not stored either.
        self.release(Status::EepromLocked, |waiting| failed == Need::Settings || waiting.need == failed);
    }

    /// True when everything that was asked before a restart is durable and answered.
    pub(super) fn is_done(&self) -> bool {
        self.device.store().settled(Need::Settings) && self.waiting.is_empty()
    }

    /// Answers the commands whose part of the EEPROM is up to date.
    pub(super) fn settle(&mut self) {
        if self.waiting.is_empty() {
            return;
        }
        for need in [Need::Settings, Need::Program] {
            if self.device.store().settled(need) {
                self.release(Status::Ok, |waiting| waiting.need == need);
            }
        }
    }

    /// Answers those of the waiting commands that `which` chooses.
    fn release(&mut self, status: Status, which: impl Fn(&Waiting) -> bool) {
        self.waiting.retain(|waiting| {
            if !which(waiting) {
                return true;
            }
            let Waiting { from, command, value, suppressed, .. } = *waiting;
            let value = if status == Status::Ok { value } else { command.value };
            match from {
                Waiter::Program => self.machine.stored(),
                Waiter::Nobody => {}
                Waiter::Link(to) => {
                    let reply = Reply::Plain { status, opcode: command.opcode, value };
                    // A link has at most one command that waits, so the queue has room.
                    let _ = self.replies.push_back(Due { to, reply: (!suppressed).then_some(reply) });
                }
            }
            false
        });
    }

    /// Forgets the stores that the program was waiting for when it was stopped or reset.
    pub(super) fn forget_stores(&mut self) {
        let all = self.waiting.iter().filter(|waiting| waiting.from == Waiter::Program).count();
        let mut stale = all.saturating_sub(self.machine.stores());
        self.waiting.retain(|waiting| {
            let keep = waiting.from != Waiter::Program || stale == 0;
            stale = stale.saturating_sub(usize::from(!keep));
            keep
        });
    }
}
