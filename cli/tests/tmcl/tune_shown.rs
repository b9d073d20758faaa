//! The findings of `tmcl tune` in virtual worlds, line by line: announcement, tables, proposals and curves. The files
//! in `tune_shown` have them; `UPDATE_FROZEN=1` in the environment writes them anew, and what has changed is to be read
//! then.

use super::harness::run;

/// Each product, both measurements, an axis that is not the first, and tracks to both sides.
const RUNS: [(&str, &[&str]); 5] = [
    ("stallguard", &["stallguard", "sim", "--world", "examples/stall_homing.toml", "--speeds", "800,1600"]),
    (
        "coolstep",
        &["coolstep", "sim", "--world", "examples/stall_homing.toml", "--speeds", "800,1200", "--threshold", "2"],
    ),
    (
        "stallguard_3212",
        &["stallguard", "sim", "--product", "3212", "--axis", "2", "--speeds", "60000", "--room", "-400000"],
    ),
    (
        "coolstep_3212",
        &["coolstep", "sim", "--product", "3212", "--axis", "1", "--speeds", "40000", "--threshold", "8"],
    ),
    (
        "coolstep_6110",
        &["coolstep", "sim", "--product", "6110", "--axis", "5", "--speeds", "30 rpm,1500", "--steps", "400"],
    ),
];

#[test]
fn what_is_found_in_virtual_worlds() {
    let root = xtask::workspace().unwrap();
    let there = root.join("cli/tests/tmcl/tune_shown");
    let folder = tempfile::tempdir().unwrap();
    for (name, arguments) in RUNS {
        let drawn = folder.path().join("curves.svg");
        let world = root.join("examples/stall_homing.toml");
        let arguments = arguments.iter().map(|it| if it.ends_with(".toml") { world.to_str().unwrap() } else { it });
        let arguments: Vec<&str> =
            ["tune"].into_iter().chain(arguments).chain(["--plot", drawn.to_str().unwrap()]).collect();
        let output = run(&arguments);
        let told = [&output.stderr[..], &output.stdout[..]].concat();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&told));
        for (extension, found) in [("txt", told), ("svg", std::fs::read(&drawn).unwrap())] {
            let file = there.join(name).with_extension(extension);
            if std::env::var_os("UPDATE_FROZEN").is_some_and(|value| value == "1") {
                std::fs::write(&file, &found).unwrap();
            }
            let expected = std::fs::read_to_string(&file).unwrap().replace("\r\n", "\n");
            let found = String::from_utf8(found).unwrap();
            let different = found.lines().zip(expected.lines()).find(|(found, expected)| found != expected);
            assert!(found == expected, "{name}.{extension}: {different:?}, or one of them is longer\n{found}");
        }
    }
}
