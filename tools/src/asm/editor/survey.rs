//! The names of a text and of those that it includes, also where it cannot be assembled.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::super::assembler::DEEPEST;
use super::super::expression::evaluate;
use super::super::include;
use super::super::message::Message;
use super::super::source::{Span, beside};
use super::super::statement::{self, Operand, Statement};
use super::super::token::{Kind, Token};
use super::built_in::BuiltIn;
use super::line::{Line, each_line};
use crate::sources::Sources;

/// The meaning of a name of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A place in the program.
    Label,
    /// A number, if it can be told.
    Constant(Option<i64>),
}

/// A name, where it is defined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Defined {
    pub(super) name: String,
    pub(super) meaning: Meaning,
    /// The file; `None` for the text itself.
    pub(super) file: Option<PathBuf>,
    pub(super) line: usize,
    pub(super) range: Range<usize>,
}

/// The names of a text and of those that it includes, in the order of reading.
pub(super) struct Survey<'a> {
    sources: &'a dyn Sources,
    built_in: &'a BuiltIn,
    /// The names.
    pub(super) defined: Vec<Defined>,
    /// Built-in files that are included.
    pub(super) included: HashSet<&'static str>,
    /// For each name in lower case its index in `defined`: of several that are the same that of the first.
    indices: HashMap<String, usize>,
    /// The files that have been looked into.
    visited: HashSet<PathBuf>,
}

impl<'a> Survey<'a> {
    /// Looks through a text with this path; each of its lines is shown to `take` on the way.
    pub(super) fn of(
        sources: &'a dyn Sources,
        built_in: &'a BuiltIn,
        path: &Path,
        text: &str,
        mut take: impl FnMut(&Line<'_>),
    ) -> Self {
        let visited = HashSet::from([sources.canonical(path)]);
        let (defined, included, indices) = (Vec::new(), HashSet::new(), HashMap::new());
        let mut survey = Survey { sources, built_in, defined, included, indices, visited };
        each_line(text, |line| {
            survey.line(&line, path, 0);
            take(&line);
        });
        survey
    }

    /// The name as it is defined. Upper and lower case are the same.
    pub(super) fn find(&self, name: &str) -> Option<&Defined> {
        self.defined.get(*self.indices.get(&name.to_lowercase())?)
    }

    /// Takes the names of a line of the file with this path, which is included so many levels deep.
    fn line(&mut self, line: &Line<'_>, path: &Path, depth: usize) {
        let (labels, tokens) = statement::labels(&line.tokens);
        for label in labels {
            self.define(&label, Meaning::Label, line, path, depth);
        }
        if line.problem.is_some() || !may_matter(tokens) {
            return;
        }
        match statement::statement(tokens, |_| Message::new("")) {
            Ok(Some(Statement::Constant(name, value))) => {
                let value = self.value(&value);
                self.define(&name, Meaning::Constant(value), line, path, depth);
            }
            Ok(Some(Statement::Include(file))) => self.include(&file.text, path, depth + 1),
            _ => {}
        }
    }

    fn define(&mut self, name: &statement::Name, meaning: Meaning, line: &Line<'_>, path: &Path, depth: usize) {
        let index = self.defined.len();
        if *self.indices.entry(name.text.to_lowercase()).or_insert(index) == index {
            let (file, range) = ((depth > 0).then(|| path.into()), line.columns().range(name.span));
            self.defined.push(Defined { name: name.text.clone(), meaning, file, line: line.number, range });
        }
    }

    /// The value of a constant that is made of numbers and of constants above it.
    fn value(&self, value: &Operand) -> Option<i64> {
        let known = |name: &str| match self.find(name).map(|defined| defined.meaning) {
            Some(Meaning::Constant(value)) => value,
            Some(Meaning::Label) => None,
            None => self.built_in.find(name).map(|constant| constant.number.into()),
        };
        let known = |name: &str| known(name).ok_or_else(|| Message::new(""));
        evaluate(&value.tokens, Span::default(), &known).ok()
    }

    fn include(&mut self, name: &str, path: &Path, depth: usize) {
        let path = beside(Some(path), name);
        if !self.sources.exists(&path) {
            self.included.extend(include::canonical(name));
            return;
        }
        if depth > DEEPEST || !self.visited.insert(self.sources.canonical(&path)) {
            return;
        }
        if let Ok(text) = self.sources.read(&path) {
            each_line(&text, |line| self.line(&line, &path, depth));
        }
    }
}

/// Whether a line may define a constant or include a file; all others need not be looked at.
fn may_matter(tokens: &[Token]) -> bool {
    match tokens {
        [first, second, ..] => matches!(first.kind, Kind::Directive(_)) || second.is('='),
        _ => false,
    }
}
