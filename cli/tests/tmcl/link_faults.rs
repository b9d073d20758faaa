//! Faults of the links by the control port: replies that are lost, corrupted or late, and a cable that hosts miss.

use std::fs;
use std::io::Read;
use std::net::TcpStream;
use std::process::Stdio;

use tmcm::tmcl::binary;

use super::harness::{PATIENCE, SILENCE, Sim, complaint, request, run};
use super::image;

const LINKS: [&str; 6] = ["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0", "--log-telegrams", "{}/log"];

/// The virtual time that each reply took, in milliseconds, of those that are in the log and not lost.
fn waits(sim: &Sim) -> Vec<f64> {
    let log = fs::read_to_string(sim.path("log")).unwrap();
    let at = |line: &str| line[..12].trim().parse::<f64>().unwrap() * 1000.0;
    let pairs =
        log.lines().zip(log.lines().skip(1)).filter(|(request, reply)| request.contains('>') && reply.contains('<'));
    pairs.filter(|(_, reply)| !reply.contains("lost:")).map(|(request, reply)| at(reply) - at(request)).collect()
}

/// The three faults of replies, as a host sees them.
fn replies_are_lost_corrupted_and_late(sim: &Sim) {
    let mut host = sim.tcp();
    assert_eq!(host.ok("GAP 6, 0"), 128);
    sim.control(&["fault reply-drop 1"]);
    host.write(&request("GAP 6, 0"));
    host.write(&request("GAP 4, 0"));
    assert_eq!(binary::decode_reply(&host.read()).unwrap().value, 1000);
    assert_eq!(host.ok("GAP 6, 0"), 128);
    sim.control(&["fault reply-corrupt 1"]);
    host.write(&request("GAP 6, 0"));
    let wrong = host.read();
    assert_eq!((wrong[7], binary::decode_reply(&wrong)), (128, None));
    assert_eq!(host.ok("GAP 6, 0"), 128);
    sim.control(&["fault reply-delay 200 ms"]);
    let before = waits(sim);
    assert_eq!(host.ok("GAP 6, 0"), 128);
    sim.control(&["fault reply-delay 0"]);
    assert_eq!(host.ok("GAP 6, 0"), 128);
    let after = waits(sim);
    assert!(before.iter().all(|wait| *wait < 100.0), "{before:?}");
    let [late, soon] = after[after.len() - 2..] else { panic!("{after:?}") };
    assert!((200.0..300.0).contains(&late) && soon < 100.0, "{after:?}");
}

#[test]
fn a_module_without_an_image_has_faults_of_replies() {
    replies_are_lost_corrupted_and_late(&Sim::start(&LINKS));
}

#[test]
fn a_module_with_an_image_has_faults_of_replies() {
    replies_are_lost_corrupted_and_late(&image::start(&[&LINKS]));
}

/// Of a module with an image every byte on the RS485 bus comes by itself, and a frame of SDO is a frame like others.
#[test]
fn buses_have_faults_of_replies_with_an_image_too() {
    let sim = image::start(&[&["--control", "127.0.0.1:0", "--rs485", "{}/bus", "--slcan-tcp", "127.0.0.1:0"]]);
    let bus = sim.told("rs485").to_owned();
    let can = format!("slcan:tcp:{}", sim.told("slcan-tcp"));
    let send = |link: &str, timeout| {
        let output = run(&["send", link, "--timeout", timeout, "--product", "1140", "GAP 6, 0"]);
        if output.status.success() {
            "answered".into()
        } else {
            complaint(&output) + &String::from_utf8_lossy(&output.stdout)
        }
    };
    for link in [&bus, &can] {
        sim.control(&["fault reply-drop 1"]);
        assert!(send(link, "500").contains("no reply"), "{link}");
        assert_eq!(send(link, "60000"), "answered");
        sim.control(&["fault reply-corrupt 1"]);
        let wrong = send(link, "500");
        assert!(wrong.contains(if *link == can { "no reply" } else { "wrong checksum" }), "{link}: {wrong}");
        sim.control(&["fault reply-delay 100 ms"]);
        assert_eq!(send(link, "60000"), "answered");
        sim.control(&["fault reply-delay 0"]);
    }
}

#[test]
fn hosts_see_that_the_cable_is_pulled_out() {
    let folder = tempfile::tempdir().unwrap();
    let links = ["--tcp", "127.0.0.1:0", "--serial", "{}/usb", "--control", "127.0.0.1:0"];
    let sim = Sim::start_saying(folder, &links, Stdio::piped());
    let path = sim.path("usb");
    for _ in 0..2 {
        let (mut serial, mut host) = (sim.serial(), sim.tcp());
        assert_eq!((serial.ok("GAP 6, 0"), host.ok("GAP 6, 0")), (128, 128));
        assert_eq!(sim.control(&["usb off --hangup"]), serde_json::json!({"ok": true}));
        // The end of the file, or an error; in any case no waiting.
        assert!(serial.has_news(PATIENCE) && host.has_news(PATIENCE));
        assert!(!serial.0.read(&mut [0; 9]).is_ok_and(|count| count > 0));
        assert!(!host.0.read(&mut [0; 9]).is_ok_and(|count| count > 0));
        assert!(fs::symlink_metadata(&path).is_err());
        // Nobody is there, but the path is not free.
        let mut visitor = TcpStream::connect(sim.told("tcp")).unwrap();
        visitor.set_read_timeout(Some(PATIENCE)).unwrap();
        assert!(!visitor.read(&mut [0; 9]).is_ok_and(|count| count > 0));
        let other = run(&["sim", "--serial", path.to_str().unwrap()]);
        assert!(complaint(&other).contains("is the port of a simulator that runs"), "{}", complaint(&other));

        assert_eq!(sim.control(&["usb on"]), serde_json::json!({"ok": true}));
        assert_eq!((sim.serial().ok("GAP 6, 0"), sim.tcp().ok("GAP 6, 0")), (128, 128));
        let dead = serial.0.read(&mut [0; 9]);
        assert!(!dead.is_ok_and(|count| count > 0), "the old terminal stays dead");
    }
}

/// A plain `usb off` is one that hosts do not see, as ever.
#[test]
fn without_hangup_connections_stay() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--serial", "{}/usb", "--control", "127.0.0.1:0"]);
    let (mut serial, mut host) = (sim.serial(), sim.tcp());
    sim.control(&["usb off"]);
    host.write(&request("GAP 6, 0"));
    serial.write(&request("GAP 6, 0"));
    assert!(!host.has_news(SILENCE) && !serial.has_news(SILENCE));
    sim.control(&["usb on"]);
    assert_eq!((serial.ok("GAP 6, 0"), host.ok("GAP 6, 0")), (128, 128));
}

/// A file that stands at the path of the terminal by then is left alone, and the port comes back when it is gone.
#[test]
fn a_file_in_the_way_of_the_new_terminal_is_left_alone() {
    let sim = Sim::start(&["--serial", "{}/usb", "--control", "127.0.0.1:0"]);
    let path = sim.path("usb");
    sim.control(&["usb off --hangup"]);
    fs::write(&path, "mine").unwrap();
    assert_eq!(sim.control(&["usb on"]), serde_json::json!({"ok": true}));
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    fs::remove_file(&path).unwrap();
    sim.control(&["state"]);
    assert_eq!(sim.serial().ok("GAP 6, 0"), 128);
}
