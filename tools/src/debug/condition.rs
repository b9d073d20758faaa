//! Conditions of breakpoints: `acc > 5`.

use super::names::Names;
use super::quantity::Quantity;
use crate::conversation::{Conversation, Error};

/// How two values are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    Less,
    LessOrEqual,
    Equal,
    NotEqual,
    GreaterOrEqual,
    Greater,
}

/// How comparisons are written; the longer ones first, because the shorter ones are in them.
const WRITTEN: [(&str, Comparison); 8] = [
    ("<=", Comparison::LessOrEqual),
    (">=", Comparison::GreaterOrEqual),
    ("==", Comparison::Equal),
    ("!=", Comparison::NotEqual),
    ("<>", Comparison::NotEqual),
    ("<", Comparison::Less),
    (">", Comparison::Greater),
    ("=", Comparison::Equal),
];

/// A condition: the comparison of a value of the module with a constant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Condition {
    /// The text that the user has typed.
    pub(super) typed: String,
    left: Quantity,
    comparison: Comparison,
    right: i64,
}

impl Condition {
    /// Reads what the user has typed.
    ///
    /// # Errors
    /// A message for the user.
    pub(super) fn parse(text: &str, names: &Names) -> Result<Self, String> {
        let text = text.trim();
        let first = text.find(['<', '>', '=', '!']).and_then(|at| text.split_at_checked(at));
        let found = first.and_then(|(left, rest)| {
            WRITTEN.iter().find_map(|(sign, comparison)| Some((left, (*sign, *comparison), rest.strip_prefix(sign)?)))
        });
        let Some((left, (sign, comparison), right)) = found else {
            return Err(format!("'{text}' compares nothing; for example: acc > 5"));
        };
        // Values are compared as modules have them, with a sign.
        let right = names.number(right).map_err(|message| match right.trim() {
            "" => format!("a value is missing behind '{sign}'"),
            right => format!("'{right}' behind '{sign}': {message}"),
        })?;
        let right = right.into();
        Ok(Condition { typed: text.into(), left: Quantity::parse(left, names)?, comparison, right })
    }

    /// Whether it is so now.
    pub(super) fn holds(&self, module: &mut Conversation) -> Result<bool, Error> {
        let left = self.left.value(module)?;
        Ok(match self.comparison {
            Comparison::Less => left < self.right,
            Comparison::LessOrEqual => left <= self.right,
            Comparison::Equal => left == self.right,
            Comparison::NotEqual => left != self.right,
            Comparison::GreaterOrEqual => left >= self.right,
            Comparison::Greater => left > self.right,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comparisons_are_read() {
        let names = Names::default();
        let read = |text| Condition::parse(text, &names).map(|condition| (condition.comparison, condition.right));
        assert_eq!(read("acc > 5"), Ok((Comparison::Greater, 5)));
        assert_eq!(read("x<=-3"), Ok((Comparison::LessOrEqual, -3)));
        assert_eq!(read("variable 10 = 2 * 4"), Ok((Comparison::Equal, 8)));
        assert_eq!(read("acc == $FFFFFFFF"), Ok((Comparison::Equal, -1)));
        assert_eq!(read("acc <> 0"), Ok((Comparison::NotEqual, 0)));
        assert_eq!(read("acc >= 0").map(|(comparison, _)| comparison), Ok(Comparison::GreaterOrEqual));
        assert_eq!(read("acc"), Err("'acc' compares nothing; for example: acc > 5".into()));
        assert_eq!(read("acc >"), Err("a value is missing behind '>'".into()));
        let told = "'3 4' behind '>=': a comma or an operator (+ - * /) is missing before this";
        assert_eq!(read("acc >= 3 4"), Err(told.into()));
        assert!(read("> 5").unwrap_err().starts_with("what?"));
        assert!(read("acc ! 5").is_err());
        assert_eq!(read("Coutn > 5"), Err("unknown name 'Coutn'".into()));
    }
}
