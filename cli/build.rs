//! Tells the program which commit it is built from, for `tmcl --version`.
//!
//! Builds that leave the checkout have it: `cargo install`, the Python package. Those of `cargo sim`, `cargo tmcl` and
//! the tests have none, because they would be compiled anew after each commit; they ask git when they are asked. Where
//! there is no repository, the variable TMCL_COMMIT stands for the commit, or the file COMMIT beside this one, which
//! packages of the sources have.

use std::env;
use std::fs;
use std::process::Command;

/// The variable that names the commit, for this script and for the program.
const COMMIT: &str = "TMCL_COMMIT";
/// The file of packages of the sources, which scripts/wheel writes.
const FILE: &str = "COMMIT";

fn main() {
    println!("cargo::rerun-if-env-changed={COMMIT}");
    println!("cargo::rerun-if-changed=build.rs");
    let stays = env::var("PROFILE").is_ok_and(|profile| profile == "debug");
    let commit = match env::var(COMMIT).ok().or_else(of_package) {
        Some(commit) => commit,
        // As `version.rs` has it.
        None if stays => "a build of a checkout".into(),
        None => {
            // Each commit and each switch to another branch adds a line to this file.
            if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
                println!("cargo::rerun-if-changed={log}");
            }
            git(&["describe", "--always", "--dirty", "--abbrev=10", "--exclude=*"]).unwrap_or("no known commit".into())
        }
    };
    println!("cargo::rustc-env={COMMIT}={commit}");
}

/// The commit that a package of the sources is of; `None` in a repository.
fn of_package() -> Option<String> {
    let commit = fs::read_to_string(FILE).ok()?;
    println!("cargo::rerun-if-changed={FILE}");
    Some(commit.trim().into())
}

/// The output of git; `None` outside of a repository, and without git.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    let said = said.trim();
    (output.status.success() && !said.is_empty()).then(|| said.to_owned())
}
