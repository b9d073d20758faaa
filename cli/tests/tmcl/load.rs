//! `tmcl load` with a module that shows faults.

use super::fake::{Fake, State, program};
use super::harness::{complaint, run};

const PROGRAM: [&str; 3] = ["MVP ABS, 0, 90000", "WAIT POS, 0, 0", "STOP"];

/// Loads the program and gives exit code, standard output and standard error.
fn load(fake: &Fake, options: &[&str]) -> (Option<i32>, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.bin");
    std::fs::write(&file, program(&PROGRAM)).unwrap();
    let output = run(&[&["load", &fake.link, file.to_str().unwrap()], options].concat());
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned(), complaint(&output))
}

/// The contents of the memory from an address on.
fn memory(fake: &Fake, at: usize) -> Vec<String> {
    fake.state().memory[at..at + PROGRAM.len()].iter().map(ToString::to_string).collect()
}

#[test]
fn a_program_is_loaded_and_started() {
    let fake = Fake::start(State::default());
    let (code, said, complaint) = load(&fake, &["--at", "50", "--verify", "--run"]);
    assert_eq!(code, Some(0), "{complaint}");
    let expected = "loaded to addresses 50 to 52\nthe module has them as they are in the file\n\
                    running from address 50\n";
    assert_eq!(said, expected);
    assert_eq!(memory(&fake, 50), PROGRAM);
    assert_eq!(fake.state().mode, 1);
}

/// After power-up a module begins at address 0, whatever there is.
#[test]
fn what_does_not_begin_at_0_does_not_start_by_itself() {
    let fake = Fake::start(State::default());
    let (code, said, complaint) = load(&fake, &["--at", "50", "--autostart"]);
    assert_eq!((code, said.as_str()), (Some(2), ""));
    assert!(complaint.starts_with("tmcl: --autostart cannot be combined with --at 50: "), "{complaint}");
    assert!(fake.state().asked.is_empty(), "nothing has been done");
    let (code, said, complaint) = load(&fake, &["--at", "0", "--autostart"]);
    assert_eq!(code, Some(0), "{complaint}");
    assert!(said.ends_with("the program starts by itself after power-up\n"), "{said}");
    assert_eq!(fake.state().autostart, 1);
}

#[test]
fn what_is_not_as_it_was_sent_is_told() {
    let fake = Fake::start(State { broken: Some(1), ..State::default() });
    let (code, _, complaint) = load(&fake, &["--verify", "--run"]);
    assert_eq!(code, Some(1));
    let expected = "1 of 3 commands differ; address 1: expected WAIT POS, 0, 0, found 0, 0, 0, 0";
    assert!(complaint.contains(expected), "{complaint}");
    assert_ne!(fake.state().mode, 1, "it must not run");
}

#[test]
fn protection_is_told() {
    let fake = Fake::start(State { protection: 3, ..State::default() });
    let (code, said, complaint) = load(&fake, &["--run"]);
    assert_eq!((code, said.as_str()), (Some(1), ""));
    assert!(complaint.contains("program memory is protected (global parameter 81)"), "{complaint}");
}

#[test]
fn a_download_that_fails_leaves_nothing_to_run() {
    let fake = Fake::start(State::default());
    let (code, _, complaint) = load(&fake, &["--at", "62", "--run"]);
    assert_eq!(code, Some(1));
    assert!(complaint.contains("address 64: STOP: status 4"), "{complaint}");
    assert!(complaint.contains("does not fit"), "{complaint}");
    assert_eq!(fake.state().memory[62].to_string(), "STOP");

    let fake = Fake::start(State { restarts: Some(1), ..State::default() });
    let (code, _, complaint) = load(&fake, &["--run"]);
    assert_eq!(code, Some(1));
    assert!(complaint.contains("address 1: WAIT POS, 0, 0: the module has not stored"), "{complaint}");
    assert_eq!(fake.state().memory[0].to_string(), "STOP");
}

/// A cable that is pulled, a supply that fails.
#[test]
fn a_module_that_falls_silent_is_told_and_what_to_do_then() {
    let fake = Fake::start(State { dies: Some(1), ..State::default() });
    let (code, said, complaint) = load(&fake, &["--run", "--timeout", "100"]);
    assert_eq!((code, said.as_str()), (Some(1), ""));
    let told = complaint.lines().last().unwrap();
    assert!(told.starts_with("tmcl: address 1: WAIT POS, 0, 0: no reply; check power"), "{complaint}");
    assert!(told.ends_with("; what is in the module now is incomplete, so load the program again"), "{complaint}");
}

#[test]
fn addresses_that_are_none_are_told() {
    let at = |text: &str| {
        let output = run(&["load", "sim", "stage.tmc", "--at", text]);
        assert_eq!(output.status.code(), Some(2), "{text}");
        complaint(&output)
    };
    for text in ["Loop", "70000", "$", ""] {
        let told =
            format!("error: invalid value '{text}' for '--at <ADDRESS>': an address is a number from 0 to 65535");
        assert!(text.is_empty() || at(text).starts_with(&told), "{}", at(text));
    }
}

#[test]
fn files_that_are_no_program_are_told() {
    let fake = Fake::start(State::default());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.bin");
    let path = file.to_str().unwrap();
    let output = run(&["load", &fake.link, path]);
    assert!(complaint(&output).contains("cannot read"), "{}", complaint(&output));
    // Neither is what a pipe or an editor has not written yet: the module keeps what it has.
    let empty = folder.path().join("empty.tmc");
    std::fs::write(&empty, "// soon\n").unwrap();
    let output = run(&["load", &fake.link, empty.to_str().unwrap()]);
    assert!(complaint(&output).ends_with("empty.tmc: the program has no commands\n"), "{}", complaint(&output));
    let output = run(&["load", &fake.link, "-"]);
    assert_eq!(complaint(&output), "tmcl: standard input: the program has no commands\n");
    assert!(fake.state().asked.iter().all(|command| command.opcode == 136), "it has been asked what it is, no more");
    std::fs::write(&file, "STOP").unwrap();
    let output = run(&["load", &fake.link, path]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("program.bin is text"), "{}", complaint(&output));
}
