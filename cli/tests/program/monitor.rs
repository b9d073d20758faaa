//! `tmcl monitor`: live values.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use rustix::fs::{Mode, OFlags};
use rustix::process::{Pid, Signal};
use rustix::pty::OpenptFlags;
use rustix::termios::Winsize;

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
    assert_eq!(line, "position         100  speed     0 int  load    0  switches left  driver STST  errors -\n");
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
    assert_eq!(monitor.wait().unwrap().code(), Some(130));
}

#[test]
fn an_axis_that_is_not_there_is_told() {
    let output = run(&["monitor", "sim", "--axis", "1"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("GAP 1, 1: status 4"), "{}", complaint(&output));
}

#[test]
fn several_axes_are_shown_side_by_side() {
    let sim = Sim::start(&["--product", "3110", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    sim.control(&["press home 2"]);
    for (axis, line) in [(0, "MVP ABS, 0, 100"), (2, "MVP ABS, 2, -300")] {
        sim.tcp().ok(line);
        sim.tcp().until(&format!("GAP 8, {axis}"), 1);
        sim.tcp().until(&format!("GAP 208, {axis}"), 128);
    }
    let csv = |options: &[&str]| {
        let output = run(&[&["monitor", &link, "--csv", "--interval", "1", "--count", "1"], options].concat());
        assert!(output.status.success(), "{}", complaint(&output));
        let text = String::from_utf8(output.stdout).unwrap();
        let (head, values) = text.trim_end().split_once('\n').unwrap();
        (head.to_owned(), values.split_once(',').unwrap().1.to_owned())
    };
    let (head, values) = csv(&[]);
    assert!(head.starts_with("time_s,position_0,speed_0,load_0,") && head.ends_with(",home_switch_2"), "{head}");
    assert!(head.contains(",home_switch_0,position_1,"), "{head}");
    assert_eq!(values, "100,0,0,128,0,0,0,0,0,0,0,128,0,0,0,0,-300,0,0,128,0,0,0,1");
    let (head, values) = csv(&["--axis", "0,2"]);
    assert!(head.contains(",home_switch_0,position_2,"), "{head}");
    assert_eq!(values, "100,0,0,128,0,0,0,0,-300,0,0,128,0,0,0,1");
    // One axis has no number, whichever it is.
    let (head, values) = csv(&["--axis", "2"]);
    assert!(head.starts_with("time_s,position,speed,") && head.ends_with(",home_switch"), "{head}");
    assert_eq!(values, "-300,0,0,128,0,0,0,1");

    let output = run(&["monitor", &link, "--count", "1"]);
    let said = String::from_utf8(output.stdout).unwrap();
    let expected = "\
axis 0  position         100  speed     0 int  load    0  switches -  driver STST  errors -
axis 1  position           0  speed     0 int  load    0  switches -  driver STST  errors -
axis 2  position        -300  speed     0 int  load    0  switches home  driver STST  errors -
";
    assert_eq!(said, expected);
    let output = run(&["monitor", &link, "--axis", "0,3"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("GAP 1, 3: status 4"), "{}", complaint(&output));
}

/// Six axes in one line of a terminal, however wide that is.
#[test]
fn a_terminal_has_one_line_for_all_axes() {
    for (columns, shown) in
        [(200, "0           0     0 ----  1           0"), (80, "0:         0 1:         0"), (20, "0:         0 ...")]
    {
        let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        rustix::pty::grantpt(&master).unwrap();
        rustix::pty::unlockpt(&master).unwrap();
        let path = rustix::pty::ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
        let slave = rustix::fs::open(path.as_str(), OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).unwrap();
        let size = Winsize { ws_row: 24, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
        rustix::termios::tcsetwinsize(&slave, size).unwrap();
        let mut command = tmcl(&["monitor", "sim", "--product", "6110", "--count", "1"]);
        let status = command.stdout(Stdio::from(slave)).status().unwrap();
        drop(command);
        assert!(status.success());
        let mut bytes = [0; 1000];
        let count = rustix::io::read(&master, &mut bytes).unwrap();
        let text = String::from_utf8(bytes[..count].to_vec()).unwrap();
        let line = text.strip_prefix('\r').unwrap().split('\x1b').next().unwrap();
        assert!(line.starts_with(shown), "{columns}: {line:?}");
        assert!(line.len() < usize::from(columns), "{columns}: {line:?}");
    }
}
