//! The report of a run: a few lines about how the program ended and what it has done.

use std::fmt::Write;

use hal_sim::clock::Nanos;
use hal_sim::control::State;
use tmcm::param::USER_VARIABLES;
use tmcm::tmcl::{Command, Opcode};
use tmcm::vm::{Awaited, ProgramState, Wait};

use super::session::{End, Session};
use super::time::show;
use super::trace::error_flags;
use crate::calc;
use crate::conversation::meaning;
use crate::product::{Product, speed_words};
use crate::program::Program;
use crate::program::target;
use tmcm_sim::NativeModule;
use tmcm_sim::tracer::Step;

/// Bank of the user variables.
const VARIABLES: u8 = 2;

/// The present values of all user variables, by number.
pub(super) fn variables(module: &mut NativeModule) -> Vec<Option<i32>> {
    let numbers = (0..=u8::MAX).take(USER_VARIABLES);
    numbers.map(|number| module.read(Command::new(Opcode::Ggp as u8, number, VARIABLES, 0))).collect()
}

/// Time that the program has run.
pub(super) fn time(session: &Session<'_>, end: End) -> Nanos {
    match (end, &session.counts.last) {
        (End::Program, Some(step)) => step.at.saturating_sub(session.start),
        _ => session.time(),
    }
}

/// The report; `before` has the values of the user variables at the start of the program.
pub(super) fn report(
    session: &mut Session<'_>,
    end: End,
    limit: Nanos,
    program: &Program,
    before: &[Option<i32>],
) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut row = |name: &str, value: &str| {
        let _ = writeln!(text, "{name:<18}{value}");
    };
    row("end", &ending(session, end, limit, program));
    row("virtual time", &show(time(session, end)));
    let counts = &session.counts;
    let refused = match &counts.first_refused {
        Some(step) => format!(", {} of them without effect; the first: {}", counts.refused, refusal(step, program)),
        None => String::new(),
    };
    row("commands executed", &format!("{}{refused}", counts.executed));
    motors_and_pins(&session.module, session.product(), &mut row);
    if let Some(machine) = session.module.machine() {
        row("accumulator", &machine.registers.accumulator.to_string());
        row("X register", &machine.registers.x.to_string());
        let flags = error_flags(machine.errors).collect::<Vec<_>>().join(" ");
        row("error flags", if flags.is_empty() { "none" } else { &flags });
    }
    let now = variables(&mut session.module);
    let changed = (0..).zip(before.iter().zip(&now)).filter(|(_, (before, now))| before != now);
    let changed: Vec<String> =
        changed.filter_map(|(number, (_, now))| Some(format!("{number} = {}", (*now)?))).collect();
    row("user variables", &if changed.is_empty() { "as they were".into() } else { changed.join(", ") });
    for (index, (at, note)) in session.notes.iter().enumerate() {
        row(if index == 0 { "events" } else { "" }, &format!("{}: {note}", show(*at)));
    }
    text
}

fn motors_and_pins(module: &NativeModule, product: Product, row: &mut impl FnMut(&str, &str)) {
    let state = State::of(&module.board().borrow());
    if module.machine().is_none() {
        return row("power", "off");
    }
    for (number, axis) in state.axes.iter().enumerate() {
        let Some((position, target)) = module.position(number) else { continue };
        let target = target.filter(|target| *target != position);
        let way = target.map_or_else(String::new, |target| format!(" on the way to {target}"));
        let lost = match axis.lost_steps {
            0 => String::new(),
            steps @ 1.. => format!("; the motor has lost steps, it is {steps} full steps behind"),
            steps => format!("; the motor has lost steps, it is {} full steps ahead", steps.unsigned_abs()),
        };
        let position = format!("{position} microsteps{way}{lost}");
        let turns = if axis.velocity == 0 { "the motor stands" } else { "the motor turns" };
        let velocity = calc::in_usual_unit(product, axis.velocity);
        let velocity = format!("{velocity} ({}): {turns}", speed_words(product));
        if state.axes.len() == 1 {
            row("position", &position);
            row("velocity", &velocity);
        } else {
            row(&format!("axis {number}"), &format!("position {position}; velocity {velocity}"));
        }
    }
    let level = |on| if on { "on" } else { "off" };
    let outputs = (0..).zip(&state.outputs).map(|(number, &on)| format!("OUT{number} {}", level(on)));
    row("outputs", &outputs.collect::<Vec<_>>().join(", "));
}

/// A refused command and the reason of the refusal.
fn refusal(step: &Step, program: &Program) -> String {
    let (command, location) = (program.text(&step.executed.command), program.location(step.executed.address));
    let why = step.executed.refused.map_or("", |status| meaning(status as u8));
    format!("{command} at {location}: {why}")
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
