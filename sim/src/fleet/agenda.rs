//! Tasks that are to be done to the modules of a fleet later: commands of the control protocol, each with its time.

use std::collections::VecDeque;

use hal_sim::clock::Nanos;
use hal_sim::control::Line;

/// The commands, in the order in which they are carried out.
#[derive(Debug, Default)]
pub(super) struct Agenda {
    entries: VecDeque<(Nanos, Line)>,
}

impl Agenda {
    /// Adds a command, behind those that are due at the same time.
    pub(super) fn add(&mut self, at: Nanos, line: Line) {
        let behind = self.entries.partition_point(|(other, _)| *other <= at);
        self.entries.insert(behind, (at, line));
    }

    /// When the first command is due.
    pub(super) fn next(&self) -> Option<Nanos> {
        self.entries.front().map(|(at, _)| *at)
    }

    /// Takes the first command that is due by now.
    pub(super) fn take(&mut self, now: Nanos) -> Option<Line> {
        self.entries.pop_front_if(|(at, _)| *at <= now).map(|(_, line)| line)
    }
}
