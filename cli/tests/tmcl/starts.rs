//! How programs start `tmcl sim`, a hundred times in a row, and what is left when it has ended.

use std::io::{BufRead, BufReader};
use std::net::{SocketAddr, TcpListener};
use std::process::{Child, Stdio};

use rustix::process::{Pid, Signal, test_kill_process};
use serde_json::Value;

use super::harness::{names, tmcl};

/// Starts a simulator with `--ready-json` and gives what it tells.
fn start(arguments: &[&str]) -> (Child, Value) {
    let mut child = tmcl(&["sim", "--ready-json"]).args(arguments).stderr(Stdio::inherit()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let told = serde_json::from_str(&line).unwrap_or_else(|error| panic!("{line}: {error}"));
    (child, told)
}

#[test]
fn one_line_of_json_tells_what_it_is_and_where() {
    let folder = tempfile::tempdir().unwrap();
    let port = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (usb, bus) = (port("usb"), port("bus"));
    let any = "127.0.0.1:0";
    let arguments = ["--product", "3110,1140", "--serial", &usb, "--rs485", &bus, "--tcp", any, "--control", any];
    let (mut child, told) = start(&[&arguments[..], &["--paused"]].concat());
    assert_eq!((&told["product"], &told["products"][1]), (&"TMCM-3110".into(), &"TMCM-1140".into()));
    assert_eq!((&told["firmware"], &told["time"], &told["image"]), (&"tmcl".into(), &"paused".into(), &Value::Null));
    assert_eq!((&told["serial"], &told["rs485"], &told["slcan"]), (&usb.into(), &bus.into(), &Value::Null));
    assert_eq!((&told["pid"], &told["version"]), (&child.id().into(), &env!("CARGO_PKG_VERSION").into()));
    for port in ["tcp", "control"] {
        let address: SocketAddr = told[port].as_str().unwrap().parse().unwrap();
        std::net::TcpStream::connect(address).unwrap();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let (mut child, told) = start(&["--firmware", "canopen", "--slcan-tcp", "127.0.0.1:0"]);
    assert_eq!((&told["firmware"], &told["time"], &told["tcp"]), (&"canopen".into(), &"running".into(), &Value::Null));
    child.kill().unwrap();
    child.wait().unwrap();
}

/// A user whose ports listen on more than this computer's own addresses is told so, and which address it is.
#[test]
fn ports_for_other_computers_are_warned_of() {
    for (arguments, open) in [
        (&["--tcp", "0.0.0.0:0"][..], &["tcp"][..]),
        (&["--firmware", "canopen", "--slcan-tcp", "0.0.0.0:0"], &["slcan_tcp"]),
        (&["--tcp", "127.0.0.1:0", "--control", "0.0.0.0:0"], &["control"]),
        (
            &["--tcp", "0.0.0.0:0", "--slcan-tcp", "0.0.0.0:0", "--control", "0.0.0.0:0"],
            &["tcp", "slcan_tcp", "control"],
        ),
        (&["--tcp", "127.0.0.1:0", "--slcan-tcp", "127.0.0.2:0", "--control", "localhost:0"], &[]),
    ] {
        let mut command = tmcl(&["sim", "--ready-json", "--exit-with-stdin"]);
        let output = command.args(arguments).output().unwrap();
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        let warned = String::from_utf8(output.stderr).unwrap();
        let lines: Vec<&str> = warned.lines().collect();
        assert_eq!(lines.len(), if open.is_empty() { 0 } else { 2 }, "{warned}");
        for port in ["tcp", "slcan_tcp", "control"] {
            let option = format!("--{} {}", port.replace('_', "-"), told[port].as_str().unwrap_or("none"));
            let is_open = open.contains(&port);
            assert_eq!(lines.first().is_some_and(|line| line.contains(&option)), is_open, "{option}: {warned}");
            assert_eq!(option.contains("0.0.0.0:"), is_open, "{option}");
        }
        assert!(lines.iter().all(|line| line.starts_with("tmcl sim: ")), "{warned}");
        assert!(
            open.is_empty() || lines[0].contains("without a password") && lines[1].contains("127.0.0.1"),
            "{warned}"
        );
    }
}

#[test]
fn a_hundred_starts_and_ends_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [usb, bus, can, eeprom] = ["usb", "bus", "can", "eeprom"].map(path);
    let links = ["--serial", &usb, "--rs485", &bus, "--slcan", &can, "--eeprom", &eeprom, "--exit-with-stdin"];
    // The ports of the first are those of all: one that was left open could not be had again.
    let mut ports: Vec<String> = vec!["127.0.0.1:0".into(); 3];
    for round in 0..100 {
        let options = ["--tcp", &ports[0], "--slcan-tcp", &ports[1], "--control", &ports[2]];
        let time = if round % 2 == 0 { "--paused" } else { "--speed=2" };
        let mut command = tmcl(&["sim", "--ready-json", time]);
        let mut child = command.args(links).args(options).stdin(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let told: Value = serde_json::from_str(&line).unwrap_or_else(|error| panic!("round {round}: {line}: {error}"));
        ports = ["tcp", "slcan_tcp", "control"].map(|port| told[port].as_str().unwrap().to_owned()).to_vec();
        let pid = Pid::from_child(&child);
        // Somebody is connected when it ends.
        let _host = std::net::TcpStream::connect(&ports[2]).unwrap();
        match round % 3 {
            0 => drop(child.stdin.take()),
            1 => rustix::process::kill_process(pid, Signal::TERM).unwrap(),
            _ => rustix::process::kill_process(pid, Signal::INT).unwrap(),
        }
        let output = child.wait_with_output().unwrap();
        assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""), "{round}");
        assert!(test_kill_process(pid).is_err(), "round {round}: the process goes on");
        assert_eq!(names(folder.path()), ["eeprom"], "round {round}");
    }
    assert!(ports.iter().all(|port| TcpListener::bind(port).is_ok()));
    // No process has any of this open: each would be one of its own, and they name the folder.
    let folder = folder.path().to_str().unwrap();
    let left = std::fs::read_dir("/proc").into_iter().flatten().flatten().filter(|entry| {
        let command = std::fs::read(entry.path().join("cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&command).contains(folder)
    });
    assert_eq!(left.count(), 0);
}
