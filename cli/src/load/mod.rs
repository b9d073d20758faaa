//! `tmcl load`: a program into a module.

mod options;
mod watch;

use std::cell::RefCell;
use std::io::Write;

use tmcl_link::EndSignal;
use tmcl_tools::asm::Settings;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::program::{Program, Transfer, fits, transfer};

use crate::failure::Failure;
use crate::files::is_standard;
use crate::program::read_program;
use crate::progress::Bar;
use crate::tell;
pub use options::Options;

/// Loads a program; compares, stores the autostart and starts the program if the options say so.
pub fn run(options: &Options) -> Result<(), Failure> {
    let at = options.at;
    if at > 0 && options.autostart {
        return Err(Failure::Arguments(format!(
            "--autostart cannot be combined with --at {at}: after power-up a module begins at address 0; load the program \
             there, or let the one that is there go on with this one: JA {at}"
        )));
    }
    if options.watch && is_standard(&options.program.file) {
        return Err(Failure::Arguments(
            "--watch: standard input cannot be saved again; give the name of a file".into(),
        ));
    }
    let signal = EndSignal::watch()?;
    let mut module = options.program.reach.open()?;
    let settings = Settings { product: module.product()?, origin: at, strict: false };
    if options.watch {
        return watch::run(&mut module, settings, options, &signal);
    }
    let program = read_program(&options.program.file, settings)?;
    check(&program, settings)?;
    load(&mut module, &program, options, &signal)
}

/// Refuses a program that has no room; warnings about it are printed.
fn check(program: &Program, settings: Settings) -> Result<(), Failure> {
    if let Some(warning) = fits(program, settings)? {
        // A closed standard error does not end the program.
        let _ = tell::warning(warning);
    }
    Ok(())
}

/// Puts a program into the module, and does what the options say then.
fn load(module: &mut Conversation, program: &Program, options: &Options, signal: &EndSignal) -> Result<(), Failure> {
    let Options { at, verify, autostart, run, .. } = *options;
    let wanted = Transfer { at, verify, autostart, run };
    let bar = RefCell::new(Bar::default());
    transfer(module, program, wanted, signal, &mut |told| bar.borrow_mut().tell(told), |done| {
        bar.borrow_mut().pause();
        Ok(writeln!(tell::out(), "{done}")?)
    })
}
