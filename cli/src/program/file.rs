//! Reading programs from files: sources, which are assembled, and assembled programs.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use tmcl_tools::asm::{Settings, Watched, assemble_among, assemble_file};
use tmcl_tools::product::Product;
use tmcl_tools::program::{Program, binary};
use tmcm::tmcl::Command;

use crate::asm::reported;
use crate::failure::Failure;
use crate::files::{Files, STANDARD, is_standard, is_text, name, read_named};

/// File name extension of a source.
const SOURCE: &str = "tmc";

/// True for the name of a source.
pub fn is_source(path: &Path) -> bool {
    path.extension().and_then(OsStr::to_str).is_some_and(|ending| ending.eq_ignore_ascii_case(SOURCE))
}

/// Reads an assembled program for a product. The message about a text says that it is one.
pub fn read_commands(path: &Path, product: Option<Product>) -> Result<Vec<Command>, Failure> {
    commands(path, &read_named(path)?, product)
}

fn commands(path: &Path, bytes: &[u8], product: Option<Product>) -> Result<Vec<Command>, Failure> {
    binary::decode(bytes, product).map_err(|error| {
        let what = if is_text(bytes) {
            " is text, not an assembled program; a source has a name that ends in .tmc, and tmcl asm assembles it"
                .into()
        } else {
            format!(": {error}")
        };
        Failure::Failed(name(path) + &what)
    })
}

/// Reads a program to be loaded into a module: a source if the file name ends in .tmc, else an assembled program, which
/// is not changed by an origin. Standard input may hold either. The assembler's errors and warnings are printed.
pub fn read_program(path: &Path, settings: impl Into<Settings>) -> Result<Program, Failure> {
    read_watched(path, settings).0
}

/// Reads a program as [`read_program`] does, and tells on which files the result depends: that one and those that it
/// includes, also where one of them does not exist.
pub fn read_watched(path: &Path, settings: impl Into<Settings>) -> (Result<Program, Failure>, Vec<PathBuf>) {
    let settings = settings.into();
    let (program, files) = if is_standard(path) {
        (standard_input(settings), Vec::new())
    } else if is_source(path) {
        let Watched { result, files, .. } = assemble_file(&Files, path, settings);
        (reported(result).map(Program::from), files)
    } else {
        (read_commands(path, settings.product).map(Program::from), vec![path.into()])
    };
    let checked = program.and_then(|program| match check(&program, settings.origin) {
        Ok(()) => Ok(program),
        Err(error) => Err(Failure::Failed(format!("{}: {error}", name(path)))),
    });
    (checked, files)
}

/// Reads a source or an assembled program from standard input.
fn standard_input(settings: Settings) -> Result<Program, Failure> {
    let path = Path::new(STANDARD);
    let bytes = read_named(path)?;
    if is_text(&bytes) {
        let text = String::from_utf8_lossy(&bytes);
        Ok(reported(assemble_among(&Files, &name(path), &text, settings).result)?.into())
    } else {
        Ok(commands(path, &bytes, settings.product)?.into())
    }
}

/// Fails for a program without commands, and for one with a command that a module would execute during the download.
/// The first command has the address `origin`.
fn check(program: &Program, origin: u16) -> Result<(), String> {
    if program.is_empty() {
        return Err("the program has no commands".into());
    }
    let mut commands = (u32::from(origin)..).zip(&program.commands);
    match commands.find(|(_, command)| command.opcode >= Command::FIRST_CONTROL) {
        None => Ok(()),
        Some((address, Command { opcode, .. })) => Err(format!(
            "address {address}: a program cannot have command {opcode}; a module would carry it out at once"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The failure of reading a file with this name and these bytes.
    fn failure_of(name: &str, bytes: &[u8]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        read_program(&path, Some(Product::Tmcm1140)).unwrap_err().to_string()
    }

    #[test]
    fn files_that_cannot_be_loaded_are_refused_with_a_reason() {
        assert!(failure_of("empty.bin", &[]).ends_with("empty.bin: the program has no commands"));
        for source in [&b"#nostop\n"[..], b"", b"// nothing yet\nSpeed = 5\nLoop:\n"] {
            assert!(failure_of("empty.tmc", source).ends_with("empty.tmc: the program has no commands"));
        }
        let message = "address 0: a program cannot have command 129; a module would carry it out at once";
        assert!(failure_of("control.bin", &[129, 0, 0, 0, 0, 0, 0, 129]).ends_with(message));
        assert!(failure_of("control.tmc", b"129\n").ends_with(message));
        assert!(failure_of("source.bin", b"MVP ABS, 0, 1\n").contains("source.bin is text, not an assembled program"));
        assert!(failure_of("short.bin", &[0; 15]).contains("short.bin: command 1 is cut off"));
        assert!(failure_of("zeros.bin", &vec![0; 1 << 21]).ends_with("larger than 1048576 bytes"));
        // The failure has no message of its own, because the assembler has printed its errors.
        assert_eq!(failure_of("wrong.TMC", b"GOTO 1\n"), "");
    }
}
