//! Values that can be shown, changed, watched and compared: registers, user variables, parameters and expressions.

use tmcm::tmcl::{Command, Opcode};

use super::names::{Names, Parameter, VARIABLES};
use super::register::Register;
use super::state::Reading;
use super::trouble::Trouble;
use crate::conversation::{Conversation, Error};
use crate::replies::unit_and_name;

/// The register, variable, parameter or constant that a value is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    Register(Register),
    /// A user variable.
    Variable(u8),
    /// A parameter of an axis.
    Axis {
        number: u8,
        axis: u8,
    },
    /// A global parameter.
    Global {
        number: u8,
        bank: u8,
    },
    /// A label, a constant or an expression of them.
    Constant(i64),
}

/// A value with the name under which the user knows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Quantity {
    /// The text that the user has typed.
    pub(super) typed: String,
    what: What,
}

impl Quantity {
    /// Reads what the user has typed.
    ///
    /// # Errors
    /// A message for the user.
    pub(super) fn parse(text: &str, names: &Names) -> Result<Self, String> {
        let text = text.trim();
        let end = text.find(|c: char| c.is_whitespace() || c == ',').unwrap_or(text.len());
        let (word, rest) = text.split_at_checked(end).unwrap_or((text, ""));
        let rest = rest.trim_start().strip_prefix(',').unwrap_or(rest).trim();
        // What the program calls by the name of a register is meant before the register.
        let register = Register::named(word).filter(|_| !names.is_own(word));
        let what = match (register, rest) {
            _ if text.is_empty() => return Err("what? For example: acc, x, variable 10, APActualPosition".into()),
            (Some(register), "") => What::Register(register),
            _ if word.eq_ignore_ascii_case("register") && !rest.is_empty() => What::Register(
                Register::named(rest).ok_or_else(|| format!("no register '{rest}'; there are acc, x, pc"))?,
            ),
            _ if word.eq_ignore_ascii_case("variable") => What::Variable(byte(rest, names)?),
            _ => match (names.variable(word), names.parameter(word), rest) {
                (Some((_, number)), _, "") => What::Variable(number),
                (_, Some(Parameter::Axis(number)), "") => What::Axis { number, axis: 0 },
                (_, Some(Parameter::Axis(number)), axis) if !axis.starts_with(['+', '-', '*', '/']) => {
                    What::Axis { number, axis: byte(axis, names)? }
                }
                (_, Some(Parameter::Global(number, bank)), "") => What::Global { number, bank },
                _ => What::Constant(names.value(text)?),
            },
        };
        Ok(Quantity { typed: text.into(), what })
    }

    /// The value now, without unit and name. Of a program that runs freely, registers are those of some moment.
    pub(super) fn value(&self, module: &mut Conversation) -> Result<i64, Error> {
        match self.what {
            What::Constant(value) => Ok(value),
            What::Register(register) => register.read(module).map(i64::from),
            What::Variable(_) | What::Axis { .. } | What::Global { .. } => {
                self.command(Opcode::Gap, Opcode::Ggp, 0).map_or(Ok(0), |command| module.value(command).map(i64::from))
            }
        }
    }

    /// The value now, with unit and name.
    pub(super) fn read(&self, module: &mut Conversation) -> Result<Reading, Error> {
        let value = self.value(module)?;
        Ok(Reading { value, ..self.described(module)? })
    }

    /// Changes the value.
    pub(super) fn write(&self, module: &mut Conversation, value: i32) -> Result<(), Trouble> {
        if let What::Register(register) = self.what {
            return register.write(module, value);
        }
        match self.command(Opcode::Sap, Opcode::Sgp, value) {
            Some(command) => Ok(module.request(command).map(|_| ())?),
            None => Err(Trouble::Mistake(format!("'{}' is a constant of the program; it cannot be set", self.typed))),
        }
    }

    /// True for a register, which a program that runs freely changes all the time.
    pub(super) fn is_register(&self) -> bool {
        matches!(self.what, What::Register(_))
    }

    /// The command about a parameter or a variable, by one of two commands; `None` for what is none of these.
    fn command(&self, of_axis: Opcode, global: Opcode, value: i32) -> Option<Command> {
        match self.what {
            What::Variable(number) => Some(Command::new(global as u8, number, VARIABLES, value)),
            What::Axis { number, axis } => Some(Command::new(of_axis as u8, number, axis, value)),
            What::Global { number, bank } => Some(Command::new(global as u8, number, bank, value)),
            What::Register(_) | What::Constant(_) => None,
        }
    }

    /// Unit and name, with the value 0.
    fn described(&self, module: &mut Conversation) -> Result<Reading, Error> {
        let plain = Reading { of: self.typed.clone(), value: 0, unit: "", name: None };
        let command = self.command(Opcode::Gap, Opcode::Ggp, 0);
        match (self.what, command) {
            (What::Variable(number), _) => {
                let named = !self.typed.to_ascii_lowercase().starts_with("variable");
                Ok(Reading { name: named.then(|| format!("variable {number}")), ..plain })
            }
            (_, Some(command)) => {
                let (unit, name) = unit_and_name(module, command)?;
                Ok(Reading { unit, name, ..plain })
            }
            (_, None) => Ok(plain),
        }
    }
}

/// A number or a bank: 0..=255.
fn byte(text: &str, names: &Names) -> Result<u8, String> {
    let value = names.value(text)?;
    u8::try_from(value).map_err(|_| format!("{value} is out of range; 0..255 fits here"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asm::assemble_text;
    use crate::product::Product;

    fn names() -> Names {
        let product = Some(Product::Tmcm6110);
        let source = "Count = 10\nSpeed = 500\nGGP Count, 2\nLoop: ROR 0, Speed\nJA Loop\n";
        Names::of(&assemble_text("test", source, product).unwrap().into(), product)
    }

    #[test]
    fn everything_that_has_a_value_can_be_named() {
        let what = |text| Quantity::parse(text, &names()).map(|quantity| quantity.what);
        for (text, expected) in [
            ("acc", What::Register(Register::Accumulator)),
            ("X", What::Register(Register::X)),
            ("pc", What::Register(Register::Counter)),
            ("register x", What::Register(Register::X)),
            ("variable 12", What::Variable(12)),
            ("variable Count + 1", What::Variable(11)),
            ("count", What::Variable(10)),
            ("APActualPosition", What::Axis { number: 1, axis: 0 }),
            ("APActualPosition 5", What::Axis { number: 1, axis: 5 }),
            ("apactualposition, Motor2", What::Axis { number: 1, axis: 2 }),
            ("GPSerialAddress", What::Global { number: 66, bank: 0 }),
            ("TI_TIMER1", What::Global { number: 1, bank: 3 }),
            ("Speed", What::Constant(500)),
            ("Loop", What::Constant(1)),
            ("APActualPosition + 1", What::Constant(2)),
            ("Count + 1", What::Constant(11)),
            ("$10", What::Constant(16)),
        ] {
            assert_eq!(what(text), Ok(expected), "{text}");
        }
        assert_eq!(what("Lop"), Err("unknown name 'Lop'; did you mean 'Loop'?".into()));
        assert_eq!(what("variable 256"), Err("256 is out of range; 0..255 fits here".into()));
        assert_eq!(what("register y"), Err("no register 'y'; there are acc, x, pc".into()));
        assert!(what(" ").unwrap_err().starts_with("what?"));
    }
}
