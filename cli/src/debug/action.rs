//! What the user of the debugger can ask for.

use tmcm::tmcl::Command;

use crate::send;

/// The commands of the debugger, for the user.
pub(super) const HELP: &str = "\
step [N]       s  execute one command, or up to N; a WAIT is waited out
continue       c  run to the next breakpoint; without any, run freely
stop              halt the program that runs freely; so does Ctrl-C
reset             back to address 0, registers and flags cleared
break [PLACE]  b  stop before the command at PLACE; alone: list breakpoints
delete [PLACE] d  remove a breakpoint; alone: remove all
registers      r  mode, program counter, accumulator, X register
list [PLACE]   l  the program around the program counter, or from PLACE on
send COMMAND      a direct command, for example: send GAP 1, 0
help           h  this
quit           q  leave; the module stays in the state it is in
A PLACE is an address or a label. Going to the handler of an interrupt is a step.";

/// One command of the debugger.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// So many commands.
    Step(u32),
    /// To the next breakpoint.
    Continue,
    /// Halt.
    Stop,
    /// Back to the start.
    Reset,
    /// Set a breakpoint at a place, or list all.
    Break(Option<String>),
    /// Remove the breakpoint at a place, or all.
    Delete(Option<String>),
    /// Show the registers.
    Registers,
    /// Show the program.
    List(Option<String>),
    /// A direct command.
    Send(Command),
    /// Show what there is.
    Help,
    /// The end.
    Quit,
    /// An empty line.
    Nothing,
}

impl Action {
    /// Reads a line. The error says what is wrong with it.
    pub(super) fn parse(line: &str) -> Result<Self, String> {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let place = || (!rest.is_empty()).then(|| rest.to_owned());
        let action = match word {
            "step" | "s" => Action::Step(times(rest)?),
            "break" | "b" => Action::Break(place()),
            "delete" | "d" => Action::Delete(place()),
            "list" | "l" => Action::List(place()),
            "send" => Action::Send(send::command(rest.trim_matches('"'))?),
            _ => return alone(word, rest),
        };
        Ok(action)
    }
}

/// The actions that are a single word.
fn alone(word: &str, rest: &str) -> Result<Action, String> {
    let action = match word {
        "" => Action::Nothing,
        "continue" | "c" => Action::Continue,
        "stop" => Action::Stop,
        "reset" => Action::Reset,
        "registers" | "r" => Action::Registers,
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

    #[test]
    fn lines_are_read() {
        assert_eq!(Action::parse("step"), Ok(Action::Step(1)));
        assert_eq!(Action::parse("  s  12 "), Ok(Action::Step(12)));
        assert_eq!(Action::parse("break Loop"), Ok(Action::Break(Some("Loop".into()))));
        assert_eq!(Action::parse("delete"), Ok(Action::Delete(None)));
        assert_eq!(Action::parse("send \"GAP 1, 0\""), Ok(Action::Send(Command::new(6, 1, 0, 0))));
        assert_eq!(Action::parse("\n"), Ok(Action::Nothing));
    }

    #[test]
    fn mistakes_are_told() {
        let told = |line| Action::parse(line).unwrap_err();
        assert!(told("jump").contains("'jump'"));
        assert!(told("step 0").contains("'0'"));
        assert!(told("reset now").contains("'now'"));
        assert!(told("send GOTO").contains("unknown command 'GOTO'"));
    }
}
