//! `tmcl send`: the same over every link.

use std::os::unix::fs::symlink;

use super::harness::{Sim, complaint, run};

const LINES: [&str; 7] =
    ["136, 0", "136, 1", "GAP 4, 0", "SAP 4, 0, 1500", "STAP 4, 0", "GIO 8, 1", "MVP ABS, 0, -500"];
const REPLIES: [&str; 7] = [
    "136, 0, 0, 0: 1140V142",
    "136, 1, 0, 0: TMCM-1140, firmware version 1.42, status 100 ok",
    "GAP 4, 0: 1000 int (maximum positioning speed), status 100 ok",
    "SAP 4, 0, 1500: 1500 int (maximum positioning speed), status 100 ok",
    "STAP 4, 0: maximum positioning speed, status 100 ok",
    "GIO 8, 1: 24.0 V (supply), status 100 ok",
    "MVP ABS, 0, -500: -500 microsteps (target), status 100 ok",
];

#[test]
fn replies_are_the_same_over_every_link() {
    let tcp = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let serial = Sim::start(&["--serial", "{}/port"]);
    let can = Sim::start(&["--slcan", "{}/can"]);
    let can_tcp = Sim::start(&["--slcan-tcp", "127.0.0.1:0"]);
    let adapters = [format!("slcan:{}", can.told("slcan")), format!("slcan:tcp:{}", can_tcp.told("slcan-tcp"))];
    let [adapter, adapter_tcp] = &adapters;
    for link in ["sim", &format!("tcp:{}", tcp.told("tcp")), serial.told("serial"), adapter, adapter_tcp] {
        let output = run(&[&["send", link], &LINES[..]].concat());
        assert!(output.status.success(), "{link}: {}", complaint(&output));
        let lines: Vec<String> = String::from_utf8(output.stdout).unwrap().lines().map(String::from).collect();
        assert_eq!(lines, REPLIES, "{link}");
    }
}

/// Three modules on the CAN bus and on the RS485 bus: each keeps its own settings, and each has an EEPROM file and
/// a place on the control port of its own.
#[test]
fn three_modules_on_two_buses() {
    let arguments =
        ["--modules", "3", "--slcan", "{}/can", "--rs485", "{}/bus", "--control", "127.0.0.1:0", "--eeprom"];
    let sim = Sim::start(&[&arguments[..], &["{}/eeprom"]].concat());
    let (can, bus) = (format!("slcan:{}", sim.told("slcan")), sim.told("rs485").to_string());
    for module in ["1", "2", "3"] {
        let line = format!("SAP 4, 0, 100{module}");
        assert!(run(&["send", &can, "--address", module, &line, "STAP 4, 0"]).status.success(), "module {module}");
    }
    for module in ["3", "1", "2"] {
        let output = run(&["send", &bus, "--address", module, "GAP 4, 0", "GGP 66, 0"]);
        let lines = String::from_utf8(output.stdout).unwrap();
        assert!(lines.contains(&format!("GAP 4, 0: 100{module} int")), "module {module}: {lines}");
        assert!(lines.contains(&format!("GGP 66, 0: {module} ")), "module {module}: {lines}");
    }
    let pressed = sim.control(&["module 2 press left", "module 2 state"]);
    assert_eq!(pressed["switches"]["left"], true);
    assert_eq!(sim.control(&["module 3 state"])["switches"]["left"], false);
    assert_eq!(sim.control(&["module 4 state"])["ok"], false);
    let files = ["eeprom", "eeprom.2", "eeprom.3"].map(|name| std::fs::read(sim.path(name)).unwrap());
    assert!(files[0] != files[1] && files[1] != files[2] && files.iter().all(|file| file.len() == 16_384));
}

#[test]
fn a_refusal_ends_with_1_after_all_is_sent() {
    let output = run(&["send", "sim", "SAP 4, 0, 5000", "GAP 300, 0"]);
    assert_eq!(output.status.code(), Some(2), "300 does not fit");
    let output = run(&["send", "sim", "SAP 4, 0, 5000", "GAP 250, 0", "GAP 4, 0"]);
    assert_eq!(output.status.code(), Some(1));
    let lines = String::from_utf8(output.stdout).unwrap();
    let expected = "SAP 4, 0, 5000: status 4 value, motor or bank out of range\n\
                    GAP 250, 0: status 3 unknown type, or read-only\n\
                    GAP 4, 0: 1000 int (maximum positioning speed), status 100 ok\n";
    assert_eq!(lines, expected);
    assert!(output.stderr.is_empty());
}

#[test]
fn silence_is_told_unless_it_is_the_answer() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let output = run(&["send", &link, "--timeout", "200", "137, 0, 0, 1234"]);
    assert!(output.status.success(), "{}", complaint(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("no reply, as it should be"));
    sim.control(&["power off"]);
    let output = run(&["send", &link, "--timeout", "200", "GAP 1, 0"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("GAP 1, 0: no reply"), "{}", complaint(&output));
}

#[test]
fn a_serial_device_may_have_any_baud_rate_and_name() {
    let sim = Sim::start(&["--serial", "{}/port"]);
    let alias = sim.path("alias");
    symlink(sim.told("serial"), &alias).unwrap();
    for baud in ["9600", "76800", "115200"] {
        let output = run(&["send", alias.to_str().unwrap(), "--baud", baud, "--address", "9", "GAP 4, 0"]);
        assert!(output.status.success(), "{baud}: {}", complaint(&output));
    }
}
