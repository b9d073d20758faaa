//! `tmcl debug` on a terminal: the lines that are typed, Ctrl-C and other signals, and the terminal's settings at the
//! end.

use std::time::{Duration, Instant};

use rustix::process::Signal;
use tmcm::tmcl::Opcode;

use super::debug::{COUNTER, PROGRAM, answers, script};
use super::fake::{Fake, State, program};
use super::harness::{PATIENCE, Sim};
use super::pty::Terminal;

/// A debugger on a terminal, with a source in a folder of its own.
fn on_a_terminal(source: &str, link: &str) -> (Terminal, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.tmc");
    std::fs::write(&file, source).unwrap();
    let mut terminal = Terminal::start(&["debug", link, file.to_str().unwrap()]);
    terminal.expect("(tmcl) ");
    (terminal, folder)
}

/// Types a line, and gives what is shown up to the next prompt.
fn ask(terminal: &mut Terminal, line: &str) -> String {
    terminal.line(line);
    // The line itself is shown with its prompt, more than once.
    terminal.expect("\n");
    terminal.expect("(tmcl) ")
}

#[test]
fn lines_are_edited_repeated_and_completed() {
    let (mut terminal, _folder) = on_a_terminal(COUNTER, "sim");
    assert!(ask(&mut terminal, "step").contains(">     1"));
    assert!(ask(&mut terminal, "").contains(">     2"));
    assert!(ask(&mut terminal, "prnt acc").contains("unknown command 'prnt'; did you mean 'print'?"));
    // Up to the mistake, and past it to the step.
    assert!(ask(&mut terminal, "\x1b[A\x1b[A").contains(">     3"));
    // The beginning of a word, and the key that completes it.
    assert!(ask(&mut terminal, "pri\t APMaxPos\t").contains("APMaxPositioningSpeed = 500 int"));
    assert!(ask(&mut terminal, "list 0").contains("      0  SAP 4, 0, 500"));
    assert!(ask(&mut terminal, "list 1").contains("      5  STOP"));
    terminal.line("quit");
    let (status, shown) = terminal.end();
    assert!(shown.contains("the program is stopped at address 3"), "{shown}");
    assert_eq!(status.code(), Some(0));
    assert!(terminal.is_as_before());
}

#[test]
fn a_changed_file_is_loaded_again() {
    let (mut terminal, folder) = on_a_terminal("CALC LOAD, 5\nBack: CALC ADD, 1\nOld: JA Back\n", "sim");
    for line in ["break Back if acc == 8", "break Old", "watch acc"] {
        ask(&mut terminal, line);
    }
    assert!(ask(&mut terminal, "continue").contains(">*    2"));
    let file = folder.path().join("program.tmc");
    std::fs::write(&file, "CALC LAOD, 5\n").unwrap();
    let told = ask(&mut terminal, "reload");
    assert!(told.contains("program.tmc:1:6: error") && told.contains("as it was; mend the file and reload"), "{told}");
    assert!(ask(&mut terminal, "registers").contains("program counter 2, accumulator 6"));
    std::fs::write(&file, "CALC LOAD, 5\nCALC ADD, 2\nCALC ADD, 0\nBack: CALC ADD, 1\nJA Back\n").unwrap();
    let told = ask(&mut terminal, "reload");
    assert!(told.contains("loaded 6 commands") && told.contains("no longer there: break Old"), "{told}");
    assert!(told.contains("acc = 0, before 6"), "{told}");
    let told = ask(&mut terminal, "continue");
    assert!(told.contains(">*    3") && told.contains("acc = 8, before 0"), "{told}");
}

const RUNS: &str = "Loop: CALC ADD, 1\nJA Loop\nNever: STOP\n";

/// While a program is executed step by step, Ctrl-C halts it, and other signals end the debugger.
#[test]
fn a_program_that_runs_is_interrupted() {
    let start = || {
        let fake = Fake::start(State::default());
        let (mut terminal, folder) = on_a_terminal(RUNS, &fake.link);
        ask(&mut terminal, "break Never");
        terminal.line("continue");
        // The line has been read for good once the first step is done.
        let end = Instant::now() + PATIENCE;
        while !fake.state().asked.iter().any(|command| command.opcode == Opcode::StepApplication as u8) {
            assert!(Instant::now() < end);
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(terminal.is_as_before());
        (terminal, folder)
    };
    let (mut interrupted, _folder) = start();
    interrupted.keys("\x03");
    interrupted.expect("interrupted");
    interrupted.expect("(tmcl) ");
    assert!(ask(&mut interrupted, "registers").contains("step by step, program counter"));
    interrupted.keys("\x04");
    assert_eq!(interrupted.end().0.code(), Some(0));
    assert!(interrupted.is_as_before());
    for (signal, code) in [(Signal::TERM, 143), (Signal::HUP, 129)] {
        let (mut killed, _folder) = start();
        killed.signal(signal);
        let (status, shown) = killed.end();
        assert_eq!(status.code(), Some(code), "{shown}");
        assert!(shown.contains("the program is stopped at address"), "{shown}");
        assert!(killed.is_as_before());
    }
}

#[test]
fn a_link_that_fails_ends_it_with_the_terminal_as_before() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let (mut terminal, _folder) = on_a_terminal(RUNS, &format!("tcp:{}", sim.told("tcp")));
    assert!(ask(&mut terminal, "step").contains(">     1"));
    sim.end(Signal::TERM);
    terminal.line("step");
    let (status, shown) = terminal.end();
    assert_eq!(status.code(), Some(1), "{shown}");
    assert!(shown.contains("tmcl: 13"), "{shown}");
    assert!(terminal.is_as_before());
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

/// A terminal of 40 columns is as good as any, and so is the end of a script in the middle of a line.
#[test]
fn narrow_terminals_and_short_scripts() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.tmc");
    std::fs::write(&file, COUNTER).unwrap();
    let mut terminal = Terminal::start_with(&["debug", "sim", file.to_str().unwrap()], 40);
    terminal.expect("(tmcl) ");
    assert!(ask(&mut terminal, "print APMaxPositioningSpeed, Motor0 + 0 + 0 + 0").contains("= 1000 int"));
    terminal.keys("\x04");
    assert_eq!(terminal.end().0.code(), Some(0));
    assert!(terminal.is_as_before());
    let (told, output) = script(COUNTER, &[], "step\r\nprint pc");
    assert_eq!((output.status.code(), answers(&told)[0]), (Some(0), "pc = 1"));
}
