//! The product of a module: who asks for it, how often, and what follows from the answer.

use super::fake::{Fake, State};
use super::harness::{complaint, run};

/// The value with which a module says that it is this product, with firmware 1.00.
fn version(product: u16) -> i32 {
    let [high, low] = product.to_be_bytes();
    i32::from_be_bytes([high, low, 1, 0])
}

/// Runs the program with a fake module in place of `LINK`. Gives how often the module was asked what it is, what was
/// said on standard output, and the notes about what it is on standard error.
fn with(state: State, arguments: &[&str]) -> (usize, String, String) {
    let fake = Fake::start(state);
    let arguments: Vec<&str> =
        arguments.iter().map(|word| if *word == "LINK" { fake.link.as_str() } else { *word }).collect();
    let output = run(&arguments);
    assert!(output.status.success(), "{arguments:?}: {}", complaint(&output));
    let identified = fake.state().identified();
    let notes = complaint(&output).lines().filter(|line| line.contains("this module")).collect::<Vec<_>>().join("\n");
    (identified, String::from_utf8(output.stdout).unwrap(), notes)
}

/// A folder with a program in it and its settings, and a command line for each command that talks to one module.
fn commands(folder: &tempfile::TempDir) -> Vec<Vec<String>> {
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("stage.tmc"), "MST 0\n").unwrap();
    std::fs::write(path("axis.tmcl"), "SAP 4, 0, 7\nSGP 68, 0, 0\n").unwrap();
    let (program, settings, saved) = (path("stage.tmc"), path("axis.tmcl"), path("saved.tmcl"));
    [
        &["send", "LINK", "GAP 1, 0", "SAP 4, 0, 7", "GGP 66, 0"][..],
        &["params", "LINK", "save", &saved],
        &["params", "LINK", "restore", &settings, "--store"],
        &["monitor", "LINK", "--count", "2", "--interval", "1"],
        &["load", "LINK", &program, "--verify", "--autostart"],
        &["debug", "LINK", &program],
    ]
    .map(|words| words.iter().map(|word| (*word).to_owned()).collect())
    .into()
}

#[test]
fn a_module_is_asked_once_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    for command in commands(&folder) {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let (identified, _, said) = with(State::default(), &words);
        assert_eq!((identified, said.as_str()), (1, ""), "{words:?}");
    }
}

#[test]
fn a_module_that_the_user_names_is_not_asked() {
    let folder = tempfile::tempdir().unwrap();
    for command in commands(&folder) {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let (identified, _, said) = with(State::default(), &[&words[..], &["--product", "tmcm-3110"]].concat());
        assert_eq!((identified, said.as_str()), (0, ""), "{words:?}");
    }
    let said = |product| with(State::default(), &["send", "LINK", "GAP 209, 0", "GAP 201, 0", "--product", product]).1;
    let position = "GAP 209, 0: 0 microsteps (encoder position), status 100 ok";
    assert_eq!(said("1140"), format!("{position}\nGAP 201, 0: 0, status 100 ok\n"));
    assert_eq!(said("3110"), format!("{position}\nGAP 201, 0: 0 (encoder mode), status 100 ok\n"));
    let position = "GAP 209, 0: 0 encoder steps (encoder position), status 100 ok";
    assert_eq!(said("3212"), format!("{position}\nGAP 201, 0: 0 (encoder mode), status 100 ok\n"));
    assert_eq!(said("6110"), "GAP 209, 0: 0, status 100 ok\nGAP 201, 0: 0, status 100 ok\n");
}

/// Commands that need no name are answered with as many telegrams as there are commands.
#[test]
fn a_command_that_needs_no_name_is_sent_alone() {
    let lines = ["6, 1, 0, 0", "9, 66, 0, 3", "MVP ABS, 0, 5", "MST 0", "GIO 8, 1", "GGP 9, 2", "135"];
    let fake = Fake::start(State::default());
    let output = run(&[&["send", &fake.link], &lines[..]].concat());
    assert_eq!(fake.state().asked.len(), lines.len(), "{}", complaint(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.starts_with("GAP 1, 0: 0, status 100 ok\nSGP 66, 0, 3: 3, status 100 ok\n"), "{said}");
    // What is refused has no name either. Where a product may not have the motor, the module is asked what it is, to
    // explain it.
    let fake = Fake::start(State::default());
    let output = run(&["send", &fake.link, "GAP 1, 5"]);
    assert_eq!((output.status.code(), fake.state().asked.len()), (Some(1), 2), "{}", complaint(&output));
}

#[test]
fn a_product_that_is_not_known_is_told_once_and_shown_in_numbers() {
    let unknown = || State { version: version(9999), ..State::default() };
    let note = "tmcl: this module is a TMCM-9999, which is not known here: its values are shown as numbers; --product 1140 \
                takes it for a TMCM-1140";
    let (identified, shown, said) = with(unknown(), &["send", "LINK", "GAP 4, 0", "SAP 4, 0, 7"]);
    assert_eq!((identified, said.as_str()), (1, note));
    assert_eq!(shown, "GAP 4, 0: 0, status 100 ok\nSAP 4, 0, 7: 7, status 100 ok\n");

    let folder = tempfile::tempdir().unwrap();
    for command in commands(&folder) {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let (identified, _, said) = with(unknown(), &words);
        assert_eq!((identified, said.as_str()), (1, note), "{words:?}");
    }
    let saved = std::fs::read_to_string(folder.path().join("saved.tmcl")).unwrap();
    assert!(saved.starts_with("// Settings of a module 9999V100, saved by tmcl params\n"), "{saved}");
    assert!(saved.contains("\nSAP 4, 0, 0\n"), "{saved}");

    // There are no names for its programs either.
    let program = folder.path().join("names.tmc");
    std::fs::write(&program, "#include TMCLParam.tmc\nSAP APMaxPositioningSpeed, 0, 7\n").unwrap();
    let fake = Fake::start(unknown());
    let output = run(&["load", &fake.link, program.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("--product NAME takes this one for one of them"), "{}", complaint(&output));
    let output = run(&["load", &fake.link, program.to_str().unwrap(), "--product", "1140"]);
    assert!(output.status.success(), "{}", complaint(&output));
}

#[test]
fn a_module_that_does_not_tell_what_it_is_is_taken_for_a_1140() {
    let mute = State { mute: true, ..State::default() };
    let (identified, shown, said) = with(mute, &["send", "LINK", "--timeout", "200", "GAP 4, 0", "GAP 5, 0"]);
    assert_eq!(identified, 1);
    assert!(shown.starts_with("GAP 4, 0: 0 int (maximum positioning speed), status 100 ok\n"), "{shown}");
    assert!(said.contains("does not tell what it is (command 136): it is taken for a TMCM-1140"), "{said}");
}

#[test]
fn names_that_are_not_known_are_answered_with_those_there_are() {
    let expected = "'6111' is none of 1140, 1110, 3110, 3212, 6110; did you mean '6110'?";
    for command in [
        &["send", "sim", "GAP 1, 0"][..],
        &["monitor", "sim"],
        &["asm", "a.tmc"],
        &["disasm", "a.bin"],
        &["run", "a.tmc"],
    ] {
        let output = run(&[command, &["--product", "6111"]].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(complaint(&output).contains(expected), "{command:?}: {}", complaint(&output));
    }
}
