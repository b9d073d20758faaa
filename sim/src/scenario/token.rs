//! The words, numbers and symbols of a line, and a reader that takes them one by one.

use hal_sim::clock::Nanos;
use hal_sim::control::time;

/// A piece of a line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// A number, in decimal, with or without a fraction, or in hexadecimal after `0x`.
    Number(f64),
    /// A word.
    Word(String),
    /// `$word`, without the dollar sign.
    Name(String),
    /// A symbol of [`SYMBOLS`].
    Symbol(&'static str),
}

/// Longer ones first.
const SYMBOLS: &[&str] = &["->", "+-", "<=", ">=", "!=", "=", "<", ">", "+", "-", "&", ",", ":"];

/// True for characters that names are made of.
pub(super) fn in_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// Reads the pieces of a line in their order.
#[derive(Clone, Debug)]
pub(super) struct Tokens {
    tokens: Vec<Token>,
    at: usize,
}

impl Tokens {
    /// Takes a line to pieces.
    pub(super) fn of(text: &str) -> Result<Self, String> {
        let mut tokens = Vec::new();
        let mut rest = text.trim();
        while let Some(first) = rest.chars().next() {
            let (token, length) = token(rest, first)?;
            tokens.push(token);
            rest = rest.get(length..).unwrap_or_default().trim_start();
        }
        Ok(Tokens { tokens, at: 0 })
    }

    /// The next piece, which is not taken.
    pub(super) fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.at)
    }

    /// Takes the next piece.
    pub(super) fn next(&mut self) -> Option<Token> {
        let token = self.tokens.get(self.at).cloned();
        self.at += 1;
        token
    }

    /// Takes the next piece if it is this symbol.
    pub(super) fn take(&mut self, symbol: &str) -> bool {
        self.take_if(|token| matches!(token, Token::Symbol(other) if *other == symbol))
    }

    /// Takes the next piece if it is this word.
    pub(super) fn take_word(&mut self, word: &str) -> bool {
        self.take_if(|token| matches!(token, Token::Word(other) if other == word))
    }

    fn take_if(&mut self, wanted: impl Fn(&Token) -> bool) -> bool {
        let found = self.peek().is_some_and(wanted);
        self.at += usize::from(found);
        found
    }

    /// Takes a time: a number and a unit.
    pub(super) fn span(&mut self) -> Result<Nanos, String> {
        match (self.next(), self.next()) {
            (Some(Token::Number(number)), Some(Token::Word(unit))) => time::span(&format!("{number} {unit}")),
            (Some(Token::Name(name)), _) => {
                Err(format!("'${name}' is no parameter, and only those can stand in the place of a time"))
            }
            _ => Err("a time is missing, such as 500 ms or 2 s".into()),
        }
    }

    /// Checks that nothing is left; the error names what is.
    pub(super) fn end(&self) -> Result<(), String> {
        match self.peek() {
            None => Ok(()),
            Some(token) => Err(format!("{} is one word too many", shown(Some(token)))),
        }
    }
}

/// The piece that a text begins with, and its length in bytes.
fn token(text: &str, first: char) -> Result<(Token, usize), String> {
    let start = usize::from(first == '$');
    let word = word(text.get(start..).unwrap_or_default(), first != '$');
    let length = start + word.len();
    if first == '$' {
        return match word {
            "" => Err("a name is missing after '$'".into()),
            word => Ok((Token::Name(word.into()), length)),
        };
    }
    if in_word(first) {
        if !first.is_ascii_digit() {
            return Ok((Token::Word(word.into()), length));
        }
        // A unit may follow its number without a space, as in `20ms`.
        let unit = if word.starts_with("0x") { None } else { word.find(|c: char| c.is_ascii_alphabetic()) };
        let digits = word.get(..unit.unwrap_or(word.len())).unwrap_or_default();
        return Ok((Token::Number(number(digits)?), digits.len()));
    }
    let symbol = SYMBOLS.iter().find(|symbol| text.starts_with(*symbol));
    symbol.map(|symbol| (Token::Symbol(symbol), symbol.len())).ok_or_else(|| format!("'{first}' means nothing here"))
}

/// The word at the front of a text; with `dots`, a dot belongs to it if the word goes on behind the dot.
fn word(text: &str, dots: bool) -> &str {
    let mut end = 0;
    let mut letters = text.char_indices().peekable();
    while let Some((at, letter)) = letters.next() {
        let goes_on = letters.peek().is_some_and(|(_, next)| in_word(*next));
        if !(in_word(letter) || dots && letter == '.' && goes_on) {
            break;
        }
        end = at + letter.len_utf8();
    }
    text.get(..end).unwrap_or_default()
}

fn number(word: &str) -> Result<f64, String> {
    let number = match word.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16).ok().map(|number| number as f64),
        None => word.parse().ok().filter(|_| word.chars().all(|c| c.is_ascii_digit() || c == '.')),
    };
    number.ok_or_else(|| format!("'{word}' is not a number"))
}

/// A piece as messages show it; `None` is the end of the line.
pub(super) fn shown(token: Option<&Token>) -> String {
    match token {
        Some(Token::Number(number)) => format!("'{number}'"),
        Some(Token::Word(word)) => format!("'{word}'"),
        Some(Token::Name(name)) => format!("'${name}'"),
        Some(Token::Symbol(symbol)) => format!("'{symbol}'"),
        None => "the end of the line".into(),
    }
}
