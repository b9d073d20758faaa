//! The assembler for TMCL programs.
//!
//! A source has one command in a line, written as in the firmware manual, chapter 3.7. Upper and lower case are the
//! same everywhere.
//!
//! ```text
//! #include TMCLParam.tmc             // names of parameters; another file: "file.tmc"
//! Speed = 2 * 500                    // a constant
//!     SAP APMaxPositioningSpeed, Motor0, Speed
//! Loop:                              // a label, alone or before a command
//!     MVP REL, 0, 51200              /* comments may
//!     WAIT POS, 0, 0                    go over several lines */
//!     JA Loop
//! ```
//!
//! * Numbers are decimal, hexadecimal (`$FF`, `0xFF`) or binary (`%1010`, `0b1010`). Every operand may be an
//!   expression of numbers, constants and labels with `+ - * /`, signs and parentheses, within 32 bits.
//! * Labels and, in commands, constants may be used above their line; a constant made of other constants comes after
//!   them.
//! * A command number may stand in place of the mnemonic; type, motor or bank, and value follow. Every command can be
//!   written like this, also one without a mnemonic.
//! * A file to include is looked for beside the file that includes it. [`include::PARAMETERS`] and
//!   [`include::INTERRUPTS`] are built in.
//! * STOP is put at the end, unless it is the last command already and no label follows; `#nostop` leaves it out.
//!
//! A program passes through the files of this module in this order: source, token, statement, symbol, expression,
//! encode, check; `assembler` calls them in turn. The results are a [`crate::program`] file and a [`listing`]. What is
//! asked while a source is written is in [`editor`].

mod assembler;
pub mod check;
mod diagnostic;
pub mod editor;
mod encode;
mod expression;
pub mod include;
mod line;
mod listing;
mod message;
mod settings;
mod source;
mod statement;
mod symbol;
mod token;

#[cfg(test)]
mod tests;

pub use assembler::{Assembly, SourceLine, Watched, assemble_among, assemble_file, assemble_text};
pub use diagnostic::{Diagnostic, Diagnostics, Location, Severity};
pub use line::{command, first_operand, names, names_of_all, value};
pub use listing::{listing, symbols};
pub use message::{Advice, Message};
pub use settings::Settings;
pub use source::Source;
pub use symbol::Symbols;
