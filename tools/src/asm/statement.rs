//! Parses the tokens of a line into labels and one statement.

use tmcm::tmcl::Instruction;

use super::message::Message;
use super::source::{Problem, Span};
use super::token::{Kind, Token};

/// The name that other assemblers have for command 0.
pub(super) const NOP: &str = "NOP";

/// A name and its part of the line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Name {
    pub(super) text: String,
    pub(super) span: Span,
}

/// An operand: the tokens between two commas, which are evaluated when all names are known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Operand {
    pub(super) tokens: Vec<Token>,
    pub(super) span: Span,
}

/// The first word of a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Head {
    Instruction(&'static Instruction),
    /// A command number in place of the mnemonic; all operands are numbers.
    Number(i64),
    /// `NOP`, the name that other assemblers have for command 0.
    Nop,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CommandLine {
    pub(super) head: Head,
    pub(super) span: Span,
    pub(super) operands: Vec<Operand>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Statement {
    /// `#include file`
    Include(Name),
    /// `#nostop`
    NoStop,
    /// `Name = expression`
    Constant(Name, Operand),
    /// `MVP ABS, 0, 51200`
    Command(CommandLine),
}

/// The labels of a line, and the tokens behind them.
pub(super) fn labels(mut tokens: &[Token]) -> (Vec<Name>, &[Token]) {
    let mut labels = Vec::new();
    while let [Token { kind: Kind::Name(text), span }, colon, rest @ ..] = tokens
        && colon.is(':')
    {
        labels.push(Name { text: text.clone(), span: *span });
        tokens = rest;
    }
    (labels, tokens)
}

/// The statement behind the labels; `None` if there is none. `unknown` makes the message for a word that is no
/// mnemonic.
pub(super) fn statement(tokens: &[Token], unknown: impl FnOnce(&str) -> Message) -> Result<Option<Statement>, Problem> {
    let Some((first, rest)) = tokens.split_first() else { return Ok(None) };
    match &first.kind {
        Kind::Directive(word) => directive(word, first.span, rest).map(Some),
        Kind::Name(name) if rest.first().is_some_and(|token| token.is('=')) => {
            let (equals, value) = rest.split_first().map_or((first.span, rest), |(equals, value)| (equals.span, value));
            let span = hull(value).unwrap_or(equals.behind());
            let name = Name { text: name.clone(), span: first.span };
            Ok(Some(Statement::Constant(name, Operand { tokens: value.to_vec(), span })))
        }
        Kind::Name(name) => match Instruction::by_mnemonic(name) {
            Some(instruction) => Ok(Some(command(Head::Instruction(instruction), first.span, rest))),
            None if name.eq_ignore_ascii_case(NOP) => Ok(Some(command(Head::Nop, first.span, rest))),
            None => Err(Problem::new(first.span, unknown(name))),
        },
        Kind::Number(number) => Ok(Some(command(Head::Number(*number), first.span, rest))),
        Kind::Symbol(_) | Kind::File(_) => {
            Err(Problem::new(first.span, "a line begins with a command, a label or the name of a constant"))
        }
    }
}

fn directive(word: &str, span: Span, rest: &[Token]) -> Result<Statement, Problem> {
    let (statement, rest) = match (word, rest) {
        ("include", [Token { kind: Kind::File(file), span }, rest @ ..]) if !file.is_empty() => {
            (Statement::Include(Name { text: file.clone(), span: *span }), rest)
        }
        ("include", _) => {
            let message = Message::new("the file is missing").advise("for example: #include TMCLParam.tmc");
            return Err(Problem::new(span, message));
        }
        ("nostop", rest) => (Statement::NoStop, rest),
        _ => {
            let message = Message::new("there are #include and #nostop").advise("a constant is written Name = value");
            return Err(Problem::new(span, message));
        }
    };
    match rest.first() {
        Some(token) => Err(Problem::new(token.span, "nothing may follow here")),
        None => Ok(statement),
    }
}

fn command(head: Head, span: Span, rest: &[Token]) -> Statement {
    // A comma right after the mnemonic is tolerated, as on the ASCII command line.
    let (comma, rest) = match rest.split_first() {
        Some((first, others)) if first.is(',') => (Some(first.span), others),
        _ => (None, rest),
    };
    let mut operands = Vec::new();
    let mut before = comma.unwrap_or(span);
    let mut tokens = Vec::new();
    let operand = |tokens: Vec<Token>, before: Span| {
        let span = hull(&tokens).unwrap_or(before.behind());
        Operand { tokens, span }
    };
    for token in rest {
        if token.is(',') {
            operands.push(operand(std::mem::take(&mut tokens), before));
            before = token.span;
        } else {
            tokens.push(token.clone());
        }
    }
    if !rest.is_empty() {
        operands.push(operand(tokens, before));
    }
    Statement::Command(CommandLine { head, span, operands })
}

/// The span from the first token to the last one.
fn hull(tokens: &[Token]) -> Option<Span> {
    Some(tokens.first()?.span.to(tokens.last()?.span))
}
