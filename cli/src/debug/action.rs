//! The commands of the debugger as the user types them.

use crate::asm::Symbols;
use crate::send::Request;

/// The help text.
pub(super) const HELP: &str = "\
step [N]       s  execute one command, or up to N; a WAIT is waited out
continue       c  run to the next breakpoint; without any, run freely
stop              halt the program that runs freely; so does Ctrl-C
reset             back to address 0, registers and flags cleared
break [PLACE]  b  stop before the command at PLACE; alone: list breakpoints
delete [PLACE] d  remove a breakpoint; alone: remove all
registers      r  mode, program counter, accumulator, X register; of several axes also the positions
axes           a  position and speed of each axis
list [PLACE]   l  the program around the program counter, or from PLACE on
send COMMAND      a direct command, for example: send GAP 1, 0
help           h  this
quit           q  leave; the module stays in the state it is in
A PLACE is an address or a label. Going to the handler of an interrupt is a step.";

/// One command of the debugger.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// Execute this number of commands.
    Step(u32),
    /// Run to the next breakpoint.
    Continue,
    /// Halt the program.
    Stop,
    /// Reset the program.
    Reset,
    /// Set a breakpoint at a label or address, or list all breakpoints.
    Break(Option<String>),
    /// Remove the breakpoint at a label or address, or all breakpoints.
    Delete(Option<String>),
    /// Show the registers.
    Registers,
    /// Show what the axes do.
    Axes,
    /// Show the program around a label or address, or around the program counter.
    List(Option<String>),
    /// Send a command to the module, which executes it at once.
    Send(Request),
    /// Show the help text.
    Help,
    /// End the debugger.
    Quit,
    /// An empty line.
    Nothing,
}

impl Action {
    /// Reads a line. The error is a message for the user.
    pub(super) fn parse(line: &str) -> Result<Self, String> {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let operand = || (!rest.is_empty()).then(|| rest.to_owned());
        let action = match word {
            "step" | "s" => Action::Step(times(rest)?),
            "break" | "b" => Action::Break(operand()),
            "delete" | "d" => Action::Delete(operand()),
            "list" | "l" => Action::List(operand()),
            "send" => Action::Send(Request::read(rest.trim_matches('"'), None, &Symbols::default())?),
            _ => return alone(word, rest),
        };
        Ok(action)
    }
}

/// Reads an action that is a single word.
fn alone(word: &str, rest: &str) -> Result<Action, String> {
    let action = match word {
        "" => Action::Nothing,
        "continue" | "c" => Action::Continue,
        "stop" => Action::Stop,
        "reset" => Action::Reset,
        "registers" | "r" => Action::Registers,
        "axes" | "a" => Action::Axes,
        "help" | "h" | "?" => Action::Help,
        "quit" | "q" => Action::Quit,
        _ => return Err(format!("unknown command '{word}'; help lists them")),
    };
    if rest.is_empty() { Ok(action) } else { Err(format!("'{word}' stands alone, without '{rest}'")) }
}

fn times(text: &str) -> Result<u32, String> {
    if text.is_empty() {
        return Ok(1);
    }
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| format!("how many commands? '{text}' is no such number"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tmcm::tmcl::Command;

    #[test]
    fn lines_are_read() {
        assert_eq!(Action::parse("step"), Ok(Action::Step(1)));
        assert_eq!(Action::parse("  s  12 "), Ok(Action::Step(12)));
        assert_eq!(Action::parse("break Loop"), Ok(Action::Break(Some("Loop".into()))));
        assert_eq!(Action::parse("delete"), Ok(Action::Delete(None)));
        assert_eq!(
            Action::parse("send \"GAP 1, 0\""),
            Ok(Action::Send(Request { command: Command::new(6, 1, 0, 0), numeric: false }))
        );
        assert_eq!(Action::parse("\n"), Ok(Action::Nothing));
    }

    #[test]
    fn mistyped_actions_are_refused_with_a_reason() {
        let told = |line| Action::parse(line).unwrap_err();
        assert!(told("jump").contains("'jump'"));
        assert!(told("step 0").contains("'0'"));
        assert!(told("reset now").contains("'now'"));
        assert!(told("send GOTO").contains("unknown command 'GOTO'"));
    }
}
