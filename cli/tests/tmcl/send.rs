//! `tmcl send`: the same over every link.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::os::unix::fs::symlink;
use std::time::Duration;

use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Reply, Status};

use super::fake::{Fake, State};
use super::harness::{Sim, complaint, run, tmcl};

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

/// Three modules are on the CAN bus and on the RS485 bus. Each keeps its own settings, and each has an EEPROM file and
/// a place on the control port of its own.
#[test]
fn three_modules_on_two_buses() {
    let arguments =
        ["--modules", "3", "--slcan", "{}/can", "--rs485", "{}/bus", "--control", "127.0.0.1:0", "--eeprom"];
    let sim = Sim::start(&[&arguments[..], &["{}/eeprom"]].concat());
    let (can, bus) = (format!("slcan:{}", sim.told("slcan")), sim.told("rs485").to_string());
    for module in ["1", "2", "3"] {
        let line = format!("SAP 4, 0, 100{module}");
        let output = run(&["send", &can, "--timeout", "60000", "--address", module, &line, "STAP 4, 0"]);
        assert!(output.status.success(), "module {module}: {}", complaint(&output));
    }
    for module in ["3", "1", "2"] {
        let output = run(&["send", &bus, "--timeout", "60000", "--address", module, "GAP 4, 0", "GGP 66, 0"]);
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

/// How often a module has been asked what it is, and how often anything.
fn asked(fake: &Fake) -> (usize, usize) {
    let state = fake.state();
    (state.identified(), state.asked.len())
}

/// Names cost one question, plain numbers none.
#[test]
fn names_and_expressions_are_those_of_the_assembler() {
    let fake = Fake::start(State::default());
    let output = run(&["send", &fake.link, "SGP 10, 2, 3 * $10", "6, 4", "MVP REL, 0, -(51200 / 4)"]);
    assert!(output.status.success(), "{}", complaint(&output));
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.starts_with("SGP 10, 2, 48: 48, status 100 ok\n"), "{told}");
    assert!(told.ends_with("MVP REL, 0, -12800: -12800 microsteps (target), status 100 ok\n"), "{told}");
    assert_eq!(asked(&fake), (0, 3));
    let output = run(&["send", &fake.link, "SAP APMaxPositioningSpeed, Motor0, 1000", "STAP apmaxpositioningspeed, 0"]);
    assert!(output.status.success(), "{}", complaint(&output));
    assert_eq!(asked(&fake), (1, 6));

    let output = run(&["send", "sim", "--product", "6110", "SAP APGroupIndex, Motor5, 1"]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "SAP 213, 5, 1: 1 (group index), status 100 ok\n");
    // Nothing is sent when one of the commands cannot be read.
    let output = run(&["send", &fake.link, "SAP 4, 0, 1", "SAP APGroupIndex, 0, 1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("the TMCM-1140 does not have it"), "{}", complaint(&output));
    assert_eq!(asked(&fake), (2, 7));
    let output = run(&["send", &fake.link, "SAP APMaxPosSpeed, 0, 1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("did you mean 'APMaxPositioningSpeed'?"), "{}", complaint(&output));
    assert_eq!(fake.state().asked.len(), 7);
}

#[test]
fn scripts_get_the_value_alone() {
    let fake = Fake::start(State { protection: 3, ..State::default() });
    let output = run(&["send", &fake.link, "--value", "GGP 81, 0", "GAP 1, 7", "GGP 81, 0"]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(String::from_utf8_lossy(&output.stdout), "3\n3\n");
    assert_eq!(complaint(&output), "tmcl: GAP 1, 7: status 4 value, motor or bank out of range\n");
    assert_eq!(fake.state().asked.len(), 3, "the values alone need no names");
    let output = run(&["send", "sim", "--value", "SAP 4, 0, 1500", "136, 0"]);
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stdout).as_ref()), (Some(1), "1500\n"));
    assert_eq!(complaint(&output), "tmcl: 136, 0, 0, 0: 1140V142; the reply has no value\n");
}

#[test]
fn json_has_an_object_for_each_command() {
    let output = run(&[&["send", "sim", "--json"], &LINES[..], &["SAP 4, 0, 5000"]].concat());
    assert_eq!(output.status.code(), Some(1));
    let lines: Vec<String> = String::from_utf8(output.stdout).unwrap().lines().map(String::from).collect();
    let expected = [
        r#"{"command":"136, 0, 0, 0","text":"1140V142"}"#,
        r#"{"command":"136, 1, 0, 0","status":100,"meaning":"ok","value":74711338,"text":"TMCM-1140, firmware version 1.42"}"#,
        r#"{"command":"GAP 4, 0","status":100,"meaning":"ok","value":1000,"unit":"int","name":"maximum positioning speed"}"#,
        r#"{"command":"SAP 4, 0, 1500","status":100,"meaning":"ok","value":1500,"unit":"int","name":"maximum positioning speed"}"#,
        r#"{"command":"STAP 4, 0","status":100,"meaning":"ok","name":"maximum positioning speed"}"#,
        r#"{"command":"GIO 8, 1","status":100,"meaning":"ok","value":240,"unit":"0.1 V","name":"supply"}"#,
        r#"{"command":"MVP ABS, 0, -500","status":100,"meaning":"ok","value":-500,"unit":"microsteps","name":"target"}"#,
        r#"{"command":"SAP 4, 0, 5000","status":4,"meaning":"value, motor or bank out of range"}"#,
    ];
    assert_eq!(lines, expected);
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("tcp:{}", silent.local_addr().unwrap());
    let output = run(&["send", &link, "--timeout", "50", "--json", "GAP 1, 0", "GAP 2, 0"]);
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.starts_with(r#"{"command":"GAP 1, 0","error":"no reply; check power"#), "{told}");
    assert_eq!(told.lines().count(), 1);
    assert!(complaint(&output).starts_with("tmcl: GAP 1, 0: no reply"), "{}", complaint(&output));
}

#[test]
fn what_was_meant_is_suggested() {
    for (arguments, meant) in [
        (["127.0.0.1:4140", "GAP 1, 0"], "did you mean tcp:127.0.0.1:4140?"),
        (["localhost:4140", "GAP 1, 0"], "did you mean tcp:localhost:4140?"),
        (["SIM", "GAP 1, 0"], "did you mean sim?"),
        (["sim", "PRESS left"], "tmcl world ADDR:PORT \"press left\""),
        (["sim", "GAPP 1, 0"], "did you mean 'GAP'?"),
    ] {
        let output = run(&["send", arguments[0], arguments[1]]);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(complaint(&output).contains(meant), "{arguments:?}: {}", complaint(&output));
    }
}

/// A module that does to each telegram what it is told.
fn answering(answer: impl Fn([u8; TELEGRAM]) -> Option<Vec<u8>> + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut request = [0; TELEGRAM];
        while stream.read_exact(&mut request).is_ok() {
            match answer(request) {
                // The program may have had enough.
                Some(bytes) => drop(stream.write_all(&bytes)),
                None => return,
            }
        }
    });
    link
}

/// Bytes that come in place of a reply are told in one sentence, with what can be done, and nothing of them is taken
/// for a value.
#[test]
fn a_module_that_does_not_answer_well_is_told() {
    let reply = |opcode, value| {
        let plain = Reply::Plain { status: Status::Ok, opcode, value };
        binary::encode_reply(2, 1, &plain).to_vec()
    };
    let late = move |_| {
        std::thread::sleep(Duration::from_millis(400));
        Some(reply(6, 1))
    };
    for (link, told) in [
        (
            answering(|_| Some(vec![0xAA; TELEGRAM])),
            "reply with a wrong checksum: AA AA AA AA AA AA AA AA AA; check the",
        ),
        (answering(|_| Some(vec![0xAA; 4])), "only 4 of 9 bytes of a reply came; on RS485 check the bit rate"),
        (answering(|_| Some(Vec::new())), "no reply; check power, wiring"),
        (answering(|_| None), "the other side has closed the connection"),
        (answering(late), "no reply; check power, wiring"),
        (answering(move |_| Some(reply(5, 1))), "it answers command 5"),
    ] {
        let output = run(&["send", &link, "--timeout", "200", "--value", "GAP 1, 0"]);
        assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(1), &b""[..]), "{told}");
        let complaint = complaint(&output);
        assert!(complaint.starts_with("tmcl: GAP 1, 0: ") && complaint.contains(told), "{told}: {complaint}");
        assert_eq!(complaint.lines().count(), 1, "{complaint}");
    }
}

#[test]
fn what_reads_the_values_may_have_enough() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut send = tmcl(&["send", "sim", "--value", "GAP 1, 0"]);
    let output = send.stdout(writer).spawn().unwrap().wait_with_output().unwrap();
    assert_eq!((output.status.code(), complaint(&output).as_str()), (Some(141), ""));
}

/// A motor, a bank or a set of axes that the module does not have is explained as `tmcl asm` explains it.
#[test]
fn a_motor_that_there_is_not_is_explained() {
    let refused = "status 4 value, motor or bank out of range";
    for (product, command, why) in [
        (
            "6110",
            "MVP COORD, 0x7F, 1",
            ": $7F is no set of axes: bits 0..5 are the axes of this module, and bit 7 moves them at once, bit 6 up to three of \
             them on a straight line",
        ),
        ("3110", "ROR 3, 100", ": there is no axis 3; the last of this module is 2"),
        ("1140", "GGP 66, 1", ": there is no bank 1; 0 has the global parameters, 2 user variables, 3 interrupts"),
        // Here it is the value.
        ("1140", "SAP 4, 0, 5000", ""),
    ] {
        let output = run(&["send", "sim", "--product", product, command]);
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(told.ends_with(&format!("{refused}{why}\n")), "{told}");
        assert_eq!(output.status.code(), Some(1));
    }
}
