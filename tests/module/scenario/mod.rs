//! Scenario files: behaviour of the module written down so that whoever knows the manual can read it, add to
//! it and run it. `tests/scenarios/README.md` describes the format.
//!
//! Nothing in here knows what carries the scenarios out: that is a [`Rig`], which needs a link for telegrams
//! and the commands of the control protocol.

#![allow(unreachable_pub)]

mod document;
mod line;
mod run;
#[cfg(test)]
mod tests;

use hal_sim::clock::Nanos;
use hal_sim::control::{Line, State};
use hal_sim::world::config::WorldConfig;
use tmcm::tmcl::Command;

pub use run::{Choice, run_directory};

/// A module, switched on, in its world.
pub trait Rig {
    /// Sends a command and waits for its reply: status and value. `None` if there is no reply.
    fn send(&mut self, command: Command) -> Option<(u8, i32)>;
    /// Carries out a command of the control protocol.
    fn control(&mut self, line: &Line);
    /// What the control protocol's `state` tells.
    fn state(&mut self) -> State;
    /// Lets time pass.
    fn pass(&mut self, span: Nanos);
}

/// A line of a file that has something to say.
#[derive(Clone, Debug)]
struct SourceLine {
    /// Counted from 1.
    number: usize,
    /// Without its comment and without spaces at the end.
    text: String,
}

/// What is wrong with a file, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Mistake {
    line: usize,
    message: String,
}

impl Mistake {
    fn new(line: usize, message: impl Into<String>) -> Self {
        Mistake { line, message: message.into() }
    }
}

/// A scenario: what happens to a fresh module, once for each of its cases.
#[derive(Clone, Debug)]
struct Scenario {
    title: String,
    cases: Vec<Case>,
}

/// A scenario with a value for each of its parameters.
#[derive(Clone, Debug)]
struct Case {
    /// The parameters and their values, for the report.
    label: String,
    world: WorldConfig,
    steps: Vec<(SourceLine, line::Step)>,
}
