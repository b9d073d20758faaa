//! Expressions: numbers and names with `+ - * /`, signs and parentheses.

use std::ops::RangeInclusive;

use super::message::Message;
use super::source::{Problem, Span};
use super::token::{Kind, Token};

/// Values of 32 bits, signed or unsigned, because programs write `$FFFFFFFF` as well as -1.
const VALUES: RangeInclusive<i64> = i32::MIN as i64..=u32::MAX as i64;

/// Greatest nesting of parentheses and signs.
const DEEPEST: usize = 64;

/// The value of an expression. `name` gives the value of a name; `span` is the location of the error if there are no
/// tokens.
pub(super) fn evaluate(
    tokens: &[Token],
    span: Span,
    name: &dyn Fn(&str) -> Result<i64, Message>,
) -> Result<i64, Problem> {
    let mut evaluator = Evaluator { tokens, last: span, depth: 0, name };
    if tokens.is_empty() {
        return Err(Problem::new(span, "a value is missing here"));
    }
    let value = evaluator.sum()?;
    match evaluator.tokens.first() {
        None => Ok(value),
        Some(token) => Err(Problem::new(token.span, unexpected(token))),
    }
}

fn unexpected(token: &Token) -> String {
    match &token.kind {
        Kind::Symbol(')') => "this ) has no (".into(),
        Kind::Symbol(symbol) => format!("a value is wanted here, not '{symbol}'"),
        _ => "a comma or an operator (+ - * /) is missing before this".into(),
    }
}

struct Evaluator<'a> {
    tokens: &'a [Token],
    last: Span,
    depth: usize,
    name: &'a dyn Fn(&str) -> Result<i64, Message>,
}

impl<'a> Evaluator<'a> {
    fn next(&mut self) -> Option<&'a Token> {
        let (first, rest) = self.tokens.split_first()?;
        self.tokens = rest;
        self.last = first.span;
        Some(first)
    }

    /// The next token, if it is one of these symbols.
    fn operator(&mut self, symbols: &[char]) -> Option<(char, Span)> {
        match self.tokens.first()?.kind {
            Kind::Symbol(symbol) if symbols.contains(&symbol) => self.next().map(|token| (symbol, token.span)),
            _ => None,
        }
    }

    fn sum(&mut self) -> Result<i64, Problem> {
        let mut value = self.product()?;
        while let Some((symbol, span)) = self.operator(&['+', '-']) {
            let right = self.product()?;
            value = checked(if symbol == '+' { value.checked_add(right) } else { value.checked_sub(right) }, span)?;
        }
        Ok(value)
    }

    fn product(&mut self) -> Result<i64, Problem> {
        let mut value = self.factor()?;
        while let Some((symbol, span)) = self.operator(&['*', '/']) {
            let right = self.factor()?;
            value = match (symbol, right) {
                ('*', _) => checked(value.checked_mul(right), span)?,
                (_, 0) => return Err(Problem::new(span, "division by zero")),
                _ => checked(value.checked_div(right), span)?,
            };
        }
        Ok(value)
    }

    fn factor(&mut self) -> Result<i64, Problem> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(Problem::new(self.last, format!("more than {DEEPEST} levels of parentheses and signs")));
        }
        let Some(token) = self.next() else {
            return Err(Problem::new(self.last.behind(), "a value is missing here"));
        };
        let value = match &token.kind {
            Kind::Number(number) => *number,
            Kind::Name(name) => (self.name)(name).map_err(|message| Problem::new(token.span, message))?,
            Kind::Symbol('-') => checked(self.factor()?.checked_neg(), token.span)?,
            Kind::Symbol('+') => self.factor()?,
            Kind::Symbol('(') => {
                let value = self.sum()?;
                if self.operator(&[')']).is_none() {
                    return Err(Problem::new(token.span, "this ( has no )"));
                }
                value
            }
            _ => return Err(Problem::new(token.span, unexpected(token))),
        };
        self.depth -= 1;
        Ok(value)
    }
}

fn checked(value: Option<i64>, span: Span) -> Result<i64, Problem> {
    value.filter(|value| VALUES.contains(value)).ok_or_else(|| {
        let message = format!("the result does not fit 32 bits ({}..{})", VALUES.start(), VALUES.end());
        Problem::new(span, message)
    })
}

#[cfg(test)]
mod tests {
    use super::super::token::Lexer;
    use super::*;

    fn value(text: &str) -> Result<i64, (usize, String)> {
        let (tokens, problem) = Lexer::default().line(1, text);
        assert_eq!(problem, None);
        let name = |name: &str| if name == "Ten" { Ok(10) } else { Err(format!("unknown {name}").into()) };
        evaluate(&tokens, Span::new(0, 1), &name).map_err(|problem| (problem.span.start, problem.message.to_string()))
    }

    #[test]
    fn operators_bind_as_usual() {
        for (text, expected) in [
            ("1 + 2 * 3", 7),
            ("(1 + 2) * 3", 9),
            ("10 - 4 - 3", 3),
            ("100 / 5 / 2", 10),
            ("-7 / 2", -3),
            ("2 - -3", 5),
            ("--Ten * +2", 20),
            ("-(Ten + 2)", -12),
            ("51200 * 200 / 360", 28_444),
            ("$FFFFFFFF", 4_294_967_295),
            ("-$80000000", -2_147_483_648),
        ] {
            assert_eq!(value(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn errors_have_the_columns_of_the_mistake() {
        for (text, columns, message) in [
            ("$FFFFFFFF + 1", 10, "the result does not fit 32 bits (-2147483648..4294967295)"),
            ("-$80000001", 0, "the result does not fit 32 bits (-2147483648..4294967295)"),
            ("$FFFFFFFF * $FFFFFFFF", 10, "the result does not fit 32 bits (-2147483648..4294967295)"),
            ("5 / (3 - 3)", 2, "division by zero"),
            ("2 * (3 + 4", 4, "this ( has no )"),
            ("2 + 3)", 5, "this ) has no ("),
            ("2 +", 3, "a value is missing here"),
            ("2 + * 3", 4, "a value is wanted here, not '*'"),
            ("2 3", 2, "a comma or an operator (+ - * /) is missing before this"),
            ("2 + Eleven", 4, "unknown Eleven"),
            ("", 0, "a value is missing here"),
        ] {
            assert_eq!(value(text), Err((columns, message.into())), "{text}");
        }
    }

    #[test]
    fn depth_is_limited() {
        let nested = |depth: usize| format!("{}1{}", "(".repeat(depth), ")".repeat(depth));
        assert_eq!(value(&nested(60)), Ok(1));
        assert!(value(&nested(100_000)).is_err());
        assert!(value(&format!("{}1", "-".repeat(100_000))).is_err());
        assert_eq!(value(&vec!["1"; 100_000].join("+")), Ok(100_000));
    }
}
