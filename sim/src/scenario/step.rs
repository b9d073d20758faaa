//! A line of a scenario: a step.

use std::sync::Arc;

use hal_sim::clock::Nanos;
use hal_sim::control::{Control, Line, time};
use tmcm::can::{CanFrame, Frame, StandardId};

use super::condition::{Condition, Sum, Template, Vocabulary};
use super::program::Program;
use super::sdo::{NODE, Object};
use super::settings::HEADS;
use super::token::{Token, Tokens};
use crate::protocol::{is_about_the_world, unknown_in_the_world};
use crate::suggest::suggestion;

/// The step that a line says.
#[derive(Clone, Debug)]
pub(super) enum Step {
    /// A TMCL command and what it must answer.
    Command { command: Template, answer: Answer },
    /// A TMCL command whose reply is not waited for.
    Post(Template),
    /// Time passes up to this time of the module.
    At(Nanos),
    /// Something that must be so, now or for a while.
    Expect { condition: Condition, hold: Nanos },
    /// Time passes; with a condition no longer than until that is met.
    Wait { span: Nanos, until: Option<Condition> },
    /// Time passes until a frame of the module comes, but no longer than this.
    Await { span: Nanos, pattern: Pattern },
    /// A value is remembered.
    Let { name: String, value: Sum },
    /// A command of the control protocol, now or later.
    Control { delay: Option<Nanos>, line: Line },
    /// The supply goes off and comes back.
    PowerCycle,
    /// A program is put into the module.
    Load(Arc<Program>),
    /// The program is started, at an address or where it stands.
    Run(Option<u16>),
    /// An object of a CANopen node is written, or read with no interest in its value; the abort code that this must
    /// bring.
    Sdo { object: Object, value: Option<Sum>, abort: Option<u32> },
    /// A frame is sent.
    Frame(Frame),
}

/// The answer that a command must have.
#[derive(Clone, Debug)]
pub(super) enum Answer {
    Status { status: u8, value: Option<Sum> },
    Nothing,
}

/// The pattern that a frame must fit: its identifier, and the bytes that its data begin with.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    pub(super) id: u16,
    pub(super) data: Vec<u8>,
}

/// The words that steps begin with.
const WORDS: [&str; 13] =
    ["expect", "wait", "at", "post", "let", "control", "power", "load", "run", "sdo", "nmt", "sync", "frame"];

/// Commands of network management: their names and numbers.
const NMT: [(&str, u8); 5] =
    [("start", 1), ("stop", 2), ("pre-operational", 0x80), ("reset-node", 0x81), ("reset-communication", 0x82)];

const SYNC: u16 = 0x80;

impl Step {
    /// Reads a line. A program is loaded by `load`, for which the file of the program is read.
    pub(super) fn parse(
        text: &str,
        vocabulary: Vocabulary<'_>,
        load: impl FnOnce(&str) -> Result<Arc<Program>, String>,
    ) -> Result<Self, String> {
        let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        match word {
            "control" => return control(rest, vocabulary),
            "load" if rest.is_empty() => return Err("usage: load FILE.tmc".into()),
            "load" => return load(rest).map(Step::Load),
            "nmt" => return nmt(rest),
            "sync" if rest.is_empty() => return data_frame(SYNC, &[]).map(Step::Frame),
            "sync" => return Err(format!("'{rest}' is too much; usage: sync")),
            "frame" => return pattern(rest).and_then(|Pattern { id, data }| data_frame(id, &data)).map(Step::Frame),
            _ => {}
        }
        if let Some((span, frame)) = rest.split_once(" for frame ").filter(|_| word == "wait") {
            return Ok(Step::Await { span: time::span(span)?, pattern: pattern(frame)? });
        }
        let mut tokens = Tokens::of(text)?;
        let step = if word.chars().any(|c| c.is_ascii_lowercase()) {
            tokens.next();
            Self::after(word, &mut tokens, vocabulary)
        } else {
            command(&mut tokens, vocabulary)
        }?;
        tokens.end().map(|()| step)
    }

    /// Reads what follows the first word of a step.
    fn after(word: &str, tokens: &mut Tokens, vocabulary: Vocabulary<'_>) -> Result<Self, String> {
        match word {
            "expect" => {
                let condition = Condition::read(tokens, vocabulary)?;
                let hold = if tokens.take_word("for") { tokens.span()? } else { 0 };
                Ok(Step::Expect { condition, hold })
            }
            "wait" => {
                let span = tokens.span()?;
                let until = if tokens.take_word("until") { Some(Condition::read(tokens, vocabulary)?) } else { None };
                Ok(Step::Wait { span, until })
            }
            "at" => tokens.span().map(Step::At),
            "post" => Template::read(tokens, vocabulary, true).map(Step::Post),
            "let" => match tokens.next() {
                Some(Token::Word(name)) if tokens.take("=") => {
                    Ok(Step::Let { name, value: Sum::read(tokens, vocabulary)? })
                }
                _ => Err("usage: let NAME = VALUE".into()),
            },
            "power" if tokens.take_word("cycle") => Ok(Step::PowerCycle),
            "power" => Err("usage: power cycle".into()),
            "run" => run(tokens, vocabulary),
            "sdo" => sdo(tokens, vocabulary),
            _ if is_about_the_world(word) => Err(format!("unknown step '{word}'; did you mean 'control {word} ...'?")),
            _ => Err(match suggestion(word, WORDS.into_iter().chain(HEADS)).as_str() {
                "" => format!(
                    "unknown step '{word}'; there are: {}, and TMCL commands in capitals",
                    WORDS.join(", ").replace("power", "power cycle")
                ),
                suggestion => format!("unknown step '{word}'{suggestion}"),
            }),
        }
    }
}

fn control(text: &str, vocabulary: Vocabulary<'_>) -> Result<Step, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let (delay, words) = match words.as_slice() {
        ["at", later @ ..] => {
            let (delay, words) = time::leading_span(later)?;
            (Some(delay), words)
        }
        words => (None, words),
    };
    if let Some(name) = words.first().filter(|name| !is_about_the_world(name)) {
        return Err(unknown_in_the_world(name));
    }
    match Line::parse(&words.join(" "))? {
        Line { module: 1, control: Control::State } => Err("the state is looked at by 'expect' and 'let'".into()),
        line @ Line { module: 1, control } => control.check(vocabulary.kind).map(|()| Step::Control { delay, line }),
        _ => Err("there is one module only".into()),
    }
}

fn command(tokens: &mut Tokens, vocabulary: Vocabulary<'_>) -> Result<Step, String> {
    let command = Template::read(tokens, vocabulary, true)?;
    if !tokens.take("->") {
        return Ok(Step::Command { command, answer: Answer::Status { status: 100, value: None } });
    }
    if tokens.take_word("no") {
        return if tokens.take_word("reply") {
            Ok(Step::Command { command, answer: Answer::Nothing })
        } else {
            Err(no_answer())
        };
    }
    let status = match tokens.next() {
        Some(Token::Number(status)) if status.fract() == 0.0 && status <= 255.0 => status as u8,
        _ => return Err(no_answer()),
    };
    let value = if tokens.peek().is_some() { Some(Sum::read(tokens, vocabulary)?) } else { None };
    Ok(Step::Command { command, answer: Answer::Status { status, value } })
}

fn no_answer() -> String {
    "usage: COMMAND -> STATUS, COMMAND -> STATUS VALUE or COMMAND -> no reply".into()
}

fn run(tokens: &mut Tokens, vocabulary: Vocabulary<'_>) -> Result<Step, String> {
    match tokens.next() {
        None => Ok(Step::Run(None)),
        Some(Token::Number(address)) if address.fract() == 0.0 && address <= f64::from(u16::MAX) => {
            Ok(Step::Run(Some(address as u16)))
        }
        Some(Token::Word(label)) => {
            let program = vocabulary.program.ok_or_else(|| format!("'{label}': no program has been loaded above"))?;
            let address = program.address(&label).ok_or_else(|| {
                let suggestion = suggestion(&label, program.labels.iter().map(String::as_str));
                format!("the program has no label '{label}'{suggestion}")
            });
            address.map(|address| Step::Run(Some(address)))
        }
        _ => Err("usage: run, run LABEL or run ADDRESS".into()),
    }
}

fn sdo(tokens: &mut Tokens, vocabulary: Vocabulary<'_>) -> Result<Step, String> {
    let object = Object::read(tokens)?;
    let value = if tokens.take("=") { Some(Sum::read(tokens, vocabulary)?) } else { None };
    let abort = match (tokens.take("->"), tokens.next()) {
        (false, None) => None,
        (true, Some(Token::Number(code))) if code.fract() == 0.0 && code <= f64::from(u32::MAX) => Some(code as u32),
        _ => {
            return Err("usage: sdo INDEX:SUB TYPE = VALUE, with -> ABORT_CODE behind it if it is to be refused".into());
        }
    };
    match (value, abort) {
        (None, None) => {
            Err("to write an object: sdo INDEX:SUB TYPE = VALUE; to read it: expect sdo INDEX:SUB TYPE = VALUE".into())
        }
        (value, abort) => Ok(Step::Sdo { object, value, abort }),
    }
}

fn nmt(text: &str) -> Result<Step, String> {
    let number = NMT.iter().find(|(name, _)| *name == text).map(|(_, number)| *number).ok_or_else(|| {
        let names = NMT.map(|(name, _)| name);
        format!("'{text}' is no command of network management; there are: {}", names.join(", "))
    });
    number.and_then(|number| data_frame(0, &[number, NODE])).map(Step::Frame)
}

/// `0x201 0F 00`: the identifier, and the bytes in hexadecimal.
fn pattern(text: &str) -> Result<Pattern, String> {
    let usage = "usage: frame ID BYTE BYTE ..., all in hexadecimal: frame 0x201 0F 00";
    let mut words = text.split_whitespace();
    let id = words.next().and_then(|word| u16::from_str_radix(word.strip_prefix("0x")?, 16).ok());
    let id = id.ok_or(usage)?;
    if id > StandardId::MAX.as_raw() {
        return Err(format!("{id:#X} is no identifier of 11 bits; the largest is 0x7FF"));
    }
    let byte = |word: &str| u8::from_str_radix(word, 16).map_err(|_| format!("'{word}' is no byte; {usage}"));
    let data = words.map(byte).collect::<Result<Vec<u8>, String>>()?;
    if data.len() > 8 { Err("a frame has 8 bytes at most".into()) } else { Ok(Pattern { id, data }) }
}

fn data_frame(id: u16, data: &[u8]) -> Result<Frame, String> {
    StandardId::new(id).and_then(|id| Frame::new(id, data)).ok_or_else(|| "there is no such frame".into())
}
