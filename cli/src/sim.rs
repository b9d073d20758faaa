//! `tmcl sim`: virtual modules with links that host software opens, which are those of [`tmcl_server`].

use std::io::{self, Write};
use std::path::Path;

use tmcl_server::console::Console;
use tmcl_server::options::Options;

use crate::failure::Failure;
use crate::output::Output;
use crate::tell;

/// Runs the virtual modules until a signal ends the program, or the end of standard input with --exit-with-stdin.
pub fn run(options: &Options) -> Result<(), Failure> {
    Ok(tmcl_server::run(options, Console { out, say, log })?)
}

fn out() -> Box<dyn Write> {
    Box::new(tell::out())
}

fn log(path: &Path) -> io::Result<Box<dyn Write>> {
    Ok(Box::new(Output::stream("--log-telegrams", path)?))
}

/// Tells a person something about a virtual module.
pub(crate) fn say(message: &str) {
    // A closed standard error must not end the simulator.
    let _ = writeln!(tell::err(), "tmcl sim: {message}");
}
