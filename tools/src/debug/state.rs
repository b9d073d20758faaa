//! Facts that the debugger knows and tells, as values. Of these `words` makes the text, and anything else that shows a
//! program step by step can show the same.

use serde::Serialize;
use tmcm_sim::wire::Reply;

use crate::program::Line;

/// State of the program, as global parameter 128 and command 135 number it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// The program has been stopped, or has ended.
    Stopped,
    /// The program runs freely.
    Running,
    /// The program is executed step by step.
    Stepping,
    /// The program has been reset.
    Reset,
    /// A number that is not known here.
    Unknown(u8),
}

/// The reply to command 135, type 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct State {
    /// The state of the program.
    pub program: RunState,
    /// True while the program is in a WAIT.
    pub waiting: bool,
    /// The program counter.
    pub counter: u16,
}

impl State {
    /// The state in the value of the reply.
    pub(super) fn of(value: i32) -> Self {
        let [mode, waiting, high, low] = value.to_be_bytes();
        let program = match mode {
            0 => RunState::Stopped,
            1 => RunState::Running,
            2 => RunState::Stepping,
            3 => RunState::Reset,
            number => RunState::Unknown(number),
        };
        State { program, waiting: waiting != 0, counter: u16::from_be_bytes([high, low]) }
    }
}

/// A command of the program with what is known of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Row {
    /// The address of the command.
    pub address: u16,
    /// The labels of the address.
    pub labels: Vec<String>,
    /// True at the program counter.
    pub current: bool,
    /// True where there is a breakpoint.
    pub breakpoint: bool,
    /// The command; `None` behind the end of the program in the file.
    pub command: Option<String>,
    /// The line of the command in the source, if there is one.
    pub line: Option<Line>,
}

/// The reason why a program is halted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The program has been reset, or it was halted already.
    Resting,
    /// The steps that were asked for are done.
    Stepped,
    /// The program has come to a breakpoint.
    Breakpoint,
    /// The program has ended by its last command.
    Ended,
    /// The user has interrupted the program.
    Interrupted,
}

/// A program that is halted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Halt {
    /// Why.
    pub reason: Reason,
    /// The commands around the next one.
    pub around: Vec<Row>,
    /// The watched values that are other ones than at the last halt.
    pub changed: Vec<Change>,
}

/// A value of the module or the program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Reading {
    /// The quantity that the value is of, as it can be typed.
    pub of: String,
    /// The value.
    pub value: i64,
    /// The unit of the value; empty if it has none.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub unit: &'static str,
    /// The name of the quantity in the manual.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

/// A value that has changed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Change {
    /// The value at the last halt.
    pub before: i64,
    /// The present value.
    pub now: Reading,
}

/// The registers of the program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Registers {
    /// The state of the program.
    pub state: State,
    /// The accumulator.
    pub accumulator: i32,
    /// The X register.
    pub x: i32,
    /// The positions of the axes in microsteps, of a module with several.
    pub positions: Vec<i32>,
}

/// An axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Axis {
    /// The number of the axis.
    pub number: u8,
    /// The position of the axis in microsteps.
    pub position: i32,
    /// The speed of the axis.
    pub speed: i32,
    /// The speed of the axis with the unit.
    pub shown: String,
}

/// A breakpoint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Stop {
    /// The command before which the program halts.
    pub row: Row,
    /// The condition, as it was typed.
    pub condition: Option<String>,
}

/// All that there is to be seen of a program at once.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct View {
    /// The registers.
    pub registers: Registers,
    /// The user variables that the program uses.
    pub variables: Vec<Reading>,
    /// The values that are watched.
    pub watched: Vec<Reading>,
    /// The breakpoints.
    pub breakpoints: Vec<Stop>,
    /// The next command, or the one with which the program has ended; `None` while the program runs.
    pub next: Option<Row>,
    /// Whether the last step has ended the program: the next one begins it anew.
    pub ended: bool,
}

/// The outcome of an action of the user.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Told {
    /// Nothing is to be told.
    Nothing,
    /// The text of the help.
    Help,
    /// The program runs freely.
    Running,
    /// The program is halted.
    Halted(Halt),
    /// The registers.
    Registers(Registers),
    /// The axes.
    Axes(Vec<Axis>),
    /// A part of the program.
    Listing(Vec<Row>),
    /// The breakpoints, or the one that was set.
    Breakpoints(Vec<Stop>),
    /// Values that were asked for.
    Values(Vec<Reading>),
    /// The values that are watched now; nothing is watched if there are none.
    Watched(Vec<Reading>),
    /// The reply to a command that was sent; `None` if the command has none.
    Reply {
        /// The command.
        command: String,
        /// The reply.
        reply: Option<Reply>,
    },
    /// The file was loaded again.
    Reloaded {
        /// The number of commands.
        commands: usize,
        /// Places of breakpoints, and watched values, that are no more.
        lost: Vec<String>,
        /// Where the program is halted.
        halt: Halt,
    },
}

/// The state in which the debugger leaves a module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Farewell {
    /// The state of the program.
    pub state: State,
    /// The axes that move.
    pub moving: Vec<Axis>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Other views that show a program step by step get the same values as the text.
    #[test]
    fn values_can_be_sent_as_json() {
        let row = Row {
            address: 7,
            labels: vec!["Back".into()],
            current: true,
            breakpoint: false,
            command: Some("MVP ABS, 0, 0".into()),
            line: Some(Line { position: "14".into(), text: "Back: MVP ABS, Motor0, 0".into() }),
        };
        let now = Reading { of: "acc".into(), value: 5, unit: "", name: None };
        let halt = Halt { reason: Reason::Breakpoint, around: vec![row], changed: vec![Change { before: 4, now }] };
        let expected = r#"{"halted":{"reason":"breakpoint","around":[{"address":7,"labels":["Back"],"current":true,"breakpoint":false,"command":"MVP ABS, 0, 0","line":{"position":"14","text":"Back: MVP ABS, Motor0, 0"}}],"changed":[{"before":4,"now":{"of":"acc","value":5}}]}}"#;
        assert_eq!(serde_json::to_string(&Told::Halted(halt)).unwrap(), expected);
        let state = State::of(0x0201_0007);
        assert_eq!(state, State { program: RunState::Stepping, waiting: true, counter: 7 });
        assert_eq!(serde_json::to_string(&state).unwrap(), r#"{"program":"stepping","waiting":true,"counter":7}"#);
    }
}
