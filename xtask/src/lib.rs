//! Builds what runs on the microcontroller. Rust's library for it is installed first if it is missing. So the toolchain
//! may be there without it, as where rustup does not install by itself what `rust-toolchain.toml` names.
//!
//! Which images there are stands in the `Cargo.toml` of their package: [`images`].

#[path = "../../images.rs"]
mod manifest;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// The microcontroller, in the words of the compiler.
pub const TARGET: &str = "thumbv7em-none-eabi";
/// The package with the images.
const PACKAGE: &str = "tmcm";
/// The image of the TMCM-1140 that speaks TMCL, which is the usual one.
pub const TMCL: &str = "tmcm1140";
/// The image of the TMCM-1140 that is a node of CANopen.
pub const CANOPEN: &str = "tmcm1140-canopen";

/// A flash image, as the package has it.
#[derive(Clone, Debug)]
pub struct Image {
    /// The name of the binary, such as `tmcm1140-canopen`.
    pub name: String,
    /// The feature of the package that is the image's board.
    pub board: String,
}

/// All images, in the order in which the package has them. The error is the sentence of [`workspace`].
pub fn images() -> Result<Vec<Image>, String> {
    let manifest = workspace()?.join("Cargo.toml");
    let text = fs::read_to_string(&manifest).map_err(|error| format!("{}: {error}", manifest.display()))?;
    let image = |(name, board): (&str, &str)| Image { name: name.into(), board: board.into() };
    Ok(manifest::images(&text).into_iter().map(image).collect())
}

/// The image of a name, such as `tmcm1140-canopen` or, for short, `1140-canopen`. The error is a sentence that lists
/// the names.
pub fn named(name: &str) -> Result<Image, String> {
    let images = images()?;
    let short = |image: &Image| image.name.trim_start_matches("tmcm").to_owned();
    let found = images.iter().find(|image| name == image.name || name == short(image));
    found.cloned().ok_or_else(|| {
        let names: Vec<_> = images.iter().map(short).collect();
        format!("'{name}' is no image; there are: {}", names.join(", "))
    })
}

/// A program for the microcontroller.
#[derive(Debug)]
pub struct Built {
    /// Where it is.
    pub path: PathBuf,
    /// The messages of the compiler.
    pub messages: String,
}

/// Builds a flash image into a build directory. The error says why not.
pub fn image(directory: &Path, name: &str) -> Result<Built, String> {
    let image = named(name)?;
    build(directory, &image.name, &image.choice())
}

impl Image {
    /// The arguments by which Cargo builds the image: it is a binary of the package, and a feature is its board.
    fn choice(&self) -> [&str; 6] {
        ["--package", PACKAGE, "--bin", &self.name, "--features", &self.board]
    }
}

/// Builds a program by `cargo rustc` into a build directory; what is there already is not built again. Flags meant for
/// the host's compiler are left out. The error is what the compiler says, or the sentence of [`prepare`].
pub fn build(directory: &Path, name: &str, arguments: &[&str]) -> Result<Built, String> {
    build_in(&workspace()?, directory, name, arguments)
}

/// The same with a program of the workspace in any folder.
pub fn build_in(folder: &Path, directory: &Path, name: &str, arguments: &[&str]) -> Result<Built, String> {
    prepare()?;
    let output = cargo(folder, "rustc")
        .args(["--color=never", "--target-dir"])
        .arg(directory)
        .args(arguments)
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .output();
    let output = output.map_err(|error| format!("cargo cannot be run: {error}"))?;
    let messages = String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() {
        return Err(messages);
    }
    Ok(Built { path: directory.join(TARGET).join("release").join(name), messages })
}

/// A command of Cargo that builds an image on the way, with more arguments: `build`, or `run` to flash it. The error is
/// the sentence of [`workspace`].
pub fn image_by(command: &str, image: &Image, arguments: &[String]) -> Result<Command, String> {
    let mut cargo = cargo(&workspace()?, command);
    cargo.args(image.choice()).args(arguments);
    Ok(cargo)
}

/// A command of Cargo for what is in a folder.
fn cargo(folder: &Path, command: &str) -> Command {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(folder);
    cargo.args([command, "--release", "--target", TARGET]);
    cargo
}

/// The folder of the workspace in which the caller runs: that of the package for which Cargo has started this process,
/// else that of the current folder. Where this was compiled tells nothing: a checkout may have been moved, or copied
/// with all that is built in it. The error is one sentence.
pub fn workspace() -> Result<PathBuf, String> {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let current = std::env::current_dir().map_err(|error| format!("there is no current folder: {error}"))?;
    let root = package.iter().chain([&current]).find_map(|folder| folder.ancestors().find(|above| has_images(above)));
    root.map(Path::to_owned).ok_or_else(|| {
        format!("neither {} nor a folder above it is a checkout of the firmware: go to one", current.display())
    })
}

/// Whether this is the folder of the package with the images, which is that of the workspace.
fn has_images(folder: &Path) -> bool {
    let line = format!("name = \"{PACKAGE}\"");
    fs::read_to_string(folder.join("Cargo.toml")).is_ok_and(|manifest| manifest.lines().any(|other| other == line))
}

/// The folder with the programs that were built together with the test that asks; the build directory is the one above.
/// The error is one sentence.
pub fn programs() -> Result<PathBuf, String> {
    let test = std::env::current_exe().map_err(|error| format!("it is unknown where this runs: {error}"))?;
    // The test itself is one folder further down.
    test.ancestors().nth(2).map(Path::to_owned).ok_or_else(|| format!("{} was not built by Cargo", test.display()))
}

/// Sees to it that Rust's library for the microcontroller is there. If it cannot be, the error is one sentence that
/// names the command to run, and for all who ask again in the same process a reference to that.
pub fn prepare() -> Result<(), String> {
    static MISSING: OnceLock<Option<String>> = OnceLock::new();
    let mut is_first = false;
    let missing = MISSING.get_or_init(|| {
        is_first = true;
        library(TARGET, "the flash image").err()
    });
    match missing {
        None => Ok(()),
        Some(sentence) if is_first => Err(sentence.clone()),
        Some(_) => Err(format!("no library for {TARGET}, as said where it was missed first")),
    }
}

/// Sees to it that Rust's library for a target is there, which `who` needs, such as "the flash image". If it cannot be,
/// the error is one sentence that names the command to run.
pub fn library(target: &str, who: &str) -> Result<(), String> {
    if is_there(target) {
        return Ok(());
    }
    let need = format!("{who} needs Rust's library for {target}");
    // Set by rustup for all that it starts.
    let Ok(toolchain) = std::env::var("RUSTUP_TOOLCHAIN") else {
        return Err(format!(
            "{need}, which this Rust lacks and, being none of rustup's, must get from where it came from; \
             with Rust from https://rustup.rs the command is: rustup target add {target}"
        ));
    };
    let arguments = ["target", "add", target, "--toolchain", &toolchain];
    let why = match Command::new("rustup").args(arguments).output() {
        Ok(output) if output.status.success() && is_there(target) => return Ok(()),
        Ok(output) => reason(&output),
        Err(error) => error.to_string(),
    };
    Err(format!("{need}, and rustup did not install it ({why}); run, with a network: rustup {}", arguments.join(" ")))
}

/// Whether the compiler has the library.
fn is_there(target: &str) -> bool {
    let compiler = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(compiler).args(["--print", "target-libdir", "--target", target]).output();
    output.is_ok_and(|output| Path::new(String::from_utf8_lossy(&output.stdout).trim_end()).is_dir())
}

/// The error that rustup gives, in a line.
fn reason(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr);
    let error = said.lines().find_map(|line| line.strip_prefix("error: "));
    error.map_or_else(|| output.status.to_string(), Into::into)
}
