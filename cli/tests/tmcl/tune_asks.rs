//! Questions that `tmcl tune` asks somebody at a terminal, and how that somebody loads the motor.

use std::time::{Duration, Instant};

use super::harness::{PATIENCE, Sim, complaint, run, tmcl};
use super::pty::{Terminal, pair};
use super::tune::{assert_left_in_peace, module, settings, ways};

/// Without a terminal nobody can be asked; on one, no is no, and Ctrl-C in the question is the end.
#[test]
fn nothing_moves_without_consent() {
    let sim = module("1140");
    let before = settings(&sim);
    let (link, control) = ways(&sim);
    let output = run(&["tune", "stallguard", &link, "--control", &control]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("--yes"), "{}", complaint(&output));
    for (answer, code) in [("n\r", 1), ("\r", 1), ("\x03", 130), ("\x04", 1)] {
        let mut terminal = Terminal::start(&["tune", "stallguard", &link, "--control", &control]);
        let told = terminal.expect("[y/N]");
        assert!(told.contains("motor 0 goes to and fro between 0 and "), "{told}");
        terminal.keys(answer);
        let (status, rest) = terminal.end();
        assert_eq!(status.code(), Some(code), "{rest}");
        assert!(terminal.is_as_before());
    }
    assert_eq!(settings(&sim), before);
    assert_eq!(sim.control(&["state"])["field"], 0);
}

/// Standard input is no terminal, so nobody can answer, though standard error is one, where the question could be read.
#[test]
fn a_terminal_that_can_only_show_is_not_asked() {
    let sim = module("1140");
    let (link, control) = ways(&sim);
    let (_keep, shown) = pair(80);
    let mut command = tmcl(&["tune", "stallguard", &link, "--control", &control]);
    assert_eq!(command.stderr(shown).status().unwrap().code(), Some(2));
    assert_eq!(sim.control(&["state"])["field"], 0);
}

/// While somebody is waited for, the motor goes on to and fro.
fn goes_to_and_fro(sim: &Sim) {
    let end = Instant::now() + PATIENCE;
    for direction in [1.0, -1.0, 1.0] {
        while sim.control(&["state"])["velocity"].as_f64().unwrap() * direction <= 0.0 {
            assert!(Instant::now() < end, "it stands");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// Somebody at a terminal with 40 columns holds the shaft when asked to.
#[test]
fn a_hand_loads_the_motor() {
    let sim = module("1140");
    let mut terminal = Terminal::start_with(&["tune", "stallguard", &ways(&sim).0, "--speeds", "2000"], 40);
    terminal.expect("[y/N]");
    terminal.line("y");
    terminal.expect("press Enter");
    goes_to_and_fro(&sim);
    sim.control(&["load 0.39"]);
    terminal.line("");
    terminal.expect("let go");
    goes_to_and_fro(&sim);
    sim.control(&["load 0"]);
    terminal.line("");
    let (status, text) = terminal.end();
    assert!(status.success(), "{text}");
    let table = text.rsplit_once("Axis 0").unwrap().1.replace('\r', "");
    assert!(table.lines().all(|line| line.chars().count() <= 40), "{table}");
    assert!(table.contains("\nSAP 174, 0, 1\n"), "{table}");
}

/// A user who types another word than yes does not hold the shaft.
#[test]
fn no_is_not_enter() {
    let sim = module("1140");
    let before = settings(&sim);
    let mut terminal = Terminal::start(&["tune", "stallguard", &ways(&sim).0, "--speeds", "2000", "--yes"]);
    terminal.expect("press Enter");
    terminal.line("no");
    let (status, text) = terminal.end();
    assert_eq!(status.code(), Some(1), "{text}");
    assert!(text.contains("ended by 'no'; all settings are as before"), "{text}");
    assert_eq!(sim.tcp().ok("GAP 1, 0"), 0);
    assert_left_in_peace(&sim, &before);
}

/// The message after Ctrl-C stands on a line of its own, without the ^C of the terminal.
#[test]
fn after_an_interrupt_the_line_is_the_program_s() {
    let sim = module("1140");
    let mut terminal = Terminal::start(&["tune", "stallguard", &ways(&sim).0, "--speeds", "2000", "--yes"]);
    terminal.expect("press Enter");
    terminal.keys("\x03");
    let (status, text) = terminal.end();
    assert_eq!(status.code(), Some(130), "{text}");
    assert!(text.contains("\r\x1b[Ktmcl: all settings are as before"), "{text}");
}

/// Standard input that ends while a hand is waited for: nobody can say that the shaft is held.
#[test]
fn without_a_hand_it_ends() {
    let sim = module("1140");
    let before = settings(&sim);
    let output = run(&["tune", "stallguard", &ways(&sim).0, "--speeds", "2000", "--yes"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("standard input has ended"), "{}", complaint(&output));
    assert_left_in_peace(&sim, &before);
}
