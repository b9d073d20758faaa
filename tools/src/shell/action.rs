//! Actions that a line of the shell asks for.

use tmcm::tmcl::Command;
use tmcm_sim::suggest::suggestion;

use crate::asm::{self, Symbols};
use crate::product::Product;

/// The words of the shell that are no commands of the module.
pub const WORDS: [&str; 6] = ["watch", "jog", "help", "quit", "exit", "axis"];

/// An action that a line asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Nothing.
    Nothing,
    /// To be told what can be typed.
    Help,
    /// To end.
    Quit,
    /// A command to the module.
    Send {
        /// The command.
        command: Command,
        /// True if it was typed in numbers alone, and is answered in numbers.
        numeric: bool,
    },
    /// To be shown parameters again and again: their names and numbers.
    Watch {
        /// Of which axis.
        axis: u8,
        /// The parameters.
        parameters: Vec<(String, u8)>,
    },
    /// To move a motor by keys.
    Jog {
        /// The number of its axis.
        axis: u8,
        /// With this speed, if not with that of positioning.
        speed: Option<i32>,
    },
}

impl Action {
    /// Reads a line. The error says what to type.
    pub fn read(line: &str, product: Option<Product>) -> Result<Self, String> {
        if line.trim_start().starts_with("//") {
            return Ok(Action::Nothing);
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let [first, rest @ ..] = words.as_slice() else { return Ok(Action::Nothing) };
        match (first.to_ascii_lowercase().as_str(), rest) {
            ("help" | "?", []) => Ok(Action::Help),
            ("quit" | "exit", []) => Ok(Action::Quit),
            ("watch", rest) => watch(rest, product),
            ("jog", rest) => jog(rest, product),
            _ => match asm::command(line, product, &Symbols::default()) {
                Ok(command) => Ok(Action::Send { command, numeric: first.starts_with(|c: char| c.is_ascii_digit()) }),
                Err(error) if error == format!("unknown command '{first}'") => {
                    let meant = suggestion(first, WORDS.into_iter());
                    let help = if meant.is_empty() { "; help shows what can be typed" } else { "" };
                    Err(format!("{error}{meant}{help}"))
                }
                Err(error) => Err(error),
            },
        }
    }
}

fn watch(words: &[&str], product: Option<Product>) -> Result<Action, String> {
    let (names, axis) = match words {
        [names @ .., word, axis] if word.eq_ignore_ascii_case("axis") => (names, number(axis, product)?),
        names => (names, 0),
    };
    if names.is_empty() {
        return Err("watch what? For example: watch APActualPosition APActualSpeed, or watch 1 3 axis 2".into());
    }
    // In the debugger this is the axis of the parameter before it.
    let between = names.windows(2).find_map(|pair| match pair {
        [name, number] if name.starts_with(char::is_alphabetic) && !name.ends_with(',') => {
            number.starts_with(|c: char| c.is_ascii_digit()).then_some((name, number))
        }
        _ => None,
    });
    if let Some((name, number)) = between {
        return Err(format!(
            "is '{number}' an axis? Then type: watch {name} axis {number}; or a parameter? Then: watch {name}, {number}"
        ));
    }
    let one = |name: &&str| {
        let name = name.trim_end_matches(',');
        Ok((name.to_owned(), number::<u8>(name, product)?))
    };
    Ok(Action::Watch { axis, parameters: names.iter().map(one).collect::<Result<_, String>>()? })
}

fn jog(words: &[&str], product: Option<Product>) -> Result<Action, String> {
    match words {
        [] => Ok(Action::Jog { axis: 0, speed: None }),
        [axis] => Ok(Action::Jog { axis: number(axis.trim_end_matches(','), product)?, speed: None }),
        [axis, speed] => {
            let speed: i32 = number(speed, product)?;
            if speed < 1 {
                return Err(format!("a jog has a speed above 0, not {speed}; the arrow keys tell the direction"));
            }
            Ok(Action::Jog { axis: number(axis.trim_end_matches(','), product)?, speed: Some(speed) })
        }
        _ => Err("usage: jog [AXIS] [SPEED], for example jog 0 500".into()),
    }
}

/// A number, or an expression without spaces.
fn number<T: TryFrom<i64>>(text: &str, product: Option<Product>) -> Result<T, String> {
    let value = asm::value(text, product, &Symbols::default()).map_err(|error| format!("'{text}': {error}"))?;
    T::try_from(value).map_err(|_| format!("'{text}': {value} is out of range"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRODUCT: Option<Product> = Some(Product::Tmcm3110);

    fn read(line: &str) -> Result<Action, String> {
        Action::read(line, PRODUCT)
    }

    #[test]
    fn lines_are_commands_or_words_of_the_shell() {
        let send = |command, numeric| Ok(Action::Send { command, numeric });
        assert_eq!(read("SAP APMaxCurrent, Motor1, 2 * 50"), send(Command::new(5, 6, 1, 100), false));
        assert_eq!(read("6, 1, 0"), send(Command::new(6, 1, 0, 0), true));
        assert_eq!((read("  "), read("  // GAP 1, 0")), (Ok(Action::Nothing), Ok(Action::Nothing)));
        assert_eq!((read("help"), read("QUIT")), (Ok(Action::Help), Ok(Action::Quit)));
        let parameters = vec![("APActualPosition".into(), 1), ("3".into(), 3)];
        assert_eq!(read("watch APActualPosition, 3 axis 2"), Ok(Action::Watch { axis: 2, parameters }));
        assert_eq!(read("jog"), Ok(Action::Jog { axis: 0, speed: None }));
        assert_eq!(read("jog Motor2 2*100"), Ok(Action::Jog { axis: 2, speed: Some(200) }));
    }

    #[test]
    fn mistakes_are_told_with_what_to_type() {
        let told = |line| read(line).unwrap_err();
        assert_eq!(told("jogg 1"), "unknown command 'jogg'; did you mean 'jog'?");
        assert_eq!(told("dance"), "unknown command 'dance'; help shows what can be typed");
        assert_eq!(told("STAPP 4, 0"), "unknown command 'STAPP'; did you mean 'STAP'?");
        assert!(told("watch").contains("For example: watch APActualPosition"));
        assert_eq!(told("watch 300"), "'300': 300 is out of range");
        assert!(told("watch APActualPositon").contains("did you mean 'APActualPosition'?"));
        let expected =
            "is '5' an axis? Then type: watch APActualSpeed axis 5; or a parameter? Then: watch APActualSpeed, 5";
        assert_eq!(told("watch APActualSpeed 5"), expected);
        assert!(told("jog 0 -5").contains("speed above 0"));
        assert!(told("jog 0 5 5").contains("usage: jog"));
        assert!(told("jog x").contains("unknown name 'x'"));
    }
}
