//! Words that the debugger completes when the user presses Tab.

use tmcl_tools::debug::{Register, WORDS};

use crate::terminal::editor::{Complete, begins, word};

/// The words that can be typed behind a command.
pub(super) struct Completion {
    /// Names of the program and of parameters.
    pub(super) names: Vec<String>,
}

impl Complete for Completion {
    fn complete(&self, line: &str, position: usize) -> (usize, Vec<String>) {
        let (start, before, typed) = word(line, position);
        let begins = |name: &&str| begins(typed, name);
        let words: Vec<String> = if before.trim().is_empty() {
            WORDS.into_iter().filter(begins).map(String::from).collect()
        } else {
            let fixed = Register::NAMES.into_iter().chain(["variable", "register"]);
            fixed.chain(self.names.iter().map(String::as_str)).filter(begins).map(String::from).collect()
        };
        (start, words)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_come_first_and_names_behind() {
        let names = ["Loop", "Back", "APMaxSpeed"].map(String::from).into();
        let complete = |line: &str| Completion { names: Vec::clone(&names) }.complete(line, line.len());
        let words =
            |start: usize, words: &[&str]| (start, words.iter().map(|word| word.to_string()).collect::<Vec<_>>());
        assert_eq!(complete("st"), words(0, &["step", "stop"]));
        assert_eq!(complete("  re"), words(2, &["reset", "registers", "reload"]));
        assert_eq!(complete("break lo"), words(6, &["Loop"]));
        assert_eq!(complete("break Loop + a"), words(13, &["acc", "APMaxSpeed"]));
        assert_eq!(complete("print ö"), words(6, &[]));
        assert_eq!(Completion { names }.complete("print ", 6).1.len(), 8);
    }
}
