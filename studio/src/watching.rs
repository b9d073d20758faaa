//! Events at moments of a virtual module's time: rows, lines of a watch, and what is done again.

use hal_sim::clock::Nanos;
use tmcl_tools::desk::{Watch, Watcher};
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::Fleet;

use crate::recorder::Recorder;
use crate::session::{Journal, Player};
use crate::types::LineTold;

/// The watches of the page, the lines that are for it, and what is done to the module at its time.
#[derive(Debug, Default)]
pub struct Page {
    /// Does a session again.
    pub player: Option<Player>,
    /// Notes what is done to the module.
    pub journal: Journal,
    /// The watch that a line of the control port has begun.
    pub watch: Option<Watch>,
    /// The recorder, which makes rows.
    pub recorder: Option<Recorder>,
    /// Lines that the page has not taken yet.
    pub lines: Vec<LineTold>,
}

impl Watcher for Page {
    fn watch_due(&self) -> Option<Nanos> {
        let (watch, recorder) = (self.watch.as_ref().map(Watch::due), self.recorder.as_ref().map(Recorder::due));
        let player = self.player.as_ref().and_then(Player::due);
        [watch, recorder, player].into_iter().flatten().min()
    }

    fn tell(&mut self, fleet: &mut Fleet<impl VirtualModule>) {
        if let Some(watch) = self.watch.as_mut().filter(|watch| watch.due() <= fleet.now()) {
            self.lines.push(LineTold { ticket: None, line: watch.take(fleet) });
        }
        if let Some(recorder) = self.recorder.as_mut().filter(|recorder| recorder.due() <= fleet.now()) {
            recorder.take(fleet);
        }
        // A row has what was there before something is done at its moment.
        if let Some(player) = &mut self.player {
            player.act(fleet, &mut self.journal);
        }
    }

    /// Lines are taken after each turn.
    fn is_behind(&mut self) -> bool {
        false
    }
}
