//! Commands as the user types them, and what is told of their replies as JSON.

use serde::Serialize;
use tmcm::tmcl::Command;
use tmcm_sim::wire::Reply;

use crate::asm::{self, Symbols};
use crate::product::Product;
use crate::suggest::world_command;

/// A command that is ready to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// The command.
    pub command: Command,
    /// True if it was typed as a command number, and is answered in numbers.
    pub numeric: bool,
}

impl Request {
    /// Reads a command with the names of a product and those of `symbols`.
    ///
    /// # Errors
    /// A message for the user.
    pub fn read(line: &str, product: Option<Product>, symbols: &Symbols) -> Result<Self, String> {
        let command = asm::command(line, product, symbols).map_err(|message| match world_command(line) {
            Some(world) => format!(
                "{message}; '{world}' changes the world of a virtual module, which has a port of its own for that: \
                 tmcl world ADDR:PORT \"{world}\""
            ),
            None => message,
        })?;
        Ok(Request { command, numeric: line.trim_start().starts_with(|c: char| c.is_ascii_digit()) })
    }
}

/// A command on the command line, which is read before it is known what the module is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Typed {
    /// A command that is the same on every product.
    Plain(Request),
    /// A command with names, whose numbers depend on the product.
    Named(String),
}

impl Typed {
    /// Takes a command that can be read for any of the products.
    ///
    /// # Errors
    /// A message for the user.
    pub fn parse(line: &str) -> Result<Self, String> {
        match Request::read(line, None, &Symbols::default()) {
            Ok(request) => Ok(Typed::Plain(request)),
            // What is a mistake on all products is told before any module is asked what it is.
            Err(_) => Request::read(line, None, &asm::names_of_all()).map(|_| Typed::Named(line.into())),
        }
    }

    /// True if what the module is has to be known.
    pub fn has_names(&self) -> bool {
        matches!(self, Typed::Named(_))
    }

    /// The command for a product.
    ///
    /// # Errors
    /// A message for the user about a name that the product does not have.
    pub fn request(&self, product: Option<Product>) -> Result<Request, String> {
        match self {
            Typed::Plain(request) => Ok(*request),
            Typed::Named(line) => Request::read(line, product, &Symbols::default()),
        }
    }
}

/// A command and its reply, for JSON.
#[derive(Debug, Serialize)]
pub struct Answered {
    /// The command.
    pub command: String,
    /// The reply to the command.
    #[serde(flatten)]
    pub reply: Option<Reply>,
    /// Why there is no reply.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_wait_for_the_product() {
        let request = |command, numeric| Request { command, numeric };
        let plain = |command, numeric| Ok(Typed::Plain(request(command, numeric)));
        assert_eq!(Typed::parse("gap 1, 0"), plain(Command::new(6, 1, 0, 0), false));
        assert_eq!(Typed::parse("6, 1"), plain(Command::new(6, 1, 0, 0), true));
        assert_eq!(Typed::parse("SAP 4, 0, 2 * 500"), plain(Command::new(5, 4, 0, 1000), false));
        let typed = Typed::parse("GAP APGroupIndex, Motor2").unwrap();
        assert_eq!(typed, Typed::Named("GAP APGroupIndex, Motor2".into()));
        assert_eq!(typed.request(Some(Product::Tmcm6110)), Ok(request(Command::new(6, 213, 2, 0), false)));
        assert!(typed.request(Some(Product::Tmcm1140)).unwrap_err().contains("the TMCM-1140 does not have it"));
    }

    #[test]
    fn what_no_product_has_is_told_at_once() {
        let told = |line| Typed::parse(line).unwrap_err();
        assert_eq!(told("GAP 300, 0"), "GAP: 300 is out of range; usage: GAP <type>, <motor or bank>");
        assert_eq!(told("GAP APGroupIndx, 0"), "unknown name 'APGroupIndx'; did you mean 'APGroupIndex'?");
        assert!(told("press left").contains("tmcl world ADDR:PORT \"press left\""));
        assert!(told("PRESS Left").contains("'press left' changes the world"));
    }
}
