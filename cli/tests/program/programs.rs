//! `tmcl load` and `tmcl debug` with virtual modules, whose firmware runs the programs.

use super::fake::program;
use super::harness::{Sim, complaint, run, type_into};

/// Two moves with a pause in between, and the end.
const MOVES: [&str; 6] =
    ["CALC LOAD, 5", "MVP ABS, 0, 2000", "WAIT POS, 0, 0", "WAIT TICKS, 0, 5", "MVP ABS, 0, -500", "STOP"];

/// The program in a file of the module's folder.
fn file(sim: &Sim, lines: &[&str]) -> String {
    let path = sim.path("program.bin");
    std::fs::write(&path, program(lines)).unwrap();
    path.to_str().unwrap().into()
}

/// Every link carries a program to the module and back.
#[test]
fn programs_are_loaded_over_every_link() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--serial", "{}/usb", "--rs485", "{}/bus", "--slcan", "{}/can"]);
    let file = file(&sim, &MOVES);
    let adapter = format!("slcan:{}", sim.told("slcan"));
    for link in [&format!("tcp:{}", sim.told("tcp")), sim.told("serial"), sim.told("rs485"), &adapter] {
        let output = run(&["load", link, &file, "--verify", "--run"]);
        assert!(output.status.success(), "{link}: {}", complaint(&output));
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.ends_with("the module has them as they are in the file\nrunning from address 0\n"), "{said}");
        let mut host = sim.tcp();
        host.until("GAP 1, 0", 2000);
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
    assert!(complaint(&output).contains("address 2048") && complaint(&output).contains("does not fit"));
}

#[test]
fn a_program_starts_by_itself() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let output = run(&["load", &link, &file(&sim, &MOVES), "--autostart"]);
    assert!(output.status.success(), "{}", complaint(&output));
    assert_eq!(sim.tcp().ok("GAP 1, 0"), 0);
    sim.control(&["power off", "power on"]);
    sim.tcp().until("GAP 1, 0", -500);
}

#[test]
fn protected_programs() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let file = file(&sim, &MOVES);
    assert!(run(&["load", &link, &file]).status.success());
    sim.tcp().ok("SGP 81, 0, 2");
    let output = run(&["load", &link, &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("program memory is protected"), "{}", complaint(&output));
}

#[test]
fn a_program_is_debugged() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let commands = "step\nregisters\nbreak 4\ncontinue\nsend \"GAP 1, 0\"\ncontinue\n";
    let output = type_into(&["debug", &link, &file(&sim, &MOVES)], commands);
    assert!(output.status.success(), "{}", complaint(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    let told: Vec<&str> = said.lines().collect();
    assert_eq!(told[..2], [">     0  CALC LOAD, 5", ">     1  MVP ABS, 0, 2000"]);
    assert!(told[2].ends_with("program counter 1, accumulator 5, X 0"), "{said}");
    let expected = [
        " *    4  MVP ABS, 0, -500",
        "breakpoint",
        ">*    4  MVP ABS, 0, -500",
        "GAP 1, 0: 2000 microsteps (actual position), status 100 ok",
        "the program has ended; reset takes it to its start",
    ];
    assert_eq!(told[3..8], expected, "{said}");
    assert!(said.contains("the program is stopped at address"), "{said}");
}

/// What runs freely is halted, and says where it is.
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
