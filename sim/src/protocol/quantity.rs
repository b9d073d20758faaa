//! A value that a watch tells: one of the world, or one that a command of TMCL reads in no time.

use hal_sim::board::BoardKind;
use tmcm::tmcl::{Command, text};

use crate::look::Look;
use crate::module::VirtualModule;
use crate::scenario::condition::Values;

/// A value and its name.
#[derive(Clone, Debug)]
pub struct Quantity {
    name: String,
    source: Source,
}

/// Where a value comes from.
#[derive(Clone, Debug)]
enum Source {
    World(Look),
    Command(Command),
}

impl Quantity {
    /// Takes a value from the front of `words` - `rotor`, `rotor 2`, `GAP 4, 0` - and gives the words behind it. `kind`
    /// is the board's.
    ///
    /// # Errors
    /// There is no such value; the message says what to write instead.
    pub fn leading<'a, 'b>(words: &'a [&'b str], kind: &BoardKind) -> Result<(Self, &'a [&'b str]), String> {
        let is_command = words.first().is_some_and(|word| word.chars().all(|letter| letter.is_ascii_uppercase()));
        let end = if is_command { end_of_command(words) } else { end_of_name(words) };
        let (own, rest) = words.split_at(end);
        let text = own.join(" ");
        let (name, source) = if is_command {
            let command = text::parse(&text).map_err(|error| format!("{text}: {error}"))?;
            (text, Source::Command(command))
        } else {
            let look = Look::parse(&text, kind)?;
            (look.name(), Source::World(look))
        };
        Ok((Quantity { name, source }, rest))
    }

    /// The value's name, as a line of a watch has it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The value now.
    ///
    /// # Errors
    /// The reason why there is none.
    pub fn read(&self, values: &mut impl Values) -> Result<f64, String> {
        match &self.source {
            Source::World(look) => values.look(look),
            Source::Command(command) => values.read(*command),
        }
    }
}

/// Where a name ends: behind the number of an axis, if one follows.
fn end_of_name(words: &[&str]) -> usize {
    let has_axis = words.get(1).is_some_and(|word| word.chars().all(|digit| digit.is_ascii_digit()));
    1 + usize::from(has_axis)
}

/// Where a command ends: its operands have commas between them.
fn end_of_command(words: &[&str]) -> usize {
    let mut end = 2.min(words.len());
    while end < words.len() && (words[end - 1].ends_with(',') || words[end].starts_with(',')) {
        end += 1;
    }
    end
}

/// The values that can be seen of a module without letting time pass.
pub struct Seen<'a, M>(pub &'a mut M);

impl<M: VirtualModule> Values for Seen<'_, M> {
    fn look(&mut self, look: &Look) -> Result<f64, String> {
        Ok(look.read(&self.0.board_mut()))
    }

    fn read(&mut self, command: Command) -> Result<f64, String> {
        self.0.peek(command).map(f64::from)
    }

    fn remembered(&self, _: &str) -> Option<f64> {
        None
    }
}
