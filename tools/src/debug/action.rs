//! The commands of the debugger as the user types them.

use tmcm_sim::suggest::suggestion;

use crate::suggest::module_command;

/// The words of the commands.
pub const WORDS: [&str; 18] = [
    "step",
    "next",
    "continue",
    "stop",
    "reset",
    "break",
    "delete",
    "registers",
    "axes",
    "print",
    "set",
    "watch",
    "unwatch",
    "list",
    "reload",
    "send",
    "help",
    "quit",
];

/// A command of the debugger.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Execute this number of commands.
    Step(u32),
    /// The same, with subroutines as one command.
    Next(u32),
    /// Run to the next breakpoint.
    Continue,
    /// Halt the program.
    Stop,
    /// Reset the program.
    Reset,
    /// Set a breakpoint at a place, or list all breakpoints.
    Break(Option<String>),
    /// Remove the breakpoint at a place, or all breakpoints.
    Delete(Option<String>),
    /// Show the registers.
    Registers,
    /// Show what the axes do.
    Axes,
    /// Show a value.
    Print(String),
    /// Change a value.
    Set(String),
    /// Show a value at each stop, or all values that are shown.
    Watch(Option<String>),
    /// Show a value no more, or none.
    Unwatch(Option<String>),
    /// Show the program around a place, or around the program counter.
    List(Option<String>),
    /// Show the program behind what was shown last.
    More,
    /// Read the file again and load it.
    Reload,
    /// Send a command to the module, which executes it at once.
    Send(String),
    /// Show the help text.
    Help,
    /// End the debugger.
    Quit,
}

impl Action {
    /// Reads a line that is not empty. The error is a message for the user.
    pub fn parse(line: &str) -> Result<Self, String> {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let operand = || (!rest.is_empty()).then(|| rest.to_owned());
        let action = match word {
            "step" | "s" => Action::Step(times(rest)?),
            "next" | "n" => Action::Next(times(rest)?),
            "break" | "b" => Action::Break(operand()),
            "delete" | "d" => Action::Delete(operand()),
            "print" | "p" => Action::Print(rest.into()),
            "set" => Action::Set(rest.into()),
            "watch" | "w" => Action::Watch(operand()),
            "unwatch" => Action::Unwatch(operand()),
            "list" | "l" => Action::List(operand()),
            "send" => Action::Send(rest.trim_matches('"').into()),
            _ => return alone(word, rest, line),
        };
        Ok(action)
    }

    /// The action of an empty line behind this one.
    pub fn again(&self) -> Self {
        match self {
            Action::List(_) => Action::More,
            action => action.clone(),
        }
    }
}

/// Reads an action that is a single word.
fn alone(word: &str, rest: &str, line: &str) -> Result<Action, String> {
    let action = match word {
        "continue" | "c" => Action::Continue,
        "stop" => Action::Stop,
        "reset" => Action::Reset,
        "registers" | "r" => Action::Registers,
        "axes" | "a" => Action::Axes,
        "reload" => Action::Reload,
        "help" | "h" | "?" => Action::Help,
        "quit" | "q" => Action::Quit,
        _ => return Err(unknown(word, line)),
    };
    if rest.is_empty() { Ok(action) } else { Err(format!("'{word}' stands alone, without '{rest}'")) }
}

/// Message about a line that is no command of the debugger.
fn unknown(word: &str, line: &str) -> String {
    let small = word.to_lowercase();
    if small != word && !matches!(Action::parse(&small), Err(message) if message.starts_with(UNKNOWN)) {
        return format!("{UNKNOWN} '{word}'; they are written in small letters: '{small}'");
    }
    if let Some(command) = module_command(line) {
        return format!("{UNKNOWN} '{word}'; did you mean 'send {command}'?");
    }
    match suggestion(word, WORDS.into_iter()) {
        none if none.is_empty() => format!("{UNKNOWN} '{word}'; help lists them"),
        suggestion => format!("{UNKNOWN} '{word}'{suggestion}"),
    }
}

/// Beginning of the message about an unknown command.
const UNKNOWN: &str = "unknown command";

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
        assert_eq!(Action::parse("n"), Ok(Action::Next(1)));
        assert_eq!(Action::parse("break Loop + 1"), Ok(Action::Break(Some("Loop + 1".into()))));
        assert_eq!(Action::parse("delete"), Ok(Action::Delete(None)));
        assert_eq!(Action::parse("send \"GAP 1, 0\""), Ok(Action::Send("GAP 1, 0".into())));
        assert_eq!(Action::parse("set acc 5"), Ok(Action::Set("acc 5".into())));
        assert_eq!(Action::List(Some("Loop".into())).again(), Action::More);
        assert_eq!(Action::Step(3).again(), Action::Step(3));
    }

    /// Each command that the help and the completion know can be typed.
    #[test]
    fn each_word_is_a_command() {
        for word in WORDS {
            assert!(Action::parse(word).is_ok(), "{word}");
        }
    }

    #[test]
    fn mistyped_actions_are_refused_with_a_reason() {
        let told = |line| Action::parse(line).unwrap_err();
        assert_eq!(told("jump"), "unknown command 'jump'; help lists them");
        assert_eq!(told("STEP 3"), "unknown command 'STEP'; they are written in small letters: 'step'");
        assert_eq!(told("contineu"), "unknown command 'contineu'; did you mean 'continue'?");
        assert_eq!(told("gap 1, 0"), "unknown command 'gap'; did you mean 'send GAP 1, 0'?");
        assert!(told("step 0").contains("'0'"));
        assert!(told("reset now").contains("'now'"));
    }
}
