//! `tmcl dump`: what a module has comes back as source.

use std::net::TcpListener;
use std::process::Stdio;

use super::harness::{Sim, complaint, names, run, tmcl};
use super::pty::Terminal;

/// A module whose whole memory is read in a moment.
const FAST: [&str; 4] = ["--tcp", "127.0.0.1:0", "--speed", "100"];

/// A program with a handler and a subroutine, and what it is in the module.
const SOURCE: &str = "\
#include TMCLParam.tmc
        VECT 0, Tick
        SGP 0, 3, 1000
        EI 0
Loop:   CSUB Step
        JA Loop
Step:   SAP APMaxPositioningSpeed, 0, 500
        RSUB
Tick:   SIO 0, 2, 1
        RETI
";
const DUMPED: &str = "\
// TMCM-1140 (1140V142): 10 commands, addresses 0 to 9
// Assembled by tmcl asm --product 1140 it has the same commands again.
    VECT 0, L7
    SGP 0, 3, 1000                  // timer 0 period
    EI 0
L3:
    CSUB L5
    JA L3
L5:
    SAP 4, 0, 500                   // maximum positioning speed
    RSUB
L7:
    SIO 0, 2, 1
    RETI
    STOP
";

fn write(sim: &Sim, name: &str, text: &str) -> String {
    let path = sim.path(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().into()
}

fn link(sim: &Sim) -> String {
    format!("tcp:{}", sim.told("tcp"))
}

/// Loads a source with these options.
fn load(sim: &Sim, source: &str, options: &[&str]) {
    let output = run(&[&["load", &link(sim), &write(sim, "program.tmc", source)], options].concat());
    assert!(output.status.success(), "{}", complaint(&output));
}

/// The output of a dump with these options.
fn dumped(sim: &Sim, options: &[&str]) -> String {
    let output = run(&[&["dump", &link(sim)], options].concat());
    assert!(output.status.success(), "{}", complaint(&output));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_program_comes_back_as_source() {
    let sim = Sim::start(&FAST);
    load(&sim, SOURCE, &[]);
    assert_eq!(dumped(&sim, &[]), DUMPED);
    let file = sim.path("again.tmc").to_str().unwrap().to_owned();
    let summary = "10 commands, addresses 0 to 9\n";
    assert_eq!(dumped(&sim, &["-o", &file]), format!("{file}: {summary}"));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), DUMPED);
    let to_standard = run(&["dump", &link(&sim), "--count", "2"]);
    let expected = "tmcl: reading the program\ntmcl: standard output: 2 commands, addresses 0 to 1\n";
    assert_eq!(complaint(&to_standard), expected, "beside the source, not in it");
}

/// Programs of all products come back as the bytes that were loaded.
#[test]
fn what_comes_back_assembles_to_the_same_bytes() {
    let examples = |name: &str| format!("{}/examples/{name}", xtask::workspace().unwrap().display());
    for (product, name) in [
        ("1140", "timer_interrupt.tmc"),
        ("1140", "routines.tmc"),
        ("3110", "pick_and_place.tmc"),
        ("3212", "six_point_ramp.tmc"),
        ("6110", "homing_axes.tmc"),
    ] {
        let sim = Sim::start(&[&FAST[..], &["--product", product]].concat());
        let path = |name: &str| sim.path(name).to_str().unwrap().to_owned();
        let [was, source, is] = ["was.bin", "again.tmc", "is.bin"].map(path);
        for arguments in [
            &["asm", &examples(name), "-o", &was, "--product", product][..],
            &["load", &link(&sim), &examples(name)],
            &["dump", &link(&sim), "-o", &source],
            &["asm", &source, "-o", &is, "--product", product],
        ] {
            let output = run(arguments);
            assert!(output.status.success(), "{arguments:?}: {}", complaint(&output));
        }
        assert!(std::fs::read(&is).unwrap() == std::fs::read(&was).unwrap(), "{name}");
        assert!(std::fs::read_to_string(&source).unwrap().starts_with(&format!("// TMCM-{product} ({product}V")));
    }
}

/// A routine that only a host starts is not lost, wherever it lies.
#[test]
fn all_of_the_memory_is_read_or_a_part_of_it() {
    let sim = Sim::start(&FAST);
    load(&sim, "Loop: MST 0\nJA Loop\n", &[]);
    load(&sim, "Again: WAIT TICKS, 0, 10\nJA Again\nSTOP\n", &["--at", "5"]);
    let whole = "\
// TMCM-1140 (1140V142): 8 commands, addresses 0 to 7; the program that begins at 0 ends at 1
// Assembled by tmcl asm --product 1140 it has the same commands again.
L0:
    MST 0
    JA L0
    // Nothing above leads to what follows.
    STOP
    0, 0, 0, 0
    0, 0, 0, 0
L5:
    WAIT TICKS, 0, 10
    JA L5
    STOP
";
    assert_eq!(dumped(&sim, &[]), whole);
    let part = "\
// TMCM-1140 (1140V142): 3 commands, addresses 5 to 7
// Assembled by tmcl asm --product 1140 --origin 5 it has the same commands again.
L5:
    WAIT TICKS, 0, 10
    JA L5
    STOP
";
    assert_eq!(dumped(&sim, &["--at", "5"]), part);
    assert_eq!(dumped(&sim, &["--at", "5", "--count", "3"]), part);
    // A jump out of the part stays what it is.
    assert!(dumped(&sim, &["--at", "6", "--count", "1"]).ends_with("\n#nostop\n    JA 5\n"));
    let beyond = run(&["dump", &link(&sim), "--at", "2048"]);
    assert_eq!((beyond.status.code(), beyond.stdout.len()), (Some(1), 0));
    assert_eq!(complaint(&beyond), "tmcl: --at 2048: program memory ends at 2047\n");
    let beyond = run(&["dump", &link(&sim), "--at", "2040", "--count", "9"]);
    assert_eq!(complaint(&beyond), "tmcl: --at 2040 --count 9: program memory ends at 2047\n");
    assert_eq!(run(&["dump", &link(&sim), "--count", "0"]).status.code(), Some(2));
}

#[test]
fn an_empty_memory_is_no_failure() {
    let output = run(&["dump", "sim"]);
    assert!(output.status.success(), "{}", complaint(&output));
    let expected = "\
// TMCM-1140 (1140V142): program memory is empty
// Assembled by tmcl asm --product 1140 it has the same commands again.
#nostop
";
    assert_eq!(String::from_utf8(output.stdout).unwrap(), expected);
}

#[test]
fn a_protected_program_is_told() {
    let sim = Sim::start(&FAST);
    load(&sim, SOURCE, &[]);
    sim.tcp().ok("SGP 81, 0, 1");
    let file = sim.path("again.tmc");
    let output = run(&["dump", &link(&sim), "-o", file.to_str().unwrap()]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0));
    let told = "tmcl: the program cannot be read, it is protected (global parameter 81)";
    assert!(complaint(&output).starts_with(told), "{}", complaint(&output));
    assert!(!file.exists());
    // Against being overwritten alone it can be read.
    sim.tcp().ok("SGP 81, 0, 0");
    load(&sim, SOURCE, &[]);
    sim.tcp().ok("SGP 81, 0, 2");
    assert_eq!(dumped(&sim, &[]), DUMPED);
}

/// A program that moves the motor goes on while it is read.
#[test]
fn a_program_that_runs_is_read() {
    let sim = Sim::start(&FAST);
    load(&sim, "Loop: GGP 7, 2\nCALC ADD, 1\nAGP 7, 2\nJA Loop\n", &["--run"]);
    assert!(dumped(&sim, &["--count", "4"]).ends_with("L0:\n    GGP 7, 2\n    CALC ADD, 1\n    AGP 7, 2\n    JA L0\n"));
    assert_eq!(sim.tcp().ok("GGP 128, 0"), 1);
}

/// The file that was there stays when nothing comes, or not all of it.
#[test]
fn a_dump_that_fails_leaves_the_file_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("backup.tmc");
    std::fs::write(&file, "mine").unwrap();
    let path = file.to_str().unwrap();
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("tcp:{}", silent.local_addr().unwrap());
    let output = run(&["dump", &link, "-o", path, "--timeout", "100"]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0));
    assert!(complaint(&output).contains("no reply"), "{}", complaint(&output));

    let sim = Sim::start(&["--rs485", "{}/bus"]);
    let mut terminal = Terminal::start(&["dump", sim.told("rs485"), "-o", path]);
    terminal.expect("reading the program [");
    terminal.keys("\x03");
    let (status, said) = terminal.end();
    assert_eq!(status.code(), Some(130));
    assert!(said.contains("tmcl: interrupted; nothing has been written"), "{said}");
    assert!(terminal.is_as_before());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
    assert_eq!(names(folder.path()), ["backup.tmc"]);

    let output = run(&["dump", "sim", "-o", folder.path().join("none/a.tmc").to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("tmcl: -o: cannot write "), "{}", complaint(&output));
}

#[test]
fn a_reader_that_has_had_enough_is_no_error() {
    let mut child = tmcl(&["dump", "sim"]).stdin(Stdio::null()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), complaint(&output).as_str()), (Some(141), "tmcl: reading the program\n"));
}
