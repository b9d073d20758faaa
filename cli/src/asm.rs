//! `tmcl asm`: the assembler for TMCL programs.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use tmcl_tools::asm::{
    Assembly, Diagnostic, Diagnostics, Settings, Severity, assemble_among, assemble_file, include, listing, symbols,
};
use tmcl_tools::product::{self, Product};
use tmcl_tools::program::{address, binary};

use crate::failure::Failure;
use crate::files::{Files, is_standard, read_source};
use crate::output::Output;
use crate::tell::{self, Tone};

/// Assemble a TMCL program
///
/// FILE is a program as text, one command in a line, written as in the firmware manual: "MVP ABS, 0, 51200". What comes
/// out is a file with eight bytes for each command, as modules store them; STOP is put at the end.
///
/// Labels (Loop:), constants (Speed = 2 * 500), comments (// and /* */) and #include work as in the vendor's
/// assembler. The lines "#include TMCLParam.tmc" and "#include Interrupts.inc" bring names for the numbers of
/// parameters and interrupts; --names shows them. Warnings tell what a module would refuse, for example a value out of
/// range; --strict makes them errors.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The program as text; - is standard input
    #[arg(value_name = "FILE", required_unless_present = "names")]
    pub source: Option<PathBuf>,

    /// Where the assembled program goes: FILE with the ending .bin, unless this says otherwise; - is standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Show labels with their addresses, and constants with their values
    #[arg(long)]
    pub symbols: bool,

    /// Show addresses, bytes and source lines side by side
    #[arg(long)]
    pub listing: bool,

    /// Show the built-in files TMCLParam.tmc and Interrupts.inc, and do nothing else
    #[arg(long, conflicts_with_all = ["source", "output", "symbols", "listing"])]
    pub names: bool,

    /// Address in program memory at which the program will begin, from which its labels count
    ///
    /// `tmcl load --at` puts it there; a source is assembled for that address by `tmcl load` itself.
    #[arg(long, value_name = "ADDRESS", default_value_t = 0, conflicts_with = "names", value_parser = address)]
    pub origin: u16,

    /// Take warnings for errors, so that no file is written for a program that has any
    #[arg(long, conflicts_with = "names")]
    pub strict: bool,

    /// The module that the program is for: {numbers}
    ///
    /// Its axes, parameters, interrupts, inputs and outputs are those of the built-in files and of the warnings.
    #[arg(long, value_name = "NAME", default_value = product::USUAL, value_parser = product::named)]
    pub product: Product,
}

const EXAMPLES: &str = "\
Examples:
  tmcl asm examples/to_and_fro.tmc -o to_and_fro.bin
      makes to_and_fro.bin; without -o it would be beside the source
  tmcl asm examples/to_and_fro.tmc -o - | tmcl disasm -
      to standard output, and what the assembler has made of it
  tmcl asm examples/routines.tmc -o routines.bin --symbols --listing
      shows where everything is
  tmcl asm --names
      names for all parameters and interrupts
  tmcl asm examples/homing_axes.tmc -o homing_axes.bin --product 6110 --strict
      for a module with six axes; nothing that it would refuse may be in it
  tmcl asm examples/there_and_back.tmc -o routine.bin --origin 50
      to be loaded to address 50
The exit code is 1 if the program has errors; no file is written then.";

/// Assembles a program into a file.
pub fn run(options: &Options) -> Result<(), Failure> {
    let Some(source) = &options.source else { return show_names(options.product) };
    let output = match &options.output {
        Some(output) => output.clone(),
        None if is_standard(source) => {
            return fail("say where the program goes, for example: -o program.bin");
        }
        None => source.with_extension("bin"),
    };
    let settings = Settings { product: Some(options.product), origin: options.origin, strict: options.strict };
    let assembly = reported(
        if is_standard(source) {
            assemble_among(&Files, "standard input", &read_source(source)?, settings)
        } else {
            assemble_file(&Files, source, settings)
        }
        .result,
    )?;
    if let Some(source) = overwritten(&assembly, &output) {
        return fail(format!("{source} is a source of this program; give another file with -o"));
    }
    let bytes = binary::encode(&assembly.commands);
    let mut out = Output::open("", &output)?;
    let mut text = String::new();
    if options.listing {
        text += &listing(&assembly);
    }
    if options.symbols {
        text += &symbols(&assembly);
    }
    text += &format!("{}: {}, {} bytes", out.name(), count(assembly.commands.len()), bytes.len());
    if options.origin > 0 {
        text += &format!(", to be loaded to address {}", options.origin);
    }
    out.write_all(&bytes)?;
    let program_shown = out.is_standard();
    out.finish()?;
    if program_shown {
        // A closed standard error does not end the program.
        let _ = writeln!(tell::err(), "{text}");
        return Ok(());
    }
    Ok(writeln!(tell::out(), "{text}")?)
}

fn fail<T>(message: impl Into<String>) -> Result<T, Failure> {
    Err(Failure::Failed(message.into()))
}

/// Prints the built-in files of a product.
fn show_names(product: Product) -> Result<(), Failure> {
    let mut out = tell::out();
    for file in [include::PARAMETERS, include::INTERRUPTS] {
        writeln!(out, "// {file}\n{}", include::text(product.spec(), file).unwrap_or_default())?;
    }
    Ok(())
}

/// Name of the source file that the output would overwrite, if there is one.
fn overwritten<'a>(assembly: &'a Assembly, output: &Path) -> Option<&'a str> {
    if is_standard(output) {
        return None;
    }
    let output = output.canonicalize().ok()?;
    let same = |path: &Path| path.canonicalize().is_ok_and(|path| path == output);
    let mut sources = assembly.lines.iter().filter(|line| line.number == 1).map(|line| &line.source);
    sources.find(|source| source.path.as_deref().is_some_and(same)).map(|source| source.name.as_str())
}

/// A number of commands in words.
fn count(commands: usize) -> String {
    format!("{commands} command{}", if commands == 1 { "" } else { "s" })
}

/// Prints the errors and warnings of an assembly; errors become a failure that has been reported.
pub(crate) fn reported(assembled: Result<Assembly, Diagnostics>) -> Result<Assembly, Failure> {
    let assembly = assembled.map_err(|errors| {
        print(&errors);
        Failure::Reported
    })?;
    print(&assembly.warnings);
    Ok(assembly)
}

/// Prints errors and warnings on standard error, each with the colour of its severity.
fn print(diagnostics: &Diagnostics) {
    let mut out = tell::err();
    let mut told = |diagnostic: &Diagnostic| {
        let (before, head, behind) = diagnostic.parts();
        let tone = match diagnostic.severity {
            Severity::Warning => Tone::Warning,
            Severity::Error => Tone::Error,
        };
        out.toned(&before, tone, head, &format!("{behind}\n"))
    };
    // A closed standard error must not end the program.
    let _ = diagnostics.first().iter().try_for_each(&mut told).and_then(|()| match diagnostics.more() {
        Some(more) => writeln!(tell::err(), "{more}"),
        None => Ok(()),
    });
}
