//! A recorder of the commands that a program in a virtual module executes.

use hal_sim::clock::{MICROSECOND, Nanos};
use tmcm::module::{Executed, Hooks};
use tmcm::vm::{Errors, Registers};

/// An executed command and the state of the program after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// When the command was executed, in virtual time.
    pub at: Nanos,
    /// The command, its address and whether it was refused.
    pub executed: Executed,
    /// Accumulator, X register and arithmetic flags after the command.
    pub registers: Registers,
    /// Error flags after the command.
    pub errors: Errors,
}

/// The recorder, which the firmware calls as its [`Hooks`]. Switched off, it records nothing.
#[derive(Clone, Debug, Default)]
pub struct Tracer {
    on: bool,
    steps: Vec<Step>,
}

impl Tracer {
    /// An empty recorder, switched on or off.
    pub fn new(on: bool) -> Self {
        Tracer { on, steps: Vec::new() }
    }

    /// Switches the recorder on or off.
    pub fn record(&mut self, on: bool) {
        self.on = on;
    }

    /// The commands recorded since the last call. Their times count from the start of the firmware.
    pub fn take(&mut self) -> Vec<Step> {
        std::mem::take(&mut self.steps)
    }
}

impl Hooks for Tracer {
    fn executed(&mut self, executed: &Executed, registers: &Registers, errors: Errors) {
        if self.on {
            let at = executed.at.0 * MICROSECOND;
            self.steps.push(Step { at, executed: *executed, registers: *registers, errors });
        }
    }
}
