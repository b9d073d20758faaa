//! The assembler as a whole.

mod language;
mod manual;
mod random;

use super::*;
use crate::program::binary;
use tmcm::tmcl::{Command, text};

/// The commands of a source, which must be good.
fn assembled(source: &str) -> Assembly {
    assemble_text("test.tmc", source).unwrap_or_else(|errors| panic!("{errors}"))
}

/// What is said about a source that cannot be assembled.
fn errors(source: &str) -> String {
    assemble_text("test.tmc", source).expect_err("errors").to_string()
}

/// The same commands, one by one.
fn commands(lines: &[&str]) -> Vec<Command> {
    lines.iter().map(|line| text::parse(line).unwrap()).collect()
}
