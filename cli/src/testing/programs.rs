//! The programs that scenarios load, from sources or assembled files.

use std::path::Path;

use tmcl_tools::asm::{Diagnostics, Severity, assemble_file};
use tmcm_sim::Product;
use tmcm_sim::scenario::program::Program;

use crate::files::Files;
use crate::program::{self, read_commands};

/// Reads the program in a file, for a product.
///
/// # Errors
/// A message: the file cannot be read, or the first of the errors in it.
pub(super) fn read(path: &Path, product: Product) -> Result<Program, String> {
    if !program::is_source(path) {
        let commands = read_commands(path, Some(product)).map_err(|failure| failure.to_string())?;
        return Ok(Program { commands, ..Program::default() });
    }
    let assembly = assemble_file(&Files, path, Some(product)).result.map_err(|errors| first(&errors))?;
    let symbols = &assembly.symbols;
    let value = |name: &str| Some((name.to_string(), symbols.value(name)?));
    let names = symbols.names().filter_map(value).collect();
    let labels = symbols.labels().map(|(name, _)| name.into()).collect();
    Ok(Program { commands: assembly.commands, names, labels })
}

/// The first error in a line, and how many more there are.
fn first(errors: &Diagnostics) -> String {
    let Some(error) = errors.0.iter().find(|diagnostic| diagnostic.severity == Severity::Error) else {
        return "the program cannot be assembled".into();
    };
    let place = error.location.as_ref().map(|place| format!("{}:{}:{}: ", place.file, place.line, place.column));
    let more = match errors.errors() {
        0 | 1 => String::new(),
        count => format!("; tmcl asm shows all {count} errors"),
    };
    format!("{}{}{more}", place.unwrap_or_default(), error.message)
}
