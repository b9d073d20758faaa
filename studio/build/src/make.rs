//! The folder with the page.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::compiler::{self, TARGET};
use crate::files::Files;
use crate::policy;

/// The package that is compiled for browsers.
const PACKAGE: &str = "tmcl-studio";
/// The file that becomes of it.
const PROGRAM: &str = "tmcl_studio.wasm";
/// The profile of Cargo with which that is done.
const PROFILE: &str = "page";
/// The folder in the build directory. The profile has another name, because Cargo has a folder of its own for each.
const FOLDER: &str = "studio";
/// The page that stands for all of them.
const INDEX: &str = "index.html";

/// Makes the page anew, and tells where it is. The error is one sentence; what the compiler has to say it prints itself.
pub fn page() -> Result<PathBuf, String> {
    let workspace = fw::workspace()?;
    let build = build_directory(&workspace)?;
    fw::library(TARGET, "the page of the studio")?;
    let files = gather(&workspace.join("studio/page"), program(&workspace, &build)?)?;
    // A page that is only half there is never seen at its place.
    let (place, beside) = (build.join(FOLDER), build.join(format!("{FOLDER}.new")));
    remove(&beside)?;
    files.write(&beside)?;
    remove(&place)?;
    fs::rename(&beside, &place).map_err(|error| format!("{} cannot be made: {error}", place.display()))?;
    Ok(place)
}

/// The files of the page: those of a folder, its index with the policy in its place, and the program.
fn gather(folder: &Path, program: Vec<u8>) -> Result<Files, String> {
    let mut files = Files::read(folder)?;
    let index = folder.join(INDEX);
    let index = index.display();
    let page = files.get_mut(INDEX).ok_or_else(|| format!("there is no {index}, with which the page begins"))?;
    let text = str::from_utf8(&page.bytes).map_err(|error| format!("{index} is not text in UTF-8: {error}"))?;
    page.bytes = policy::place(text).map_err(|why| format!("{index}: {why}"))?.into_bytes();
    files.add(PROGRAM, program).map_err(|why| format!("{}: {why}", folder.join(PROGRAM).display()))?;
    Ok(files)
}

/// Compiles the program for browsers, and reads it.
fn program(workspace: &Path, build: &Path) -> Result<Vec<u8>, String> {
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(workspace).args(["build", "--profile", PROFILE, "--target", TARGET, "--package", PACKAGE]);
    cargo.arg("--target-dir").arg(build).env("CARGO_ENCODED_RUSTFLAGS", remaps(workspace, build)?);
    let status = cargo.status().map_err(|error| format!("cargo cannot be run: {error}"))?;
    if !status.success() {
        return Err(format!("{PACKAGE}, the program of the page, was not built; what is wrong with it stands above"));
    }
    let program = build.join(TARGET).join(PROFILE).join(PROGRAM);
    fs::read(&program).map_err(|error| format!("{} cannot be read: {error}", program.display()))
}

/// The flags by which messages of panics, which tell files and lines, do not tell folders of this computer. Of several
/// that fit the last one counts. Between them stands a character that no path has.
fn remaps(workspace: &Path, build: &Path) -> Result<OsString, String> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| Some(env::home_dir()?.join(".cargo")));
    let home = home.ok_or("it is unknown where Cargo keeps its packages: set CARGO_HOME to that folder")?;
    let sysroot = compiler::print(workspace, "sysroot")?;
    let remaps = [(workspace, "checkout"), (build, "target"), (&home, "cargo"), (Path::new(&sysroot), "rust")];
    let mut flags = OsString::new();
    for (from, to) in remaps {
        if !flags.is_empty() {
            flags.push("\u{1f}");
        }
        flags.push("--remap-path-prefix=");
        flags.push(from);
        flags.push(format!("={to}"));
    }
    Ok(flags)
}

/// The folder in which Cargo builds.
fn build_directory(workspace: &Path) -> Result<PathBuf, String> {
    let chosen = env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| workspace.join("target").into());
    std::path::absolute(chosen).map_err(|error| format!("CARGO_TARGET_DIR names no folder: {error}"))
}

/// Removes a folder if it is there.
fn remove(folder: &Path) -> Result<(), String> {
    match fs::remove_dir_all(folder) {
        Err(error) if folder.exists() => Err(format!("{} cannot be removed: {error}", folder.display())),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_its_policy_and_its_program() {
        let folder = tempfile::tempdir().unwrap();
        let refused = || gather(folder.path(), vec![]).unwrap_err();
        assert!(refused().starts_with("there is no /"), "{}", refused());
        fs::write(folder.path().join(INDEX), "<html>").unwrap();
        assert!(refused().contains("index.html: {policy}"), "{}", refused());
        fs::write(folder.path().join(INDEX), "{policy}").unwrap();
        let files = gather(folder.path(), b"\0asm".to_vec()).unwrap();
        assert_eq!(files.get(INDEX).unwrap().bytes, policy::PAGE.as_bytes());
        assert_eq!(files.get(PROGRAM).unwrap().bytes, b"\0asm");
        fs::write(folder.path().join(PROGRAM), "").unwrap();
        assert!(refused().contains("tmcl_studio.wasm: the builder makes"), "{}", refused());
    }
}
