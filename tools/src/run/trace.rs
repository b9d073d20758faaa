//! The trace: a line for each command that the program has executed.

use std::fmt::Write;

use hal_sim::clock::{MILLISECOND, Nanos};
use tmcm::vm::{Condition, ErrorFlag, Errors, Registers};
use tmcm_sim::tracer::Step;
use tmcm_sim::wire::meaning;

use crate::failure::Failure;
use crate::program::Program;

/// Widths in characters of the columns of labels and commands; longer ones push the rest of their line to the right.
const LABEL: usize = 16;
const COMMAND: usize = 28;

/// Length from which on buffered lines are written, in bytes.
const CHUNK: usize = 1 << 16;

/// A trace, and the width of its first column.
pub struct Trace<'a> {
    /// Takes its text, some lines at a time; false if it can take no more.
    out: &'a mut dyn FnMut(&str) -> bool,
    /// Lines that have not been written yet.
    lines: String,
    label_width: usize,
}

impl<'a> Trace<'a> {
    /// Begins a trace. `out` takes its text, some lines at a time, and tells by false that it can take no more, which
    /// ends the run.
    pub fn begin(out: &'a mut dyn FnMut(&str) -> bool, program: &Program) -> Self {
        // A label is followed by a colon and a space.
        let longest = program.labels.iter().map(|(name, _)| name.chars().count() + 2).max();
        let label_width = longest.unwrap_or_default().min(LABEL);
        let lines = format!(
            "{:>12} {:>5}  {:label_width$}{:COMMAND$} {:>11} {:>11}  flags\n",
            "time in ms", "at", "", "command", "accumulator", "X"
        );
        Trace { out, lines, label_width }
    }

    /// Writes a line.
    fn write(&mut self, line: &str) -> Result<(), Failure> {
        // Writing to a string cannot fail.
        let _ = writeln!(self.lines, "{}", line.trim_end());
        if self.lines.len() < CHUNK {
            return Ok(());
        }
        self.flush()
    }

    /// Hands out the lines that are left.
    fn flush(&mut self) -> Result<(), Failure> {
        match (self.out)(&std::mem::take(&mut self.lines)) {
            true => Ok(()),
            false => Err(Failure::Failed("the trace cannot be written".into())),
        }
    }

    /// Writes the line of a command executed at a time since the start of the program.
    pub(super) fn step(&mut self, at: Nanos, step: &Step, program: &Program) -> Result<(), Failure> {
        let (address, label_width) = (step.executed.address, self.label_width);
        let label = program.label(address).map_or_else(String::new, |label| format!("{label}: "));
        let command = program.text(&step.executed.command);
        let Registers { accumulator, x, .. } = step.registers;
        let flags = flags(&step.registers, step.errors);
        let effect = match step.executed.refused {
            Some(status) => format!("{}no effect: {}", if flags.is_empty() { "" } else { "  " }, meaning(status as u8)),
            None => String::new(),
        };
        let line = format!(
            "{:>12.3} {address:>5}  {label:label_width$}{command:COMMAND$} {accumulator:>11} {x:>11}  {flags}{effect}",
            milliseconds(at)
        );
        self.write(&line)
    }

    /// Writes the line of an event of option `--at`.
    pub(super) fn note(&mut self, at: Nanos, text: &str) -> Result<(), Failure> {
        self.write(&format!("{:>12.3}        // {text}", milliseconds(at)))
    }

    /// Writes what is left.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        self.flush()
    }
}

fn milliseconds(time: Nanos) -> f64 {
    time as f64 / MILLISECOND as f64
}

/// The flags that are set, by their names in JC.
pub(super) fn flags(registers: &Registers, errors: Errors) -> String {
    let conditions =
        [(Condition::Zero, "ZE"), (Condition::Equal, "EQ"), (Condition::Greater, "GT"), (Condition::Lower, "LT")];
    let met = conditions.iter().filter(|(condition, _)| registers.meets(*condition, errors));
    let errors = error_flags(errors);
    met.map(|(_, name)| *name).chain(errors).collect::<Vec<_>>().join(" ")
}

/// The error flags that are set, by their names in CLE.
pub(super) fn error_flags(errors: Errors) -> impl Iterator<Item = &'static str> {
    let flags = [
        (ErrorFlag::Timeout, "ETO"),
        (ErrorFlag::Alarm, "EAL"),
        (ErrorFlag::Deviation, "EDV"),
        (ErrorFlag::Position, "EPO"),
        (ErrorFlag::Shutdown, "ESD"),
    ];
    flags.into_iter().filter(move |(flag, _)| errors.raised(*flag)).map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_have_the_names_of_the_manual() {
        let mut registers = Registers::default();
        let mut errors = Errors::default();
        assert_eq!(flags(&registers, errors), "");
        registers.compare(0);
        assert_eq!(flags(&registers, errors), "ZE EQ");
        registers.compare(7);
        errors.raise(ErrorFlag::Position);
        errors.raise(ErrorFlag::Timeout);
        assert_eq!(flags(&registers, errors), "LT ETO EPO");
    }
}
