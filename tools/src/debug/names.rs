//! The names that a user of the debugger can type: those of the program, and those of the product's parameters.

use std::collections::BTreeSet;

use tmcm::tmcl::{Command, Opcode};

use crate::asm::{self, Symbols};
use crate::product::{Product, parameter};
use crate::program::Program;

/// Bank of the user variables.
pub(super) const VARIABLES: u8 = 2;
/// Bank of the interrupts' parameters.
const INTERRUPTS: u8 = 3;

/// A parameter that has a name in the built-in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Parameter {
    /// The axis parameter with this number.
    Axis(u8),
    /// The global parameter with this number in this bank.
    Global(u8, u8),
}

/// The names of a program in a module.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    /// The product of the module; `None` if it is not known.
    pub(super) product: Option<Product>,
    /// Labels and constants of the program.
    pub(super) symbols: Symbols,
    /// The constants with which the program names its user variables, and the numbers of these.
    variables: Vec<(String, u8)>,
}

impl Names {
    pub(super) fn of(program: &Program, product: Option<Product>) -> Self {
        let variables = program.at_addresses(0).filter_map(|(address, command)| {
            let number = variable(command)?;
            let name = asm::first_operand(&program.line(address)?.text)?;
            let constant = program.symbols.value(&name) == Some(number.into());
            constant.then_some((name, number))
        });
        Names { product, symbols: program.symbols.clone(), variables: variables.collect() }
    }

    /// The value of an expression.
    ///
    /// # Errors
    /// A message for the user.
    pub(super) fn value(&self, text: &str) -> Result<i64, String> {
        asm::value(text, self.product, &self.symbols)
    }

    /// The value of an expression as modules have it, in 32 bits with a sign.
    ///
    /// # Errors
    /// A message for the user.
    pub(super) fn number(&self, text: &str) -> Result<i32, String> {
        // An expression has at most 32 bits, signed or unsigned, so the conversion loses none.
        self.value(text).map(|value| value as u32 as i32)
    }

    /// The user variable that the program has under this name. Upper and lower case are the same.
    pub(super) fn variable(&self, name: &str) -> Option<(&str, u8)> {
        let found = self.variables.iter().find(|(variable, _)| variable.eq_ignore_ascii_case(name));
        found.map(|(name, number)| (name.as_str(), *number))
    }

    /// The user variables of a program, each as it can be typed: by its name, or by its number.
    pub(super) fn used(&self, program: &Program) -> Vec<String> {
        let numbers = program.at_addresses(0).filter_map(|(_, command)| variable(command));
        let numbers: BTreeSet<u8> = numbers.collect();
        let named =
            |number| self.variables.iter().find(|(_, variable)| *variable == number).map(|(name, _)| name.clone());
        numbers.into_iter().map(|number| named(number).unwrap_or_else(|| format!("variable {number}"))).collect()
    }

    /// True for a label or constant of the program. Upper and lower case are the same.
    pub(super) fn is_own(&self, name: &str) -> bool {
        let is = |own: &str| own.eq_ignore_ascii_case(name);
        self.symbols.labels().any(|(own, _)| is(own)) || self.symbols.constants().any(|(own, _)| is(own))
    }

    /// The parameter with this name in the built-in files, unless the program itself gives the name another meaning.
    pub(super) fn parameter(&self, name: &str) -> Option<Parameter> {
        if self.is_own(name) {
            return None;
        }
        let number = u8::try_from(asm::names(self.product).value(name)?).ok()?;
        let beginning = name.get(..2)?.to_ascii_uppercase();
        match beginning.as_str() {
            "AP" => Some(Parameter::Axis(number)),
            "GP" => Some(Parameter::Global(number, 0)),
            "TI" => {
                let command = Command::new(Opcode::Ggp as u8, number, INTERRUPTS, 0);
                let known = parameter(self.product?.spec(), Opcode::Ggp, command);
                known.map(|_| Parameter::Global(number, INTERRUPTS))
            }
            _ => None,
        }
    }

    /// All names.
    pub(super) fn all(&self) -> Vec<String> {
        let built_in = asm::names(self.product);
        let mut all: Vec<String> = self.symbols.names().chain(built_in.names()).map(String::from).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// The number of the user variable that a command is about.
fn variable(command: Command) -> Option<u8> {
    let is_global = matches!(
        Opcode::from_number(command.opcode)?,
        Opcode::Sgp | Opcode::Ggp | Opcode::Stgp | Opcode::Rsgp | Opcode::Agp
    );
    (is_global && command.motor == VARIABLES).then_some(command.kind)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asm::assemble_text;

    fn names(source: &str) -> Names {
        let product = Some(Product::Tmcm1140);
        Names::of(&assemble_text("test", source, product).unwrap().into(), product)
    }

    #[test]
    fn variables_are_found_by_their_use() {
        let names =
            names("Count = 10\nOther = 11\nPort = 2\nLoop: GGP Count, 2 // Count\nSIO Other, Port, 1\nJA Loop\n");
        assert_eq!(names.variable("COUNT"), Some(("Count", 10)));
        assert_eq!((names.variable("Other"), names.variable("Loop")), (None, None));
        let program =
            assemble_text("test", "Count = 10\nGGP Count, 2\nSGP 3, 2, 5\nAGP 3, 2\nSGP 4, 0, 1", None).unwrap();
        assert_eq!(names.used(&program.into()), ["variable 3", "Count"]);
        assert_eq!((names.value("Count + 1"), names.number("$FFFFFFFF")), (Ok(11), Ok(-1)));
    }

    #[test]
    fn parameters_have_the_names_of_the_built_in_files() {
        let names = names("GPAutoStart = 5\nSTOP\n");
        assert_eq!(names.parameter("apmaxpositioningspeed"), Some(Parameter::Axis(4)));
        assert_eq!(names.parameter("TI_TIMER0"), Some(Parameter::Global(0, 3)));
        assert_eq!(names.parameter("GPSerialAddress"), Some(Parameter::Global(66, 0)));
        for none in ["GPAutoStart", "TI_GLOBAL", "Motor0", "APNothing", "é"] {
            assert_eq!(names.parameter(none), None, "{none}");
        }
        assert!(names.all().contains(&"APActualPosition".into()));
    }
}
