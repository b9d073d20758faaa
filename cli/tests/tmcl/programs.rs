//! `tmcl load` and `tmcl debug` with virtual modules, whose firmware runs the programs.

use std::time::Instant;

use rustix::process::Signal;

use super::fake::program;
use super::harness::{PATIENCE, Sim, complaint, run, type_into};
use super::pty::Terminal;

/// Two moves with a pause in between, and the end.
const MOVES: [&str; 6] =
    ["CALC LOAD, 5", "MVP ABS, 0, 2000", "WAIT POS, 0, 0", "WAIT TICKS, 0, 5", "MVP ABS, 0, -500", "STOP"];

/// The program in a file of the module's folder.
fn file(sim: &Sim, lines: &[&str]) -> String {
    let path = sim.path("program.bin");
    std::fs::write(&path, program(lines)).unwrap();
    path.to_str().unwrap().into()
}

/// A source in a file of the module's folder.
fn source(sim: &Sim, text: &str) -> String {
    let path = sim.path("program.tmc");
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().into()
}

/// Every link carries a program to the module and back. It keeps where it has been, because nobody may look meanwhile.
#[test]
fn programs_are_loaded_over_every_link() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--serial", "{}/usb", "--rs485", "{}/bus", "--slcan", "{}/can"]);
    let moves = ["MVP ABS, 0, 2000", "WAIT POS, 0, 0", "GAP 1, 0", "AGP 7, 2", "MVP ABS, 0, -500", "STOP"];
    let file = file(&sim, &moves);
    let adapter = format!("slcan:{}", sim.told("slcan"));
    for link in [&format!("tcp:{}", sim.told("tcp")), sim.told("serial"), sim.told("rs485"), &adapter] {
        let mut host = sim.tcp();
        host.ok("SGP 7, 2, 0");
        let output = run(&["load", link, &file, "--verify", "--run"]);
        assert!(output.status.success(), "{link}: {}", complaint(&output));
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.ends_with("the module has them as they are in the file\nrunning from address 0\n"), "{said}");
        host.until("GGP 7, 2", 2000);
        host.until("GAP 1, 0", -500);
        host.until("GGP 128, 0", 0);
    }
}

#[test]
fn a_routine_beside_the_program() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    assert!(run(&["load", &link, &file(&sim, &MOVES)]).status.success());
    let output = run(&["load", &link, &file(&sim, &["MVP ABS, 0, 777", "STOP"]), "--at", "50", "--run"]);
    assert!(output.status.success(), "{}", complaint(&output));
    sim.tcp().until("GAP 1, 0", 777);
    let output = run(&["send", &link, "134, 0, 0, 0", "134, 0, 0, 5", "134, 0, 0, 50"]);
    let said = String::from_utf8(output.stdout).unwrap();
    let stored: Vec<&str> = said.lines().map(|line| line.split_once(": ").unwrap().1).collect();
    assert_eq!(stored, ["CALC LOAD, 5", "STOP", "MVP ABS, 0, 777"]);
    // The memory ends at 2048.
    let output = run(&["load", &link, &file(&sim, &MOVES), "--at", "2045"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("6 commands from address 2045 on do not fit"), "{}", complaint(&output));
}

/// A source knows where it goes; of an assembled program its assembler has to know it.
#[test]
fn labels_are_right_wherever_a_program_is_loaded_to() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let routine = source(&sim, "CALC LOAD, 0\nLoop: CALC ADD, 1\nCOMP 5\nJC LT, Loop\nAGP 7, 2\n");
    let output = run(&["load", &link, &routine, "--at", "50", "--run"]);
    assert!(output.status.success(), "{}", complaint(&output));
    assert_eq!(complaint(&output), "tmcl: loading the program\n", "no warning");
    sim.tcp().until("GGP 7, 2", 5);
    let output = run(&["send", &link, "134, 0, 0, 53"]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "134, 0, 0, 53: JC LT, 51\n");

    let file = sim.path("program.bin");
    let assembled = file.to_str().unwrap();
    for (origin, warned) in [("0", true), ("50", false)] {
        assert!(run(&["asm", &routine, "-o", assembled, "--origin", origin]).status.success());
        let output = run(&["load", &link, assembled, "--at", "50"]);
        assert!(output.status.success(), "{}", complaint(&output));
        let warning = "warning: address 53: JC LT, 1 leads out of this program; load its source, or assemble it with tmcl asm \
                       --origin 50\n";
        assert_eq!(complaint(&output).contains(warning), warned, "{}", complaint(&output));
    }
    // The memory ends at 2048.
    let output = run(&["load", &link, &routine, "--at", "2046"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        complaint(&output).contains("program memory holds 2 commands from address 2046 on"),
        "{}",
        complaint(&output)
    );
}

/// A program that a user writes, and what becomes of it without anybody's doing anything.
const STAGE: &str = "\
// To and fro
#include TMCLParam.tmc
Far = 2 * 25600

        SAP APMaxPositioningSpeed, Motor0, 2000
Loop:   MVP ABS, Motor0, Far
        WAIT POS, Motor0, 0
        MVP ABS, Motor0, 0
        WAIT POS, Motor0, 0
        JA Loop
";

/// Waits until the rotor has been on both sides of the middle: the program moves it to and fro.
fn sees_it_move(sim: &Sim) {
    let end = Instant::now() + PATIENCE;
    let start = sim.control(&["state"])["rotor"].as_i64().unwrap();
    let (mut least, mut most) = (start, start);
    while most - least < 40_000 {
        let rotor = sim.control(&["state"])["rotor"].as_i64().unwrap();
        (least, most) = (least.min(rotor), most.max(rotor));
        assert!(Instant::now() < end, "the rotor moves from {least} to {most}");
    }
}

#[test]
fn from_an_empty_editor_to_a_program_that_starts_by_itself() {
    let arguments =
        ["--serial", "{}/port", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0", "--eeprom", "{}/module.bin"];
    let sim = Sim::start(&arguments);
    let source = source(&sim, STAGE);
    let output = run(&["asm", &source]);
    assert!(output.status.success() && output.stderr.is_empty(), "{}", complaint(&output));

    let output = run(&["load", sim.told("serial"), &source, "--verify", "--run", "--autostart"]);
    assert!(output.status.success(), "{}", complaint(&output));
    let said = "loaded to addresses 0 to 6\nthe module has them as they are in the file\n\
                the program starts by itself after power-up\nrunning from address 0\n";
    assert_eq!(String::from_utf8(output.stdout).unwrap(), said);
    sees_it_move(&sim);

    sim.control(&["power off", "power on"]);
    sees_it_move(&sim);

    // The EEPROM goes into another module.
    let (_, folder) = sim.end(Signal::TERM);
    let sim = Sim::start_in(folder, &arguments);
    sees_it_move(&sim);
    // It has what the assembler made, too.
    let link = format!("tcp:{}", sim.told("tcp"));
    let assembled = sim.path("program.bin");
    let output = type_into(&["debug", &link, assembled.to_str().unwrap(), "--attach"], "stop\n");
    assert!(output.status.success(), "{}", complaint(&output));
}

/// The first program is on its way when the second comes; its motor turns until the new one moves it.
#[test]
fn a_program_that_runs_is_replaced() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    assert!(run(&["load", &link, &source(&sim, STAGE), "--run"]).status.success());
    sim.tcp().until("GGP 128, 0", 1);
    let output = run(&["load", &link, &source(&sim, "MVP ABS, 0, -777\n"), "--verify", "--run"]);
    assert!(output.status.success(), "{}", complaint(&output));
    sim.tcp().until("GAP 1, 0", -777);
    sim.tcp().until("GGP 128, 0", 0);
}

#[test]
fn programs_come_from_standard_input_too() {
    let assembled = program(&["CALC LOAD, 5", "STOP"]);
    let assembled = std::str::from_utf8(&assembled).unwrap();
    for text in ["CALC LOAD, 5\n", assembled] {
        let output = type_into(&["load", "sim", "-", "--verify"], text);
        assert!(output.status.success(), "{}", complaint(&output));
        assert!(output.stdout.starts_with(b"loaded to addresses 0 to 1\n"));
    }
    let output = type_into(&["load", "sim", "-"], "CALC LAOD, 5\n");
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).starts_with("standard input:1:6: error: 'LAOD' is none of "), "{}", complaint(&output));
    let output = type_into(&["debug", "sim", "-"], "step\n");
    assert!(complaint(&output).contains("the program has to be in a file"), "{}", complaint(&output));
}

#[test]
fn sources_with_mistakes_are_not_loaded() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    for command in ["load", "debug"] {
        let output = run(&[command, &link, &source(&sim, "Loop: ROR 0, 500\nJA Lop\n")]);
        assert_eq!(output.status.code(), Some(1));
        let expected = "program.tmc:2:4: error: unknown name 'Lop'; did you mean 'Loop'?\n    JA Lop\n       ^^^\n";
        assert!(complaint(&output).ends_with(expected), "{}", complaint(&output));
    }
    // A warning does not keep a program from being loaded, but one that would reset the module is none.
    let output = run(&["load", &link, &source(&sim, "SAP 4, 0, 9999\n")]);
    assert!(output.status.success());
    assert!(complaint(&output).contains("warning: 9999 is out of range"), "{}", complaint(&output));
    let output = run(&["load", &link, &source(&sim, "137, 0, 0, 1234\n")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("a program cannot have command 137"), "{}", complaint(&output));
    let output = run(&["send", &link, "134, 0, 0, 0"]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "134, 0, 0, 0: SAP 4, 0, 9999\n");
}

/// Somebody edits a program in one window and has the module run it in another.
#[test]
fn a_program_is_loaded_again_whenever_it_is_saved() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let include = sim.path("number.inc");
    std::fs::write(&include, "Number = 1\n").unwrap();
    let stage = source(&sim, "#include number.inc\nCALC LOAD, Number\nAGP 7, 2\n");
    let mut terminal = Terminal::start(&["load", &link, &stage, "--run", "--verify", "--watch"]);
    terminal.expect("loaded to addresses 0 to 2");
    terminal.expect("running from address 0");
    terminal.expect(&format!("waiting for {stage} to be saved; Ctrl-C ends"));
    sim.tcp().until("GGP 7, 2", 1);

    // The file that it includes is a part of it.
    std::fs::write(&include, "Number = 22\n").unwrap();
    terminal.expect("number.inc has changed");
    terminal.expect("Ctrl-C ends");
    sim.tcp().until("GGP 7, 2", 22);

    // A mistake is shown, and the module keeps what it has.
    source(&sim, "#include number.inc\nLoop: CALC LAOD, Number\nJA Loop\n");
    terminal.expect("error: 'LAOD' is none of");
    terminal.expect("not loaded; the module keeps the program that it has");
    terminal.expect("Ctrl-C ends");
    let output = run(&["send", &link, "134, 0, 0, 0"]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "134, 0, 0, 0: CALC LOAD, 22\n");

    // An editor that puts a new file in the place of the old one; and the file that is missing comes.
    let new = sim.path("new.tmc");
    std::fs::write(&new, "#include more.inc\nLoop: CALC LOAD, More\nAGP 7, 2\nJA Loop\n").unwrap();
    std::fs::rename(&new, &stage).unwrap();
    terminal.expect("cannot read");
    terminal.expect("Ctrl-C ends");
    std::fs::write(sim.path("more.inc"), "More = 333\n").unwrap();
    terminal.expect("more.inc has changed");
    terminal.expect("running from address 0");
    terminal.expect("Ctrl-C ends");
    sim.tcp().until("GGP 7, 2", 333);

    terminal.keys("\x03");
    let (status, _) = terminal.end();
    assert_eq!(status.code(), Some(130));
    assert!(terminal.is_as_before());
    assert_eq!(sim.tcp().ok("GGP 128, 0"), 1, "the program goes on");
}

/// Half a program is none: what has been begun is made a STOP.
#[test]
fn a_download_that_is_interrupted_leaves_nothing_to_run() {
    let sim = Sim::start(&["--rs485", "{}/bus", "--tcp", "127.0.0.1:0"]);
    let long = source(&sim, &"MVP REL, 0, 5\n".repeat(500));
    for (at, told) in [("0", "the module has no program now"), ("50", "at address 50 the module has no program now")] {
        // A module on a busy computer may answer late.
        let patient = ["--timeout", "60000"];
        let arguments = [&["load", sim.told("rs485"), &long, "--run", "--at", at], &patient[..]].concat();
        let mut terminal = Terminal::start_with(&arguments, 40);
        terminal.expect("loading the program [");
        terminal.expect("1 %");
        terminal.keys("\x03");
        let (status, said) = terminal.end();
        assert_eq!(status.code(), Some(130));
        assert!(said.contains(&format!("tmcl: interrupted; {told}")), "{said}");
        assert!(terminal.is_as_before());
        let output = run(&["send", &format!("tcp:{}", sim.told("tcp")), &format!("134, 0, 0, {at}"), "GGP 128, 0"]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.starts_with(&format!("134, 0, 0, {at}: STOP\nGGP 128, 0: ")), "{said}");
    }
}

/// A user who watches learns that the module is gone, and does not wait for ever.
#[test]
fn a_module_that_vanishes_ends_the_watch() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let folder = tempfile::tempdir().unwrap();
    let stage = folder.path().join("stage.tmc");
    std::fs::write(&stage, "MST 0\n").unwrap();
    let mut terminal =
        Terminal::start(&["load", &format!("tcp:{}", sim.told("tcp")), stage.to_str().unwrap(), "--watch"]);
    terminal.expect("Ctrl-C ends");
    drop(sim);
    std::fs::write(&stage, "MST 0\nMST 0\n").unwrap();
    let (status, said) = terminal.end();
    assert_eq!(status.code(), Some(1));
    assert!(said.contains("the other side has closed the connection"), "{said}");
}

#[test]
fn what_cannot_be_saved_again_is_not_watched() {
    let output = type_into(&["load", "sim", "-", "--watch"], "STOP\n");
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).starts_with("tmcl: --watch: standard input cannot"), "{}", complaint(&output));
}

#[test]
fn protected_programs() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let file = file(&sim, &MOVES);
    assert!(run(&["load", &link, &file]).status.success());
    // Against being read: it can be replaced, not compared; it is debugged on trust.
    sim.tcp().ok("SGP 81, 0, 1");
    let output = run(&["load", &link, &file, "--verify", "--run"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("the program cannot be compared: it is protected"), "{}", complaint(&output));
    // What has not been compared does not run.
    assert_eq!((sim.tcp().ok("GGP 128, 0"), sim.tcp().ok("GAP 1, 0")), (0, 0));
    let output = type_into(&["debug", &link, &file, "--attach"], "step\n");
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(bare(&said)[1], ">     1  MVP ABS, 0, 2000");
    // Against being overwritten.
    sim.tcp().ok("SGP 81, 0, 2");
    let output = run(&["load", &link, &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("program memory is protected"), "{}", complaint(&output));
}

/// Status 5 has two reasons, and only one of them goes away by what takes a protection off.
#[test]
fn an_eeprom_that_does_not_answer_is_told_from_a_protection() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let file = file(&sim, &MOVES);
    assert!(run(&["load", &link, &file]).status.success());
    sim.control(&["fault eeprom on"]);
    let output = run(&["load", &link, &file]);
    assert_eq!(output.status.code(), Some(1));
    let told = "tmcl: the module's EEPROM does not answer, so nothing can be stored; the program is not protected";
    assert!(complaint(&output).starts_with(told), "{}", complaint(&output));
    assert!(!complaint(&output).contains("SGP 81"), "{}", complaint(&output));
    sim.control(&["fault eeprom off"]);
    sim.tcp().ok("SGP 81, 0, 2");
    let output = run(&["load", &link, &file]);
    assert!(complaint(&output).contains("\"SGP 81, 0, 0\" lifts the protection"), "{}", complaint(&output));
}

/// The output of the debugger without the commands that it shows around the one where it is.
fn bare(said: &str) -> Vec<&str> {
    said.lines().filter(|line| !line.starts_with("   ")).collect()
}

#[test]
fn a_program_is_debugged() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let commands = "step\nregisters\nbreak 4\ncontinue\nsend \"GAP 1, 0\"\ncontinue\n";
    let output = type_into(&["debug", &link, &file(&sim, &MOVES)], commands);
    assert!(output.status.success(), "{}", complaint(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    let told = bare(&said);
    assert_eq!(told[..2], [">     0  CALC LOAD, 5", ">     1  MVP ABS, 0, 2000"]);
    assert!(told[2].ends_with("program counter 1, accumulator 5, X 0"), "{said}");
    let expected = [
        " *    4  MVP ABS, 0, -500",
        "breakpoint",
        ">*    4  MVP ABS, 0, -500",
        "GAP 1, 0: 2000 microsteps (actual position), status 100 ok",
        "the program has ended; the next step begins it again",
    ];
    assert_eq!(told[3..8], expected, "{said}");
    assert!(said.contains("the program is stopped at address"), "{said}");
}

/// A handler that is called in a WAIT. The period is long, so that stepping through it is faster on any computer.
const TICKS: &str = "\
#include Interrupts.inc
Ticks = 7                       // user variable

        SGP TI_TIMER0, 3, 1000
        VECT TI_TIMER0, Tick
        EI TI_TIMER0
        EI TI_GLOBAL
Loop:   WAIT TICKS, 0, 140
Done:   JA Loop
Tick:   GGP Ticks, 2
        CALC ADD, 1
        AGP Ticks, 2
        RETI
";

/// Through a handler, back into the WAIT, over its rest, and on freely.
#[test]
fn a_source_is_debugged_by_its_labels() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--serial", "{}/usb", "--slcan", "{}/can"]);
    let source = source(&sim, TICKS);
    let commands = "break tick\ncontinue\nregisters\nstep 4\ndelete\nbreak Done\ncontinue\ndelete Done\n\
                    list Done\ncontinue\nregisters\nstop\nbreak Tick\nregisters\n";
    let begin = "\
>     0  SGP 0, 3, 1000                    4  SGP TI_TIMER0, 3, 1000
      1  VECT 0, 6                         5  VECT TI_TIMER0, Tick
      2  EI 0                              6  EI TI_TIMER0
Tick:
 *    6  GGP 7, 2                         10  Tick:   GGP Ticks, 2
breakpoint
Loop:
      4  WAIT TICKS, 0, 140                8  Loop:   WAIT TICKS, 0, 140
Done:
      5  JA 4                              9  Done:   JA Loop
Tick:
>*    6  GGP 7, 2                         10  Tick:   GGP Ticks, 2
      7  CALC ADD, 1                      11  CALC ADD, 1
      8  AGP 7, 2                         12  AGP Ticks, 2
step by step, program counter 6, accumulator 0, X 0
      2  EI 0                              6  EI TI_TIMER0
      3  EI 255                            7  EI TI_GLOBAL
Loop:
>     4  WAIT TICKS, 0, 140                8  Loop:   WAIT TICKS, 0, 140
Done:
      5  JA 4                              9  Done:   JA Loop
Tick:
 *    6  GGP 7, 2                         10  Tick:   GGP Ticks, 2
no breakpoints
Done:
 *    5  JA 4                              9  Done:   JA Loop
breakpoint
      3  EI 255                            7  EI TI_GLOBAL
Loop:
      4  WAIT TICKS, 0, 140                8  Loop:   WAIT TICKS, 0, 140
Done:
>*    5  JA 4                              9  Done:   JA Loop
Tick:
      6  GGP 7, 2                         10  Tick:   GGP Ticks, 2
      7  CALC ADD, 1                      11  CALC ADD, 1
no breakpoints
Done:
>     5  JA 4                              9  Done:   JA Loop
Tick:
      6  GGP 7, 2                         10  Tick:   GGP Ticks, 2
      7  CALC ADD, 1                      11  CALC ADD, 1
      8  AGP 7, 2                         12  AGP Ticks, 2
      9  RETI                             13  RETI
     10  STOP
running; stop halts it
running";
    let adapter = format!("slcan:{}", sim.told("slcan"));
    for link in [&format!("tcp:{}", sim.told("tcp")), sim.told("serial"), &adapter] {
        let output = type_into(&["debug", link, &source], commands);
        assert!(output.status.success(), "{link}: {}", complaint(&output));
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.starts_with(begin), "{link}: {said}");
        assert!(said.contains("\nstopped, program counter "), "{link}: {said}");
        assert!(said.contains("\nthe program is stopped at address "), "{link}: {said}");
    }
}

/// A program that runs freely is halted, and the debugger says where it is.
#[test]
fn a_loop_is_halted() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let output = type_into(&["debug", &link, &file(&sim, &["JA 0"])], "continue\nregisters\nstop\nquit\n");
    assert!(output.status.success(), "{}", complaint(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    let told: Vec<&str> = said.lines().collect();
    assert!(told[2].starts_with("running, program counter 0"), "{said}");
    assert_eq!(told[3..], [">     0  JA 0", "the program is stopped at address 0"]);
    assert_eq!(sim.tcp().ok("GGP 128, 0"), 0);
}

#[test]
fn a_program_of_several_axes_is_debugged() {
    let sim = Sim::start(&["--product", "6110", "--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let lines = "#include TMCLParam.tmc\nMVP ABS, Motor5, 2000\nWAIT POS, Motor5, 0\nROR Motor1, 5\nDone: STOP\n";
    let output = type_into(&["debug", &link, &source(&sim, lines)], "b Done\nc\nregisters\nsend MST 1\naxes\n");
    assert!(output.status.success(), "{}", complaint(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    let told: Vec<&str> = said.lines().skip_while(|line| !line.starts_with("step by step")).collect();
    assert!(told[1].starts_with("positions 0, ") && told[1].ends_with(", 0, 0, 0, 2000"), "{said}");
    assert_eq!(told[3], "axis 0: position 0, speed 0 int");
    assert!(told[4].starts_with("axis 1: position "), "{said}");
    assert_eq!(told[8], "axis 5: position 2000, speed 0 int");
}
