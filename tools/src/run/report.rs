//! The report of a run: how the program ended and what it has done, as values. Text and JSON are made of them.

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use hal_sim::clock::{MICROSECOND, Nanos};
use hal_sim::control::State;
use serde::{Serialize, Serializer};
use tmcm::param::USER_VARIABLES;
use tmcm::tmcl::{Command, Opcode};
use tmcm::vm::{Awaited, ProgramState, Wait};
use tmcm_sim::NativeModule;

use super::mishap::Mishaps;
use super::session::{End, Session};
use super::time::show;
use super::trace::error_flags;
use crate::calc;
use crate::product::{Product, speed_words};
use crate::program::Program;
use crate::program::target;

/// Bank of the user variables.
const VARIABLES: u8 = 2;

/// How a program ended and what it has done. What is not known of a module without power is left out of JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Why the run is over, and where the program is.
    end: String,
    /// True if the program would go on.
    running: bool,
    /// Virtual time that the program has run.
    #[serde(rename = "time_s", serialize_with = "seconds")]
    time: Nanos,
    /// Number of executed commands.
    commands: u64,
    #[serde(flatten)]
    mishaps: Mishaps,
    #[serde(flatten)]
    module: Option<Module>,
    #[serde(flatten)]
    registers: Option<Registers>,
    /// The user variables that have another value than before, by their numbers.
    user_variables: BTreeMap<u8, i32>,
    /// The events by option `--at`, and the host's answers.
    events: Vec<Happened>,
    /// The file with the plot, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plot: Option<String>,
}

/// The state of a module as it is seen from outside.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Module {
    axes: Vec<Axis>,
    /// The digital outputs, OUT0 and up.
    outputs: Vec<bool>,
    /// The unit of the speeds in words.
    #[serde(skip)]
    speed_unit: &'static str,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Axis {
    axis: usize,
    /// In microsteps.
    position: i32,
    /// The target of a positioning that is not over.
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<i32>,
    /// In the unit that speeds of the product are in.
    velocity: i32,
    /// Full steps that the rotor is behind the counter; negative if it is ahead.
    lost_steps: i64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Registers {
    accumulator: i32,
    x: i32,
    /// The error flags that are set, by their names in CLE.
    error_flags: Vec<&'static str>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Happened {
    #[serde(rename = "time_s", serialize_with = "seconds")]
    time: Nanos,
    what: String,
}

/// A time as a number of seconds, to the microsecond.
fn seconds<S: Serializer>(time: &Nanos, serializer: S) -> Result<S::Ok, S::Error> {
    let microseconds = (*time + MICROSECOND / 2) / MICROSECOND;
    serializer.serialize_f64(microseconds as f64 / 1e6)
}

/// The present values of all user variables, by number.
pub fn variables(module: &mut NativeModule) -> Vec<Option<i32>> {
    let numbers = (0..=u8::MAX).take(USER_VARIABLES);
    numbers.map(|number| module.read(Command::new(Opcode::Ggp as u8, number, VARIABLES, 0))).collect()
}

/// Time that the program has run.
pub fn ran(session: &Session<'_>, end: End) -> Nanos {
    match (end, &session.counts.last) {
        (End::Program, Some(step)) => step.at.saturating_sub(session.start),
        _ => session.time(),
    }
}

impl Report {
    /// The report of a run that is over; `before` has the values of the user variables at the start of the program.
    pub fn of(session: &mut Session<'_>, end: End, limit: Nanos, program: &Program, before: &[Option<i32>]) -> Self {
        let now = variables(&mut session.module);
        let changed = (0..=u8::MAX).zip(before.iter().zip(&now)).filter(|(_, (before, now))| before != now);
        let machine = session.module.machine();
        let registers = machine.map(|machine| Registers {
            accumulator: machine.registers.accumulator,
            x: machine.registers.x,
            error_flags: error_flags(machine.errors).collect(),
        });
        Report {
            end: ending(session, end, limit, program),
            running: machine.is_some_and(|machine| machine.runs()),
            time: ran(session, end),
            commands: session.counts.executed,
            mishaps: session.counts.mishaps.clone(),
            module: Module::of(&session.module, session.product()),
            registers,
            user_variables: changed.filter_map(|(number, (_, now))| Some((number, (*now)?))).collect(),
            events: session.notes.iter().map(|(time, what)| Happened { time: *time, what: what.clone() }).collect(),
            plot: None,
        }
    }

    /// The list of what went wrong, for a message; `None` if nothing did.
    pub fn wrong(&self) -> Option<String> {
        let wrong = self.mishaps.all().into_iter().filter(|(_, tally)| tally.count > 0);
        let wrong: Vec<String> = wrong.map(|(name, tally)| format!("{name} {}", tally.times())).collect();
        (!wrong.is_empty()).then(|| wrong.join(", "))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let mut row = |name: &str, value: &str| {
            let _ = writeln!(text, "{name:<18}{value}");
        };
        row("end", &self.end);
        row("virtual time", &show(self.time));
        let refused = match self.mishaps.refused.first_in_words() {
            Some(first) => format!(", {} of them without effect; the first: {first}", self.mishaps.refused.count),
            None => String::new(),
        };
        row("commands executed", &format!("{}{refused}", self.commands));
        for (name, tally) in self.mishaps.all().into_iter().skip(1) {
            if let Some(first) = tally.first_in_words() {
                let which = if tally.count == 1 { "" } else { "; the first" };
                row(name, &format!("{}{which}: {first}", tally.times()));
            }
        }
        match &self.module {
            Some(module) => module.rows(&mut row),
            None => row("power", "off"),
        }
        if let Some(Registers { accumulator, x, error_flags }) = &self.registers {
            row("accumulator", &accumulator.to_string());
            row("X register", &x.to_string());
            let flags = error_flags.join(" ");
            row("error flags", if flags.is_empty() { "none" } else { &flags });
        }
        let variables: Vec<String> =
            self.user_variables.iter().map(|(number, value)| format!("{number} = {value}")).collect();
        row("user variables", &if variables.is_empty() { "as they were".into() } else { variables.join(", ") });
        for (index, Happened { time, what }) in self.events.iter().enumerate() {
            row(if index == 0 { "events" } else { "" }, &format!("{}: {what}", show(*time)));
        }
        if let Some(plot) = &self.plot {
            row("plot", plot);
        }
        f.write_str(&text)
    }
}

impl Module {
    /// Reads what is seen of a module; `None` without power.
    fn of(module: &NativeModule, product: Product) -> Option<Self> {
        module.machine()?;
        let state = State::of(&module.board().borrow());
        let axes = state.axes.iter().enumerate().filter_map(|(number, axis)| {
            let (position, target) = module.position(number)?;
            Some(Axis {
                axis: number,
                position,
                target: target.filter(|target| *target != position),
                velocity: calc::in_usual_unit(product, axis.velocity),
                lost_steps: axis.lost_steps,
            })
        });
        Some(Module { axes: axes.collect(), outputs: state.outputs.clone(), speed_unit: speed_words(product) })
    }

    fn rows(&self, row: &mut impl FnMut(&str, &str)) {
        for Axis { axis, position, target, velocity, lost_steps } in &self.axes {
            let way = target.map_or_else(String::new, |target| format!(" on the way to {target}"));
            let lost = match lost_steps {
                0 => String::new(),
                steps @ 1.. => format!("; the motor has lost steps, it is {steps} full steps behind"),
                steps => format!("; the motor has lost steps, it is {} full steps ahead", steps.unsigned_abs()),
            };
            let position = format!("{position} microsteps{way}{lost}");
            let turns = if *velocity == 0 { "the motor stands" } else { "the motor turns" };
            let velocity = format!("{velocity} ({}): {turns}", self.speed_unit);
            if self.axes.len() == 1 {
                row("position", &position);
                row("velocity", &velocity);
            } else {
                row(&format!("axis {axis}"), &format!("position {position}; velocity {velocity}"));
            }
        }
        let level = |on| if on { "on" } else { "off" };
        let outputs = (0..).zip(&self.outputs).map(|(number, &on)| format!("OUT{number} {}", level(on)));
        row("outputs", &outputs.collect::<Vec<_>>().join(", "));
    }
}

/// The reason why the run is over, and the address of the program.
fn ending(session: &Session<'_>, end: End, limit: Nanos, program: &Program) -> String {
    let Some(machine) = session.module.machine() else { return "the module has no power".into() };
    if machine.runs() {
        let location = program.location(machine.counter());
        let wait = match machine.wait() {
            None => format!("at {location}"),
            Some(Wait::For { awaited, .. }) => format!("in WAIT {} at {location}", awaited_name(awaited)),
            Some(Wait::Store) => format!("waiting for the EEPROM at {location}"),
        };
        return match end {
            End::Signal => format!("interrupted by Ctrl-C, {wait}"),
            End::Time | End::Program => format!("still running after {}, {wait}", show(limit)),
        };
    }
    let Some(step) = &session.counts.last else { return "no command was executed".into() };
    let (command, location) = (step.executed.command, program.location(step.executed.address));
    let outside =
        target(&command).is_some_and(|target| tmcm::vm::address(target, session.product().spec().commands).is_none());
    match Opcode::from_number(command.opcode) {
        Some(Opcode::Stop) => format!("STOP at {location}"),
        _ if machine.state() == ProgramState::Reset => format!("reset from outside, after {location}"),
        _ if command.opcode == 0 => format!("an empty command at {location}: a program ends with STOP"),
        _ if outside => format!("{command} at {location} leads out of program memory"),
        _ => format!("stopped from outside, after {location}"),
    }
}

/// The name of a WAIT's event in programs.
fn awaited_name(awaited: Awaited) -> &'static str {
    match awaited {
        Awaited::Ticks => "TICKS",
        Awaited::Position => "POS",
        Awaited::ReferenceSwitch => "REFSW",
        Awaited::LimitSwitch => "LIMSW",
        Awaited::ReferenceSearch => "RFS",
    }
}
