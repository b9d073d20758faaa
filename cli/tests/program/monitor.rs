//! `tmcl monitor`: live values.

use std::io::{BufRead, BufReader};

use rustix::process::{Pid, Signal};

use super::harness::{Sim, complaint, run, tmcl};

#[test]
fn samples_are_lines_of_numbers() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    sim.control(&["press left"]);
    sim.tcp().ok("MVP ABS, 0, 100");
    sim.tcp().until("GAP 8, 0", 1);
    sim.tcp().until("GAP 208, 0", 128);
    let output = run(&["monitor", &link, "--csv", "--interval", "1", "--count", "3"]);
    assert!(output.status.success(), "{}", complaint(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let mut lines = text.lines();
    let headline = "time_s,position,speed,load,driver_flags,extended_flags,left_switch,right_switch,home_switch";
    assert_eq!(lines.next(), Some(headline));
    let values: Vec<&str> = lines.map(|line| line.split_once(',').unwrap().1).collect();
    assert_eq!(values, ["100,0,0,128,0,1,0,0"; 3]);
    let output = run(&["monitor", &link, "--count", "1"]);
    let line = String::from_utf8(output.stdout).unwrap();
    assert_eq!(line, "position         100  speed     0  load    0  switches left  driver STST  errors -\n");
}

#[test]
fn an_interrupt_ends_it_well() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let mut monitor = tmcl(&["monitor", &link, "--csv"]).spawn().unwrap();
    let mut lines = BufReader::new(monitor.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("time_s,"));
    assert!(lines.next().unwrap().unwrap().ends_with(",0,0,0,128,0,0,0,0"));
    rustix::process::kill_process(Pid::from_child(&monitor), Signal::INT).unwrap();
    assert_eq!(monitor.wait().unwrap().code(), Some(0));
}

#[test]
fn an_axis_that_is_not_there_is_told() {
    let output = run(&["monitor", "sim", "--axis", "1"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("GAP 1, 1: status 4"), "{}", complaint(&output));
}
