//! Conditions such as `rotor 2 = 5000 +- 10` and `GAP 1, 0 between $x and $x + 5`. They are read from text without
//! anything being run, and evaluated over whoever knows the values. Scenario files state with them what must be so, and
//! the control protocol's `run-until` what it waits for.

use hal_sim::board::BoardKind;
use tmcm::tmcl::{Command, Field, Instruction, Opcode, text};

use super::program::Program;
use super::sdo::Object;
use super::token::{Token, Tokens, shown};
use crate::look::Look;
use crate::suggest::suggestion;

/// Where the values of a condition come from.
pub trait Values {
    /// The value that the world shows.
    ///
    /// # Errors
    /// The reason why it does not show this.
    fn look(&mut self, look: &Look) -> Result<f64, String>;

    /// The value that a command of TMCL reads.
    ///
    /// # Errors
    /// The reason why there is none: the command is refused, or must not be used here.
    fn read(&mut self, command: Command) -> Result<f64, String>;

    /// The value of an object of a CANopen node.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    fn object(&mut self, object: Object) -> Result<f64, String> {
        let _ = object;
        Err("no object of a CANopen node can be read here".into())
    }

    /// A value that was remembered under a name.
    fn remembered(&self, name: &str) -> Option<f64>;
}

/// The difference by which decimal fractions may be off, because they are stored as binary ones: `supply = 24.1 - 0.1`
/// is to be met at 24.0 V. Whole numbers are exact.
const ROUNDING: f64 = 1e-9;

/// The values and names that a condition may speak of.
#[derive(Clone, Copy, Debug)]
pub struct Vocabulary<'a> {
    /// The board whose world shows values.
    pub kind: &'static BoardKind,
    /// The names of the values that are remembered.
    pub names: &'a [String],
    /// The program whose names stand for numbers.
    pub program: Option<&'a Program>,
}

impl Vocabulary<'_> {
    /// The values of a board and what commands read, without names.
    pub fn new(kind: &'static BoardKind) -> Self {
        Vocabulary { kind, names: &[], program: None }
    }

    /// The number that a name of the program stands for, if it does.
    fn constant(&self, name: &str) -> Option<f64> {
        self.program?.value(name).map(|value| value as f64)
    }
}

/// A condition, with a tolerance where it compares for equality.
#[derive(Clone, Debug)]
pub struct Condition {
    left: Sum,
    relation: Box<Relation>,
}

#[derive(Clone, Debug)]
enum Relation {
    Near(Sum, Option<Sum>),
    Not(Sum),
    Below(Sum),
    UpTo(Sum),
    Above(Sum),
    From(Sum),
    Between(Sum, Sum),
}

/// Values that are put together from left to right.
#[derive(Clone, Debug)]
pub(super) struct Sum {
    first: Term,
    others: Vec<(Operator, Term)>,
}

#[derive(Clone, Copy, Debug)]
enum Operator {
    Plus,
    Minus,
    /// The bits that both have.
    And,
}

#[derive(Clone, Debug)]
enum Term {
    Number(f64),
    Remembered(String),
    World(Look),
    /// The value that a command answers.
    Read(Template),
    /// An object of a CANopen node.
    Object(Object),
    /// The state of a program: see [`PROGRAM`].
    Program,
    /// The address of its next command.
    Counter,
}

/// The state of a program, and its numbers in the reply to command 135.
const PROGRAM: [(&str, f64); 4] = [("stopped", 0.0), ("running", 1.0), ("stepping", 2.0), ("reset", 3.0)];

/// A TMCL command whose operands may depend on values.
#[derive(Clone, Debug)]
pub(super) struct Template {
    name: String,
    operands: Vec<Operand>,
}

#[derive(Clone, Debug)]
enum Operand {
    Word(String),
    Value(Sum),
}

impl Condition {
    /// Reads a condition.
    ///
    /// # Errors
    /// A message that says what to write instead.
    pub fn parse(text: &str, vocabulary: Vocabulary<'_>) -> Result<Self, String> {
        let mut tokens = Tokens::of(text)?;
        let condition = Self::read(&mut tokens, vocabulary)?;
        tokens.end().map(|()| condition)
    }

    /// Takes a condition from the front of what is left of a line.
    pub(super) fn read(tokens: &mut Tokens, vocabulary: Vocabulary<'_>) -> Result<Self, String> {
        let sum = |tokens: &mut Tokens| Sum::read(tokens, vocabulary);
        let left = sum(tokens)?;
        let relation = match tokens.next() {
            Some(Token::Symbol("=")) => {
                let right = sum(tokens)?;
                let tolerance = if tokens.take("+-") { Some(sum(tokens)?) } else { None };
                Relation::Near(right, tolerance)
            }
            Some(Token::Symbol("!=")) => Relation::Not(sum(tokens)?),
            Some(Token::Symbol("<")) => Relation::Below(sum(tokens)?),
            Some(Token::Symbol("<=")) => Relation::UpTo(sum(tokens)?),
            Some(Token::Symbol(">")) => Relation::Above(sum(tokens)?),
            Some(Token::Symbol(">=")) => Relation::From(sum(tokens)?),
            Some(Token::Word(word)) if word == "between" => {
                let low = sum(tokens)?;
                if !tokens.take_word("and") {
                    return Err("usage: VALUE between VALUE and VALUE".into());
                }
                Relation::Between(low, sum(tokens)?)
            }
            other => return Err(format!("one of = != < <= > >= between is missing before {}", shown(other.as_ref()))),
        };
        Ok(Condition { left, relation: Box::new(relation) })
    }

    /// The values, in words, if the condition is not met; `None` if it is.
    ///
    /// # Errors
    /// A value could not be had.
    pub fn violated(&self, values: &mut impl Values) -> Result<Option<String>, String> {
        let left = self.left.value(values)?;
        let (met, right) = match &*self.relation {
            Relation::Near(right, tolerance) => {
                let right = right.value(values)?;
                let tolerance = tolerance.as_ref().map_or(Ok(0.0), |tolerance| tolerance.value(values))?;
                ((left - right).abs() <= tolerance + ROUNDING, right)
            }
            Relation::Not(right) => compared(right, values, |right| left != right)?,
            Relation::Below(right) => compared(right, values, |right| left < right)?,
            Relation::UpTo(right) => compared(right, values, |right| left <= right)?,
            Relation::Above(right) => compared(right, values, |right| left > right)?,
            Relation::From(right) => compared(right, values, |right| left >= right)?,
            Relation::Between(low, high) => {
                let (low, high) = (low.value(values)?, high.value(values)?);
                let met = (low..=high).contains(&left);
                return Ok((!met).then(|| format!("the left side is {left}, the others are {low} and {high}")));
            }
        };
        Ok((!met).then(|| format!("the left side is {left}, the right side {right}")))
    }
}

fn compared(right: &Sum, values: &mut impl Values, relation: impl Fn(f64) -> bool) -> Result<(bool, f64), String> {
    let right = right.value(values)?;
    Ok((relation(right), right))
}

impl Sum {
    pub(super) fn read(tokens: &mut Tokens, vocabulary: Vocabulary<'_>) -> Result<Self, String> {
        let mut sum = Sum { first: Term::read(tokens, vocabulary)?, others: Vec::new() };
        while let Some(operator) = Operator::take(tokens) {
            sum.others.push((operator, Term::read(tokens, vocabulary)?));
        }
        Ok(sum)
    }

    pub(super) fn value(&self, values: &mut impl Values) -> Result<f64, String> {
        self.evaluate(|term| term.value(values))
    }

    /// The value if it is the same whatever happens.
    fn constant(&self) -> Option<f64> {
        let number = |term: &Term| if let Term::Number(number) = term { Ok(*number) } else { Err(String::new()) };
        self.evaluate(number).ok()
    }

    fn evaluate(&self, mut value: impl FnMut(&Term) -> Result<f64, String>) -> Result<f64, String> {
        let mut total = value(&self.first)?;
        for (operator, term) in &self.others {
            let value = value(term)?;
            total = match operator {
                Operator::Plus => total + value,
                Operator::Minus => total - value,
                Operator::And => (total as i64 & value as i64) as f64,
            };
        }
        Ok(total)
    }
}

impl Operator {
    fn take(tokens: &mut Tokens) -> Option<Self> {
        let operators = [("+", Operator::Plus), ("-", Operator::Minus), ("&", Operator::And)];
        operators.into_iter().find(|(symbol, _)| tokens.take(symbol)).map(|(_, operator)| operator)
    }
}

impl Term {
    fn read(tokens: &mut Tokens, vocabulary: Vocabulary<'_>) -> Result<Self, String> {
        let negative = tokens.take("-");
        match tokens.peek().cloned() {
            Some(Token::Number(number)) => {
                tokens.next();
                Ok(Term::Number(if negative { -number } else { number }))
            }
            Some(Token::Name(name)) if !negative => {
                tokens.next();
                if vocabulary.names.contains(&name) {
                    Ok(Term::Remembered(name))
                } else {
                    Err(format!("'${name}' is neither a parameter nor remembered by a 'let' above"))
                }
            }
            Some(Token::Word(word)) if !negative => Self::named(&word, tokens, vocabulary),
            Some(Token::Word(word)) if vocabulary.constant(&word).is_some() => {
                tokens.next();
                Ok(Term::Number(-vocabulary.constant(&word).unwrap_or_default()))
            }
            other => Err(format!("a value is missing before {}", shown(other.as_ref()))),
        }
    }

    /// Takes a value that begins with this word, which is still there.
    fn named(word: &str, tokens: &mut Tokens, vocabulary: Vocabulary<'_>) -> Result<Self, String> {
        let capitals = word.chars().all(|c| c.is_ascii_uppercase());
        if Instruction::by_mnemonic(word).is_some() && capitals {
            return Ok(Term::Read(Template::read(tokens, vocabulary, false)?));
        }
        tokens.next();
        match word {
            "sdo" => return Ok(Term::Object(Object::read(tokens)?)),
            "program" => return Ok(Term::Program),
            "program_counter" => return Ok(Term::Counter),
            _ => {}
        }
        if Look::named(word, None, vocabulary.kind).is_err() {
            let state = PROGRAM.iter().find(|(name, _)| *name == word).map(|(_, number)| *number);
            if let Some(number) = vocabulary.constant(word).or(state) {
                return Ok(Term::Number(number));
            }
            if capitals {
                return Err(format!("unknown command '{word}'"));
            }
        }
        let axis = match tokens.peek() {
            Some(Token::Number(axis)) if axis.fract() == 0.0 => Some(*axis as usize),
            _ => None,
        };
        let look = Look::named(word, axis, vocabulary.kind).map_err(|error| {
            let others = ["program", "program_counter"].into_iter().chain(PROGRAM.map(|(name, _)| name));
            match suggestion(word, others).as_str() {
                suggestion if error.starts_with("unknown") && !suggestion.is_empty() => {
                    format!("unknown value '{word}'{suggestion}")
                }
                _ => error,
            }
        })?;
        if axis.is_some() {
            tokens.next();
        }
        Ok(Term::World(look))
    }

    fn value(&self, values: &mut impl Values) -> Result<f64, String> {
        match self {
            Term::Number(number) => Ok(*number),
            Term::Remembered(name) => values.remembered(name).ok_or_else(|| format!("'${name}' has no value")),
            Term::World(look) => values.look(look),
            Term::Read(template) => {
                let command = template.command(values)?;
                values.read(command)
            }
            Term::Object(object) => values.object(*object),
            Term::Program => Ok(f64::from(application(values)?.to_be_bytes()[0])),
            Term::Counter => Ok(f64::from(application(values)? as u16)),
        }
    }
}

/// The state of the program with its counter: the reply to command 135, type 1.
fn application(values: &mut impl Values) -> Result<i32, String> {
    Ok(values.read(Command::new(Opcode::ApplicationStatus as u8, 1, 0, 0))? as i32)
}

/// Whether a command has a word like this among its operands.
fn is_operand(mnemonic: &str, word: &str) -> bool {
    let fields = Instruction::by_mnemonic(mnemonic).map_or(&[][..], |instruction| instruction.fields);
    fields
        .iter()
        .any(|field| matches!(field, Field::Named(names) if names.iter().any(|name| name.eq_ignore_ascii_case(word))))
}

impl Template {
    /// Reads a command and its operands; `sums` says whether an operand may be a sum (in a value the sum goes on behind
    /// the command).
    pub(super) fn read(tokens: &mut Tokens, vocabulary: Vocabulary<'_>, sums: bool) -> Result<Self, String> {
        let (name, separated) = match tokens.next() {
            Some(Token::Word(name)) => (name, true),
            Some(Token::Number(opcode)) => (opcode.to_string(), tokens.take(",")),
            other => return Err(format!("a TMCL command is missing before {}", shown(other.as_ref()))),
        };
        let mut operands = Vec::new();
        if separated && !matches!(tokens.peek(), None | Some(Token::Symbol("->"))) {
            loop {
                // A word of the command, as in MVP ABS, is one even where the program has a name like it. Other names
                // of the program, and those of the world, are values.
                let is_word = |word: &str| {
                    let known = vocabulary.constant(word).is_some() || Look::named(word, None, vocabulary.kind).is_ok();
                    !known || is_operand(&name, word)
                };
                let word = match tokens.peek() {
                    Some(Token::Word(word)) if is_word(word) => Some(word.clone()),
                    _ => None,
                };
                operands.push(if let Some(word) = word {
                    tokens.next();
                    Operand::Word(word)
                } else if sums {
                    Operand::Value(Sum::read(tokens, vocabulary)?)
                } else {
                    Operand::Value(Sum { first: Term::read(tokens, vocabulary)?, others: Vec::new() })
                });
                if !tokens.take(",") {
                    break;
                }
            }
        }
        let template = Template { name, operands };
        // Whether there is such a command shows before anything runs; what is not known yet is taken to be zero.
        template.filled(|sum| Ok(sum.constant().unwrap_or_default()))?;
        Ok(template)
    }

    /// The command with the values of this moment.
    pub(super) fn command(&self, values: &mut impl Values) -> Result<Command, String> {
        self.filled(|sum| sum.value(values))
    }

    fn filled(&self, mut evaluate: impl FnMut(&Sum) -> Result<f64, String>) -> Result<Command, String> {
        let mut words = Vec::new();
        for operand in &self.operands {
            words.push(match operand {
                Operand::Word(word) => word.clone(),
                Operand::Value(sum) => match evaluate(sum)? {
                    value if value.fract() == 0.0 => value.to_string(),
                    value => return Err(format!("{}: {value} is not a whole number", self.name)),
                },
            });
        }
        let line = format!("{} {}", self.name, words.join(", "));
        text::parse(&line).map_err(|error| error.to_string())
    }
}
