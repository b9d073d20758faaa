//! The assembler's errors and warnings on standard error.

use super::assembler::Assembly;
use super::diagnostic::Diagnostics;
use crate::failure::Failure;
use crate::tell;

/// Prints the errors and warnings of an assembly; errors become a failure that has been reported.
pub(crate) fn reported(assembled: Result<Assembly, Diagnostics>) -> Result<Assembly, Failure> {
    let assembly = assembled.map_err(|errors| {
        print(&errors);
        Failure::Reported
    })?;
    print(&assembly.warnings);
    Ok(assembly)
}

/// Prints errors and warnings.
fn print(diagnostics: &Diagnostics) {
    if !diagnostics.is_empty() {
        // A closed standard error must not end the program.
        let _ = diagnostics.tell(&mut tell::err());
    }
}
