//! Tells the program which commit it is built from, for `tmcl --version`.
//!
//! Builds with optimisation have it, which are those that users run: `cargo sim`, `cargo tmcl`, `cargo install`. Builds for
//! tests have none, because they would be compiled anew after each commit. The variable TMCL_COMMIT stands for the commit
//! where there is no repository, as in a package of the sources.

use std::env;
use std::process::Command;

/// The variable that names the commit, for this script and for the program.
const COMMIT: &str = "TMCL_COMMIT";

fn main() {
    println!("cargo::rerun-if-env-changed={COMMIT}");
    println!("cargo::rerun-if-changed=build.rs");
    let is_for_tests = env::var("PROFILE").is_ok_and(|profile| profile == "debug");
    let commit = match env::var(COMMIT) {
        Ok(commit) => commit,
        Err(_) if is_for_tests => "a build for tests".into(),
        Err(_) => {
            // Each commit and each switch to another branch adds a line to this file.
            if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
                println!("cargo::rerun-if-changed={log}");
            }
            git(&["describe", "--always", "--dirty", "--abbrev=10", "--exclude=*"]).unwrap_or("no known commit".into())
        }
    };
    println!("cargo::rustc-env={COMMIT}={commit}");
}

/// What git says; `None` outside of a repository, and without git.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    let said = said.trim();
    (output.status.success() && !said.is_empty()).then(|| said.to_owned())
}
