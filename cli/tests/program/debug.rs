//! `tmcl debug`, told what to do through a pipe and on a terminal.

use rustix::process::Signal;

use super::fake::{Fake, State, program};
use super::harness::{complaint, run, type_into};
use super::pty::Terminal;

const PROGRAM: [&str; 5] = ["CALC LOAD, 5", "CALC ADD, 1", "WAIT TICKS, 0, 100", "JA 1", "STOP"];

/// Debugs a program and gives the lines that are told.
fn debug(fake: &Fake, lines: &[&str], options: &[&str], commands: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.bin");
    std::fs::write(&file, program(lines)).unwrap();
    let output = type_into(&[&["debug", &fake.link, file.to_str().unwrap()], options].concat(), commands);
    assert!(output.status.success(), "{}", complaint(&output));
    String::from_utf8(output.stdout).unwrap().lines().map(String::from).collect()
}

#[test]
fn steps_and_breakpoints() {
    let fake = Fake::start(State::default());
    let told = debug(
        &fake,
        &PROGRAM,
        &[],
        "s\nregisters\nbreak 3\ncontinue\ncontinue\nregisters\ndelete 3\nstep 2\nlist 3\nreset\n",
    );
    let expected = [
        ">     0  CALC LOAD, 5",
        ">     1  CALC ADD, 1",
        "step by step, program counter 1, accumulator 5, X 0",
        " *    3  JA 1",
        "breakpoint",
        ">*    3  JA 1",
        "breakpoint",
        ">*    3  JA 1",
        "step by step, program counter 3, accumulator 7, X 0",
        "no breakpoints",
        ">     2  WAIT TICKS, 0, 100",
        "      3  JA 1",
        "      4  STOP",
        ">     0  CALC LOAD, 5",
        "the program is stopped at address 0",
    ];
    assert_eq!(told, expected);
}

#[test]
fn the_end_of_the_program_is_noticed() {
    let fake = Fake::start(State::default());
    let told = debug(&fake, &["CALC LOAD, 5", "STOP"], &[], "break 1\nstep\nstep\nlist\nlist 1\nstep\nlist\n");
    let expected = [
        " *    1  STOP",
        ">*    1  STOP",
        "the program has ended; the next step begins it again",
        // The module has its program counter at 0 again; where it has ended is remembered here.
        ">*    1  STOP",
        "      0  CALC LOAD, 5",
        ">*    1  STOP",
        ">*    1  STOP",
        ">*    1  STOP",
        "      0  CALC LOAD, 5",
        ">*    1  STOP",
        "the program is stopped at address 1",
    ];
    assert_eq!(told[1..], expected);
}

#[test]
fn a_program_that_runs_freely_is_left_so_and_told() {
    let fake = Fake::start(State::default());
    let told = debug(&fake, &PROGRAM, &[], "continue\nstep\nregisters\nquit\nnever read\n");
    assert_eq!(told[1..3], ["running; stop halts it", "the program runs; stop halts it"]);
    assert_eq!(told[3], "running, program counter 0, accumulator 0, X 0");
    assert_eq!(told[4], "the program goes on running in the module; command 128 stops it");
    assert_eq!(fake.state().mode, 1);
    let told = debug(&fake, &PROGRAM, &["--attach"], "stop\n");
    assert_eq!(told, ["running; stop halts it", ">     0  CALC LOAD, 5", "the program is stopped at address 0"]);
}

#[test]
fn direct_commands_and_mistakes() {
    let fake = Fake::start(State::default());
    let told =
        debug(&fake, &PROGRAM, &[], "send \"GGP 81, 0\"\nsend GOTO\njump\nbreak Loop\nbreak 9\ndelete 1\nhelp\n");
    assert_eq!(told[1], "GGP 81, 0: 0 (TMCL code protection), status 100 ok");
    assert_eq!(told[2], "unknown command 'GOTO'");
    assert_eq!(told[3], "unknown command 'jump'; help lists them");
    assert_eq!(told[4], "'Loop' is neither an address nor a label of the program");
    assert_eq!(told[5], "the program ends before address 9");
    assert_eq!(told[6], "there is no breakpoint at address 1");
    assert!(told[7].starts_with("step [N]"));
}

#[test]
fn another_program_in_the_module_is_told() {
    let fake = Fake::start(State::default());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.bin");
    std::fs::write(&file, program(&PROGRAM)).unwrap();
    let output = run(&["debug", &fake.link, file.to_str().unwrap(), "--attach"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("5 of 5 commands differ; address 0"), "{}", complaint(&output));
}

/// However the debugger ends, the terminal is as it was.
#[test]
fn the_terminal_gets_its_settings_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.bin");
    std::fs::write(&file, program(&PROGRAM)).unwrap();
    let start = || {
        let mut terminal = Terminal::start(&["debug", "sim", file.to_str().unwrap()]);
        terminal.expect("(tmcl) ");
        assert!(!terminal.is_as_before());
        terminal
    };
    let ends = |terminal: &mut Terminal, code: i32| {
        let (status, shown) = terminal.end();
        assert_eq!(status.code(), Some(code), "{shown}");
        assert!(terminal.is_as_before(), "{shown}");
    };
    let mut quits = start();
    quits.line("step");
    quits.expect("(tmcl) ");
    quits.line("quit");
    ends(&mut quits, 0);
    let mut leaves = start();
    leaves.keys("\x03");
    leaves.expect("(tmcl) ");
    leaves.keys("\x04");
    ends(&mut leaves, 0);
    for (signal, code) in [(Signal::TERM, 143), (Signal::HUP, 129), (Signal::INT, 130)] {
        let mut killed = start();
        killed.signal(signal);
        ends(&mut killed, code);
    }
    let mut closed = start();
    closed.hang_up();
    assert_eq!(closed.end().0.code(), Some(129));
}
