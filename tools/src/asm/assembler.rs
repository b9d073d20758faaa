//! The assembler's passes: reads all source files and gives labels their addresses, evaluates constants, then makes the
//! commands.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tmcm::tmcl::{Command, Instruction, Opcode, text};

use super::check;
use super::diagnostic::{Diagnostic, Diagnostics, SHOWN, Severity};
use super::encode;
use super::expression::evaluate;
use super::include;
use super::message::Message;
use super::settings::Settings;
use super::source::{Problem, Source, beside};
use super::statement::{self, CommandLine, Head, Name, Operand, Statement};
use super::symbol::{Meaning, Symbols};
use super::token::Lexer;
use crate::product::Product;
use crate::sources::{Sources, Texts};

/// Most commands that addresses have room for.
const MOST_COMMANDS: usize = 1 << 16;
/// Greatest depth of files that include each other.
pub(super) const DEEPEST: usize = 16;
/// Most `#include` lines that are followed, so that files that include each other many times over end with an error.
const MOST_FILES: usize = 500;

/// An assembled program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assembly {
    /// The commands in the order of their addresses, with the STOP that was put at the end.
    pub commands: Vec<Command>,
    /// Address of the first command.
    pub origin: usize,
    /// Labels and constants.
    pub symbols: Symbols,
    /// Every line of every file in the order of reading; an included file follows the line that includes it.
    pub lines: Vec<SourceLine>,
    /// Warnings about commands that a module would refuse.
    pub warnings: Diagnostics,
    /// For each command the index in `lines` of its line.
    written: Vec<usize>,
}

/// A line of a source file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceLine {
    /// The file of the line.
    pub source: Arc<Source>,
    /// Number of the line in the file, from 1.
    pub number: usize,
    /// Address of the command in this line; `None` if the line has no command.
    pub address: Option<usize>,
}

impl SourceLine {
    /// The text of the line.
    pub fn text(&self) -> &str {
        self.source.lines.get(self.number.saturating_sub(1)).map_or("", String::as_str)
    }
}

impl Assembly {
    /// The line of the command at an address; `None` for the STOP that was put at the end.
    pub fn line(&self, address: usize) -> Option<&SourceLine> {
        self.lines.get(*self.written.get(address.checked_sub(self.origin)?)?)
    }

    /// The command at an address.
    pub fn command(&self, address: usize) -> Option<&Command> {
        self.commands.get(address.checked_sub(self.origin)?)
    }

    /// The addresses of the commands.
    pub fn addresses(&self) -> Range<usize> {
        self.origin..self.origin + self.commands.len()
    }
}

/// The outcome of a source, and the other sources on which it depends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Watched {
    /// The program, or the errors and warnings.
    pub result: Result<Assembly, Diagnostics>,
    /// The names of the source and of those that it includes, also where one of them does not exist. Built-in files and
    /// a source without a name of its own are left out.
    pub files: Vec<PathBuf>,
    /// Number of commands, with the STOP that was put at the end; where there are errors, of those that could be read.
    pub used: usize,
}

/// Assembles a source, with those that it includes, for a product.
pub fn assemble_file(sources: &dyn Sources, path: &Path, settings: impl Into<Settings>) -> Watched {
    match Source::read(sources, path) {
        Ok(source) => assemble(sources, source, settings.into()),
        Err(message) => Watched {
            result: Err(Diagnostics(vec![Diagnostic::without_location(message.into())])),
            files: vec![path.into()],
            used: 0,
        },
    }
}

/// Assembles a text under the name `name`, which errors and warnings show. What it includes is looked for among
/// `sources`.
pub fn assemble_among(sources: &dyn Sources, name: &str, text: &str, settings: impl Into<Settings>) -> Watched {
    assemble(sources, Source::from_text(name, text), settings.into())
}

/// Assembles a text that includes nothing but built-in files, as [`assemble_among`] does.
///
/// # Errors
/// The errors and warnings in the text.
pub fn assemble_text(name: &str, text: &str, settings: impl Into<Settings>) -> Result<Assembly, Diagnostics> {
    assemble_among(&Texts::default(), name, text, settings).result
}

fn assemble(sources: &dyn Sources, source: Source, settings: Settings) -> Watched {
    let Settings { product, origin, strict } = settings;
    let (origin, symbols) = (origin.into(), Symbols::new(product));
    let wanted = source.path.iter().cloned().collect();
    let mut assembler = Assembler {
        sources,
        product,
        origin,
        strict,
        lines: Vec::new(),
        symbols,
        constants: Pending::new(),
        commands: Pending::new(),
        no_stop: false,
        stop_added: false,
        found: Vec::new(),
        errors: 0,
        open: Vec::new(),
        files: 0,
        wanted,
    };
    assembler.read(Arc::new(source));
    assembler.evaluate();
    let commands = assembler.encode();
    let used = assembler.commands.len() + usize::from(assembler.stop_added);
    if assembler.errors == 0 {
        assembler.check(&commands);
    }
    let Assembler { lines, symbols, commands: written, mut found, errors, wanted: files, .. } = assembler;
    // Errors and warnings are sorted by line, because several passes have found them.
    found.sort_by_key(|(line, _)| *line);
    let diagnostics = Diagnostics(found.into_iter().map(|(_, diagnostic)| diagnostic).collect());
    let written = written.into_iter().map(|(line, _)| line).collect();
    let result = match errors {
        0 => Ok(Assembly { commands, origin, symbols, lines, warnings: diagnostics, written }),
        _ => Err(diagnostics),
    };
    Watched { result, files, used }
}

/// Statements to be evaluated when all names are known, each with the index of its line in `Assembler::lines`.
type Pending<T> = Vec<(usize, T)>;

struct Assembler<'a> {
    sources: &'a dyn Sources,
    product: Option<Product>,
    /// Address of the first command.
    origin: usize,
    strict: bool,
    lines: Vec<SourceLine>,
    symbols: Symbols,
    constants: Pending<(Name, Operand)>,
    commands: Pending<CommandLine>,
    no_stop: bool,
    /// Whether STOP has been put at the end.
    stop_added: bool,
    found: Vec<(usize, Diagnostic)>,
    errors: usize,
    /// The files that are being read, the outermost first.
    open: Vec<PathBuf>,
    /// Number of `#include` lines that have been followed.
    files: usize,
    /// Paths of the source and of the files that it includes; those that are built in are left out.
    wanted: Vec<PathBuf>,
}

impl Assembler<'_> {
    fn report(&mut self, line: usize, severity: Severity, problem: Problem) {
        let Some(SourceLine { source, number, .. }) = self.lines.get(line) else { return };
        self.found.push((line, Diagnostic::new(severity, source, *number, problem)));
        self.errors += usize::from(severity == Severity::Error);
    }

    fn error(&mut self, line: usize, problem: Problem) {
        self.report(line, Severity::Error, problem);
    }

    fn warning(&mut self, line: usize, problem: Problem) {
        let severity = if self.strict { Severity::Error } else { Severity::Warning };
        self.report(line, severity, problem);
    }

    /// Number of commands from the first one to the end of program memory.
    fn room(&self) -> usize {
        let size = self.product.map_or(MOST_COMMANDS, |product| product.spec().commands.into());
        size.saturating_sub(self.origin)
    }

    /// Tells in words what program memory has room for.
    fn room_in_words(&self) -> String {
        match (self.origin, self.room()) {
            (0, room) => format!("program memory holds {room} commands"),
            (origin, 0) => format!("program memory ends before address {origin}"),
            (origin, room) => format!("program memory holds {room} commands from address {origin} on"),
        }
    }

    /// Address of the command that is read next.
    fn address(&self) -> usize {
        self.origin + self.commands.len()
    }

    /// True after so many errors that further ones would not be shown.
    fn gives_up(&self) -> bool {
        self.errors > SHOWN
    }

    /// The first pass: cuts the lines of a file, and of those it includes, into statements and gives labels their
    /// addresses.
    fn read(&mut self, source: Arc<Source>) {
        let mut lexer = Lexer::default();
        let path = source.path.as_deref().map(|path| self.sources.canonical(path));
        self.open.extend(path.clone());
        for (number, text) in (1..).zip(&source.lines) {
            if self.gives_up() {
                return;
            }
            let line = self.lines.len();
            self.lines.push(SourceLine { source: Arc::clone(&source), number, address: None });
            let (tokens, problem) = lexer.line(line, text);
            let (labels, tokens) = statement::labels(&tokens);
            for label in &labels {
                if self.gives_up() {
                    return;
                }
                self.define(line, label, Meaning::Label(self.address()));
            }
            let statement = match problem {
                Some(problem) => Err(problem),
                None => statement::statement(tokens, unknown_command),
            };
            match statement {
                Ok(Some(statement)) => self.take(line, statement),
                Ok(None) => {}
                Err(problem) => self.error(line, problem),
            }
        }
        if let Some((line, problem)) = lexer.finish() {
            self.error(line, problem);
        }
        if path.is_some() {
            self.open.pop();
        }
    }

    fn take(&mut self, line: usize, statement: Statement) {
        match statement {
            Statement::Include(file) => match self.find(line, &file.text) {
                Ok(Some(source)) => self.read(Arc::new(source)),
                Ok(None) => {}
                Err(message) => self.error(line, Problem::new(file.span, message)),
            },
            Statement::NoStop => self.no_stop = true,
            Statement::Constant(name, value) => {
                self.define(line, &name, Meaning::Constant(None));
                self.constants.push((line, (name, value)));
            }
            Statement::Command(command) => {
                if self.commands.len() == self.room() {
                    let message = format!("the program is too long: {}", self.room_in_words());
                    self.error(line, Problem::new(command.span, message));
                }
                let address = self.address();
                if let Some(line) = self.lines.get_mut(line) {
                    line.address = Some(address);
                }
                self.commands.push((line, command));
            }
        }
    }

    fn define(&mut self, line: usize, name: &Name, meaning: Meaning) {
        let Some(SourceLine { source, number, .. }) = self.lines.get(line) else { return };
        if let Err(message) = self.symbols.define(&name.text, meaning, source, *number) {
            self.error(line, Problem::new(name.span, message));
        }
    }

    /// The source that an `#include` names: a file beside the including file, or a built-in file. `None` for a
    /// built-in file that has been included already.
    fn find(&mut self, line: usize, name: &str) -> Result<Option<Source>, Message> {
        self.files += 1;
        if self.open.len() >= DEEPEST {
            return Err(format!("files include each other more than {DEEPEST} deep").into());
        }
        if self.files > MOST_FILES {
            return Err(format!("more than {MOST_FILES} files are included").into());
        }
        let path = beside(self.lines.get(line).and_then(|line| line.source.path.as_deref()), name);
        if !self.sources.exists(&path)
            && let Some(source) = self.product.and_then(|product| include::source(product.spec(), name))
        {
            // A built-in file that is included again is skipped, because its names would be defined twice.
            let again = self.lines.iter().any(|line| line.source.built_in && line.source.name == source.name);
            return Ok((!again).then_some(source));
        }
        if !self.wanted.contains(&path) {
            self.wanted.push(path.clone());
        }
        if self.open.contains(&self.sources.canonical(&path)) {
            return Err(format!("{} includes itself", path.display()).into());
        }
        let hint = match self.product {
            _ if self.sources.exists(&path) => "",
            Some(_) => "TMCLParam.tmc and Interrupts.inc are built in",
            None if include::is_built_in(name) => {
                "it is built in for the modules that are known here: --product NAME takes this one for one of them"
            }
            None => "",
        };
        Source::read(self.sources, &path).map(Some).map_err(|words| match hint {
            "" => Message::new(words),
            hint => Message::new(words).advise(hint),
        })
    }

    /// Evaluates the constants in their order. A constant may use all labels, and the constants above it.
    fn evaluate(&mut self) {
        for (line, (name, value)) in std::mem::take(&mut self.constants) {
            if self.gives_up() {
                return;
            }
            let value = evaluate(&value.tokens, value.span, &|name| self.symbols.resolve(name));
            if let Some(SourceLine { source, number, .. }) = self.lines.get(line) {
                // A constant with an error gets the value 0, so that its uses do not cause further errors.
                self.symbols.set(&name.text, *value.as_ref().unwrap_or(&0), source, *number);
            }
            if let Err(problem) = value {
                self.error(line, problem);
            }
        }
    }

    /// The second pass: makes the commands, and puts STOP at the end.
    fn encode(&mut self) -> Vec<Command> {
        let mut commands = Vec::new();
        let written = std::mem::take(&mut self.commands);
        for (line, command) in &written {
            if self.gives_up() {
                break;
            }
            let text = self.lines.get(*line).map_or("", SourceLine::text);
            match encode::command(command, text, &self.symbols) {
                Ok(command) => commands.push(command),
                Err(problem) => self.error(*line, problem),
            }
        }
        self.commands = written;
        let stop = Command { opcode: Opcode::Stop as u8, ..Command::default() };
        let label_behind = self.symbols.labels().any(|(_, address)| address >= self.origin + commands.len());
        if !self.no_stop && (commands.last() != Some(&stop) || label_behind) {
            if commands.len() == self.room()
                && self.errors == 0
                && let Some((line, last)) = self.commands.last()
            {
                let message = Message::new(format!(
                    "the program is too long: with the STOP behind this it has {} commands, and {}",
                    commands.len() + 1,
                    self.room_in_words()
                ))
                .advise("make STOP the last, or write #nostop");
                let (line, problem) = (*line, Problem::new(last.span, message));
                self.error(line, problem);
            }
            commands.push(stop);
            self.stop_added = true;
        }
        commands
    }

    /// Warns about commands that a module would refuse.
    fn check(&mut self, commands: &[Command]) {
        let written = std::mem::take(&mut self.commands);
        let addresses = self.origin..self.origin + commands.len();
        for (command, (line, text)) in commands.iter().zip(&written) {
            if text.head == Head::Nop {
                let message = "this ends the program: a module takes command 0 for the end, none does nothing";
                self.warning(*line, Problem::new(text.span, message));
            }
            let spec = self.product.map(Product::spec);
            for (part, message) in check::warnings(spec, *command, addresses.clone()) {
                self.warning(*line, Problem::new(encode::span(text, part), message));
            }
        }
        self.commands = written;
    }
}

/// Message about a word that is no mnemonic.
pub(super) fn unknown_command(word: &str) -> Message {
    let mnemonics = Instruction::all().map(|i| i.mnemonic).filter(|mnemonic| !mnemonic.is_empty());
    Message::from(text::Error::UnknownMnemonic(word)).suggest(word, mnemonics)
}
