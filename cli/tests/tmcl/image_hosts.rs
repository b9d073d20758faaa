//! Hosts of `tmcl sim --image` that come, go and send without end: they share one USB cable, and what one of them does
//! is nothing to the next.
//!
//! Times are the module's, and pass slowly: what this computer is busy with costs next to nothing of them.

use std::fs::OpenOptions;
use std::io::{BufRead, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Instant;

use rustix::termios::QueueSelector;

use super::harness::{Host, PATIENCE, Sim, request};
use super::image::{CONTROL, TCP, start};
use super::turns::{Flood, LONGEST, MOST_CONNECTIONS, adapter, frame};

/// The pace of time: 50 ms are a second.
const SLOW: [&str; 2] = ["--speed", "0.05"];
/// In this time, in us, the module answers on a link that is free.
const PROMPT: u64 = 20_000;
/// In this time the module has started and a USB host has opened its port.
const START: u64 = 400_000;
/// So long a telegram and the reply to it take at 9 600 bit/s.
const ON_THE_WIRE: u64 = 18_750;

/// The vendor's request for the boot loader, which gets no answer.
const BOOTLOADER: &str = "242, 129, 146, -1548433962";

/// The module's clock.
fn time(sim: &Sim) -> u64 {
    sim.control(&["state"])["time_us"].as_u64().unwrap()
}

/// Requests of each kind, also such that are not answered, and something that is none.
fn mixed() -> Vec<u8> {
    let lines = ["GAP 1, 0", "MVP ABS, 0, 1000", "SGP 68, 0, 7", "GAP 206, 0", BOOTLOADER, "138, 0, 0, 1", "GGP 66, 0"];
    let mut bytes = lines.map(request).concat();
    bytes.extend(b"rubbish");
    bytes.extend([0xFF; 2]);
    bytes
}

/// Whoever comes finds the link in the mode that parameter 67 had at the start of the module, whatever those before
/// have made of it, and whoever else is there.
#[test]
fn each_connection_begins_in_the_start_mode() {
    let sim = start(&[&TCP, &CONTROL]);
    // Nothing that is typed comes back.
    sim.tcp().ok("SGP 67, 0, 32");
    for others in [0, 1] {
        let _others: Vec<_> = (0..others).map(|_| sim.tcp()).collect();
        let mut host = sim.tcp();
        host.ok("139");
        host.write(b"AGAP 4, 0\r");
        assert_eq!(host.read(), *b"BA 100 10");
        drop(host);
        assert_eq!(sim.tcp().ok("GAP 4, 0"), 1000);
    }
    sim.tcp().ok("SGP 67, 0, 33");
    sim.control(&["power off", "power on"]);
    for _ in 0..2 {
        let mut host = sim.tcp();
        host.write(b"ABIN\r");
        assert_eq!(host.read(), *b"BA 100 0\r");
        assert_eq!(host.ok("GAP 4, 0"), 1000);
    }
}

/// The next line that comes in ASCII mode.
fn line(host: &mut Host<TcpStream>) -> String {
    host.0.set_read_timeout(Some(PATIENCE)).unwrap();
    let (mut line, mut byte) = (String::new(), [0]);
    loop {
        host.0.read_exact(&mut byte).unwrap();
        match byte {
            [b'\r'] => return line,
            [byte] => line.push(byte.into()),
        }
    }
}

/// A host that stays in ASCII mode has the link for itself only as long as nobody else wants it: then its session is
/// over.
#[test]
fn who_has_left_the_start_mode_makes_room_for_the_others() {
    let sim = start(&[&TCP, &CONTROL, &SLOW, &["--serial", "{}/usb"]]);
    let mut other = sim.tcp();
    // Nothing that is typed comes back.
    other.ok("SGP 67, 0, 32");
    let answered_soon = |host: &mut Host<TcpStream>| {
        let asked = time(&sim);
        assert_eq!(host.ok("GAP 4, 0"), 1000);
        let answered = time(&sim);
        assert!(answered - asked <= LONGEST, "{} us", answered - asked);
    };
    // With all said, and with a line begun.
    for begun in ["", "AGAP 4"] {
        let mut host = sim.tcp();
        host.ok("139");
        host.write(b"AGAP 4, 0\r");
        assert_eq!(line(&mut host), "BA 100 1000");
        host.write(begun.as_bytes());
        answered_soon(&mut sim.tcp());
        answered_soon(&mut other);
        host.0.set_read_timeout(Some(PATIENCE)).unwrap();
        let closed = host.0.read(&mut [0; 64]);
        assert!(closed.map_or_else(|error| error.kind() == ErrorKind::ConnectionReset, |count| count == 0), "{begun}");
    }
    // The serial port stays, and what is next at it begins anew, too.
    let mut serial = sim.serial();
    serial.ok("139");
    answered_soon(&mut other);
    assert_eq!(serial.ok("GAP 4, 0"), 1000);
    // Who has left ASCII mode again is in nobody's way.
    let mut host = sim.tcp();
    host.ok("139");
    host.write(b"ABIN\r");
    assert_eq!(line(&mut host), "BA 100 0");
    answered_soon(&mut other);
    assert_eq!(host.ok("GAP 4, 0"), 1000);
}

/// An event belongs to who has asked for it: who comes later does not get it.
#[test]
fn a_subscription_goes_with_its_host() {
    let sim = start(&[&TCP]);
    let mut host = sim.tcp();
    host.ok("138, 0, 0, 1");
    host.ok("MVP ABS, 0, 20000");
    drop(host);
    let mut next = sim.tcp();
    next.until("GAP 8, 0", 1);
    assert_eq!(next.ok("GAP 1, 0"), 20_000);
}

#[test]
fn hosts_that_send_all_at_once_hold_up_nobody() {
    for floods in [1, MOST_CONNECTIONS - 1] {
        let sim = start(&[&TCP, &CONTROL, &SLOW]);
        let mut host = sim.tcp();
        let bytes = request("GAP 1, 0").repeat(2_000);
        let _floods: Vec<Flood> = (0..floods).map(|_| Flood::new(sim.told("tcp"), bytes.clone())).collect();
        for _ in 0..10 {
            let asked = time(&sim);
            host.ok("GAP 1, 0");
            let answered = time(&sim);
            assert!(answered - asked <= LONGEST, "{floods}: {} us", answered - asked);
        }
    }
}

/// Requests that have no answer, or a late one, hold up nobody longer than that.
#[test]
fn a_host_that_sends_all_kinds_at_once_holds_up_nobody() {
    let sim = start(&[&TCP, &CONTROL, &SLOW]);
    let mut host = sim.tcp();
    let _flood = Flood::new(sim.told("tcp"), mixed().repeat(300));
    for _ in 0..10 {
        let asked = time(&sim);
        host.ok("GAP 1, 0");
        let answered = time(&sim);
        assert!(answered - asked <= LONGEST, "{} us", answered - asked);
    }
}

/// Every link, in slow time.
const LINKS: [&str; 6] = ["--speed", "0.1", "--rs485", "{}/rs485", "--slcan-tcp", "127.0.0.1:0"];

#[test]
fn after_a_flood_and_a_power_cycle_the_links_of_an_image_are_free() {
    links_are_free_after_a_flood_and_a_power_cycle(&start(&[&TCP, &CONTROL, &LINKS]));
}

#[test]
fn after_a_flood_and_a_power_cycle_the_links_of_a_core_are_free() {
    links_are_free_after_a_flood_and_a_power_cycle(&Sim::start(&[&TCP[..], &CONTROL, &LINKS].concat()));
}

/// Bytes that hosts had sent before the power was cut are lost with it, wherever they waited.
fn links_are_free_after_a_flood_and_a_power_cycle(sim: &Sim) {
    let mut rs485 = Host(OpenOptions::new().read(true).write(true).open(sim.told("rs485")).unwrap());
    // As much as fits in a terminal, and the beginning of another telegram.
    rs485.write(&mixed().repeat(50)[..3_500]);
    let frames = ["GAP 1, 0", "SGP 68, 0, 7", "MVP ABS, 0, 1000"].map(frame).concat();
    let mut bus = adapter(sim);
    bus.get_mut().write_all(frames.repeat(500).as_bytes()).unwrap();
    let mut usb = sim.tcp();
    usb.write(&mixed().repeat(100)[..6_500]);
    // The module has begun with it.
    usb.read();
    rs485.read();
    assert_eq!(sim.control(&["power off", "power on"])["ok"], true);
    let on = time(sim);
    let end = Instant::now() + PATIENCE;
    while time(sim) < on + START {
        assert!(Instant::now() < end);
    }
    // From here on time passes as far as requests need it, however busy this computer is.
    sim.control(&["pause"]);
    let prompt = |link: &str, most: u64, ask: &mut dyn FnMut()| {
        let asked = time(sim);
        ask();
        let answered = time(sim);
        assert!(answered - asked <= most, "{link}: {} us", answered - asked);
    };
    let mut next = sim.tcp();
    prompt("USB", PROMPT, &mut || assert_eq!(next.ok("GAP 1, 0"), 0));
    let mut next = adapter(sim);
    prompt("CAN", PROMPT, &mut || {
        next.get_mut().write_all(frame("GAP 1, 0").as_bytes()).unwrap();
        let mut lines = next.by_ref().split(b'\r').map(Result::unwrap);
        assert!(lines.any(|line| line.starts_with(b"t0028016406")));
    });
    rustix::termios::tcflush(&rs485.0, QueueSelector::IFlush).unwrap();
    prompt("RS485", PROMPT + ON_THE_WIRE, &mut || assert_eq!(rs485.ok("GAP 1, 0"), 0));
}
