//! The library in a crate of one's own: the example for a module at a port, copied to where no checkout is, drives a
//! virtual module over TCP. `docs/library.md` tells of it.

use std::fs;

use super::harness::{Sim, command, complaint, run};

/// The manifest of somebody who works outside of the checkout, whose place is the root.
fn manifest(root: &std::path::Path) -> String {
    let path = |folder: &str| format!("{{ path = {:?} }}", root.join(folder));
    let (link, tools, core) = (path("link"), path("tools"), path(""));
    // Built as fast as can be: what it does takes no time.
    format!(
        "[package]\nname = \"my-stage\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[workspace]\n\n[dependencies]\n\
         tmcl-link = {link}\ntmcl-tools = {tools}\ntmcm = {core}\n\n[profile.dev]\ndebug = false\nincremental = false\n"
    )
}

/// The program moves the axis, stores the parameter, and puts a TMCL program into the module: seen by other means.
#[test]
fn fifteen_lines_elsewhere_drive_a_module() {
    let root = xtask::workspace().unwrap();
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("src")).unwrap();
    fs::write(folder.path().join("Cargo.toml"), manifest(&root)).unwrap();
    fs::copy(root.join("link/examples/real_module.rs"), folder.path().join("src/main.rs")).unwrap();
    // The versions with which the checkout is tested.
    fs::copy(root.join("Cargo.lock"), folder.path().join("Cargo.lock")).unwrap();
    let built = command(env!("CARGO"))
        .args(["build", "--offline", "--quiet"])
        .current_dir(folder.path())
        .env("CARGO_TARGET_DIR", root.join("target/elsewhere"))
        .output()
        .unwrap();
    let said = complaint(&built);
    assert!(built.status.success() && !said.contains("warning"), "{said}");

    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let program = root.join("target/elsewhere/debug/my-stage");
    let done = command(program.to_str().unwrap()).arg(sim.told("tcp")).output().unwrap();
    assert!(done.status.success(), "{}", complaint(&done));
    assert_eq!(String::from_utf8_lossy(&done.stdout), "at 51200\n");
    let link = format!("tcp:{}", sim.told("tcp"));
    let shown = |arguments: &[&str]| {
        let output = run(arguments);
        assert!(output.status.success(), "{}", complaint(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let dump = shown(&["dump", &link]);
    assert!(dump.contains("ROR 0, 500") && dump.contains("MST 0"), "{dump}");
    // What was stored is there after a restart, and what was not is not.
    sim.control(&["restart"]);
    assert!(shown(&["send", &link, "GAP 4, 0"]).contains("1500"));
    assert!(shown(&["send", &link, "GAP 1, 0"]).contains(": 0"));
}
