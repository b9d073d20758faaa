//! One line of a scenario: a step, and the values and conditions in it.

use hal_sim::board::TMCM_1140;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::control::{Control, Line, State};
use tmcm::tmcl::text;

/// What a line says.
#[derive(Clone, Debug)]
pub(super) enum Step {
    /// A TMCL command and what it must answer.
    Command { command: Template, answer: Answer },
    /// Something that must be so, now or for a while.
    Expect { condition: Condition, hold: Nanos },
    /// Time passes; with a condition no longer than until that is met.
    Wait { span: Nanos, until: Option<Condition> },
    /// A value is remembered.
    Let { name: String, value: Sum },
    /// A command of the control protocol.
    Control(Line),
    /// The supply goes off and comes back.
    PowerCycle,
}

/// What a command must answer.
#[derive(Clone, Debug)]
pub(super) enum Answer {
    Status { status: u8, value: Option<Sum> },
    Nothing,
}

/// A TMCL command whose operands may depend on remembered values.
#[derive(Clone, Debug)]
pub(super) struct Template {
    pub(super) name: String,
    pub(super) operands: Vec<Operand>,
}

#[derive(Clone, Debug)]
pub(super) enum Operand {
    Word(String),
    Value(Sum),
}

/// A condition, with a tolerance where it compares for equality.
#[derive(Clone, Debug)]
pub(super) struct Condition {
    pub(super) left: Sum,
    pub(super) relation: Relation,
}

#[derive(Clone, Debug)]
pub(super) enum Relation {
    Near(Sum, Sum),
    Not(Sum),
    Below(Sum),
    UpTo(Sum),
    Above(Sum),
    From(Sum),
    Between(Sum, Sum),
}

/// Values to be added, or subtracted where the flag is set.
pub(super) type Sum = Vec<(bool, Term)>;

#[derive(Clone, Debug)]
pub(super) enum Term {
    Number(i64),
    Remembered(String),
    World(Look),
    /// The value that a command answers.
    Read(Template),
}

/// Finds a value of the world in its state.
pub(super) type Look = fn(&State) -> i64;

/// The world's values by name.
const WORLD: &[(&str, Look)] = &[
    ("time", |state| (state.time_us / 1000) as i64),
    ("rotor", |state| state.first.rotor),
    ("field", |state| state.first.field),
    ("lost_steps", |state| state.first.lost_steps),
    ("position", |state| state.first.position.into()),
    ("velocity", |state| state.first.velocity.into()),
    ("current", |state| state.first.current.into()),
    ("bridges", |state| state.first.bridges_on.into()),
    ("stall_guard", |state| state.first.stall_guard.into()),
    ("left_switch", |state| state.first.switches.left.into()),
    ("right_switch", |state| state.first.switches.right.into()),
    ("home_switch", |state| state.first.switches.home.into()),
    ("output_0", |state| state.outputs[0].into()),
    ("output_1", |state| state.outputs[1].into()),
    ("pull_ups", |state| state.pull_ups.into()),
    ("led_1", |state| state.leds[0].into()),
    ("encoder", |state| state.first.encoder.into()),
    ("abn", |state| state.first.abn),
];

#[derive(Clone, Debug, PartialEq, Eq)]
enum Token {
    Number(i64),
    Word(String),
    Name(String),
    Symbol(&'static str),
}

/// Longer ones first. `+-` is the tolerance when a space follows.
const SYMBOLS: &[&str] = &["->", "<=", ">=", "!=", "=", "<", ">", "+", "-", ","];

/// What names are made of.
pub(super) fn in_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// Reads a line. `names` are the values remembered before it.
pub(super) fn parse(text: &str, names: &[String]) -> Result<Step, String> {
    if let Some(line) = text.strip_prefix("control ") {
        return match Line::parse(line)? {
            Line { module: 1, control: Control::State } => Err("the state is looked at by 'expect' and 'let'".into()),
            line @ Line { module: 1, control } => control.check(&TMCM_1140).map(|()| Step::Control(line)),
            _ => Err("there is one module only".into()),
        };
    }
    let mut parser = Parser { tokens: tokens(text)?, at: 0, names };
    let step = match parser.tokens.first() {
        Some(Token::Word(word)) if word == "expect" => parser.expect(),
        Some(Token::Word(word)) if word == "wait" => parser.wait(),
        Some(Token::Word(word)) if word == "let" => parser.remember(),
        Some(Token::Word(word)) if word == "power" => parser.power(),
        Some(Token::Word(word)) if word.chars().any(|c| c.is_ascii_lowercase()) => Err(format!(
            "unknown step '{word}'; there are: expect, wait, let, control, power cycle, and TMCL commands in capitals"
        )),
        _ => parser.command(),
    }?;
    match parser.tokens.get(parser.at) {
        None => Ok(step),
        Some(token) => Err(format!("{} is one word too many", shown(Some(token)))),
    }
}

fn tokens(text: &str) -> Result<Vec<Token>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim();
    while let Some(first) = rest.chars().next() {
        let start = usize::from(first == '$');
        let length = rest[start..].find(|c| !in_word(c)).map_or(rest.len(), |at| at + start);
        let length = if in_word(first) || first == '$' {
            let word = &rest[start..length];
            tokens.push(match first {
                '$' if word.is_empty() => return Err("a name is missing after '$'".into()),
                '$' => Token::Name(word.into()),
                '0'..='9' => Token::Number(number(word)?),
                _ => Token::Word(word.into()),
            });
            length
        } else if rest.starts_with("+- ") {
            tokens.push(Token::Symbol("+-"));
            2
        } else {
            let symbol = SYMBOLS.iter().find(|symbol| rest.starts_with(*symbol));
            let symbol = symbol.ok_or_else(|| format!("'{first}' means nothing here"))?;
            tokens.push(Token::Symbol(symbol));
            symbol.len()
        };
        rest = rest[length..].trim_start();
    }
    Ok(tokens)
}

fn number(word: &str) -> Result<i64, String> {
    let number = match word.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16),
        None => word.parse(),
    };
    number.map_err(|_| format!("'{word}' is not a number"))
}

fn shown(token: Option<&Token>) -> String {
    match token {
        Some(Token::Number(number)) => format!("'{number}'"),
        Some(Token::Word(word)) => format!("'{word}'"),
        Some(Token::Name(name)) => format!("'${name}'"),
        Some(Token::Symbol(symbol)) => format!("'{symbol}'"),
        None => "the end of the line".into(),
    }
}

struct Parser<'a> {
    tokens: Vec<Token>,
    at: usize,
    names: &'a [String],
}

impl Parser<'_> {
    fn next(&mut self) -> Option<Token> {
        let token = self.tokens.get(self.at).cloned();
        self.at += 1;
        token
    }

    fn take(&mut self, symbol: &str) -> bool {
        self.take_if(|token| matches!(token, Token::Symbol(other) if *other == symbol))
    }

    fn take_word(&mut self, word: &str) -> bool {
        self.take_if(|token| matches!(token, Token::Word(other) if other == word))
    }

    fn take_if(&mut self, wanted: impl Fn(&Token) -> bool) -> bool {
        let found = self.tokens.get(self.at).is_some_and(wanted);
        self.at += usize::from(found);
        found
    }

    fn power(&mut self) -> Result<Step, String> {
        self.at += 1;
        if self.take_word("cycle") { Ok(Step::PowerCycle) } else { Err("usage: power cycle".into()) }
    }

    fn expect(&mut self) -> Result<Step, String> {
        self.at += 1;
        let condition = self.condition()?;
        let hold = if self.take_word("for") { self.span()? } else { 0 };
        Ok(Step::Expect { condition, hold })
    }

    fn wait(&mut self) -> Result<Step, String> {
        self.at += 1;
        let span = self.span()?;
        let until = if self.take_word("until") { Some(self.condition()?) } else { None };
        Ok(Step::Wait { span, until })
    }

    fn remember(&mut self) -> Result<Step, String> {
        self.at += 1;
        let Some(Token::Word(name)) = self.next() else { return Err("usage: let NAME = VALUE".into()) };
        if !self.take("=") {
            return Err("usage: let NAME = VALUE".into());
        }
        Ok(Step::Let { name, value: self.sum()? })
    }

    fn command(&mut self) -> Result<Step, String> {
        let command = self.template(true)?;
        if !self.take("->") {
            return Ok(Step::Command { command, answer: Answer::Status { status: 100, value: None } });
        }
        if self.take_word("no") {
            let known = self.take_word("reply");
            return if known { Ok(Step::Command { command, answer: Answer::Nothing }) } else { Err(no_answer()) };
        }
        let Some(Token::Number(status)) = self.next() else { return Err(no_answer()) };
        let status = u8::try_from(status).map_err(|_| no_answer())?;
        let value = if self.at < self.tokens.len() { Some(self.sum()?) } else { None };
        Ok(Step::Command { command, answer: Answer::Status { status, value } })
    }

    fn span(&mut self) -> Result<Nanos, String> {
        if let (Some(Token::Number(number)), Some(Token::Word(unit))) = (self.next(), self.next()) {
            let unit = match unit.as_str() {
                "us" => MICROSECOND,
                "ms" => MILLISECOND,
                "s" => SECOND,
                _ => return Err(format!("'{unit}' is none of the units us, ms, s")),
            };
            return u64::try_from(number).map(|number| number * unit).map_err(|_| "a time is not negative".into());
        }
        Err("a time is missing, such as 500 ms or 2 s".into())
    }

    fn condition(&mut self) -> Result<Condition, String> {
        let left = self.sum()?;
        let relation = match self.next() {
            Some(Token::Symbol("=")) => {
                let right = self.sum()?;
                let tolerance = if self.take("+-") { self.sum()? } else { vec![(false, Term::Number(0))] };
                Relation::Near(right, tolerance)
            }
            Some(Token::Symbol("!=")) => Relation::Not(self.sum()?),
            Some(Token::Symbol("<")) => Relation::Below(self.sum()?),
            Some(Token::Symbol("<=")) => Relation::UpTo(self.sum()?),
            Some(Token::Symbol(">")) => Relation::Above(self.sum()?),
            Some(Token::Symbol(">=")) => Relation::From(self.sum()?),
            Some(Token::Word(word)) if word == "between" => {
                let low = self.sum()?;
                if !self.take_word("and") {
                    return Err("usage: VALUE between VALUE and VALUE".into());
                }
                Relation::Between(low, self.sum()?)
            }
            other => return Err(format!("one of = != < <= > >= between is missing before {}", shown(other.as_ref()))),
        };
        Ok(Condition { left, relation })
    }

    fn sum(&mut self) -> Result<Sum, String> {
        let mut sum = vec![(false, self.term()?)];
        loop {
            if self.take("+") {
                sum.push((false, self.term()?));
            } else if self.take("-") {
                sum.push((true, self.term()?));
            } else {
                return Ok(sum);
            }
        }
    }

    fn term(&mut self) -> Result<Term, String> {
        let negative = self.take("-");
        match self.tokens.get(self.at).cloned() {
            Some(Token::Number(number)) => {
                self.at += 1;
                Ok(Term::Number(if negative { -number } else { number }))
            }
            Some(Token::Name(name)) if !negative => {
                self.at += 1;
                if self.names.contains(&name) {
                    Ok(Term::Remembered(name))
                } else {
                    Err(format!("'${name}' is neither a parameter nor remembered by a 'let' above"))
                }
            }
            Some(Token::Word(word)) if !negative => match WORLD.iter().find(|(name, _)| *name == word) {
                Some((_, read)) => {
                    self.at += 1;
                    Ok(Term::World(*read))
                }
                None if word.chars().all(|c| c.is_ascii_uppercase()) => Ok(Term::Read(self.template(false)?)),
                None => {
                    let names: Vec<&str> = WORLD.iter().map(|(name, _)| *name).collect();
                    Err(format!("unknown value '{word}'; the world has: {}", names.join(", ")))
                }
            },
            other => Err(format!("a value is missing before {}", shown(other.as_ref()))),
        }
    }

    /// A command and its operands; `sums` says whether an operand may be a sum (in a value the sum goes on
    /// behind the command).
    fn template(&mut self, sums: bool) -> Result<Template, String> {
        let (name, separated) = match self.next() {
            Some(Token::Word(name)) => (name, true),
            Some(Token::Number(opcode)) => (opcode.to_string(), self.take(",")),
            other => return Err(format!("a TMCL command is missing before {}", shown(other.as_ref()))),
        };
        let mut operands = Vec::new();
        let done = |token: Option<&Token>| matches!(token, None | Some(Token::Symbol("->")));
        if separated && !done(self.tokens.get(self.at)) {
            loop {
                let word = match self.tokens.get(self.at) {
                    Some(Token::Word(word)) if !WORLD.iter().any(|(name, _)| name == word) => Some(word.clone()),
                    _ => None,
                };
                operands.push(if let Some(word) = word {
                    self.at += 1;
                    Operand::Word(word)
                } else if sums {
                    Operand::Value(self.sum()?)
                } else {
                    Operand::Value(vec![(false, self.term()?)])
                });
                if !self.take(",") {
                    break;
                }
            }
        }
        let template = Template { name, operands };
        // Whether such a command exists shows before anything runs; all values are taken to be zero.
        text::parse(&template.filled(|_| Ok(0))?).map_err(|error| error.to_string())?;
        Ok(template)
    }
}

impl Template {
    /// The command in mnemonic form, with the values that `evaluate` gives.
    pub(super) fn filled(&self, mut evaluate: impl FnMut(&Sum) -> Result<i64, String>) -> Result<String, String> {
        let mut words = Vec::new();
        for operand in &self.operands {
            words.push(match operand {
                Operand::Word(word) => word.clone(),
                Operand::Value(sum) => evaluate(sum)?.to_string(),
            });
        }
        Ok(format!("{} {}", self.name, words.join(", ")))
    }
}

fn no_answer() -> String {
    "usage: COMMAND -> STATUS, COMMAND -> STATUS VALUE or COMMAND -> no reply".into()
}
