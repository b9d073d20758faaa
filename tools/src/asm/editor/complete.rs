//! Completion: the texts that can be written at a place.

use std::ops::Range;
use std::path::Path;

use tmcm::tmcl::{Field, Instruction, Opcode};

use super::super::include::{INTERRUPTS, PARAMETERS};
use super::super::source::{Span, beside};
use super::super::token::{Kind, Token};
use super::built_in::{self, BuiltIn, fits};
use super::line::{Line, each_line};
use super::slot::{Place, Slot};
use super::survey::{Defined, Meaning, Survey};
use crate::product::Product;
use crate::sources::Sources;

/// Most that is offered.
const MOST: usize = 200;
/// Fewest letters that are looked for within names, and not only at their beginnings.
const FEWEST: usize = 3;
/// How far a name stands back that has the letters, but does not begin with them.
const WITHIN: u8 = 10;

/// The texts that can be written at a place.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Completion {
    /// The columns that it replaces: what is written of it already, and the rest of that word.
    pub range: Range<usize>,
    /// The texts that can be written, what fits best first, and then by name; at most 200.
    pub items: Vec<Item>,
}

/// Something that can be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// The text that is written.
    pub text: String,
    /// An explanation of the text, in a few words.
    pub note: String,
}

/// Finds what can be written at a place in the text with this name, which may include others, for a product.
///
/// # Errors
/// There is no such text.
pub fn complete(
    sources: &dyn Sources,
    main: &Path,
    product: Option<Product>,
    line: usize,
    column: usize,
) -> Result<Completion, String> {
    let text = sources.read(main)?;
    let built_in = BuiltIn::of(product);
    let mut typed = None;
    let survey = Survey::of(sources, &built_in, main, &text, |there| {
        if there.number == line {
            typed = Some(Typed::at(there, column));
        }
    });
    let Some(typed) = typed else { return Ok(Completion { range: column..column, items: Vec::new() }) };
    let mut offers = Offers::for_letters(&typed.letters);
    match typed.wanted {
        Wanted::Directive => {
            offers.offer(0, "#include", || "reads a file here".into());
            offers.offer(0, "#nostop", || "puts no STOP at the end".into());
        }
        Wanted::Slot(Slot::Statement) => offers.commands(&built_in, |instruction| instruction.program),
        Wanted::Slot(Slot::File) => offers.files(sources, main, &built_in),
        Wanted::Slot(Slot::Operand(place)) => {
            offers.names(place, &built_in, Some(&survey));
            let jumps = matches!(place.instruction.opcode, Opcode::Ja | Opcode::Jc | Opcode::Csub | Opcode::Vect);
            let jumps = jumps && place.field == Field::Value;
            offers.defined(&survey, 1, |meaning| jumps && meaning == Meaning::Label);
        }
        Wanted::Slot(Slot::Value) => offers.defined(&survey, 0, |meaning| meaning == Meaning::Label),
        Wanted::Slot(Slot::Nothing) => {}
    }
    Ok(offers.completion(typed.range))
}

/// Finds what can be written at a place in a command that stands alone, as it is sent to a module of this product.
pub fn complete_command(line: &str, product: Option<Product>, column: usize) -> Completion {
    let built_in = BuiltIn::of(product);
    let mut completion = Completion { range: column..column, items: Vec::new() };
    each_line(line, |line| {
        if line.number > 0 {
            return;
        }
        let typed = Typed::at(&line, column);
        let mut offers = Offers::for_letters(&typed.letters);
        match typed.wanted {
            Wanted::Slot(Slot::Statement) => offers.commands(&built_in, |instruction| instruction.direct),
            Wanted::Slot(Slot::Operand(place)) => offers.names(place, &built_in, None),
            Wanted::Slot(_) | Wanted::Directive => {}
        }
        completion = offers.completion(typed.range);
    });
    completion
}

/// The kind of text that is wanted at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wanted {
    /// A directive, which has been begun.
    Directive,
    /// A text of the kind that the place is for.
    Slot(Slot),
}

/// The text that is written already at a place.
struct Typed {
    /// The columns of the word.
    range: Range<usize>,
    /// The letters of the word in front of the place.
    letters: String,
    wanted: Wanted,
}

impl Typed {
    fn at(line: &Line<'_>, column: usize) -> Self {
        let columns = line.columns();
        let at = columns.character(column);
        let begins = |token: &&Token| token.span.end < at || token.span.end == at && !is_word(token);
        let (before, behind) = line.tokens.split_at(line.tokens.iter().take_while(begins).count());
        let slot = Slot::behind(before);
        let word = behind.first().filter(|token| {
            let begun = if slot == Slot::File { token.span.start <= at } else { token.span.start < at };
            begun && is_word(token)
        });
        let wrong = line.problem.as_ref().map(|problem| problem.span).filter(|span| span.start < at);
        let (span, wanted) = match (word, wrong) {
            _ if line.is_comment(at) => (None, Slot::Nothing),
            // A name of a file whose end has not been written yet.
            (None, Some(span)) if slot == Slot::File => (Some(span), slot),
            (_, Some(_)) => (None, Slot::Nothing),
            (None, None) => (None, slot),
            (Some(word), None) => match (&word.kind, behind.get(1)) {
                (Kind::Number(_), _) => (None, Slot::Nothing),
                (Kind::Name(_), Some(next)) if slot == Slot::Statement && (next.is(':') || next.is('=')) => {
                    (None, Slot::Nothing)
                }
                _ => (Some(word.span), slot),
            },
        };
        let span = span.unwrap_or(Span::new(at, at));
        let letters: String = line.text.chars().take(at).skip(span.start).collect();
        let is_directive = word.is_some_and(|word| matches!(word.kind, Kind::Directive(_)));
        let (letters, wanted) = match wanted {
            Slot::Statement if is_directive => (letters.split_whitespace().collect(), Wanted::Directive),
            Slot::File => (letters.trim_start_matches(['"', '<']).into(), Wanted::Slot(wanted)),
            _ => (letters, Wanted::Slot(wanted)),
        };
        Typed { range: columns.range(span), letters, wanted }
    }
}

/// Whether a token may be written on.
fn is_word(token: &Token) -> bool {
    !matches!(token.kind, Kind::Symbol(_))
}

/// The texts that are offered.
struct Offers {
    /// The letters that each of them has, in lower case.
    letters: String,
    /// Each with its rank and its name in lower case, by which they are sorted.
    items: Vec<(u8, String, Item)>,
}

impl Offers {
    fn for_letters(letters: &str) -> Self {
        Offers { letters: letters.to_lowercase(), items: Vec::new() }
    }

    /// Offers a text, if it has the letters.
    fn offer(&mut self, rank: u8, text: &str, note: impl FnOnce() -> String) {
        let name = text.to_lowercase();
        let rank = match name.trim_start_matches(['"', '<']).find(&self.letters) {
            Some(0) => rank,
            Some(_) if self.letters.chars().count() >= FEWEST => rank + WITHIN,
            _ => return,
        };
        self.items.push((rank, name, Item { text: text.into(), note: note() }));
    }

    fn commands(&mut self, built_in: &BuiltIn, may_stand: impl Fn(&Instruction) -> bool) {
        let there = Instruction::all().filter(|instruction| {
            !instruction.mnemonic.is_empty() && may_stand(instruction) && built_in.has(instruction.opcode)
        });
        for instruction in there {
            let usage = || instruction.to_string().trim_start_matches(instruction.mnemonic).trim().into();
            self.offer(0, instruction.mnemonic, usage);
        }
    }

    /// The names of a command itself, and those of the product, at a place in an operand.
    fn names(&mut self, place: Place, built_in: &BuiltIn, program: Option<&Survey<'_>>) {
        let Place { instruction, field, begins } = place;
        if let Field::Named(names) = field
            && begins
        {
            for (number, name) in names.iter().enumerate() {
                self.offer(0, name, || format!("type {number} of {}", instruction.mnemonic));
            }
        }
        for (file, constant) in built_in.constants.iter().filter(|(_, constant)| fits(constant, instruction, field)) {
            let note = || built_in::note(constant);
            match program {
                Some(program) if program.find(&constant.name).is_some() => {}
                Some(program) if !program.included.contains(file) => {
                    self.offer(0, &constant.name, || format!("{}; wants #include {file}", note()));
                }
                _ => self.offer(0, &constant.name, note),
            }
        }
    }

    /// The constants of a program with this rank, and in front of them the labels, if they are wanted.
    fn defined(&mut self, survey: &Survey<'_>, rank: u8, wanted: impl Fn(Meaning) -> bool) {
        for defined in &survey.defined {
            match defined.meaning {
                Meaning::Constant(Some(value)) => self.offer(rank, &defined.name, || format!("constant, {value}")),
                Meaning::Constant(None) => self.offer(rank, &defined.name, || "constant".into()),
                meaning if wanted(meaning) => self.offer(0, &defined.name, || label(defined)),
                Meaning::Label => {}
            }
        }
    }

    fn files(&mut self, sources: &dyn Sources, main: &Path, built_in: &BuiltIn) {
        let folder = main.parent().unwrap_or(Path::new(""));
        for path in sources.names().iter().filter(|path| *path != main) {
            let Some(name) = path.strip_prefix(folder).ok().and_then(Path::to_str) else { continue };
            let quoted = name.contains(char::is_whitespace) || name.starts_with(['"', '<']);
            match quoted {
                true if name.contains('"') => self.offer(0, &format!("<{name}>"), String::new),
                true => self.offer(0, &format!("\"{name}\""), String::new),
                false => self.offer(0, name, String::new),
            }
        }
        let files = [(PARAMETERS, "numbers of parameters and axes"), (INTERRUPTS, "numbers of interrupts")];
        for (file, note) in files {
            if built_in.product.is_some() && !sources.exists(&beside(Some(main), file)) {
                self.offer(1, file, || format!("built in, {note}"));
            }
        }
    }

    fn completion(mut self, range: Range<usize>) -> Completion {
        self.items.sort_by(|(rank, name, _), (other_rank, other, _)| (rank, name).cmp(&(other_rank, other)));
        let items = self.items.into_iter().map(|(_, _, item)| item).take(MOST).collect();
        Completion { range, items }
    }
}

/// Where a label is, in a few words. People count lines from 1.
fn label(Defined { file, line, .. }: &Defined) -> String {
    match file {
        Some(file) => format!("label, {}:{}", file.display(), line + 1),
        None => format!("label, line {}", line + 1),
    }
}
