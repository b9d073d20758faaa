//! The connections that give commands at a control port, as far as the desk knows them.

use hal_sim::clock::Nanos;
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::Fleet;

use super::answer::Told;
use super::watch::Watch;

/// Number of a connection to the control port; no other has it, before or after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControllerId(pub u64);

/// The outcome of a line.
#[derive(Debug)]
pub enum Outcome {
    /// The command has been carried out, and there may be something to tell.
    Done(Option<Told>),
    /// The command takes virtual time; the answer comes later.
    Later,
    /// Lines of a watch follow the answer, and take the place of those of an earlier watch.
    Watch(Watch),
    /// No more lines of a watch follow.
    Unwatch,
}

/// Somebody who may watch while time passes.
pub trait Watcher {
    /// When the next line of the watch is due.
    fn watch_due(&self) -> Option<Nanos>;

    /// Takes the lines of the watch that are due.
    fn tell(&mut self, fleet: &mut Fleet<impl VirtualModule>);

    /// True if the next line of the watch would be lost, because those before have not been read: a step waits for
    /// that.
    fn is_behind(&mut self) -> bool;
}
