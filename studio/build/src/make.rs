//! The folder with the page.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::compiler::{self, TARGET};
use crate::files::Files;
use crate::{maker, policy};

/// The packages that are compiled for browsers, each with the file that becomes of it. The first is the program of the
/// page. The second is the same with what runs flash images, and is loaded when it is needed.
const PROGRAMS: [(&str, &str); 2] =
    [("tmcl-studio", "tmcl_studio.wasm"), ("tmcl-studio-image", "tmcl_studio_image.wasm")];
/// The profile of Cargo with which that is done.
const PROFILE: &str = "page";
/// The folder in the build directory. The profile has another name, because Cargo has a folder of its own for each.
const FOLDER: &str = "studio";
/// The page that stands for all of them.
const INDEX: &str = "index.html";

/// Makes the page anew, and tells where it is. The error is one sentence; what the compiler has to say it prints
/// itself.
pub fn page() -> Result<PathBuf, String> {
    let workspace = xtask::workspace()?;
    let build = build_directory(&workspace)?;
    xtask::library(TARGET, "the page of the studio")?;
    let files = gather(&workspace.join("studio/page"), programs(&workspace, &build)?)?;
    // A page that is only half there is never seen at its place.
    let (place, beside) = (build.join(FOLDER), build.join(format!("{FOLDER}.new")));
    remove(&beside)?;
    files.write(&beside)?;
    remove(&place)?;
    fs::rename(&beside, &place).map_err(|error| format!("{} cannot be made: {error}", place.display()))?;
    Ok(place)
}

/// The files of the page: those of a folder, its index with the policy in its place, and the programs.
fn gather(folder: &Path, programs: Vec<(&str, Vec<u8>)>) -> Result<Files, String> {
    let mut files = Files::read(folder)?;
    let index = folder.join(INDEX);
    let index = index.display();
    let page = files.get_mut(INDEX).ok_or_else(|| format!("there is no {index}, with which the page begins"))?;
    let text = str::from_utf8(&page.bytes).map_err(|error| format!("{index} is not text in UTF-8: {error}"))?;
    page.bytes = policy::place(text).map_err(|why| format!("{index}: {why}"))?.into_bytes();
    for (name, program) in programs {
        files.add(name, program).map_err(|why| format!("{}: {why}", folder.join(name).display()))?;
    }
    maker::place(&mut files, INDEX)?;
    Ok(files)
}

/// Compiles the programs for browsers, and reads them.
fn programs(workspace: &Path, build: &Path) -> Result<Vec<(&'static str, Vec<u8>)>, String> {
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(workspace).args(["build", "--profile", PROFILE, "--target", TARGET]);
    cargo.args(PROGRAMS.iter().flat_map(|(package, _)| ["--package", package]));
    cargo.arg("--target-dir").arg(build).env("CARGO_ENCODED_RUSTFLAGS", remaps(workspace, build)?);
    let status = cargo.status().map_err(|error| format!("cargo cannot be run: {error}"))?;
    if !status.success() {
        let packages = PROGRAMS.map(|(package, _)| package).join(" and ");
        return Err(format!(
            "{packages}, the programs of the page, were not built; what is wrong with them stands above"
        ));
    }
    let read = |name| {
        let program = build.join(TARGET).join(PROFILE).join(name);
        let bytes = fs::read(&program).map_err(|error| format!("{} cannot be read: {error}", program.display()))?;
        Ok((name, bytes))
    };
    PROGRAMS.iter().map(|(_, name)| read(*name)).collect()
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
    fn a_page_has_its_policy_and_its_programs() {
        let folder = tempfile::tempdir().unwrap();
        let programs = || PROGRAMS.map(|(_, name)| (name, name.into())).to_vec();
        let refused = || gather(folder.path(), programs()).unwrap_err();
        assert!(refused().starts_with("there is no /"), "{}", refused());
        fs::write(folder.path().join(INDEX), "<html>").unwrap();
        assert!(refused().contains("index.html: {policy}"), "{}", refused());
        fs::write(folder.path().join(INDEX), "{policy}\n{made}").unwrap();
        let files = gather(folder.path(), programs()).unwrap();
        let page = str::from_utf8(&files.get(INDEX).unwrap().bytes).unwrap();
        assert!(page.starts_with(policy::PAGE) && !page.contains('{'), "{page}");
        for (_, name) in PROGRAMS {
            assert_eq!(files.get(name).unwrap().bytes, name.as_bytes());
            fs::write(folder.path().join(name), "").unwrap();
            assert!(refused().contains(&format!("{name}: the builder makes")), "{}", refused());
            fs::remove_file(folder.path().join(name)).unwrap();
        }
    }
}
