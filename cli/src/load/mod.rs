//! `tmcl load`: a program into a module.

mod options;
mod transfer;
mod watch;

use tmcl_link::EndSignal;
use tmcl_tools::asm::Settings;

use crate::failure::Failure;
use crate::files::is_standard;
use crate::program::read_program;
pub use options::Options;
use transfer::{fit, load};

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
    let program = fit(read_program(&options.program.file, settings)?, settings)?;
    load(&mut module, &program, options, &signal)
}
