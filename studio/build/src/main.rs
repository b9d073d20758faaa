//! `cargo studio` builds the page of the studio into `target/studio` and serves it to the browsers of this
//! computer until it is killed. It prints the address, and `ready` when that can be opened.

use std::io::{self, Write};
use std::process::ExitCode;

use studio_build::files::Files;
use studio_build::server::Server;
use studio_build::{example, make, opener};

const HELP: &str = "\
Builds the page of the studio into target/studio, and serves it to the browsers of this computer.

Usage: cargo studio [--port N] [--open examples/NAME] [--build]

  --port N             serve at this port; without it, or with 0, at any free one
  --open examples/NAME open an example in the browser, on a virtual module
  --build              only build, and print the size of each file in bytes
  --help               print this
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
    let (mut port, mut serves, mut opened) = (0, true, None);
    // A word that is not UTF-8 is none of these, however it is shown.
    let mut words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    while let Some(word) = words.next() {
        match word.as_str() {
            "--port" => port = number(words.next())?,
            "--open" => opened = Some(example::link(&words.next().unwrap_or_default())?),
            "--build" => serves = false,
            "--help" => return print(HELP),
            _ => {
                return Err(format!(
                    "{word:?} is no option; there are: --port N, --open examples/NAME, --build, --help"
                ));
            }
        }
    }
    let files = Files::read(&make::page()?)?;
    if !serves {
        let sizes = files.iter().map(|(path, file)| format!("{:>9} {path}\n", file.bytes.len()));
        return print(&sizes.collect::<String>());
    }
    let server = Server::bind(files, port)?;
    let address = format!("http://127.0.0.1:{}/{}", server.port(), opened.as_deref().unwrap_or_default());
    print(&format!("{address}\nready\n"))?;
    if opened.is_some()
        && let Err(sentence) = opener::open(&address)
    {
        eprintln!("{sentence}");
    }
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
