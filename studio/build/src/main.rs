//! `cargo studio` builds the page of the studio into `target/studio` and serves it to the browsers of this
//! computer until it is killed. It prints the address, and `ready` when that can be opened.

use std::io::{self, Write};
use std::process::ExitCode;

use studio_build::files::Files;
use studio_build::make;
use studio_build::server::Server;

const HELP: &str = "\
Builds the page of the studio into target/studio, and serves it to the browsers of this computer.

Usage: cargo studio [--port N] [--build]

  --port N  serve at this port; without it, or with 0, at any free one
  --build   only build, and print the size of each file in bytes
  --help    print this
";

fn main() -> ExitCode {
    match carry_out() {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => {
            eprintln!("{sentence}");
            ExitCode::FAILURE
        }
    }
}

fn carry_out() -> Result<(), String> {
    let (mut port, mut serves) = (0, true);
    // A word that is not UTF-8 is none of these, however it is shown.
    let mut words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    while let Some(word) = words.next() {
        match word.as_str() {
            "--port" => port = number(words.next())?,
            "--build" => serves = false,
            "--help" => return print(HELP),
            _ => return Err(format!("{word:?} is no option; there are: --port N, --build, --help")),
        }
    }
    let files = Files::read(&make::page()?)?;
    if !serves {
        let sizes = files.iter().map(|(path, file)| format!("{:>9} {path}\n", file.bytes.len()));
        return print(&sizes.collect::<String>());
    }
    let server = Server::bind(files, port)?;
    print(&format!("http://127.0.0.1:{}/\nready\n", server.port()))?;
    server.run()
}

/// The port that a word is.
fn number(word: Option<String>) -> Result<u16, String> {
    let word = word.unwrap_or_default();
    word.parse().map_err(|_| format!("--port wants a number from 0 to 65535, not {word:?}"))
}

fn print(text: &str) -> Result<(), String> {
    let mut output = io::stdout().lock();
    let printed = output.write_all(text.as_bytes()).and_then(|()| output.flush());
    printed.map_err(|error| format!("nothing can be printed: {error}"))
}
