//! `tmcl scan`: who is there.

use std::fmt::Debug;
use std::fs::File;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::os::fd::OwnedFd;
use std::thread;
use std::time::Duration;

use rustix::fs::{Mode, OFlags};
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;
use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Reply, Status};

use super::harness::{Sim, complaint, run};

const VERSION: &str = "TMCM-1140, firmware version 1.42 (1140V142)";

/// Scans until what the lines say is this. A module that answers later than is waited for is missed, and a busy
/// computer makes any module late, so each time it is waited longer. Who is not there is waited for as well: hence not
/// at once for long.
fn assert_says<T: PartialEq + Debug>(arguments: &[&str], read: impl Fn(&str) -> T, expected: &[T]) {
    let mut found = Vec::new();
    for timeout in ["100", "1000", "8000"] {
        let output = run(&[&["scan"], arguments, &["--timeout", timeout]].concat());
        found = String::from_utf8(output.stdout).unwrap().lines().map(&read).collect();
        if found == expected {
            return;
        }
        // Missed is not mistaken.
        assert!(found.iter().all(|line| expected.contains(line)), "{arguments:?}: {found:?}");
    }
    assert_eq!(found, expected, "{arguments:?}");
}

fn assert_found(arguments: &[&str], expected: &[String]) {
    assert_says(arguments, str::to_owned, expected);
}

#[test]
fn every_module_of_a_bus_is_found_once() {
    let sim = Sim::start(&["--modules", "3", "--rs485", "{}/bus", "--slcan", "{}/can"]);
    // The second address of module 2 is another way to it.
    let bus = sim.told("rs485");
    assert!(run(&["send", bus, "--address", "2", "SGP 87, 0, 5"]).status.success());
    let mut expected: Vec<String> = (1..=3).map(|n| format!("address {n} at 9600 baud: {VERSION}")).collect();
    expected.push(format!("address 5 at 9600 baud: {VERSION}, the secondary address of module 2"));
    assert_found(&[bus, "--addresses", "1-5"], &expected);
    assert_found(&[bus, "--addresses", "3", "--baud", "115200"], &[expected[2].replace("9600", "115200")]);
    let can = format!("slcan:{}", sim.told("slcan"));
    let expected: Vec<String> = (1..=3).map(|n| format!("identifier {n}: {VERSION}")).collect();
    assert_found(&[&can, "--addresses", "1-4"], &expected);
    // Identifiers are wider than addresses.
    assert!(run(&["send", &can, "--address", "3", "SGP 71, 0, 1794"]).status.success());
    assert_found(&[&can, "--addresses", "1793-1794"], &[format!("identifier 1794: {VERSION}")]);
    let output = run(&["send", &can, "--address", "1794", "GGP 71, 0"]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "GGP 71, 0: 1794 (CAN ID), status 100 ok\n");
    let output = run(&["send", bus, "--address", "256", "GAP 1, 0"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("addresses go up to 255 on this link"), "{}", complaint(&output));
}

#[test]
fn a_module_alone_on_its_link_is_found_once() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--serial", "{}/port"]);
    sim.tcp().ok("SGP 66, 0, 7");
    let expected = [format!("one module, whatever the address: address 7: {VERSION}")];
    assert_found(&[&format!("tcp:{}", sim.told("tcp"))], &expected);
    assert_found(&[sim.told("serial")], &expected);
}

#[test]
fn nobody_there_is_a_failure() {
    let sim = Sim::start(&["--rs485", "{}/bus"]);
    let output = run(&["scan", sim.told("rs485"), "--addresses", "2-4", "--baud", "9600"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty());
    assert!(complaint(&output).contains("no module answers"), "{}", complaint(&output));
}

/// A module with address 1 on a serial port: it hears one bit rate only, and its replies take their time. It lives as
/// long as the terminal that is given with its path.
fn module(baud: u32, delay: Duration) -> (String, OwnedFd) {
    let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    rustix::pty::grantpt(&master).unwrap();
    rustix::pty::unlockpt(&master).unwrap();
    let path = rustix::pty::ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
    let slave = rustix::fs::open(path.as_str(), OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).unwrap();
    let mut settings = rustix::termios::tcgetattr(&slave).unwrap();
    settings.make_raw();
    rustix::termios::tcsetattr(&slave, OptionalActions::Now, &settings).unwrap();
    let mut port = File::from(master);
    thread::spawn(move || {
        let mut request = [0; TELEGRAM];
        while port.read_exact(&mut request).is_ok() {
            // What a host sets is the terminal's at both ends.
            let speed = rustix::termios::tcgetattr(&port).unwrap().output_speed();
            if speed == baud
                && request[0] == 1
                && let Some(command) = binary::decode_command(&request)
            {
                let reply = Reply::Plain { status: Status::Ok, opcode: command.opcode, value: 0x0474_012A };
                let mut port = port.try_clone().unwrap();
                thread::spawn(move || {
                    thread::sleep(delay);
                    // Nobody may be there any more.
                    let _ = port.write_all(&binary::encode_reply(2, 1, &reply));
                });
            }
        }
    });
    (path, slave)
}

#[test]
fn a_module_is_found_at_its_bit_rate() {
    let (path, _terminal) = module(14_400, Duration::ZERO);
    assert_found(&[&path, "--addresses", "1"], &["address 1 at 14400 baud: TMCM-1140, firmware version 1.42".into()]);
}

/// A computer that is busy may be late itself, and find it; at the right bit rate then.
#[test]
fn a_reply_that_comes_late_is_none_at_the_next_bit_rate() {
    for delay in [80, 120, 170, 230] {
        let (path, _terminal) = module(9_600, Duration::from_millis(delay));
        let output = run(&["scan", &path, "--addresses", "1", "--timeout", "50"]);
        let found = String::from_utf8_lossy(&output.stdout);
        assert!(found.lines().all(|line| line.starts_with("address 1 at 9600 baud: ")), "{delay} ms: {found}");
    }
}

/// Starts a peer that answers to each telegram over TCP, after a time; gives its link.
fn answering(delay: Duration, answer: impl Fn(&[u8; TELEGRAM]) -> [u8; TELEGRAM] + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("tcp:{}", listener.local_addr().unwrap());
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut request = [0; TELEGRAM];
            while stream.read_exact(&mut request).is_ok() {
                thread::sleep(delay);
                // Nobody may be there any more.
                let _ = stream.write_all(&answer(&request));
            }
        }
    });
    link
}

/// The reply of a TMCM-1140 with address 1.
fn reply(request: &[u8; TELEGRAM]) -> [u8; TELEGRAM] {
    let opcode = binary::decode_command(request).unwrap().opcode;
    binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode, value: 0x0474_012A })
}

#[test]
fn something_that_is_no_module_is_told_from_nobody() {
    let wrong_sum = |request: &[u8; TELEGRAM]| {
        let mut reply = reply(request);
        reply[8] ^= 1;
        reply
    };
    for link in [answering(Duration::ZERO, |_| *b"SSH-2.0-O"), answering(Duration::ZERO, wrong_sum)] {
        let output = run(&["scan", &link, "--addresses", "1-2"]);
        assert_eq!(output.status.code(), Some(1));
        let told = complaint(&output);
        assert!(told.contains("no module answers, but something does: what came is not the reply"), "{told}");
    }
}

/// Over a long way a module takes its time, and is found without an option.
#[test]
fn a_module_behind_a_slow_network_is_found() {
    let output = run(&["scan", &answering(Duration::from_millis(900), reply)]);
    let found = String::from_utf8_lossy(&output.stdout);
    assert_eq!(found, "one module, whatever the address: address 1: TMCM-1140, firmware version 1.42\n");
}

#[test]
fn each_module_is_told_by_its_product() {
    let sim = Sim::start(&["--product", "1140,3110,6110,3212", "--rs485", "{}/bus"]);
    let expected = [
        format!("address 1 at 9600 baud: {VERSION}"),
        "address 2 at 9600 baud: TMCM-3110, firmware version 1.14 (3110V114)".into(),
        "address 3 at 9600 baud: TMCM-6110, firmware version 1.46 (6110V146)".into(),
        "address 4 at 9600 baud: TMCM-3212, firmware version 1.05 (3212V105)".into(),
    ];
    assert_found(&[sim.told("rs485"), "--addresses", "1-4", "--baud", "9600"], &expected);
}

#[test]
fn a_program_gets_json() {
    let sim = Sim::start(&["--product", "1140,3110", "--rs485", "{}/bus", "--tcp", "127.0.0.1:0", "--slcan", "{}/can"]);
    let bus = sim.told("rs485");
    assert!(run(&["send", bus, "--address", "2", "SGP 87, 0, 3"]).status.success());
    let assert_json = |arguments: &[&str], expected: &[serde_json::Value]| {
        assert_says(&[arguments, &["--json"]].concat(), |line| serde_json::from_str(line).unwrap(), expected);
    };
    let first = serde_json::json!({
        "address": 1, "baud": 9600, "alone": false, "product": "TMCM-1140", "firmware": "1.42", "version": "1140V142"
    });
    let second = serde_json::json!({
        "address": 2, "baud": 9600, "alone": false, "product": "TMCM-3110", "firmware": "1.14", "version": "3110V114"
    });
    let mut third = second.clone();
    (third["address"], third["secondary_of"]) = (3.into(), 2.into());
    assert_json(&[bus, "--addresses", "1-3", "--baud", "9600"], &[first, second, third]);
    let alone = serde_json::json!({
        "address": 1, "alone": true, "product": "TMCM-1140", "firmware": "1.42", "version": "1140V142"
    });
    assert_json(&[&format!("tcp:{}", sim.told("tcp"))], &[alone]);
    let on_can = serde_json::json!({
        "identifier": 1, "alone": false, "product": "TMCM-1140", "firmware": "1.42", "version": "1140V142"
    });
    assert_json(&[&format!("slcan:{}", sim.told("slcan")), "--addresses", "1"], &[on_can]);
}
