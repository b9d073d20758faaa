//! Where samples are shown: as a line of a terminal that is refreshed, as lines for people, or as rows for programs.

use std::io::{StdoutLock, Write};
use std::time::Duration;

use tmcl_tools::monitor::{Column, Object, Sample, Shown, Speeds, headline, line, named, row, short, status, usual};
use tmcl_tools::product::axis_number;
use tmcm::param::AxisParameter;

use crate::failure::Failure;
use crate::tell;
use crate::terminal;

/// The form of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Csv,
    Json,
    /// A line of a terminal, which is refreshed.
    Status,
    /// A line for each axis.
    Lines,
}

/// Standard output, and what is shown there.
pub(super) struct Display {
    out: tell::Shown<StdoutLock<'static>>,
    form: Form,
    axes: Vec<u8>,
    columns: Vec<Column>,
    speeds: Speeds,
    /// The extended error flags of all samples so far, for each axis: the module forgets them when they are read.
    seen: Vec<i32>,
    /// The cursor stands behind a line that has not been ended.
    open: bool,
}

impl Display {
    pub(super) fn new(form: Option<Form>, axes: Vec<u8>, columns: Vec<Column>, speeds: Speeds) -> Self {
        let out = tell::out();
        let form = form.unwrap_or(if out.is_terminal() { Form::Status } else { Form::Lines });
        let seen = vec![0; axes.len()];
        Display { out, form, axes, columns, speeds, seen, open: false }
    }

    /// Writes what comes before all samples.
    pub(super) fn begin(&mut self) -> Result<(), Failure> {
        if self.form == Form::Csv {
            writeln!(self.out, "{}", headline(&self.axes, &self.columns))?;
        }
        Ok(())
    }

    /// Shows a sample of each axis, with times since `begun`.
    pub(super) fn show(&mut self, samples: &[Sample], begun: Duration) -> Result<(), Failure> {
        let flags = axis_number(None, AxisParameter::ExtendedErrorFlags);
        if let Some(place) = self.columns.iter().position(|column| Some(column.number) == flags) {
            for (seen, sample) in self.seen.iter_mut().zip(samples) {
                *seen |= sample.values.get(place).copied().flatten().unwrap_or_default();
            }
        }
        match self.form {
            Form::Csv => writeln!(self.out, "{}", row(samples, begun))?,
            Form::Json => {
                for (axis, sample) in self.axes.iter().zip(samples) {
                    let object = Object { axis: *axis, columns: &self.columns, sample, begun };
                    let object = serde_json::to_string(&object).map_err(std::io::Error::from)?;
                    writeln!(self.out, "{object}")?;
                }
            }
            Form::Status => {
                let width = terminal::columns().saturating_sub(1);
                let line = self.status(samples, width);
                // The line is cut to the terminal's width, because a line that wraps around could not be overwritten.
                self.out.redraw(&format!("{line:.width$}"))?;
                self.open = true;
            }
            Form::Lines => {
                for line in self.lines(samples) {
                    writeln!(self.out, "{line}")?;
                }
            }
        }
        Ok(self.out.flush()?)
    }

    /// The values that are shown of the axes, if their columns are the usual ones.
    fn usual(&self, samples: &[Sample]) -> Option<Vec<Shown>> {
        if self.columns != usual() {
            return None;
        }
        let all = self.axes.iter().zip(samples).zip(&self.seen);
        all.map(|((&axis, sample), &seen)| {
            Some(Shown { axis, sample: sample.values.as_slice().try_into().ok()?, seen })
        })
        .collect()
    }

    /// The line of a terminal with so many columns.
    fn status(&self, samples: &[Sample], width: usize) -> String {
        match self.usual(samples).as_deref() {
            Some([shown]) => short(shown, &self.speeds, width),
            Some(all) => status(all, &self.speeds, width),
            None => self.lines(samples).join("  "),
        }
    }

    /// A line for each axis.
    fn lines(&self, samples: &[Sample]) -> Vec<String> {
        let lines: Vec<String> = match self.usual(samples) {
            Some(all) => all.iter().map(|shown| line(shown, &self.speeds)).collect(),
            None => samples.iter().map(|sample| named(&self.columns, &sample.values)).collect(),
        };
        let several = self.axes.len() > 1;
        let axis = |axis: u8| if several { format!("axis {axis}  ") } else { String::new() };
        self.axes.iter().zip(lines).map(|(number, line)| format!("{}{line}", axis(*number))).collect()
    }

    /// Says something beside the samples.
    pub(super) fn say(&mut self, text: &str) -> Result<(), Failure> {
        self.end_line()?;
        // A closed standard error must not end the program.
        let _ = writeln!(tell::err(), "tmcl: {text}");
        Ok(())
    }

    /// Ends the line that is refreshed, so that what comes next has a line of its own.
    pub(super) fn end_line(&mut self) -> Result<(), Failure> {
        if std::mem::take(&mut self.open) {
            writeln!(self.out)?;
            self.out.flush()?;
        }
        Ok(())
    }
}
