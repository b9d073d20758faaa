//! Mishaps, which do not stop a program: refused commands, divisions by zero, a return stack that is full or empty.
//! Each is counted, and the first is kept with its place.

use serde::Serialize;
use tmcm::tmcl::{Command, Opcode};
use tmcm_sim::tracer::Step;
use tmcm_sim::wire::meaning;

use crate::program::{Line, Program};

/// Types of CALC and CALCX that divide: DIV and MOD (manual section 3.7.33).
const DIVIDES: [u8; 2] = [3, 4];

/// A kind of mishap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Refused,
    DivisionByZero,
    StackFull,
    StackEmpty,
}

impl Kind {
    /// Why the command did not do what it says.
    fn reason(self, step: &Step) -> &'static str {
        match self {
            Kind::Refused => step.executed.refused.map_or("", |status| meaning(status as u8)),
            Kind::DivisionByZero if step.executed.command.kind == DIVIDES[0] => "the result is 0",
            Kind::DivisionByZero => "the accumulator keeps its value",
            Kind::StackFull => "the return stack is full, the subroutine is not called",
            Kind::StackEmpty => "the return stack is empty, the program goes on behind it",
        }
    }
}

/// A command and where it stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Place {
    /// The command as text.
    command: String,
    /// The address of the command in program memory.
    address: u16,
    /// The line of the command in the source; left out for an assembled program.
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<usize>,
    /// The included file in which this line is.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// Why it did not do what it says.
    reason: &'static str,
    /// The place in words.
    #[serde(skip)]
    location: String,
}

/// How often something has happened, and where it did first.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct Tally {
    pub(super) count: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) first: Option<Place>,
}

impl Tally {
    fn add(&mut self, kind: Kind, step: &Step, program: &Program) {
        self.count += 1;
        self.first.get_or_insert_with(|| {
            let address = step.executed.address;
            let (file, line) = program.line(address).map(Line::place).unzip();
            Place {
                command: program.text(&step.executed.command),
                address,
                line,
                file: file.flatten().map(Into::into),
                reason: kind.reason(step),
                location: program.location(address),
            }
        });
    }

    /// The number in words.
    pub(super) fn times(&self) -> String {
        if self.count == 1 { "once".into() } else { format!("{} times", self.count) }
    }

    /// The first in words.
    pub(super) fn first_in_words(&self) -> Option<String> {
        let Place { command, line, file, reason, location, .. } = self.first.as_ref()?;
        let file = file.as_ref().map_or_else(String::new, |file| format!("{file}:"));
        let line = line.map_or_else(String::new, |line| format!(", line {file}{line}"));
        Some(format!("{command} at {location}{line}: {reason}"))
    }
}

/// All that went wrong.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct Mishaps {
    pub(super) refused: Tally,
    pub(super) divisions_by_zero: Tally,
    pub(super) stack_full: Tally,
    pub(super) stack_empty: Tally,
    /// The last CSUB or RSUB of the program, and of its interrupt handlers, until it is seen where it has led.
    #[serde(skip)]
    undecided: [Option<Step>; 2],
}

impl Mishaps {
    /// Takes note of an executed command.
    pub(super) fn take(&mut self, step: &Step, program: &Program) {
        let executed = &step.executed;
        // A handler begins between any two commands, and has calls and returns of its own.
        let context = usize::from(executed.handler);
        if let Some(jump) = self.undecided.get_mut(context).and_then(Option::take) {
            // Without its effect a call or return is followed by the command behind it. No return leads there, because
            // the command before that is the return itself and not a call.
            if jump.executed.address.checked_add(1) == Some(executed.address) {
                match Opcode::from_number(jump.executed.command.opcode) {
                    Some(Opcode::Csub) => self.stack_full.add(Kind::StackFull, &jump, program),
                    _ => self.stack_empty.add(Kind::StackEmpty, &jump, program),
                }
            }
        }
        if executed.command.opcode == Opcode::Stop as u8 {
            // A handler that ends the program is not gone on with.
            self.undecided = [None; 2];
            return;
        }
        if executed.refused.is_some() {
            self.refused.add(Kind::Refused, step, program);
            return;
        }
        let Command { opcode, kind, value, .. } = executed.command;
        let opcode = Opcode::from_number(opcode);
        let divisor = match opcode {
            Some(Opcode::Calc) => Some(value),
            // The X register is the divisor, and stays what it is.
            Some(Opcode::Calcx) => Some(step.registers.x),
            _ => None,
        };
        if divisor == Some(0) && DIVIDES.contains(&kind) {
            self.divisions_by_zero.add(Kind::DivisionByZero, step, program);
        }
        // A call of what stands behind it leads there with a full stack as well as with one that has room.
        let leads_on = value == i32::from(executed.address) + 1;
        let leads = matches!((opcode, leads_on), (Some(Opcode::Csub), false) | (Some(Opcode::Rsub), _));
        if let Some(undecided) = self.undecided.get_mut(context).filter(|_| leads) {
            *undecided = Some(*step);
        }
    }

    /// All tallies, each with the name of what it counts.
    pub(super) fn all(&self) -> [(&'static str, &Tally); 4] {
        [
            ("refused", &self.refused),
            ("division by 0", &self.divisions_by_zero),
            ("stack full", &self.stack_full),
            ("stack empty", &self.stack_empty),
        ]
    }
}
