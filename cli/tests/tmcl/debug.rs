//! `tmcl debug`, told what to do through a pipe.

use std::process::Output;

use super::fake::{Fake, State, program};
use super::harness::{complaint, run, type_into};

pub(crate) const PROGRAM: [&str; 5] = ["CALC LOAD, 5", "CALC ADD, 1", "WAIT TICKS, 0, 100", "JA 1", "STOP"];

/// Debugs a program and gives the lines that are told.
fn debug(fake: &Fake, lines: &[&str], options: &[&str], commands: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.bin");
    std::fs::write(&file, program(lines)).unwrap();
    let output = type_into(&[&["debug", &fake.link, file.to_str().unwrap()], options].concat(), commands);
    assert!(output.status.success(), "{}", complaint(&output));
    String::from_utf8(output.stdout).unwrap().lines().map(String::from).collect()
}

/// Debugs a source on a virtual module, and gives what is told and the output.
pub(crate) fn script(source: &str, options: &[&str], commands: &str) -> (Vec<String>, Output) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("program.tmc");
    std::fs::write(&file, source).unwrap();
    let output = type_into(&[&["debug", "sim", file.to_str().unwrap()], options].concat(), commands);
    (String::from_utf8_lossy(&output.stdout).lines().map(String::from).collect(), output)
}

/// The lines that show no command of the program.
pub(crate) fn answers(told: &[String]) -> Vec<&str> {
    let is_command = |line: &&str| line.get(2..7).is_some_and(|place| place.trim().parse::<u16>().is_ok());
    told.iter().map(String::as_str).filter(|line| !is_command(line) && !line.ends_with(':')).collect()
}

/// The addresses at which the program was halted, one after the other.
fn halts(told: &[String]) -> Vec<u16> {
    let arrows = told.iter().filter(|line| line.starts_with('>'));
    arrows.map(|line| line[2..7].trim().parse().unwrap()).collect()
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
        "      1  CALC ADD, 1",
        "      2  WAIT TICKS, 0, 100",
        "      0  CALC LOAD, 5",
        ">     1  CALC ADD, 1",
        "      2  WAIT TICKS, 0, 100",
        "      3  JA 1",
        "step by step, program counter 1, accumulator 5, X 0",
        " *    3  JA 1",
        "breakpoint",
        "      1  CALC ADD, 1",
        "      2  WAIT TICKS, 0, 100",
        ">*    3  JA 1",
        "      4  STOP",
        "breakpoint",
        "      1  CALC ADD, 1",
        "      2  WAIT TICKS, 0, 100",
        ">*    3  JA 1",
        "      4  STOP",
        "step by step, program counter 3, accumulator 7, X 0",
        "no breakpoints",
        "      0  CALC LOAD, 5",
        "      1  CALC ADD, 1",
        ">     2  WAIT TICKS, 0, 100",
        "      3  JA 1",
        "      4  STOP",
        "      3  JA 1",
        "      4  STOP",
        ">     0  CALC LOAD, 5",
        "      1  CALC ADD, 1",
        "      2  WAIT TICKS, 0, 100",
        "the program is stopped at address 0",
    ];
    assert_eq!(told, expected);
}

#[test]
fn the_end_of_the_program_is_noticed() {
    let fake = Fake::start(State::default());
    let told = debug(&fake, &["CALC LOAD, 5", "STOP"], &[], "break 1\nstep\nstep\nlist\nlist 1\nstep\nlist\n");
    let expected = [
        "      1  STOP",
        " *    1  STOP",
        "      0  CALC LOAD, 5",
        ">*    1  STOP",
        "the program has ended; the next step begins it again",
        "      0  CALC LOAD, 5",
        // The module has its program counter at 0 again; where it has ended is remembered here.
        ">*    1  STOP",
        "      0  CALC LOAD, 5",
        ">*    1  STOP",
        ">*    1  STOP",
        "      0  CALC LOAD, 5",
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
    let told = debug(&fake, &PROGRAM, &[], "continue\nregisters\nquit\nnever read\n");
    assert_eq!(told[3], "running; stop halts it");
    assert_eq!(told[4], "running, program counter 0, accumulator 0, X 0");
    assert_eq!(told[5], "the program goes on running in the module; command 128 stops it");
    assert_eq!(fake.state().mode, 1);
    let told = debug(&fake, &PROGRAM, &["--attach"], "stop\n");
    assert_eq!(told[..2], ["running; stop halts it", ">     0  CALC LOAD, 5"]);
    assert_eq!(told.last().unwrap(), "the program is stopped at address 0");
}

/// The first line that cannot be carried out ends a script, wherever the mistake is, and the exit code tells of it.
#[test]
fn a_script_ends_at_its_first_mistake() {
    let source = "Loop: CALC ADD, 1\nJA Loop\n";
    for (line, told) in [
        ("jump", "unknown command 'jump'; help lists them"),
        ("STEP", "unknown command 'STEP'; they are written in small letters: 'step'"),
        ("GAP 1, 0", "unknown command 'GAP'; did you mean 'send GAP 1, 0'?"),
        ("send GOTO", "unknown command 'GOTO'"),
        ("send press left", "tmcl world ADDR:PORT \"press left\""),
        ("break Lopp", "'Lopp' is neither an address nor a label of the program; did you mean 'Loop'?"),
        ("break 9", "the program ends before address 9"),
        ("break :9", "no command follows in line 9 or below"),
        ("break Loop if acc", "'acc' compares nothing; for example: acc > 5"),
        ("break Loop if APActualPosition 7 > 1", "GAP 1, 7: status 4"),
        ("delete 1", "there is no breakpoint at address 1"),
        ("print Lopp", "unknown name 'Lopp'; did you mean 'Loop'?"),
        ("set acc", "For example: set acc 5"),
        ("set Loop 5", "'Loop' is a constant of the program; it cannot be set"),
        ("set pc 1", "no command sets the program counter alone"),
        ("set APMaxCurrent 9999", "SAP 6, 0, 9999: status 4"),
        ("unwatch acc", "'acc' is not watched"),
    ] {
        let (lines, output) = script(source, &[], &format!("\nstep\n{line}\nstep\n"));
        let complaint = complaint(&output);
        let at = complaint.rfind("tmcl: line 3: ").unwrap_or_else(|| panic!("{line}: {complaint}"));
        assert!(complaint[at..].contains(told), "{line}: {complaint}");
        assert_eq!(output.status.code(), Some(1), "{line}");
        assert_eq!(
            (halts(&lines), lines.last().unwrap().as_str()),
            (vec![0, 1], "the program is stopped at address 1")
        );
    }
    let (lines, output) = script(source, &[], "continue\nset acc 5\n");
    assert_eq!((output.status.code(), lines.len()), (Some(1), 6), "{lines:?}");
    assert!(complaint(&output).contains("the program runs; stop halts it"), "{}", complaint(&output));
}

#[test]
fn direct_commands_have_the_names_of_the_program() {
    let fake = Fake::start(State::default());
    let told = debug(&fake, &PROGRAM, &[], "send \"GGP 81, 0\"\nhelp\n");
    assert_eq!(told[3], "GGP 81, 0: 0 (TMCL code protection), status 100 ok");
    assert!(told[4].starts_with("step [N]"));
    let commands = "send SAP APMaxPositioningSpeed, Motor0, Speed * 2\nsend GAP 4, 0\n";
    let (told, _) = script("Speed = 400\nROR 0, Speed\n", &[], commands);
    assert_eq!(answers(&told)[0], "SAP 4, 0, 800: 800 int (maximum positioning speed), status 100 ok");
    assert_eq!(answers(&told)[1], "GAP 4, 0: 800 int (maximum positioning speed), status 100 ok");
}

pub(crate) const COUNTER: &str = "\
#include TMCLParam.tmc
Count = 10
        SAP APMaxPositioningSpeed, Motor0, 500
Loop:
        GGP Count, 2
        CALC ADD, 1
        // one more
        AGP Count, 2
        JA Loop
";

#[test]
fn values_are_shown_and_changed() {
    let commands = "\
        break Loop if Count >= 2\ncontinue\nprint acc\nprint variable Count\nset x 7\nprint acc\nprint X\n\
        set acc = 5 * 8 + 1\nset Count 100\nstep 2\nprint acc\nprint x\nset APMaxPositioningSpeed 2 * 400\n\
        print APActualPosition 0\nprint Loop\nprint GPSerialAddress\nprint pc\nprint Count * 2\nset variable 11 -1\n\
        delete Loop\nbreak Loop if acc == 103\ncontinue\nprint Count\n";
    let (told, output) = script(COUNTER, &[], commands);
    assert!(output.status.success(), "{}", complaint(&output));
    let expected = [
        "         if Count >= 2",
        "breakpoint",
        "acc = 2",
        "variable Count = 2",
        "x = 7",
        "acc = 2",
        "X = 7",
        "acc = 41",
        "Count = 100 (variable 10)",
        "acc = 101",
        "x = 7",
        "APMaxPositioningSpeed = 800 int (maximum positioning speed)",
        "APActualPosition 0 = 0 microsteps (actual position)",
        "Loop = 1",
        "GPSerialAddress = 1 (serial address)",
        "pc = 3",
        "Count * 2 = 20",
        "variable 11 = -1",
        "no breakpoints",
        "         if acc == 103",
        "breakpoint",
        "Count = 103 (variable 10)",
        "the program is stopped at address 1",
    ];
    assert_eq!(answers(&told), expected);
}

#[test]
fn watched_values_are_shown_when_they_change() {
    let (told, output) =
        script(COUNTER, &[], "watch Count\nwatch acc\nstep 3\nstep\nstep\nwatch\nunwatch Count\nunwatch\nstep 4\n");
    assert!(output.status.success(), "{}", complaint(&output));
    let expected = [
        "Count = 0 (variable 10)",
        "acc = 0",
        "acc = 1, before 0",
        "Count = 1, before 0 (variable 10)",
        "Count = 1 (variable 10)",
        "acc = 1",
        "acc = 1",
        "nothing is watched",
        "the program is stopped at address 1",
    ];
    assert_eq!(answers(&told), expected);
}

#[test]
fn breakpoints_are_set_by_lines_labels_and_expressions() {
    let (told, _) = script(COUNTER, &[], "b :6\nb Loop + 2\nb program.tmc:4\nc\nc\nc\nd :7\nc\nc\nd\n");
    assert_eq!(halts(&told), [0, 1, 2, 3, 1, 2]);
    let shown: Vec<&String> = told.iter().filter(|line| line.starts_with(" *    2")).collect();
    assert_eq!(*shown[0], " *    2  CALC ADD, 1                       6  CALC ADD, 1");
    assert_eq!(answers(&told).last(), Some(&"the program is stopped at address 2"));
}

#[test]
fn a_subroutine_is_stepped_over() {
    let source = "CSUB Outer\nCALC ADD, 100\nSTOP\n\
        Outer: CSUB Inner\nCSUB Inner\nRSUB\nInner: CALC ADD, 1\nRSUB\n";
    let commands = "next\nprint acc\nn\nreset\nstep\nn\nprint acc\nn 2\nprint acc\nreset\nb Inner\nn\n";
    let (told, output) = script(source, &[], commands);
    assert!(output.status.success(), "{}", complaint(&output));
    assert_eq!(halts(&told), [0, 1, 2, 0, 3, 4, 1, 0, 6]);
    let expected = ["acc = 2", "acc = 1", "acc = 2", "breakpoint", "the program is stopped at address 6"];
    assert_eq!(answers(&told), expected);
}

#[test]
fn a_virtual_module_has_a_world_and_an_eeprom() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("world.toml"), "[supply]\nvolts = 12.5\n").unwrap();
    let (world, eeprom) = (path("world.toml"), path("eeprom"));
    let options = ["--world", &world, "--eeprom", &eeprom];
    let (told, output) = script("STOP\n", &options, "send GIO 8, 1\nset variable 10 77\nsend STGP 10, 2\n");
    assert!(output.status.success(), "{}", complaint(&output));
    assert_eq!(answers(&told)[0], "GIO 8, 1: 12.5 V (supply), status 100 ok");
    let (told, _) = script("STOP\n", &options, "print variable 10\n");
    assert_eq!(answers(&told)[0], "variable 10 = 77");
    let fake = Fake::start(State::default());
    let output = run(&["debug", &fake.link, "stage.tmc", "--eeprom", &eeprom]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("--eeprom is for LINK sim"), "{}", complaint(&output));
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

/// Files and links that cannot be debugged are told of before anything moves.
#[test]
fn wrong_files_and_links_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("good.tmc"), "STOP\n").unwrap();
    std::fs::write(path("bad.tmc"), "STPO\n").unwrap();
    std::fs::write(path("text.bin"), "STOP\n").unwrap();
    let good = path("good.tmc");
    for (arguments, code, told) in [
        (["sim", &path("none.tmc")], 1, "none.tmc: there is no such file"),
        (["sim", &path("bad.tmc")], 1, "bad.tmc:1:1: error: unknown command 'STPO'"),
        (["sim", &path("text.bin")], 1, "text.bin is text, not an assembled program"),
        (["sim", "-"], 2, "the program has to be in a file"),
        (["tcp:127.0.0.1", &good], 2, "give a host and a port"),
        (["127.0.0.1:1", &good], 2, "did you mean tcp:127.0.0.1:1?"),
        (["tcp:127.0.0.1:1", &good], 1, "cannot connect to 127.0.0.1:1"),
        (["/dev/null", &good], 1, "/dev/null is not a serial device"),
    ] {
        let output = run(&["debug", arguments[0], arguments[1]]);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        assert!(complaint(&output).contains(told), "{arguments:?}: {}", complaint(&output));
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
}

/// Homing programs call their user variables so; the registers have another name as well.
#[test]
fn the_program_s_own_names_come_before_the_registers() {
    let source = "X = 10\nPC = 11\nMain: SGP X, 2, 77\nSGP PC, 2, 5\nCALC LOAD, 3\nInc: CALC ADD, 1\nSTOP\n";
    let commands = "step 4\nprint X\nprint x\nprint PC\nprint register pc\nset x 78\nprint variable 10\n\
                    print register x\nset register x 4\nprint acc\nreset\nbreak Inc if X = 77\ncontinue\n";
    let (told, output) = script(source, &[], commands);
    let told = answers(&told);
    let expected = [
        "X = 77 (variable 10)",
        "x = 77 (variable 10)",
        "PC = 5 (variable 11)",
        "register pc = 4",
        "x = 78 (variable 10)",
        "variable 10 = 78",
        "register x = 0",
        "register x = 4",
        "acc = 4",
    ];
    assert!(told.windows(expected.len()).any(|part| part == expected), "{told:?} {}", complaint(&output));
    assert!(told.contains(&"breakpoint"), "{told:?}");
}

#[test]
fn the_axis_of_a_parameter_may_stand_before_its_new_value() {
    let commands = "set APMaxCurrent 2 60\nset APMaxCurrent, 1, 50\nset APMaxCurrent 2 * 35\nset APMaxCurrent 2 = 61\n";
    let (told, output) = script("STOP\n", &["--product", "3110"], commands);
    let expected = ["APMaxCurrent 2 = 60", "APMaxCurrent, 1 = 50", "APMaxCurrent = 70", "APMaxCurrent 2 = 61"];
    let told: Vec<&str> = told.iter().filter_map(|line| Some(line.split_once(" 1/255")?.0)).collect();
    assert_eq!(told, expected, "{}", complaint(&output));
}
