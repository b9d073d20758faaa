//! A project of somebody else uses this library by its path alone, without this workspace.

use std::fs;
use std::path::Path;
use std::process::Command;

/// The manifest of such a project.
fn manifest(library: &Path) -> String {
    let library = library.display();
    format!(
        "[package]\nname = \"outside\"\nedition = \"2024\"\n\n[workspace]\n\n\
         [dependencies]\ntmcm-sim = {{ path = {:?} }}\n",
        library.to_string()
    )
}

#[test]
fn the_example_compiles_outside_of_the_workspace() {
    let workspace = xtask::workspace().unwrap();
    let library = workspace.join("sim");
    // Kept from run to run, so that only the first one builds everything.
    let project = workspace.join("target/outside");
    fs::create_dir_all(project.join("src")).unwrap();
    fs::write(project.join("Cargo.toml"), manifest(&library)).unwrap();
    // The versions are those of the workspace, which are there already: nothing has to be fetched.
    fs::copy(workspace.join("Cargo.lock"), project.join("Cargo.lock")).unwrap();
    fs::copy(library.join("examples/ten_lines.rs"), project.join("src/main.rs")).unwrap();
    let output = Command::new(env!("CARGO"))
        .args(["check", "--offline", "--quiet"])
        .current_dir(&project)
        .env("CARGO_TARGET_DIR", project.join("target"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
