//! The breakpoints, which only the host knows: modules have none.

use std::collections::BTreeMap;

use super::condition::Condition;

/// A breakpoint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Breakpoint {
    /// The place as the user has typed it; where that is, is found again when the program has changed.
    pub(super) place: String,
    /// The condition under which the program halts there; without one it always does.
    pub(super) condition: Option<Condition>,
}

/// The breakpoints by their addresses.
pub(super) type Breakpoints = BTreeMap<u16, Breakpoint>;

/// Cuts what is typed behind `break` into the place and the condition.
pub(super) fn place_and_condition(typed: &str) -> (&str, Option<&str>) {
    let condition = typed.match_indices("if").find(|(at, word)| {
        let before = typed.get(..*at).and_then(|before| before.chars().next_back());
        let behind = typed.get(at + word.len()..).and_then(|behind| behind.chars().next());
        before.is_some_and(char::is_whitespace) && behind.is_none_or(char::is_whitespace)
    });
    match condition.and_then(|(at, _)| typed.split_at_checked(at)) {
        Some((place, condition)) => (place.trim(), condition.get(2..)),
        None => (typed.trim(), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_begins_with_the_word_if() {
        assert_eq!(place_and_condition("Back"), ("Back", None));
        assert_eq!(place_and_condition("Back + 1 if acc > 5"), ("Back + 1", Some(" acc > 5")));
        assert_eq!(place_and_condition("Shift if x == 1"), ("Shift", Some(" x == 1")));
        assert_eq!(place_and_condition("Back if"), ("Back", Some("")));
        assert_eq!(place_and_condition("if"), ("if", None));
    }
}
