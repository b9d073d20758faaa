//! Scenario files: behaviour of a module written down so that whoever knows the manual can read it, add to it and run
//! it. `docs/scenarios.md` describes the language.
//!
//! * [`condition`] - conditions and the values in them, which the control protocol uses as well
//! * [`program`] - the TMCL programs that scenarios load
//! * `document` - the large structure of a file: scenarios with their settings and steps
//! * `settings` - what stands above the steps: product, firmware, world, tables
//! * [`eeprom`] - the contents of an EEPROM in lines
//! * `step` - one line of a scenario
//! * `sdo` - the objects of a CANopen node
//! * `run` - carries a case out on a [`Rig`]
//! * `stand` - the rig of a virtual module
//! * [`suite`] - runs the scenarios of many files on all processors

pub mod condition;
mod document;
pub mod eeprom;
pub mod program;
mod run;
mod sdo;
mod settings;
mod stand;
mod step;
pub mod suite;
#[cfg(test)]
mod tests;
mod token;

use hal_sim::clock::Nanos;
use hal_sim::control::Line;
use hal_sim::world::config::WorldConfig;
use tmcm::can::Frame;
use tmcm::tmcl::Command;

pub use document::{Surroundings, read};
pub use run::run_case;
pub use stand::Stand;

use crate::look::Look;
use crate::native::Model;

/// A module, switched on, in its world.
pub trait Rig {
    /// Sends a command and waits for its reply: status and value. `None` if there is no reply.
    fn send(&mut self, command: Command) -> Option<(u8, i32)>;
    /// Sends a command, and does not wait for its reply.
    fn post(&mut self, command: Command);
    /// Carries out a command of the control protocol.
    ///
    /// # Errors
    /// The module has not what the command speaks of.
    fn control(&mut self, line: &Line) -> Result<(), String>;
    /// Has a command of the control protocol carried out when `delay` nanoseconds have passed.
    ///
    /// # Errors
    /// As for [`control`](Self::control).
    fn control_at(&mut self, delay: Nanos, line: &Line) -> Result<(), String>;
    /// The value that the world shows.
    fn look(&mut self, look: &Look) -> f64;
    /// Virtual time since the board was first switched on.
    fn now(&mut self) -> Nanos;
    /// Lets time pass.
    fn pass(&mut self, span: Nanos);
    /// Sends a frame on the CAN bus.
    fn send_frame(&mut self, frame: Frame);
    /// The next frame that the module has sent, oldest first.
    fn frame(&mut self) -> Option<Frame>;
    /// The reason for which the module cannot go on; `None` while it can.
    fn stopped(&self) -> Option<String>;
}

/// A line of a file that has something to say.
#[derive(Clone, Debug)]
struct SourceLine {
    /// Counted from 1.
    number: usize,
    /// Without its comment and without spaces at the end.
    text: String,
}

/// A mistake in a file, and the line that it is in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// The line, counted from 1.
    pub line: usize,
    /// The mistake, in words, and what to write instead.
    pub message: String,
}

impl Mistake {
    fn new(line: usize, message: impl Into<String>) -> Self {
        Mistake { line, message: message.into() }
    }
}

/// A scenario: what happens to a fresh module, once for each of its cases.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// The text that is written behind `==`.
    pub title: String,
    /// The line of the title.
    pub line: usize,
    /// A case for each combination of its parameters; or the mistake in the scenario.
    pub cases: Result<Vec<Case>, Mistake>,
}

/// A scenario with a value for each of its parameters.
#[derive(Clone, Debug)]
pub struct Case {
    /// The parameters and their values, for the report; empty if the scenario has none.
    pub label: String,
    /// Product and firmware of the module.
    pub model: Model,
    /// The world around it.
    pub world: WorldConfig,
    /// Why the case is not for the flash image, if it is not.
    pub not_on_image: Option<String>,
    /// The contents of the EEPROM; fresh if `None`.
    pub eeprom: Option<Vec<u8>>,
    steps: Vec<(SourceLine, step::Step)>,
}
