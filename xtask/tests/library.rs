//! Rust's library for the microcontroller: installed where it is missing, and one sentence where it cannot be. Of all
//! tests of the workspace these are the first (packages go by their names), so that where it cannot be, no other is
//! begun. And which checkout is built.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

#[test]
fn it_is_there_or_gets_installed() {
    xtask::prepare().unwrap_or_else(|sentence| panic!("{sentence}"));
}

/// A computer whose programs do what these scripts say, each noting that it was called.
struct Computer(tempfile::TempDir);

impl Computer {
    fn with(programs: &[(&str, &str)]) -> Self {
        let computer = Computer(tempfile::tempdir().unwrap());
        for (name, script) in programs {
            let script = format!("#!/bin/sh\ncd \"$(dirname \"$0\")\"\necho {name} \"$@\" >>calls\n{script}\n");
            // Written by another process: a file that this one writes while a test beside it starts a program cannot be
            // run.
            let write = ["-c", "printf %s \"$1\" >$0 && chmod +x $0", name, &script];
            let done = Command::new("sh").args(write).current_dir(computer.folder()).status().unwrap();
            assert!(done.success());
        }
        computer
    }

    fn folder(&self) -> &Path {
        self.0.path()
    }

    /// Runs `cargo fw` there.
    fn fw(&self, toolchain: Option<&str>) -> Output {
        self.run(Command::new(program()).arg("build"), toolchain)
    }

    /// Runs a program there.
    fn run(&self, program: &mut Command, toolchain: Option<&str>) -> Output {
        let path = format!("{}:/usr/bin:/bin", self.folder().display());
        program.env("PATH", path).env_remove("RUSTC").env_remove("RUSTUP_TOOLCHAIN");
        program.env("CARGO", self.folder().join("cargo"));
        program.envs(toolchain.map(|name| ("RUSTUP_TOOLCHAIN", name))).output().unwrap()
    }

    /// The calls that were made, each by its first words.
    fn calls(&self) -> Vec<String> {
        let calls = fs::read_to_string(self.folder().join("calls")).unwrap();
        calls.lines().map(|line| line.split(' ').take(3).collect::<Vec<_>>().join(" ")).collect()
    }
}

/// The program that `cargo fw` runs.
fn program() -> PathBuf {
    xtask::programs().unwrap().join("xtask")
}

/// A compiler that tells where the library would be.
const RUSTC: (&str, &str) = ("rustc", "echo $PWD/library");
const CARGO: (&str, &str) = ("cargo", "");
const NAME: &str = "1.95.0-some-computer";

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn what_is_there_is_not_installed() {
    let computer = Computer::with(&[RUSTC, CARGO, ("rustup", "")]);
    fs::create_dir(computer.folder().join("library")).unwrap();
    let output = computer.fw(Some(NAME));
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(computer.calls(), ["rustc --print target-libdir", "cargo build --release"]);
}

#[test]
fn what_is_missing_is_installed_for_the_toolchain_in_use() {
    let install = format!("[ \"$*\" = \"target add {} --toolchain {NAME}\" ] && mkdir library", xtask::TARGET);
    let computer = Computer::with(&[RUSTC, CARGO, ("rustup", &install)]);
    let output = computer.fw(Some(NAME));
    assert!(output.status.success(), "{}", said(&output));
    let question = "rustc --print target-libdir";
    assert_eq!(computer.calls(), [question, "rustup target add", question, "cargo build --release"]);
}

#[test]
fn what_cannot_be_installed_is_told_in_one_sentence_with_the_command() {
    let fails = "echo 'info: downloading' >&2; echo 'error: no network' >&2; echo 'caused by: fate' >&2; exit 1";
    let computer = Computer::with(&[RUSTC, CARGO, ("rustup", fails)]);
    let output = computer.fw(Some(NAME));
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        said(&output),
        "the flash image needs Rust's library for thumbv7em-none-eabi, and rustup did not install it (no network); run, \
         with a network: rustup target add thumbv7em-none-eabi --toolchain 1.95.0-some-computer\n"
    );
    assert!(!computer.calls().iter().any(|call| call.starts_with("cargo")), "nothing is built");
}

#[test]
fn a_rust_that_is_not_rustups_is_told_so() {
    let computer = Computer::with(&[RUSTC, CARGO]);
    let output = computer.fw(None);
    assert_eq!(output.status.code(), Some(1));
    let said = said(&output);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("none of rustup's") && said.ends_with(": rustup target add thumbv7em-none-eabi\n"), "{said}");
}

#[test]
fn who_asks_again_is_only_reminded() {
    const ASKS: &str = "ASKS_TWICE";
    if std::env::var_os(ASKS).is_some() {
        println!("{:?}\n{:?}", xtask::prepare(), xtask::prepare());
        return;
    }
    let computer = Computer::with(&[RUSTC]);
    let mut this = Command::new(std::env::current_exe().unwrap());
    this.args(["--exact", "who_asks_again_is_only_reminded", "--nocapture"]).env(ASKS, "1");
    let output = computer.run(&mut this, None);
    let said = String::from_utf8_lossy(&output.stdout);
    let errors: Vec<_> = said.lines().filter(|line| line.contains("Err(")).collect();
    let [first, second] = errors[..] else { panic!("{said}") };
    assert!(first.contains(": rustup target add") && second.contains("as said"), "{said}");
    assert_eq!(computer.calls().len(), 1, "the compiler is not asked again");
}

/// Each image is known by its name and by the short one, and an unknown word is answered with the list.
#[test]
fn an_image_is_chosen_by_its_name() {
    let computer = Computer::with(&[RUSTC, ("cargo", "echo $*")]);
    fs::create_dir(computer.folder().join("library")).unwrap();
    fs::write(computer.folder().join("Cargo.toml"), MANIFEST).unwrap();
    let run = |words: &[&str]| {
        let mut fw = Command::new(program());
        fw.args(words).current_dir(computer.folder()).env_remove("CARGO_MANIFEST_DIR");
        computer.run(&mut fw, Some(NAME))
    };
    for (words, command, image, board, rest) in [
        (&[][..], "build", "tmcm1140", "tmcm1140", ""),
        (&["build"], "build", "tmcm1140", "tmcm1140", ""),
        (&["build", "--offline", "-v"], "build", "tmcm1140", "tmcm1140", " --offline -v"),
        (&["run", "1140-canopen"], "run", "tmcm1140-canopen", "tmcm1140", ""),
        (&["tmcm1140-canopen", "build"], "build", "tmcm1140-canopen", "tmcm1140", ""),
    ] {
        let output = run(words);
        assert!(output.status.success(), "{}", said(&output));
        let expected = format!("--package tmcm --bin {image} --features {board}{rest}\n");
        let place = format!("{command} --release --target {} ", xtask::TARGET);
        assert_eq!(String::from_utf8(output.stdout).unwrap(), place + &expected, "{words:?}");
    }
    assert_eq!(run(&["list"]).stdout, b"tmcm1140 tmcm1140\ntmcm1140-canopen tmcm1140\n");
    let unknown = run(&["build", "9999"]);
    assert_eq!(
        (unknown.status.code(), said(&unknown).as_str()),
        (Some(1), "'9999' is no image; there are: 1140, 1140-canopen\n")
    );
}

/// The `Cargo.toml` of a checkout with two images.
const MANIFEST: &str = "[workspace]\n
[package]\nname = \"tmcm\"\n
[[bin]]\nname = \"tmcm1140\"\nrequired-features = [\"tmcm1140\"]\n
[[bin]]\nname = \"tmcm1140-canopen\"\npath = \"src/bin/tmcm1140_canopen.rs\"\nrequired-features = [\"tmcm1140\"]\n
[profile.dev]\nopt-level = 2\n";

/// The program here was compiled in this checkout, and other ones are built: so it is where a checkout has been copied
/// with all that is built in it.
#[test]
fn the_checkout_is_built_for_which_cargo_runs_it_or_in_which_somebody_stands() {
    let computer = Computer::with(&[RUSTC, ("cargo", "echo $OLDPWD")]);
    let folder = computer.folder().canonicalize().unwrap();
    fs::create_dir(folder.join("library")).unwrap();
    for copy in ["a copy", "another"] {
        fs::create_dir_all(folder.join(copy).join("docs")).unwrap();
        fs::create_dir_all(folder.join(copy).join("xtask")).unwrap();
        fs::write(folder.join(copy).join("Cargo.toml"), MANIFEST).unwrap();
    }
    let built = |package: Option<&str>, current: &str| {
        let mut fw = Command::new(program());
        fw.arg("build").current_dir(folder.join(current)).env_remove("CARGO_MANIFEST_DIR");
        fw.envs(package.map(|name| ("CARGO_MANIFEST_DIR", folder.join(name))));
        computer.run(&mut fw, Some(NAME))
    };
    for (package, current, expected) in [
        (Some("a copy/xtask"), "another", "a copy"),
        (None, "a copy", "a copy"),
        (None, "another/docs", "another"),
        // Somebody else's package is none of this.
        (Some("library"), "another/docs", "another"),
    ] {
        let output = built(package, current);
        assert!(output.status.success(), "{}", said(&output));
        let place = String::from_utf8(output.stdout).unwrap();
        assert_eq!(Path::new(place.trim_end()), folder.join(expected), "{package:?}, {current}");
    }
    let output = built(None, "library");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said(&output).ends_with("library nor a folder above it is a checkout of the firmware: go to one\n"),
        "{output:?}"
    );
}
