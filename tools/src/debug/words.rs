//! The text that the debugger shows, made of the values of [`state`](super::state).

use tmcm_sim::wire::Meaning;

use super::state::{Axis, Change, Farewell, Halt, Reading, Reason, Registers, Row, RunState, Stop, Told};
use crate::product::with_unit;

/// Width of the column of commands; the source line follows behind it.
const SOURCE: usize = 30;

/// The help text.
const HELP: &str = "\
step [N]       s  execute one command, or up to N; a WAIT is waited out
next [N]       n  the same, but a CSUB with all of its subroutine is one command
continue       c  run to the next breakpoint; without any, run freely
stop              halt the program that runs freely; so does Ctrl-C
reset             back to address 0, registers and flags cleared
break [PLACE]  b  stop before the command at PLACE; alone: list breakpoints
break PLACE if WHAT > VALUE    only if this is so; also >= < <= == !=
delete [PLACE] d  remove a breakpoint; alone: remove all
registers      r  mode, program counter, accumulator, X register; of several axes also the positions
axes           a  position and speed of each axis
print WHAT     p  a value
set WHAT VALUE    change it; acc and x only while the program is halted
watch [WHAT]   w  show it at each stop if it has changed; alone: all that is watched
unwatch [WHAT]    show it no more; alone: nothing
list [PLACE]   l  the program around the program counter, or from PLACE on
reload            assemble and load the file again; breakpoints stay
send COMMAND      a direct command, for example: send GAP APActualPosition, 0
help           h  this
quit           q  leave; the module stays in the state it is in
An empty line repeats the last command. Going to the handler of an interrupt is a step.
PLACE: an address, Label, Label + 1, or :12 for line 12 of the source (included.tmc:12 of another file).
WHAT: acc, x, pc, variable N, the name of such a number, a parameter by its name in tmcl asm --names (behind it the
axis, as in APActualSpeed 1), a label or constant, an expression. VALUE: an expression, also behind a =.
register acc, register x and register pc are the registers where the program gives these names to something else.
set acc and set x leave the flag that JC ZE asks for as CALC LOAD of the accumulator does.";

/// The text of what an action leads to, without the values that have changed; empty if there is none.
pub fn text(told: &Told) -> String {
    match told {
        Told::Nothing => String::new(),
        Told::Help => HELP.into(),
        Told::Running => "running; stop halts it".into(),
        Told::Halted(halted) => halt(halted),
        Told::Registers(shown) => registers(shown),
        Told::Axes(axes) => joined(axes.iter().map(axis)),
        Told::Listing(rows) => joined(rows.iter().map(row)),
        Told::Breakpoints(stops) if stops.is_empty() => "no breakpoints".into(),
        Told::Breakpoints(stops) => joined(stops.iter().map(stop)),
        Told::Values(values) => joined(values.iter().map(reading)),
        Told::Watched(values) if values.is_empty() => "nothing is watched".into(),
        Told::Watched(values) => joined(values.iter().map(reading)),
        Told::Reply { command, reply } => format!("{command}: {}", Meaning::from(reply.as_ref()).text),
        Told::Reloaded { commands, lost, halt: halted } => {
            let lines = lost.iter().map(|what| format!("no longer there: {what}"));
            let loaded = format!("loaded {commands} command{}", if *commands == 1 { "" } else { "s" });
            joined([loaded].into_iter().chain(lines).chain([halt(halted)]))
        }
    }
}

/// The lines about values that have changed.
pub fn changes(told: &Told) -> impl Iterator<Item = String> {
    let halt = match told {
        Told::Halted(halt) | Told::Reloaded { halt, .. } => Some(halt),
        _ => None,
    };
    halt.into_iter().flat_map(|halt| halt.changed.iter().map(change))
}

/// The text about the state in which a module is left.
pub fn farewell(Farewell { state, moving }: &Farewell) -> String {
    let first = match state.program {
        RunState::Running => "the program goes on running in the module; command 128 stops it".into(),
        _ => format!("the program is stopped at address {}", state.counter),
    };
    let axes = moving
        .iter()
        .map(|Axis { number, shown, .. }| format!("motor {number} turns with speed {shown}; MST {number} stops it"));
    joined([first].into_iter().chain(axes))
}

fn joined(lines: impl Iterator<Item = String>) -> String {
    lines.collect::<Vec<_>>().join("\n")
}

fn halt(Halt { reason, around, .. }: &Halt) -> String {
    let reason = match reason {
        Reason::Resting | Reason::Stepped => None,
        Reason::Breakpoint => Some("breakpoint"),
        Reason::Ended => Some("the program has ended; the next step begins it again"),
        Reason::Interrupted => Some("interrupted"),
    };
    joined(reason.map(String::from).into_iter().chain(around.iter().map(row)))
}

/// The lines that show a command: the labels of its address, then an arrow at the program counter, a star at a
/// breakpoint, the command and its source line.
fn row(Row { address, labels, current, breakpoint, command, line }: &Row) -> String {
    let labels: String = labels.iter().map(|name| format!("{name}:\n")).collect();
    let arrow = if *current { '>' } else { ' ' };
    let star = if *breakpoint { '*' } else { ' ' };
    let command = command.as_deref().unwrap_or("(not in the file)");
    let shown = format!("{labels}{arrow}{star}{address:5}  ");
    match line {
        Some(line) => format!("{shown}{command:SOURCE$} {:>4}  {}", line.position, line.text),
        None => shown + command,
    }
}

fn stop(Stop { row: shown, condition }: &Stop) -> String {
    match condition {
        Some(condition) => format!("{}\n         if {condition}", row(shown)),
        None => row(shown),
    }
}

fn reading(Reading { of, value, unit, name }: &Reading) -> String {
    format!("{of} = {}{}", quantity(*value, unit), behind(name.as_deref()))
}

fn change(Change { before, now: Reading { of, value, unit, name } }: &Change) -> String {
    format!("{of} = {}, before {before}{}", quantity(*value, unit), behind(name.as_deref()))
}

fn quantity(value: i64, unit: &str) -> String {
    i32::try_from(value).map_or_else(|_| value.to_string(), |value| with_unit(value, unit))
}

fn behind(name: Option<&str>) -> String {
    name.map_or_else(String::new, |name| format!(" ({name})"))
}

fn registers(Registers { state, accumulator, x, positions }: &Registers) -> String {
    let mode = match state.program {
        RunState::Stopped => "stopped".into(),
        RunState::Running => "running".into(),
        RunState::Stepping => "step by step".into(),
        RunState::Reset => "reset".into(),
        RunState::Unknown(number) => format!("unknown mode {number}"),
    };
    let waiting = if state.waiting { ", in a WAIT" } else { "" };
    let counter = state.counter;
    let first = format!("{mode}{waiting}, program counter {counter}, accumulator {accumulator}, X {x}");
    if positions.is_empty() {
        return first;
    }
    format!("{first}\npositions {}", positions.iter().map(i32::to_string).collect::<Vec<_>>().join(", "))
}

fn axis(Axis { number, position, shown, .. }: &Axis) -> String {
    format!("axis {number}: position {position}, speed {shown}")
}
