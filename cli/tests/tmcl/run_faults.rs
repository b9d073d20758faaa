//! `tmcl run` with programs, files and arguments that are wrong, and with somebody who ends it.

use super::harness::{complaint, names, tmcl, type_into};
use super::pty::Terminal;
use super::run::Folder;
use super::run_plots::texts;

#[test]
fn what_cannot_be_run_is_told() {
    let folder = Folder::with("ROR 0, Sped\n");
    let expected = "\
program.tmc:1:8: error: unknown name 'Sped'
    ROR 0, Sped
           ^^^^
";
    assert_eq!(folder.complaint(1, &["program.tmc"]), expected);
    assert!(folder.complaint(1, &["none.tmc"]).starts_with("tmcl: cannot read none.tmc: "));
    assert!(folder.complaint(1, &["none.bin"]).starts_with("tmcl: cannot read none.bin: "));
    folder.write("program.tmc", "136, 1, 0, 0\n");
    folder.write("fine.tmc", "STOP\n");
    for option in ["--trace", "--plot"] {
        let complaint = folder.complaint(1, &["fine.tmc", option, "./fine.tmc"]);
        assert_eq!(complaint, format!("tmcl: {option} would replace the program; give another file\n"));
        let told = folder.complaint(1, &["fine.tmc", option, "none/out.svg"]);
        assert!(told.starts_with(&format!("tmcl: {option}: cannot write none/out.svg: ")), "{told}");
    }
    let told = folder.complaint(2, &["fine.tmc", "--plot", "./program.tmc"]);
    assert!(told.starts_with("tmcl: --plot: ./program.tmc does not end in .svg"), "{told}");
    assert_eq!(folder.read("fine.tmc"), "STOP\n");
    assert_eq!(names(folder.0.path()), ["fine.tmc", "program.tmc"]);
    for (options, told) in [
        (&["--trace", "-", "--json"][..], "--json and --trace cannot both have standard output"),
        (&["--plot", "-", "--json"], "--json and --plot cannot both have standard output"),
        (&["--plot", "-", "--trace", "-"], "--trace and --plot cannot have the same file"),
    ] {
        assert!(folder.complaint(2, &[&["fine.tmc"], options].concat()).contains(told), "{told}");
    }
    // The motor is locked: nothing can run.
    folder.write("dark.toml", "[supply]\nvolts = 7.0\n");
    let complaint = folder.complaint(1, &["fine.tmc", "--world", "dark.toml"]);
    assert!(complaint.starts_with("tmcl: the module does not start the program: status 6"), "{complaint}");
}

/// A run that somebody ends has its report and its plot up to there.
#[test]
fn a_run_can_be_interrupted() {
    let folder = Folder::with("L: JA L\n");
    let file = |name: &str| folder.0.path().join(name).to_str().unwrap().to_owned();
    let (program, plot) = (file("program.tmc"), file("out.svg"));
    let options = ["run", &program, "--until", "1000 h", "--plot", &plot];
    let mut terminal = Terminal::start_with(&options, 40);
    let bar = terminal.expect(" %");
    assert!(bar.trim_start_matches('\r').chars().count() < 40, "{bar:?}");
    terminal.keys("\x03");
    let (status, shown) = terminal.end();
    assert_eq!(status.code(), Some(130));
    assert!(shown.contains("interrupted by Ctrl-C, at address 0 (L)"), "{shown}");
    assert!(texts(&folder.read("out.svg")).contains(&"program.tmc"));
    assert!(terminal.is_as_before());
}

#[test]
fn a_trace_whose_reader_has_had_enough_ends_quietly() {
    let folder = Folder::with("L: CALC ADD, 1\nJA L\n");
    let mut command = tmcl(&["run", "program.tmc", "--trace"]);
    let mut run = command.current_dir(folder.0.path()).spawn().unwrap();
    drop(run.stdout.take());
    let output = run.wait_with_output().unwrap();
    assert_eq!((output.status.code(), complaint(&output)), (Some(141), String::new()));
}

#[test]
fn what_is_wrong_with_the_arguments_is_told_in_one_sentence() {
    let folder = Folder::with("STOP\n");
    folder.write("world.toml", "[stage]\nleft = 5\nright = 1\n");
    folder.write("noise.tmc", "\u{0}\u{1}\u{2}");
    for (code, arguments, told) in [
        (1, &["none.tmc"][..], "cannot read none.tmc"),
        (1, &["."], "cannot read ."),
        (1, &["noise.tmc"], "noise.tmc is no text"),
        (1, &["program.tmc", "--world", "none.toml"], "--world: cannot read none.toml"),
        (
            1,
            &["program.tmc", "--world", "world.toml"],
            "world.toml: line 2: stage.left: 5 is not below stage.right (1)",
        ),
        (1, &["program.tmc", "--world", "world.toml", "--trace", "world.toml"], "--trace would replace the world"),
        (1, &["program.tmc", "--trace", "/dev/full"], "--trace: cannot write /dev/full"),
        (2, &["program.tmc", "--until", "forever"], "'forever' is no time"),
        (2, &["program.tmc", "--product", "9999"], "'9999' is none of 1140, 1110, 3110, 3212, 6110"),
        (2, &["program.tmc", "--at", "1 s: presss left"], "unknown command 'presss'"),
    ] {
        let said = folder.complaint(code, arguments);
        assert!(said.contains(told), "{arguments:?}: {said}");
    }
    assert_eq!(folder.read("world.toml"), "[stage]\nleft = 5\nright = 1\n");
    // A program from standard input.
    let output = type_into(&["run", "-", "--plot", "-"], "STOP\n");
    assert!(output.status.success(), "{}", complaint(&output));
    assert!(texts(&String::from_utf8(output.stdout).unwrap()).contains(&"standard input"));
    assert!(type_into(&["run", "-"], "").status.code().is_some());
}
