//! The knowledge that a module has of its links and of the hosts at their other ends.

use super::link_settings::LinkSettings;
use super::origin::Source;
use super::overheard::Overheard;
use super::supervision::Supervision;
use super::waiting::Waiting;
use crate::executor::{Globals, Product, SETTINGS};
use crate::param::GlobalParameter as G;
use crate::tmcl::ascii::Echo;
use crate::units::Micros;

/// The links of a module.
#[derive(Debug)]
pub(super) struct Links {
    /// The settings in force.
    pub(super) settings: LinkSettings,
    /// A global parameter has been written since the settings were made of the global parameters.
    stale: bool,
    /// The requests to other modules that were overheard, on RS485 and on CAN.
    pub(super) overheard: [Overheard; 2],
    supervision: Supervision,
}

impl Links {
    /// The links before their [start](Self::start). Inlined, so that on the way to their place they are on the stack
    /// once.
    #[inline(always)]
    pub(super) fn new() -> Self {
        Links {
            settings: LinkSettings::default(),
            stale: false,
            overheard: [Overheard::default(), Overheard::default()],
            supervision: Supervision::new(Micros(0)),
        }
    }

    /// Starts the links at `now`, with settings that follow from the global parameters.
    pub(super) fn start(&mut self, now: Micros, globals: &Globals) {
        self.settings = LinkSettings::of(globals);
        self.supervision = Supervision::new(now);
    }

    /// True while the settings do not follow from the global parameters.
    pub(super) const fn are_stale(&self) -> bool {
        self.stale
    }

    /// Notes that global parameters have been written.
    pub(super) const fn outdate(&mut self) {
        self.stale = true;
    }

    /// Notes that a command has set a global parameter. A time limit for hosts counts from now on.
    pub(super) fn follow<P: Product>(&mut self, now: Micros, number: u8, bank: u8) {
        if bank == SETTINGS
            && let Some(parameter) = P::SPEC.global.find(number)
        {
            self.stale = true;
            self.supervision.limit(now, parameter.function);
        }
    }

    /// Lets the settings follow the global parameters, unless a reply still has to go out under the old ones.
    pub(super) fn update(&mut self, globals: &Globals, waiting: &Waiting) {
        if self.stale {
            self.renew(globals, waiting);
        }
    }

    /// A function of its own, marked as cold: every request asks for an update, and few requests change a parameter.
    #[cold]
    fn renew(&mut self, globals: &Globals, waiting: &Waiting) {
        if !waiting.owes_replies() {
            self.settings = LinkSettings { start: self.settings.start, ..LinkSettings::of(globals) };
            self.stale = false;
        }
        self.settings.echo = Echo::from_parameter(globals.get(G::AsciiMode));
    }

    /// Notes that a command has come in over a link.
    pub(super) fn hear(&mut self, now: Micros, source: Source) {
        self.supervision.hear(now, source);
    }

    /// True while a host has not been heard for longer than parameters 68 and 82 allow.
    pub(super) fn heartbeat_missed(&self, now: Micros, globals: &Globals) -> bool {
        self.supervision.heartbeat_missed(now, globals.get(G::SerialHeartbeat), globals.get(G::CanHeartbeat))
    }

    /// The time before which no host misses its heartbeat, if none is heard. It is in the past if a host has missed it.
    pub(super) fn calm_until(&self, globals: &Globals) -> Micros {
        self.supervision.calm_until(globals.get(G::SerialHeartbeat), globals.get(G::CanHeartbeat))
    }
}
