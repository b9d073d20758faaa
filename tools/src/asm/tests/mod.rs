//! Tests of the assembler as a whole.

mod editors;
mod language;
mod manual;
mod random;
mod refusals;

use std::path::Path;

use tmcm::tmcl::{Command, text};

use super::*;
use crate::product::Product;
use crate::program::binary;
use crate::sources::Texts;

/// The commands of a source, which must assemble.
fn assembled(source: &str) -> Assembly {
    editors::agree(source);
    assemble_text("test.tmc", source, Some(Product::Tmcm1140)).unwrap_or_else(|errors| panic!("{errors}"))
}

/// The diagnostics of a source that cannot be assembled.
fn errors(source: &str) -> String {
    editors::agree(source);
    assemble_text("test.tmc", source, Some(Product::Tmcm1140)).expect_err("errors").to_string()
}

/// The commands of these lines, each read by itself.
fn commands(lines: &[&str]) -> Vec<Command> {
    lines.iter().map(|line| text::parse(line).unwrap()).collect()
}
