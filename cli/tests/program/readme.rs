//! README and other pages do not lie: see [`super::page`].

use std::fs;

use super::page::Page;

const README: Page = Page {
    name: "README.md",
    not_run: &[
        ("cargo fw", "builds the flash image, as this test does by itself"),
        ("RANDOM_INPUTS=", "runs tests, for half a minute"),
    ],
    awaited: &[
        "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 8, 0\" \"SAP 4, 0, 3000\"",
        "tmcl send tcp:127.0.0.1:4140 \"GAP 3, 0\" \"GAP 206, 0\"",
        // Reading parameter 207, which follows, clears it: so it is read once.
        "tmcl send tcp:127.0.0.1:4140 \"GAP 3, 0\"",
        "tmcl send tcp:127.0.0.1:4140 \"GGP 10, 2\" \"GGP 128, 0\"",
        "tmcl send tcp:127.0.0.1:4140 \"GGP 128, 0\"",
        "tmcl send tcp:127.0.0.1:4140 \"RFS STATUS, 0\" \"RFS STATUS, 1\" \"RFS STATUS, 2\"",
        "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 1, 1\" \"GAP 1, 2\"",
        "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 8, 0\"",
    ],
    varies: &[
        (
            "{\"ok\":true,\"time_us\":#,\"power\":true,\"position\":#,\"velocity\":0,\"rotor\":#, ...",
            "when the load came",
        ),
        ("tmcl sim: # info: power on", "how long the image takes"),
        ("tmcl sim: # info: module runs at address 1", "how long the image takes"),
        ("tmcl sim: # info: RS485 at 9600 bit/s", "how long the image takes"),
        ("position # speed # int load # switches - driver - errors -", "where the program is"),
    ],
    mended: Some(["stage.tmc", "JA Lop", "JA Loop", "unknown name 'Lop'"]),
};

#[test]
fn what_readme_shows_happens() {
    let folder = README.check();
    let root = fw::workspace().unwrap();
    let [is, was] = [folder.path().join("stall_homing.svg"), root.join("docs/stall_homing.svg")].map(fs::read);
    assert!(is.unwrap() == was.unwrap(), "docs/stall_homing.svg is not what README's command draws");
}

const TOOLS: Page = Page {
    name: "docs/tools.md",
    not_run: &[],
    awaited: &[
        "tmcl send tcp:127.0.0.1:4140 --value \"GAP APActualSpeed, 0\"",
        "tmcl send tcp:127.0.0.1:4140 \"RFS STATUS, 0\"",
    ],
    varies: &[("position # speed 1678 int load # switches - driver - errors -", "how long the motor has turned")],
    mended: Some(["count.tmc", "COMP Turnz", "COMP Turns", "unknown name 'Turnz'"]),
};

#[test]
fn what_the_page_of_the_tools_shows_happens() {
    TOOLS.check();
}

#[test]
fn what_the_page_of_the_control_port_shows_happens() {
    Page::plain("docs/control.md").check();
}

#[test]
fn what_the_page_of_ci_shows_happens() {
    Page::plain("docs/ci.md").check();
}

/// `cargo sim` and `cargo tmcl` are what is run for them here.
#[test]
fn its_short_commands_are_those_of_the_program() {
    let folder = fw::workspace().unwrap().join(".cargo");
    let aliases = fs::read_to_string(folder.join("config.toml")).unwrap();
    for (name, end) in [("sim", "-- sim\""), ("tmcl", "--\"")] {
        let alias = aliases.lines().find(|line| line.starts_with(&format!("{name} = \"run "))).unwrap();
        assert!(alias.contains(" -p tmcl-cli --bin tmcl ") && alias.ends_with(end), "{alias}");
    }
}
