//! The program that runs the modules, as far as something is printed.

use std::io::{self, Write};
use std::path::Path;

/// Where the server prints.
#[derive(Clone, Copy, Debug)]
pub struct Console {
    /// Opens standard output, for the lines that say what the modules are and where they can be reached. They come from
    /// the user alone: names of files, addresses.
    pub out: fn() -> Box<dyn Write>,
    /// Tells a person something, in words without a line end.
    pub say: fn(&str),
    /// Opens the file that option --log-telegrams names. An error of it, or of writing to it, has words for a user who
    /// does not know which file is meant.
    pub log: fn(&Path) -> io::Result<Box<dyn Write>>,
}
