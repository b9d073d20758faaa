//! Serial ports have one owner and one user at a time.

use std::fs::OpenOptions;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::symlink;
use std::time::Instant;

use rustix::process::Signal;

use super::harness::{PATIENCE, Sim, complaint, run, tmcl};

const SERIAL: [&str; 2] = ["--serial", "{}/port"];

#[test]
fn the_path_of_a_running_simulator_is_its_own() {
    let sim = Sim::start(&[&SERIAL[..], &["--rs485", "{}/bus"]].concat());
    let folder = sim.folder.path().to_str().unwrap();
    symlink(folder, sim.path("another way")).unwrap();
    for option in ["--serial", "--rs485", "--slcan"] {
        for name in ["port", "bus", "another way/port", "./bus"] {
            let output = run(&["sim", "--exit-with-stdin", option, &format!("{folder}/{name}")]);
            assert_eq!(output.status.code(), Some(1), "{option} {name}");
            let complaint = complaint(&output);
            assert!(complaint.contains(option) && complaint.contains("is the port of a simulator that runs"));
        }
    }
    // Nor can one simulator have two ports at a path.
    let two = format!("{folder}/two");
    let output = run(&["sim", "--exit-with-stdin", "--serial", &two, "--rs485", &two]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("--rs485"), "{}", complaint(&output));
    assert!(!sim.path("two").is_symlink());
    assert_eq!(sim.serial().ok("GAP 4, 0"), 1000);
}

/// The numbers of terminals are used again: what a link of one that is gone leads to may be another simulator's.
#[test]
fn a_stale_link_to_the_terminal_of_another_simulator_is_replaced() {
    let other = Sim::start(&SERIAL);
    let folder = tempfile::tempdir().unwrap();
    symlink(std::fs::read_link(other.path("port")).unwrap(), folder.path().join("port")).unwrap();
    let sim = Sim::start_in(folder, &SERIAL);
    sim.serial().ok("SAP 4, 0, 1234");
    assert_eq!((sim.serial().ok("GAP 4, 0"), other.serial().ok("GAP 4, 0")), (1234, 1000));
    let port = other.path("port");
    let _folder = other.end(Signal::TERM);
    assert!(!port.is_symlink() && sim.path("port").is_symlink());
}

#[test]
fn a_serial_port_has_one_tool_at_a_time() {
    let sim = Sim::start(&[&SERIAL[..], &["--slcan", "{}/can"]].concat());
    let port = sim.told("serial");
    let program = sim.path("program.tmc");
    std::fs::write(&program, "STOP\n").unwrap();
    let program = program.to_str().unwrap();
    let tools: [&[&str]; 7] = [
        &["send", port, "GAP 4, 0"],
        &["load", port, program],
        &["debug", port, program],
        &["params", port, "save", program],
        &["monitor", port, "--count", "1"],
        &["scan", port],
        &["send", &format!("slcan:{port}"), "GAP 4, 0"],
    ];
    let mut monitor = tmcl(&["monitor", port, "--csv"]).spawn().unwrap();
    let mut lines = BufReader::new(monitor.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("time_s,"));
    for tool in tools {
        let output = run(tool);
        assert_eq!(output.status.code(), Some(1), "{tool:?}");
        assert!(complaint(&output).contains("another program uses this port"), "{tool:?}: {}", complaint(&output));
    }
    // The one who was first goes on undisturbed.
    assert!(lines.nth(1).unwrap().unwrap().ends_with(",0,0,0,128,0,0,0,0"));
    monitor.kill().unwrap();
    monitor.wait().unwrap();
    for _ in 0..2 {
        assert!(run(&["send", port, "GAP 4, 0"]).status.success());
    }
    assert!(run(&["send", &format!("slcan:{}", sim.told("slcan")), "GAP 4, 0"]).status.success());
}

/// As pySerial does with `exclusive`.
#[test]
fn the_port_of_the_simulator_can_be_locked_by_its_user() {
    let sim = Sim::start(&SERIAL);
    let port = sim.told("serial");
    for _ in 0..2 {
        let host = OpenOptions::new().read(true).write(true).open(port).unwrap();
        host.try_lock().unwrap();
        let output = run(&["send", port, "GAP 4, 0"]);
        assert!(complaint(&output).contains("another program uses this port"), "{}", complaint(&output));
        drop(host);
        // A process that a test beside this one has just begun holds the lock until it is the program that it is to be.
        let end = Instant::now() + PATIENCE;
        while !run(&["send", port, "GAP 4, 0"]).status.success() {
            assert!(Instant::now() < end, "the lock stays");
        }
    }
}
