//! Several clients of one `tmcl sim`: each gets its turn, whatever the others send.
//!
//! Times are virtual. They are read off a second module's clock, which nobody keeps busy, and pass slowly here: what
//! this computer is busy with costs next to nothing of them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::thread;

use tmcm::tmcl::binary::TELEGRAM;
use tmcm::tmcl::{can, text};

use super::harness::{Host, PATIENCE, Sim, request};

/// Two modules, and the pace of time: 50 ms are a second.
const SLOW: [&str; 6] = ["--modules", "2", "--speed", "0.05", "--control", "127.0.0.1:0"];
const TCP: [&str; 2] = ["--tcp", "127.0.0.1:0"];
/// Longest time, in us, for which clients may hold up another.
pub(crate) const LONGEST: u64 = 50_000;
/// Connections to a port at one time.
pub(crate) const MOST_CONNECTIONS: usize = 16;

/// A client that sends all at once what takes the module long, and takes the replies until it is dropped.
pub(crate) struct Flood(TcpStream);

impl Flood {
    pub(crate) fn new(address: &str, bytes: Vec<u8>) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        let (mut sender, mut receiver) = (stream.try_clone().unwrap(), stream.try_clone().unwrap());
        // It may be dropped before all is sent.
        thread::spawn(move || sender.write_all(&bytes));
        thread::spawn(move || while receiver.read(&mut [0; 4096]).is_ok_and(|count| count > 0) {});
        Flood(stream)
    }
}

impl Drop for Flood {
    fn drop(&mut self) {
        // It may be closed already.
        let _ = self.0.shutdown(Shutdown::Both);
    }
}

/// The line of an adapter that makes a frame to module 1.
pub(crate) fn frame(line: &str) -> String {
    let data = can::encode_command(text::parse(line).unwrap());
    let digits: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
    format!("t001{}{digits}\r", data.len())
}

/// An adapter on the CAN bus whose channel is open.
pub(crate) fn adapter(sim: &Sim) -> BufReader<TcpStream> {
    let mut stream = TcpStream::connect(sim.told("slcan-tcp")).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(b"O\r").unwrap();
    BufReader::new(stream)
}

/// The clock of the second module.
fn time(sim: &Sim) -> u64 {
    sim.control(&["module 2 state"])["time_us"].as_u64().unwrap()
}

/// Asks again and again: no reply takes longer than one may be held up.
fn is_never_held_up(sim: &Sim, host: &mut Host<TcpStream>) {
    for _ in 0..20 {
        let asked = time(sim);
        host.ok("GAP 1, 0");
        let answered = time(sim);
        assert!(answered - asked <= LONGEST, "{} us", answered - asked);
    }
}

#[test]
fn one_that_sends_all_at_once_holds_up_nobody() {
    let sim = Sim::start(&[&TCP[..], &SLOW].concat());
    let mut host = sim.tcp();
    let _flood = Flood::new(sim.told("tcp"), request("GAP 1, 0").repeat(20_000));
    is_never_held_up(&sim, &mut host);
}

#[test]
fn as_many_as_there_can_be_hold_up_nobody() {
    let sim = Sim::start(&[&TCP[..], &SLOW].concat());
    let mut host = sim.tcp();
    // What takes the module most of its time without a wait: everything of the ramp is set anew.
    let bytes = [request("GAP 1, 0"), request("SAP 5, 0, 500"), request("GAP 206, 0")].concat().repeat(1000);
    let _floods: Vec<Flood> = (1..MOST_CONNECTIONS).map(|_| Flood::new(sim.told("tcp"), bytes.clone())).collect();
    is_never_held_up(&sim, &mut host);
}

/// A request that stores something keeps the link until it is done, one after the other.
#[test]
fn one_that_stores_without_end_holds_up_nobody() {
    let sim = Sim::start(&[&TCP[..], &SLOW].concat());
    let mut host = sim.tcp();
    let bytes = [request("SGP 68, 0, 1"), request("SGP 68, 0, 2")].concat().repeat(300);
    let _flood = Flood::new(sim.told("tcp"), bytes);
    is_never_held_up(&sim, &mut host);
}

/// The same on the CAN bus, where each has an adapter.
#[test]
fn adapters_hold_up_nobody() {
    let sim = Sim::start(&[&["--slcan-tcp", "127.0.0.1:0"][..], &SLOW].concat());
    let mut host = adapter(&sim);
    let bytes = ["O\r".into(), frame("GAP 1, 0").repeat(1_000)].concat().into_bytes();
    let _floods: Vec<Flood> = (1..MOST_CONNECTIONS).map(|_| Flood::new(sim.told("slcan-tcp"), bytes.clone())).collect();
    for n in 0..10 {
        let asked = time(&sim);
        // Nobody else asks for that.
        host.get_mut().write_all(frame(&format!("SGP 1, 2, {n}")).as_bytes()).unwrap();
        let mut lines = host.by_ref().split(b'\r').map(Result::unwrap);
        assert!(lines.any(|line| line.starts_with(b"t0028016409")));
        let answered = time(&sim);
        assert!(answered - asked <= LONGEST, "{} us", answered - asked);
    }
}

#[test]
fn who_is_one_too_many_is_refused_at_once() {
    let sim = Sim::start(&TCP);
    let mut hosts: Vec<_> = (0..MOST_CONNECTIONS).map(|_| sim.tcp()).collect();
    hosts.iter_mut().for_each(|host| assert_eq!(host.ok("GAP 4, 0"), 1000));
    let is_closed = |mut host: Host<TcpStream>| {
        host.0.set_read_timeout(Some(PATIENCE)).unwrap();
        host.0.read(&mut [0; TELEGRAM]).is_ok_and(|count| count == 0)
    };
    assert!(is_closed(sim.tcp()));
    let last = hosts.pop().unwrap();
    last.0.shutdown(Shutdown::Write).unwrap();
    assert!(is_closed(last), "the simulator knows that it has gone");
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1000);
    assert_eq!(hosts[0].ok("GAP 4, 0"), 1000);
}

/// GAP 1 takes a datagram of 24 us to the motion controller.
#[test]
fn replies_do_not_come_before_their_time() {
    const REQUESTS: usize = 3_000;
    let sim = Sim::start(&[&TCP[..], &SLOW].concat());
    let mut host = sim.tcp();
    let before = time(&sim);
    host.write(&request("GAP 1, 0").repeat(REQUESTS));
    // There are more behind them, whose time the module has not come to.
    let replies = REQUESTS - 100;
    host.0.read_exact(&mut vec![0; replies * TELEGRAM]).unwrap();
    let passed = time(&sim) - before;
    assert!(passed >= 24 * replies as u64, "{passed} us");
}
