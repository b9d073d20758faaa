//! Cuts the lines of a source into tokens, and tells where comments are.

use super::message::Message;
use super::source::{Problem, Span};

/// The kinds of tokens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A mnemonic, label, constant or the name of an operand.
    Name(String),
    /// A number, 0..=4294967295.
    Number(i64),
    /// A symbol: one of `, : = + - * / ( )`.
    Symbol(char),
    /// A word after `#`, in lower case.
    Directive(String),
    /// The file of an `#include`.
    File(String),
}

/// A token and its part of the line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Token {
    pub(super) kind: Kind,
    pub(super) span: Span,
}

impl Token {
    pub(super) fn is(&self, symbol: char) -> bool {
        self.kind == Kind::Symbol(symbol)
    }
}

/// Cuts the lines of one file in their order, because a comment may span several lines.
#[derive(Debug, Default)]
pub(super) struct Lexer {
    /// Line number and span at which an unfinished comment began.
    comment: Option<(usize, Span)>,
    /// The comments of the line that was cut last, and the parts of those that go over several lines.
    comments: Vec<Span>,
}

impl Lexer {
    /// The tokens of the line with this number, up to the first character that begins no token, and the problem with
    /// that character.
    pub(super) fn line(&mut self, number: usize, text: &str) -> (Vec<Token>, Option<Problem>) {
        let characters: Vec<char> = text.chars().collect();
        let mut cursor = Cursor { characters: &characters, at: 0 };
        let mut tokens = Vec::new();
        let mut comment = 0;
        self.comments.clear();
        loop {
            if self.comment.is_some() {
                let ends = cursor.skip_past_end_of_comment();
                self.comments.push(Span::new(comment, cursor.at));
                if !ends {
                    return (tokens, None);
                }
                self.comment = None;
            }
            cursor.skip(char::is_whitespace);
            let start = cursor.at;
            match (cursor.peek(0), cursor.peek(1)) {
                (None, _) => return (tokens, None),
                (Some('/'), Some('/')) => {
                    self.comments.push(Span::new(start, characters.len()));
                    return (tokens, None);
                }
                (Some('/'), Some('*')) => {
                    comment = start;
                    cursor.at += 2;
                    self.comment = Some((number, Span::new(start, cursor.at)));
                }
                (Some(first), _) => match cursor.token(first, tokens.last()) {
                    Ok(kind) => tokens.push(Token { kind, span: Span::new(start, cursor.at) }),
                    Err(message) => {
                        let span = Span::new(start, cursor.at.max(start + 1));
                        return (tokens, Some(Problem { span, message }));
                    }
                },
            }
        }
    }

    /// Whether a comment goes on in the next line.
    pub(super) fn is_in_comment(&self) -> bool {
        self.comment.is_some()
    }

    /// The comments of the line that was cut last.
    pub(super) fn comments(&self) -> &[Span] {
        &self.comments
    }

    /// The problem at the end of the file, with its line: a comment that does not end.
    pub(super) fn finish(self) -> Option<(usize, Problem)> {
        let (line, span) = self.comment?;
        Some((line, Problem::new(span, Message::new("this comment does not end").advise("close it with */"))))
    }
}

struct Cursor<'a> {
    characters: &'a [char],
    at: usize,
}

impl Cursor<'_> {
    fn peek(&self, ahead: usize) -> Option<char> {
        self.characters.get(self.at + ahead).copied()
    }

    fn skip(&mut self, wanted: impl Fn(char) -> bool) {
        while self.peek(0).is_some_and(&wanted) {
            self.at += 1;
        }
    }

    fn take(&mut self, wanted: impl Fn(char) -> bool) -> String {
        let start = self.at;
        self.skip(wanted);
        self.characters.iter().take(self.at).skip(start).collect()
    }

    fn skip_past_end_of_comment(&mut self) -> bool {
        while let Some(character) = self.peek(0) {
            if character == '*' && self.peek(1) == Some('/') {
                self.at += 2;
                return true;
            }
            self.at += 1;
        }
        false
    }

    fn token(&mut self, first: char, before: Option<&Token>) -> Result<Kind, Message> {
        if before.is_some_and(|token| token.kind == Kind::Directive("include".into())) {
            return self.file(first);
        }
        let in_word = |c: char| c.is_alphanumeric() || c == '_';
        match first {
            '0'..='9' => number(&self.take(in_word)),
            '$' | '%' => {
                self.at += 1;
                let digits = self.take(in_word);
                magnitude(&digits, if first == '$' { 16 } else { 2 }, &format!("{first}{digits}"))
            }
            '#' => {
                self.at += 1;
                self.skip(char::is_whitespace);
                Ok(Kind::Directive(self.take(in_word).to_lowercase()))
            }
            ',' | ':' | '=' | '+' | '-' | '*' | '/' | '(' | ')' => {
                self.at += 1;
                Ok(Kind::Symbol(first))
            }
            _ if in_word(first) => Ok(Kind::Name(self.take(in_word))),
            ';' => Err(Message::new("';' means nothing in TMCL").advise("comments begin with //")),
            _ => Err(format!("{first:?} means nothing in TMCL").into()),
        }
    }

    /// A file name, in quotes or up to the next space.
    fn file(&mut self, first: char) -> Result<Kind, Message> {
        let close = match first {
            '"' => '"',
            '<' => '>',
            _ => return Ok(Kind::File(self.take(|c| !c.is_whitespace()))),
        };
        self.at += 1;
        let name = self.take(|c| c != close);
        if self.peek(0).is_none() {
            return Err(Message::new("the file name does not end").advise(format!("close it with {close}")));
        }
        self.at += 1;
        Ok(Kind::File(name))
    }
}

/// A number that begins with a decimal digit.
fn number(word: &str) -> Result<Kind, Message> {
    let prefixed = |prefix: [&str; 2]| prefix.iter().find_map(|prefix| word.strip_prefix(prefix));
    if let Some(digits) = prefixed(["0x", "0X"]) {
        magnitude(digits, 16, word)
    } else if let Some(digits) = prefixed(["0b", "0B"]) {
        magnitude(digits, 2, word)
    } else {
        magnitude(word, 10, word)
    }
}

fn magnitude(digits: &str, radix: u32, word: &str) -> Result<Kind, Message> {
    if digits.is_empty() || !digits.chars().all(|c| c.is_digit(radix)) {
        let digits = match radix {
            2 => "binary digits, 0 and 1",
            16 => "hexadecimal digits",
            _ => "decimal digits",
        };
        let message = Message::new(format!("'{word}' is not a number: it wants {digits}"));
        return Err(if radix == 10 { message.advise("hexadecimal numbers begin with $ or 0x") } else { message });
    }
    match u32::from_str_radix(digits, radix) {
        Ok(number) => Ok(Kind::Number(number.into())),
        Err(_) => Err(format!("{word} does not fit 32 bits").into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<Kind> {
        let (tokens, problem) = Lexer::default().line(1, text);
        assert_eq!(problem, None, "{text}");
        tokens.into_iter().map(|token| token.kind).collect()
    }

    fn problem(text: &str) -> (usize, usize, String) {
        let Problem { span, message } = Lexer::default().line(1, text).1.unwrap();
        (span.start, span.end, message.to_string())
    }

    #[test]
    fn numbers_have_four_forms() {
        let numbers = [10, 255, 255, 10, 10, u32::MAX.into(), 0].map(Kind::Number);
        assert_eq!(kinds("10 $fF 0xFF %1010 0b1010 4294967295 00"), numbers);
        assert_eq!(problem("SAP 4, 12ab").0, 7);
        assert!(problem("$").2.contains("hexadecimal"));
        assert!(problem("%12").2.contains("0 and 1"));
        assert_eq!(problem("  4294967296"), (2, 12, "4294967296 does not fit 32 bits".into()));
    }

    #[test]
    fn comments_are_left_out_and_may_go_over_lines() {
        assert_eq!(kinds("STOP // STOP /* "), [Kind::Name("STOP".into())]);
        assert_eq!(kinds("a/* b */c"), [Kind::Name("a".into()), Kind::Name("c".into())]);
        let mut lexer = Lexer::default();
        assert_eq!(lexer.line(1, "4 /* from here").0.len(), 1);
        assert_eq!(lexer.line(2, "not // this").0.len(), 0);
        let (tokens, _) = lexer.line(3, "to here */ 5 /*/ 6");
        assert_eq!(tokens, [Token { kind: Kind::Number(5), span: Span::new(11, 12) }]);
        assert_eq!(lexer.comments(), [Span::new(0, 10), Span::new(13, 18)]);
        assert_eq!(lexer.finish().map(|(line, problem)| (line, problem.span)), Some((3, Span::new(13, 15))));
    }

    #[test]
    fn file_names_with_and_without_quotes() {
        let file = |name: &str| [Kind::Directive("include".into()), Kind::File(name.into())];
        assert_eq!(kinds("#include Interrupts.inc // names"), file("Interrupts.inc"));
        assert_eq!(kinds("# INCLUDE \"a b//c.tmc\""), file("a b//c.tmc"));
        assert_eq!(kinds("#include <x.inc>"), file("x.inc"));
        assert!(problem("#include \"x.inc").2.contains("close it"));
    }
}
