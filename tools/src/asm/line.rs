//! Single commands and values with names and expressions, as users type them outside of a program.

use tmcm::tmcl::{Command, text};

use super::assembler::{assemble_text, unknown_command};
use super::encode;
use super::expression::evaluate;
use super::include::{INTERRUPTS, PARAMETERS};
use super::source::{Problem, Span};
use super::statement::{self, CommandLine, Statement, labels};
use super::symbol::Symbols;
use super::token::{Kind, Lexer, Token};
use crate::product::Product;

/// The names that `tmcl asm --names` shows for a product, without any of a program; none for a product that is not
/// known.
pub fn names(product: Option<Product>) -> Symbols {
    let source = match product {
        Some(_) => format!("#include {PARAMETERS}\n#include {INTERRUPTS}\n"),
        None => String::new(),
    };
    // The built-in files have no errors, which their tests make sure of.
    assemble_text("names", &source, product).map(|assembly| assembly.symbols).unwrap_or_default()
}

/// The names of all products, each with the number that the first product with the name gives to it.
pub fn names_of_all() -> Symbols {
    Product::ALL.into_iter().fold(Symbols::default(), |all, product| all.with(&names(Some(product)))).of_no_product()
}

/// Reads one command as it is written in a program, without a label. Its operands may be expressions with the names of
/// `symbols` and with those of the built-in files of the product, included or not. The names of `symbols` come first. A
/// command in plain numbers needs no product.
///
/// # Errors
/// A message for the user, with a suggestion for an unknown name.
pub fn command(line: &str, product: Option<Product>, symbols: &Symbols) -> Result<Command, String> {
    let plain = match text::parse(line) {
        Ok(command) => return Ok(command),
        Err(error) => error,
    };
    // The messages about plain commands show how the command is used, those of the assembler know the names.
    if !matches!(plain, text::Error::UnknownMnemonic(_) | text::Error::BadOperand(..)) {
        return Err(plain.to_string());
    }
    let tokens = tokens(line)?;
    let (labels, tokens) = labels(&tokens);
    if let Some(label) = labels.first() {
        return Err(format!("a label ({}:) means nothing here; give a command, for example GAP 1, 0", label.text));
    }
    match statement::statement(tokens, unknown_command).map_err(message)? {
        Some(Statement::Command(command)) => {
            encode::command(&command, line, &symbols.with(&names(product))).map_err(message)
        }
        Some(_) => Err("only a program can have this; give a command, for example GAP 1, 0".into()),
        None => Err(text::Error::Empty.to_string()),
    }
}

/// The name that stands alone as the first operand of the command in a line of a program; `None` if there is none.
pub fn first_operand(line: &str) -> Option<String> {
    let tokens = tokens(line).ok()?;
    let (_, tokens) = labels(&tokens);
    let Statement::Command(CommandLine { operands, .. }) = statement::statement(tokens, unknown_command).ok()?? else {
        return None;
    };
    match operands.first()?.tokens.as_slice() {
        [Token { kind: Kind::Name(name), .. }] => Some(name.clone()),
        _ => None,
    }
}

/// The value of an expression as operands have them: -2147483648..=4294967295. It may have the names of `symbols` and
/// those of the built-in files of the product, included or not; the names of `symbols` come first.
///
/// # Errors
/// A message for the user, with a suggestion for an unknown name.
pub fn value(text: &str, product: Option<Product>, symbols: &Symbols) -> Result<i64, String> {
    let known = symbols.with(&names(product));
    evaluate(&tokens(text)?, Span::default(), &|name| known.resolve(name)).map_err(message)
}

/// The tokens of a line that stands alone.
fn tokens(line: &str) -> Result<Vec<Token>, String> {
    let mut lexer = Lexer::default();
    let (tokens, problem) = lexer.line(1, line);
    match problem.or_else(|| lexer.finish().map(|(_, problem)| problem)) {
        Some(problem) => Err(message(problem)),
        None => Ok(tokens),
    }
}

fn message(problem: Problem) -> String {
    problem.message.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: Option<Product> = Some(Product::Tmcm1140);

    fn program() -> Symbols {
        assemble_text("test", "Speed = 2 * 500\nROR 0, Speed\nLoop: JA Loop\n", KNOWN).unwrap().symbols
    }

    #[test]
    fn commands_have_names_and_expressions() {
        for (line, expected) in [
            ("GAP 1, 0", Command::new(6, 1, 0, 0)),
            ("gap apactualposition, Motor0", Command::new(6, 1, 0, 0)),
            ("SAP APMaxPositioningSpeed, 0, Speed + 3 * $10", Command::new(5, 4, 0, 1048)),
            ("MVP REL, Motor0, -(51200 / 4)", Command::new(4, 1, 0, -12_800)),
            ("EI TI_GLOBAL", Command::new(25, 255, 0, 0)),
            ("129, 1, 0, Loop + 1", Command::new(129, 1, 0, 2)),
            ("JA %11", Command::new(22, 0, 0, 3)),
        ] {
            assert_eq!(command(line, KNOWN, &program()), Ok(expected), "{line}");
        }
    }

    #[test]
    fn a_plain_command_needs_no_product() {
        let plain = Command::new(5, 4, 0, 1500);
        assert_eq!(command("SAP 4, 0, 1500", None, &Symbols::default()), Ok(plain));
        assert_eq!(command("SAP 2 + 2, 0, 3 * 500", None, &Symbols::default()), Ok(plain));
        let unknown = command("SAP APMaxPositioningSpeed, 0, 1500", None, &Symbols::default());
        assert_eq!(unknown.unwrap_err(), "unknown name 'APMaxPositioningSpeed'");
    }

    #[test]
    fn mistakes_are_told_with_suggestions() {
        let told = |line| command(line, KNOWN, &program()).unwrap_err();
        assert_eq!(told("STAPP 4, 0"), "unknown command 'STAPP'; did you mean 'STAP'?");
        assert_eq!(told("GAP APActualPositon, 0"), "unknown name 'APActualPositon'; did you mean 'APActualPosition'?");
        assert_eq!(told("ROR 0, Sped"), "unknown name 'Sped'; did you mean 'Speed'?");
        assert!(told("GAP APGroupIndex, 0").contains("the TMCM-1140 does not have it"));
        assert_eq!(told("GAP 300, 0"), "GAP: 300 is out of range; usage: GAP <type>, <motor or bank>");
        assert_eq!(told("GAP 100 + 200, 0"), "300 is out of range; 0..255 fits here");
        assert!(told("SAP APMaxPositioningSpeed, 0").contains("SAP: missing <value>"));
        assert!(told("Loop: GAP APActualPosition, 0").contains("label (Loop:)"));
        assert!(told("Speed = 5").contains("only a program"));
        assert_eq!(told(" "), "no command; try GAP 1, 0");
        assert!(told("GAP 1 /* here").contains("does not end"));
    }

    #[test]
    fn values_have_names_and_expressions() {
        let value = |text| value(text, KNOWN, &program());
        assert_eq!(value("Speed / 4"), Ok(250));
        assert_eq!(value("Loop + APMaxCurrent"), Ok(7));
        assert_eq!(value("$FFFFFFFF"), Ok(4_294_967_295));
        assert_eq!(value(""), Err("a value is missing here".into()));
        assert_eq!(value("5 000"), Err("a comma or an operator (+ - * /) is missing before this".into()));
        assert_eq!(value("Lopp"), Err("unknown name 'Lopp'; did you mean 'Loop'?".into()));
    }

    /// A program may have a name of its own that is also one of the built-in files.
    #[test]
    fn the_names_of_the_program_come_first() {
        let symbols = assemble_text("test", "TI_GLOBAL = 7\nSTOP\n", KNOWN).unwrap().symbols;
        assert_eq!(value("ti_global", KNOWN, &symbols), Ok(7));
        let all = symbols.with(&names(KNOWN));
        assert_eq!(all.names().filter(|name| name.eq_ignore_ascii_case("TI_GLOBAL")).count(), 1);
        assert_eq!(all.names().count(), names(KNOWN).names().count());
    }
}
