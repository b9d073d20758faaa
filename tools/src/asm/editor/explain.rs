//! Explanations of what stands at a place, in words.

use std::ops::Range;
use std::path::{Path, PathBuf};

use tmcm::tmcl::{Command, Field, Instruction};

use super::super::assembler::assemble_file;
use super::super::include::{INTERRUPTS, PARAMETERS, canonical};
use super::super::source::beside;
use super::super::statement::NOP;
use super::super::token::{Kind, Token};
use super::built_in::{self, BuiltIn};
use super::line::Line;
use super::slot::{Place, Slot};
use super::survey::{Defined, Meaning, Survey};
use crate::product::{Product, parameter};
use crate::sources::Sources;

/// An explanation of what stands at a place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Explanation {
    /// The columns of what is explained.
    pub range: Range<usize>,
    /// The explanation, in words.
    pub words: String,
    /// Where it is defined, if that is in a text.
    pub definition: Option<Definition>,
}

/// A place where something is defined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Definition {
    /// The file; `None` for the text itself.
    pub file: Option<PathBuf>,
    /// The line.
    pub line: usize,
    /// The column.
    pub column: usize,
}

/// Explains what stands at a place in the text with this name, which may include others, for a product; `None` where
/// nothing has a meaning of its own.
///
/// # Errors
/// There is no such text.
pub fn explain(
    sources: &dyn Sources,
    main: &Path,
    product: Option<Product>,
    line: usize,
    column: usize,
) -> Result<Option<Explanation>, String> {
    let text = sources.read(main)?;
    let built_in = BuiltIn::of(product);
    let mut found = None;
    let survey = Survey::of(sources, &built_in, main, &text, |there| {
        if there.number == line {
            found = Found::at(there, column);
        }
    });
    let Some(found) = found else { return Ok(None) };
    let explainer = Explainer { sources, main, built_in: &built_in, survey };
    Ok(explainer.told(&found).map(|(words, definition)| Explanation { range: found.range, words, definition }))
}

/// A token, with those of its line.
struct Found {
    tokens: Vec<Token>,
    index: usize,
    range: Range<usize>,
}

impl Found {
    /// The token at a place: the one in which it lies, else the one that ends there.
    fn at(line: &Line<'_>, column: usize) -> Option<Self> {
        let columns = line.columns();
        let at = columns.character(column);
        let inside = line.tokens.iter().position(|token| token.span.start <= at && at < token.span.end);
        let named = |index: &usize| line.tokens.get(*index).is_some_and(|token| !matches!(token.kind, Kind::Symbol(_)));
        let index = inside.filter(named).or_else(|| line.tokens.iter().position(|token| token.span.end == at))?;
        let range = columns.range(line.tokens.get(index)?.span);
        Some(Found { tokens: line.tokens.clone(), index, range })
    }

    fn slot(&self) -> Slot {
        Slot::behind(self.tokens.get(..self.index).unwrap_or_default())
    }

    fn behind(&self) -> &[Token] {
        self.tokens.get(self.index + 1..).unwrap_or_default()
    }

    /// Whether the token is the whole operand, if it is its first one.
    fn stands_alone(&self) -> bool {
        self.behind().first().is_none_or(|token| token.is(','))
    }
}

type Told = (String, Option<Definition>);

struct Explainer<'a> {
    sources: &'a dyn Sources,
    main: &'a Path,
    built_in: &'a BuiltIn,
    survey: Survey<'a>,
}

impl Explainer<'_> {
    fn told(&self, found: &Found) -> Option<Told> {
        match (&found.tokens.get(found.index)?.kind, found.slot()) {
            (Kind::Name(name), Slot::Statement) => {
                let defines = found.behind().first().is_some_and(|token| token.is(':') || token.is('='));
                let command = if defines { None } else { self.command(name) };
                command.map(|words| (words, None)).or_else(|| self.defined(name))
            }
            (Kind::Name(name), Slot::Operand(Place { instruction, field: Field::Named(names), begins: true }))
                if found.stands_alone() && names.iter().any(|own| own.eq_ignore_ascii_case(name)) =>
            {
                let number = names.iter().position(|own| own.eq_ignore_ascii_case(name))?;
                Some((format!("type {number} of {}", instruction.mnemonic), None))
            }
            (Kind::Name(name), _) => self.defined(name).or_else(|| Some((self.constant(name)?, None))),
            (Kind::Number(number), Slot::Operand(Place { instruction, field: Field::Kind, begins: true }))
                if found.stands_alone() =>
            {
                let command = Command::new(instruction.opcode as u8, u8::try_from(*number).ok()?, self.bank(found)?, 0);
                let named = parameter(self.built_in.product?.spec(), instruction.opcode, command)?;
                Some((built_in::parameter_words(command, instruction, &named), None))
            }
            (Kind::Directive(word), _) if word == "nostop" => Some(("puts no STOP at the end".into(), None)),
            (Kind::Directive(word), _) if word == "include" => Some(("reads a file here".into(), None)),
            (Kind::File(name), _) => self.file(name),
            (Kind::Number(_) | Kind::Symbol(_) | Kind::Directive(_), _) => None,
        }
    }

    fn command(&self, name: &str) -> Option<String> {
        let Some(instruction) = Instruction::by_mnemonic(name) else {
            return name.eq_ignore_ascii_case(NOP).then(|| "command 0, which ends a program".into());
        };
        let words = format!("command {}: {instruction}", instruction.opcode as u8);
        Some(match self.built_in.product {
            Some(product) if !self.built_in.has(instruction.opcode) => {
                format!("{words}; the {} does not have it", product.name())
            }
            _ => words,
        })
    }

    /// The bank of a parameter whose number this is; that of axis parameters does not matter.
    fn bank(&self, found: &Found) -> Option<u8> {
        let value = match found.behind() {
            [] => 0,
            [_, Token { kind: Kind::Number(number), .. }, ..] => *number,
            [_, Token { kind: Kind::Name(name), .. }, ..] => match self.survey.find(name).map(|found| found.meaning) {
                Some(Meaning::Constant(value)) => value?,
                Some(Meaning::Label) => return None,
                None => self.built_in.find(name)?.number.into(),
            },
            _ => 0,
        };
        u8::try_from(value).ok()
    }

    /// A name of the program.
    fn defined(&self, name: &str) -> Option<Told> {
        let Defined { name, meaning, file, line, range } = self.survey.find(name)?;
        let assembled =
            || assemble_file(self.sources, self.main, self.built_in.product).result.ok()?.symbols.value(name);
        let words = match meaning {
            Meaning::Label => assembled().map_or("label".into(), |address| format!("label, address {address}")),
            Meaning::Constant(value) => {
                value.or_else(assembled).map_or("constant".into(), |value| format!("constant, {value}"))
            }
        };
        Some((words, Some(Definition { file: file.clone(), line: *line, column: range.start })))
    }

    /// A name of the product.
    fn constant(&self, name: &str) -> Option<String> {
        self.built_in.find(name).map(built_in::words)
    }

    fn file(&self, name: &str) -> Option<Told> {
        let path = beside(Some(self.main), name);
        if self.sources.exists(&path) {
            let words = format!("file {}", path.display());
            return Some((words, Some(Definition { file: Some(path), line: 0, column: 0 })));
        }
        self.built_in.product?;
        let words = match canonical(name)? {
            PARAMETERS => "built-in file with the numbers of parameters and axes",
            INTERRUPTS => "built-in file with the numbers of interrupts",
            _ => return None,
        };
        Some((words.into(), None))
    }
}
