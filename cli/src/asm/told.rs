//! What the assembler has to say, on standard error.

use std::io::Write;

use super::assembler::Assembly;
use super::diagnostic::Diagnostics;
use crate::failure::Failure;

/// Shows the errors and warnings of what has been assembled.
pub(crate) fn told(assembled: Result<Assembly, Diagnostics>) -> Result<Assembly, Failure> {
    let assembly = assembled.map_err(|errors| {
        say(&errors);
        Failure::Reported
    })?;
    say(&assembly.warnings);
    Ok(assembly)
}

/// Shows errors and warnings.
fn say(diagnostics: &Diagnostics) {
    if !diagnostics.is_empty() {
        // Where standard error is closed there is nobody to tell.
        let _ = writeln!(std::io::stderr(), "{diagnostics}");
    }
}
