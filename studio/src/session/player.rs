//! Does again what was done to a module, each thing at its time.

use std::collections::VecDeque;

use hal_sim::clock::Nanos;
use tmcm_sim::VirtualModule;
use tmcm_sim::client::Client;
use tmcm_sim::fleet::Fleet;

use super::deed::Deed;
use super::journal::Journal;

/// The deeds that are still to be done, and until when the module is followed.
#[derive(Debug)]
pub struct Player {
    deeds: VecDeque<Deed>,
    /// When the session ends, in nanoseconds of the module's time.
    until: Nanos,
    /// The clients that have sent commands whose replies nobody has taken.
    asked: Vec<Client>,
}

impl Player {
    /// A player of these deeds, in the order of their times, until the session ends.
    pub fn new(deeds: impl IntoIterator<Item = Deed>, until: Nanos) -> Self {
        Player { deeds: deeds.into_iter().collect(), until, asked: Vec::new() }
    }

    /// When there is something to be done again; `None` if all has been done.
    pub fn due(&self) -> Option<Nanos> {
        self.deeds.front().map(|deed| deed.at)
    }

    /// When the session ends.
    pub fn until(&self) -> Nanos {
        self.until
    }

    /// Does what is due, and notes it.
    pub fn act(&mut self, fleet: &mut Fleet<impl VirtualModule>, journal: &mut Journal) {
        while let Some(deed) = self.deeds.pop_front_if(|deed| deed.at <= fleet.now()) {
            self.asked.extend(deed.what.carry_out(fleet));
            journal.note(deed.at, deed.what);
        }
        self.asked.retain(|client| fleet.reply_to(*client).is_pending());
    }
}
