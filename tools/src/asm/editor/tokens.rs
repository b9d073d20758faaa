//! The parts of lines, as editors colour them.

use std::ops::Range;

use tmcm::tmcl::Instruction;

use super::super::source::Span;
use super::super::statement::{NOP, labels};
use super::super::token::{Kind, Token};
use super::line::{Line, each_line};

/// The kinds of parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PieceKind {
    /// The mnemonic of a command, where a command begins.
    Mnemonic,
    /// Another name.
    Name,
    /// A label, where it is defined.
    Label,
    /// A number.
    Number,
    /// A symbol: one of `, : = + - * / ( )`.
    Symbol,
    /// `#include` or `#nostop`, or what stands in its place.
    Directive,
    /// The file of an `#include`.
    File,
    /// A comment, or the part of it that is in a line.
    Comment,
    /// Something that begins no token, where the assembler reads the line no further.
    Wrong,
}

/// A part of a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// The columns of the part.
    pub range: Range<usize>,
    /// The kind of the part.
    pub kind: PieceKind,
}

/// The parts of each line of a text, in their order.
pub fn tokens(text: &str) -> Vec<Vec<Piece>> {
    let mut all = Vec::new();
    each_line(text, |line| all.push(pieces(&line)));
    all
}

/// The parts of a line.
pub(super) fn pieces(line: &Line<'_>) -> Vec<Piece> {
    let columns = line.columns();
    let behind = labels(&line.tokens).1.len();
    let head = line.tokens.len() - behind;
    let tokens = line.tokens.iter().enumerate().map(|(index, token)| (token.span, kind(&line.tokens, index, head)));
    let comments = line.comments.iter().map(|span| (*span, PieceKind::Comment));
    let wrong = line.problem.iter().map(|problem| (problem.span, PieceKind::Wrong));
    let mut parts: Vec<(Span, PieceKind)> = tokens.chain(comments).chain(wrong).collect();
    parts.retain(|(span, _)| span.start < span.end);
    parts.sort_by_key(|(span, _)| span.start);
    parts.into_iter().map(|(span, kind)| Piece { range: columns.range(span), kind }).collect()
}

/// The kind of the token with this index, in a line whose labels end before `head`.
fn kind(tokens: &[Token], index: usize, head: usize) -> PieceKind {
    match tokens.get(index).map(|token| &token.kind) {
        Some(Kind::Name(_)) if index < head => PieceKind::Label,
        Some(Kind::Name(name)) if index == head && is_command(name, tokens.get(index + 1)) => PieceKind::Mnemonic,
        Some(Kind::Name(_)) | None => PieceKind::Name,
        Some(Kind::Number(_)) => PieceKind::Number,
        Some(Kind::Symbol(_)) => PieceKind::Symbol,
        Some(Kind::Directive(_)) => PieceKind::Directive,
        Some(Kind::File(_)) => PieceKind::File,
    }
}

/// Whether a line with these tokens behind its labels has a command.
pub(super) fn has_command(tokens: &[Token]) -> bool {
    match tokens {
        [Token { kind: Kind::Number(_), .. }, ..] => true,
        [Token { kind: Kind::Name(name), .. }, rest @ ..] => is_command(name, rest.first()),
        _ => false,
    }
}

/// Whether a name at the place of a command is one; before `=` it is meant as a constant.
fn is_command(name: &str, next: Option<&Token>) -> bool {
    let known = Instruction::by_mnemonic(name).is_some() || name.eq_ignore_ascii_case(NOP);
    known && !next.is_some_and(|token| token.is('='))
}
