//! Colours: on a terminal, unless somebody does not want them; never in what others have written.

use std::fs;

use super::harness::{Sim, complaint, run, tmcl};
use super::pty::Terminal;

const ERROR: &str = "\x1b[1;31m";
const WARNING: &str = "\x1b[1;33m";
const CHANGED: &str = "\x1b[32m";
const FORMER: &str = "\x1b[31m";
const END: &str = "\x1b[0m";

/// A failure on a terminal with these variables in the environment, and with these arguments in front.
fn on_a_terminal(arguments: &[&str], variables: &[(&str, &str)]) -> String {
    let mut terminal = Terminal::start_in(&[arguments, &["asm", "/no/such.tmc"]].concat(), 80, variables);
    terminal.expect("cannot read /no/such.tmc")
}

#[test]
fn a_terminal_has_them_unless_they_are_not_wanted() {
    let coloured = format!("{ERROR}tmcl:{END} cannot read");
    assert!(on_a_terminal(&[], &[]).contains(&coloured));
    assert!(on_a_terminal(&["--color", "always"], &[("NO_COLOR", "1")]).contains(&coloured));
    for (arguments, variables) in [
        (&["--color", "never"][..], &[][..]),
        (&[], &[("NO_COLOR", "1")]),
        (&["--color=auto"], &[("NO_COLOR", "x")]),
        (&[], &[("TERM", "dumb")]),
    ] {
        let shown = on_a_terminal(arguments, variables);
        assert!(shown.contains("tmcl: cannot read") && !shown.contains('\x1b'), "{arguments:?} {variables:?}: {shown}");
    }
}

#[test]
fn files_have_none_unless_they_are_wanted() {
    let plain = complaint(&run(&["asm", "/no/such.tmc"]));
    assert!(plain.starts_with("tmcl: cannot read"), "{plain}");
    let wanted = complaint(&run(&["asm", "/no/such.tmc", "--color", "always"]));
    assert_eq!(wanted.replace(ERROR, "").replace(END, ""), plain);
    assert!(wanted.starts_with(&format!("{ERROR}tmcl:{END} cannot read")), "{wanted}");
    // A variable of others that is often set does not change what scripts read.
    let output = tmcl(&["asm", "/no/such.tmc"]).env("CLICOLOR", "1").output().unwrap();
    assert_eq!(complaint(&output), plain);
}

/// The text of a source file stays without colours, whatever it is.
#[test]
fn errors_and_warnings_of_the_assembler() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.tmc");
    let assembled = |text: &str| {
        fs::write(&file, text).unwrap();
        complaint(&run(&["asm", file.to_str().unwrap(), "--color", "always"]))
    };
    let said = assembled("EI 99\n");
    assert!(said.contains(&format!("a.tmc:1:4: {WARNING}warning:{END} ")), "{said}");
    let said = assembled("ROR 0, \x1b[31mSpeeed\n");
    assert!(said.contains(&format!("{ERROR}error:{END} ")), "{said}");
    assert!(said.contains("ROR 0, \\u001b[31mSpeeed"), "{said}");
    assert_eq!(said.matches('\x1b').count(), 2, "{said}");
}

#[test]
fn settings_that_differ_and_values_that_change() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["SAP 4, 0, 1000\n", "SAP 4, 0, 900\n"].into_iter().enumerate().map(|(number, text)| {
        let file = folder.path().join(number.to_string());
        fs::write(&file, text).unwrap();
        file.to_str().unwrap().to_owned()
    });
    let files: Vec<String> = files.collect();
    let output = run(&["--color", "always", "params", "diff", &files[0], &files[1]]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains(&format!("\n{FORMER}-SAP 4, 0, 1000")), "{said}");
    assert!(said.contains(&format!("\n{CHANGED}+SAP 4, 0, 900")), "{said}");

    let program = folder.path().join("count.tmc");
    fs::write(&program, "CALC LOAD, 5\nSTOP\n").unwrap();
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    assert!(run(&["load", &link, program.to_str().unwrap()]).status.success());
    let script = folder.path().join("script");
    fs::write(&script, "watch acc\nstep\n").unwrap();
    let mut command = tmcl(&["debug", &link, program.to_str().unwrap(), "--color", "always"]);
    let output = command.stdin(fs::File::open(&script).unwrap()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains(&format!("{CHANGED}acc = 5, before 0{END}\n")), "{said}{}", complaint(&output));
}
