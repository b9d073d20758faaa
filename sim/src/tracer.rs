//! A recorder of the commands that a program in a virtual module executes.

use hal_sim::clock::Nanos;
use tmcm::module::{Executed, Hooks};
use tmcm::units::Micros;
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
    steps: Vec<(Executed, Registers, Errors)>,
}

impl Tracer {
    /// Switches the recorder on or off.
    pub fn record(&mut self, on: bool) {
        self.on = on;
    }

    /// The commands recorded since the last call; `when` makes virtual time of the firmware's.
    pub fn take(&mut self, when: impl Fn(Micros) -> Nanos) -> Vec<Step> {
        let step = |(executed, registers, errors): (Executed, Registers, Errors)| Step {
            at: when(executed.at),
            executed,
            registers,
            errors,
        };
        std::mem::take(&mut self.steps).into_iter().map(step).collect()
    }
}

impl Hooks for Tracer {
    fn executed(&mut self, executed: &Executed, registers: &Registers, errors: Errors) {
        if self.on {
            self.steps.push((*executed, *registers, errors));
        }
    }
}
