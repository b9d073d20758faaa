//! The commands that a program executes, recorded where the firmware tells of them.

use hal_sim::clock::{MICROSECOND, Nanos};
use tmcm::module::{Executed, Hooks};
use tmcm::vm::{Errors, Machine, Registers};

/// A command, executed, and what the program has then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// Virtual time.
    pub at: Nanos,
    /// The command.
    pub executed: Executed,
    /// Accumulator, X register and arithmetic flags after it.
    pub registers: Registers,
    /// Error flags after it.
    pub errors: Errors,
}

/// The recorder: the hooks of a virtual module. Switched off it does nothing.
#[derive(Clone, Debug, Default)]
pub struct Tracer {
    on: bool,
    steps: Vec<Step>,
}

impl Tracer {
    /// A recorder that has nothing yet.
    pub fn new(on: bool) -> Self {
        Tracer { on, steps: Vec::new() }
    }

    /// Records from now on, or no more.
    pub fn record(&mut self, on: bool) {
        self.on = on;
    }

    /// What has been recorded since the last call, with times of the firmware's clock.
    pub fn take(&mut self) -> Vec<Step> {
        std::mem::take(&mut self.steps)
    }
}

impl Hooks for Tracer {
    fn executed(&mut self, executed: &Executed, machine: &Machine) {
        if self.on {
            let at = executed.at.0 * MICROSECOND;
            self.steps.push(Step { at, executed: *executed, registers: machine.registers, errors: machine.errors });
        }
    }
}
