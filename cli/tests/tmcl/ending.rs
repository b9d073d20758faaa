//! How `tmcl sim` ends, and what it leaves behind.

use std::io::Write;
use std::process::Stdio;

use rustix::process::Signal;

use super::harness::{Sim, command, run, tmcl, tmcl_path};

#[test]
fn every_signal_that_ends_it_removes_its_links() {
    for signal in [Signal::HUP, Signal::INT, Signal::TERM] {
        let sim = Sim::start(&["--serial", "{}/port", "--rs485", "{}/bus", "--slcan", "{}/can"]);
        let links = ["port", "bus", "can"].map(|name| sim.path(name));
        assert!(links.iter().all(|link| link.is_symlink()));
        let (status, _folder) = sim.end(signal);
        assert_eq!(status.code(), Some(0), "{signal:?}");
        assert!(!links.iter().any(|link| link.is_symlink()), "{signal:?}");
    }
}

/// As `nohup` starts it.
#[test]
fn it_outlives_its_terminal_if_that_is_wanted() {
    let mut command = command("sh");
    command.args(["-c", "trap '' HUP; exec \"$@\"", "sh", tmcl_path(), "sim", "--tcp", "127.0.0.1:0"]);
    let sim = Sim::start_as(tempfile::tempdir().unwrap(), command.stdin(Stdio::null()).stdout(Stdio::piped()));
    sim.signal(Signal::HUP);
    // The signal has come before the command.
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1000);
    assert_eq!(sim.end(Signal::TERM).0.code(), Some(0));
}

#[test]
fn it_ends_with_its_standard_input_if_that_is_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let port = folder.path().join("port");
    let arguments = ["sim", "--exit-with-stdin", "--serial", port.to_str().unwrap()];
    let mut sim = Sim::start_as(folder, tmcl(&arguments).stdin(Stdio::piped()));
    let mut stdin = sim.stdin();
    // More than is read at once, and no end.
    stdin.write_all(&[b'\n'; 10_000]).unwrap();
    for _ in 0..50 {
        assert_eq!(sim.serial().ok("GAP 4, 0"), 1000);
    }
    drop(stdin);
    let (status, _folder) = sim.wait();
    assert_eq!(status.code(), Some(0));
    assert!(!port.is_symlink());
    assert!(String::from_utf8_lossy(&run(&["sim", "--help"]).stdout).contains("--exit-with-stdin"));
}
