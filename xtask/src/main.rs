//! `cargo fw` builds a flash image, `cargo fw-run` brings it to a module: `cargo fw [IMAGE] [ARGUMENT...]`. An IMAGE is
//! one of those in `Cargo.toml`, such as `1140-canopen`, and without one it is that of the TMCM-1140; arguments are
//! those of Cargo, and begin with `-`. `list` in the place of `build` and `run` prints each image with its board.

use std::process::ExitCode;

fn main() -> ExitCode {
    match carry_out() {
        Ok(code) => code,
        Err(sentence) => {
            eprintln!("{sentence}");
            ExitCode::FAILURE
        }
    }
}

fn carry_out() -> Result<ExitCode, String> {
    let (mut command, mut image) = ("build".to_owned(), xtask::TMCL.to_owned());
    let mut arguments = std::env::args().skip(1).peekable();
    // Command and image may stand in either order: the aliases of Cargo have the command, what follows them is the
    // user's.
    while let Some(word) = arguments.next_if(|word| !word.starts_with('-')) {
        match word.as_str() {
            "build" | "run" | "list" => command = word,
            _ => image = word,
        }
    }
    if command == "list" {
        xtask::images()?.iter().for_each(|image| println!("{} {}", image.name, image.board));
        return Ok(ExitCode::SUCCESS);
    }
    let image = xtask::named(&image)?;
    xtask::prepare()?;
    let status = xtask::image_by(&command, &image, &arguments.collect::<Vec<_>>())?.status();
    let status = status.map_err(|error| format!("cargo cannot be run: {error}"))?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}
