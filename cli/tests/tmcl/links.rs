//! The serial port and the TCP port of `tmcl sim`.

use std::io::{Read, Write};
use std::net::Shutdown;
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use tmcm::tmcl::binary;

use super::harness::{Host, SILENCE, Sim, request};

const TCP: [&str; 2] = ["--tcp", "127.0.0.1:0"];
const SERIAL: [&str; 2] = ["--serial", "{}/port"];

#[test]
fn without_options_there_is_a_link_of_each_kind() {
    let sim = Sim::start(&[]);
    assert_eq!(sim.serial().ok("GAP 4, 0"), 1000);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1000);
    // The usual port is taken now; another module finds one of its own.
    let other = Sim::start(&[]);
    assert_ne!(sim.told("tcp"), other.told("tcp"));
    assert_eq!(other.tcp().ok("GAP 4, 0"), 1000);
}

#[test]
fn the_serial_port_survives_its_hosts_and_goes_with_the_module() {
    let sim = Sim::start(&SERIAL);
    for n in 0..5 {
        let mut host = sim.serial();
        assert_eq!(host.ok(&format!("SAP 4, 0, {}", 1000 + n)), 1000 + n);
        assert_eq!(host.ok("GAP 4, 0"), 1000 + n);
    }
    let port = sim.path("port");
    assert!(port.is_symlink());
    let (status, _folder) = sim.end(Signal::TERM);
    assert_eq!(status.code(), Some(0));
    assert!(!port.is_symlink());
}

#[test]
fn interrupt_ends_it_too() {
    let sim = Sim::start(&TCP);
    let _idle = sim.tcp();
    assert_eq!(sim.end(Signal::INT).0.code(), Some(0));
}

#[test]
fn a_link_left_behind_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink("/dev/pts/does-not-exist", folder.path().join("port")).unwrap();
    let sim = Sim::start_in(folder, &SERIAL);
    assert_eq!(sim.serial().ok("GAP 4, 0"), 1000);
    let (_, folder) = sim.end(Signal::KILL);
    let sim = Sim::start_in(folder, &SERIAL);
    assert_eq!(sim.serial().ok("GAP 4, 0"), 1000);
}

#[test]
fn telegrams_arrive_in_pieces() {
    fn pieces<T: Read + Write + AsFd>(mut host: Host<T>) {
        let telegram = request("GAP 4, 0");
        for cut in 1..telegram.len() {
            let (head, tail) = telegram.split_at(cut);
            host.write(head);
            let cut = Instant::now();
            host.write(tail);
            if cut.elapsed() < Duration::from_millis(4) {
                assert_eq!(binary::decode_reply(&host.read()).unwrap().value, 1000);
            } else {
                // This test itself was held up: the telegram may be torn or not.
                if host.has_news(SILENCE) {
                    host.read();
                }
            }
        }
    }
    let sim = Sim::start(&[TCP, SERIAL].concat());
    pieces(sim.tcp());
    pieces(sim.serial());
}

#[test]
fn after_a_silence_it_is_in_step_again() {
    fn broken<T: Read + Write + AsFd>(sim: &Sim, mut host: Host<T>) {
        let telegram = request("GAP 4, 0");
        for rubbish in [&[0xFF][..], &telegram[..3], &telegram[1..]] {
            host.write(rubbish);
            sim.has_looked();
            std::thread::sleep(SILENCE);
            sim.has_looked();
            assert_eq!(host.ok("GAP 4, 0"), 1000);
        }
        // Nine bytes of rubbish are a telegram with a wrong checksum.
        host.write(b"rubbish!!");
        assert_eq!(binary::decode_reply(&host.read()).unwrap().status, 1);
        assert_eq!(host.ok("GAP 4, 0"), 1000);
    }
    let sim = Sim::start(&[TCP, SERIAL, ["--control", "127.0.0.1:0"]].concat());
    broken(&sim, sim.tcp());
    broken(&sim, sim.serial());
}

#[test]
fn framing_starts_afresh_with_each_connection() {
    let sim = Sim::start(&TCP);
    let mut unfinished = sim.tcp();
    unfinished.write(&request("GAP 4, 0")[..4]);
    for _ in 0..20 {
        assert_eq!(sim.tcp().ok("GAP 4, 0"), 1000);
    }
}

#[test]
fn everybody_gets_its_own_replies() {
    let sim = Sim::start(&[TCP, SERIAL].concat());
    let (mut first, mut second, mut third) = (sim.tcp(), sim.tcp(), sim.serial());
    for n in 0..50 {
        // The second one's replies come late: they wait for the EEPROM.
        second.write(&request(&format!("SGP 68, 0, {n}")));
        first.write(&request("GAP 5, 0"));
        third.write(&request(&format!("SGP 9, 2, {n}")));
        let opcodes = [first.read(), second.read(), third.read()].map(|reply| {
            let reply = binary::decode_reply(&reply).unwrap();
            (reply.status, reply.opcode, reply.value)
        });
        assert_eq!(opcodes, [(100, 6, 1000), (100, 9, n), (100, 9, n)]);
    }
}

#[test]
fn the_event_goes_to_who_armed_it() {
    let sim = Sim::start(&TCP);
    let (mut other, mut armed) = (sim.tcp(), sim.tcp());
    for (target, suppressed) in [(2000, false), (0, true)] {
        std::mem::swap(&mut other, &mut armed);
        if suppressed {
            // From now on nothing but what is read is answered.
            armed.ok("SGP 255, 0, 1");
            armed.write(&request("138, 0, 0, 1"));
            armed.write(&request(&format!("MVP ABS, 0, {target}")));
        } else {
            armed.ok("138, 0, 0, 1");
            armed.ok(&format!("MVP ABS, 0, {target}"));
        }
        let event = binary::decode_reply(&armed.read()).unwrap();
        assert_eq!((event.status, event.opcode, event.value), (128, 138, 1));
        assert_eq!(other.ok("GAP 1, 0"), target);
        assert!(!other.has_news(Duration::ZERO));
        // Refused, it changes nothing.
        other.write(&request("138, 2, 0, 1"));
        assert!(suppressed || binary::decode_reply(&other.read()).unwrap().status == 3);
    }
}

#[test]
fn a_request_may_end_the_connection() {
    let sim = Sim::start(&TCP);
    let mut host = sim.tcp();
    host.write(&request("SGP 68, 0, 7"));
    host.0.shutdown(Shutdown::Write).unwrap();
    assert_eq!(binary::decode_reply(&host.read()).unwrap().value, 7);
    assert_eq!(host.0.read(&mut [0; 9]).unwrap(), 0, "closed after the reply");
    // Who does not even wait has its command carried out all the same.
    sim.tcp().write(&request("SGP 68, 0, 8"));
    sim.tcp().until("GGP 68, 0", 8);
}

#[test]
fn who_never_reads_does_not_hold_up_others() {
    let sim = Sim::start(&TCP);
    let mut deaf = sim.tcp();
    deaf.0.set_write_timeout(Some(Duration::from_secs(1))).unwrap();
    let flood = request("GGP 66, 0").repeat(1000);
    let cut_off = (0..5000).any(|_| deaf.0.write_all(&flood).is_err());
    assert!(cut_off);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1000);
}

#[test]
fn any_address_is_answered_with_the_module_s_own() {
    let sim = Sim::start(&TCP);
    let mut host = sim.tcp();
    for address in [0, 1, 77] {
        host.write(&binary::encode_command(address, tmcm::tmcl::text::parse("GAP 4, 0").unwrap()));
        let reply = binary::decode_reply(&host.read()).unwrap();
        assert_eq!((reply.host, reply.module, reply.status), (2, 1, 100));
    }
}

/// ASCII mode is a connection's own; the next one starts as parameter 67 said when the module started.
#[test]
fn each_connection_has_a_mode_of_its_own() {
    let sim = Sim::start(&[TCP, ["--control", "127.0.0.1:0"]].concat());
    let (mut one, mut other) = (sim.tcp(), sim.tcp());
    one.ok("SGP 67, 0, 32");
    one.ok("139");
    one.write(b"\rAMST\r");
    assert_eq!(one.read(), *b"BA 100 0\r");
    assert_eq!(other.ok("GAP 4, 0"), 1000);
    assert_eq!(sim.tcp().ok("SGP 67, 0, 33"), 33);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1000);
    one.write(b"ABIN\r");
    assert_eq!(one.read(), *b"BA 100 0\r");
    assert_eq!(one.ok("GAP 4, 0") + other.ok("GAP 4, 0"), 2000);
    sim.control(&["power off", "power on"]);
    let mut third = sim.tcp();
    // What has been typed before the end is carried out, one after the other.
    third.write(b"ASGP 77, 0, 1\rAGGP 77\r");
    third.0.shutdown(Shutdown::Write).unwrap();
    assert_eq!((third.read(), third.read()), (*b"BA 100 1\r", *b"BA 100 1\r"));
    assert_eq!(third.0.read(&mut [0; 9]).unwrap(), 0, "closed after the last reply");
}
