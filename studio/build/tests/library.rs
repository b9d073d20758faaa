//! Rust's library for browsers: installed where it is missing, before anything is compiled.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// Puts a program into a folder that does what a script says, noting that it was called.
fn install(folder: &Path, name: &str, script: &str) {
    let script = format!("#!/bin/sh\ncd \"$(dirname \"$0\")\"\necho {name} \"$@\" >>calls\n{script}\n");
    // Written by another process: a file that this one writes while a test beside it starts a program cannot be run.
    let write = ["-c", "printf %s \"$1\" >$0 && chmod +x $0", name, &script];
    assert!(Command::new("sh").args(write).current_dir(folder).status().unwrap().success());
}

/// A page that is made here, of programs without anything in them, is opened with an example behind its address.
#[test]
fn an_example_is_opened_in_the_browser() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    fs::create_dir(place.join("library")).unwrap();
    install(place, "rustc", "echo $PWD/library");
    let programs = "target/wasm32-unknown-unknown/page";
    install(
        place,
        "cargo",
        &format!("mkdir -p {programs} && cd {programs} && touch tmcl_studio.wasm tmcl_studio_image.wasm"),
    );
    install(place, "browser", "echo \"$1\" >opened.new && mv opened.new opened");
    let mut program = Command::new(xtask::programs().unwrap().join("studio-build"));
    program.args(["--open", "examples/jog"]).env("PATH", format!("{}:/usr/bin:/bin", place.display()));
    program.env_remove("RUSTC").env("CARGO", place.join("cargo")).env("CARGO_TARGET_DIR", place.join("target"));
    program.env("BROWSER", place.join("browser")).stdout(Stdio::piped());
    let mut running = program.spawn().unwrap();
    let mut lines = BufReader::new(running.stdout.take().unwrap()).lines();
    let address = lines.next().unwrap().unwrap();
    assert_eq!(lines.next().unwrap().unwrap(), "ready");
    assert!(address.starts_with("http://127.0.0.1:") && address.contains("/#session="), "{address}");
    let opened = place.join("opened");
    while !opened.exists() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    running.kill().unwrap();
    running.wait().unwrap();
    assert_eq!(fs::read_to_string(opened).unwrap().trim(), address);
}

/// The compiler has no library until rustup has added it; then cargo is called, which fails here.
#[test]
fn what_is_missing_is_added_and_then_the_page_is_compiled() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    install(place, "rustc", "echo $PWD/library");
    install(place, "rustup", "[ \"$*\" = \"target add wasm32-unknown-unknown --toolchain here\" ] && mkdir library");
    install(place, "cargo", "exit 1");
    let mut program = Command::new(xtask::programs().unwrap().join("studio-build"));
    program.arg("--build").env("PATH", format!("{}:/usr/bin:/bin", place.display()));
    program.env_remove("RUSTC").env("CARGO", place.join("cargo")).env("CARGO_TARGET_DIR", place.join("target"));
    let output = program.env("RUSTUP_TOOLCHAIN", "here").output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        said,
        "tmcl-studio and tmcl-studio-image, the programs of the page, were not built; what is wrong with them stands above\n"
    );
    let calls = fs::read_to_string(place.join("calls")).unwrap();
    let called: Vec<_> = calls.lines().map(|line| line.split(' ').take(2).collect::<Vec<_>>().join(" ")).collect();
    assert_eq!(called, ["rustc --print", "rustup target", "rustc --print", "rustc --print", "cargo build"], "{calls}");
    assert!(calls.contains(
        "cargo build --profile page --target wasm32-unknown-unknown --package tmcl-studio --package tmcl-studio-image"
    ));
}
