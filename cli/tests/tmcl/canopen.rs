//! `tmcl sim --firmware canopen`, as a CANopen master meets it.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use tmcl_tools::slcan;
use tmcm::can::{CanFrame, Frame, Id, StandardId};

use super::harness::{PATIENCE, Sim, complaint, request, run};

const LINKS: [&str; 6] = ["--firmware", "canopen", "--slcan-tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];
/// The data of a message of boot-up.
const BOOT_UP: [u8; 1] = [0];
/// States of a node in a heartbeat.
const PRE_OPERATIONAL: u8 = 127;
const OPERATIONAL: u8 = 5;

/// A master at the CAN adapter.
pub(super) struct Master {
    stream: TcpStream,
    line: Vec<u8>,
    /// Frames that nobody has asked for yet: identifiers and data.
    heard: VecDeque<(u16, Vec<u8>)>,
}

impl Master {
    pub(super) fn new(sim: &Sim) -> Self {
        let stream = TcpStream::connect(sim.told("slcan-tcp")).unwrap();
        stream.set_read_timeout(Some(Duration::from_millis(10))).unwrap();
        let mut master = Master { stream, line: Vec::new(), heard: VecDeque::new() };
        master.stream.write_all(b"C\rS8\rO\r").unwrap();
        master
    }

    pub(super) fn send(&mut self, id: u16, data: &[u8]) {
        let frame = Frame::standard(id, data).unwrap();
        self.stream.write_all((slcan::line(&frame) + "\r").as_bytes()).unwrap();
    }

    fn send_remote(&mut self, id: u16) {
        let frame = Frame::new_remote(StandardId::new(id).unwrap(), 1).unwrap();
        self.stream.write_all((slcan::line(&frame) + "\r").as_bytes()).unwrap();
    }

    /// Takes what the adapter has sent, if it has.
    fn listen(&mut self) {
        let mut buffer = [0; 4096];
        let count = match self.stream.read(&mut buffer) {
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => 0,
            Err(error) => panic!("{error}"),
        };
        for byte in &buffer[..count] {
            if *byte != b'\r' {
                self.line.push(*byte);
                continue;
            }
            let line = String::from_utf8(std::mem::take(&mut self.line)).unwrap();
            if let Some(frame) = slcan::parse(line.trim_start_matches('z'))
                && let Id::Standard(id) = frame.id()
            {
                self.heard.push_back((id.as_raw(), frame.data().to_vec()));
            }
        }
    }

    /// The data of the next frame with this identifier; those before it are forgotten.
    fn next(&mut self, id: u16) -> Vec<u8> {
        self.find(id, |_| true)
    }

    /// Waits for a frame with this identifier and this data.
    pub(super) fn until(&mut self, id: u16, data: &[u8]) {
        self.find(id, |found| found == data);
    }

    fn find(&mut self, wanted: u16, fits: impl Fn(&[u8]) -> bool) -> Vec<u8> {
        let end = Instant::now() + PATIENCE;
        loop {
            while let Some((id, data)) = self.heard.pop_front() {
                if id == wanted && fits(&data) {
                    return data;
                }
            }
            assert!(Instant::now() < end, "no such frame {wanted:03X}");
            self.listen();
        }
    }

    /// Sends an SDO request and takes the reply.
    fn request(&mut self, node: u16, request: [u8; 8]) -> [u8; 8] {
        self.send(0x600 + node, &request);
        self.next(0x580 + node).try_into().unwrap()
    }

    /// The number that an object of four bytes at most has.
    pub(super) fn read(&mut self, node: u16, index: u16, sub: u8) -> u32 {
        let [low, high] = index.to_le_bytes();
        let [command, a, b, c, value @ ..] = self.request(node, [0x40, low, high, sub, 0, 0, 0, 0]);
        assert_eq!((command & 0xE2, [a, b, c]), (0x42, [low, high, sub]), "{index:04X}h");
        u32::from_le_bytes(value)
    }

    /// The text that an object has.
    fn read_text(&mut self, node: u16, index: u16) -> String {
        let [low, high] = index.to_le_bytes();
        let [command, _, _, _, length, ..] = self.request(node, [0x40, low, high, 0, 0, 0, 0, 0]);
        assert_eq!(command, 0x41, "{index:04X}h");
        let mut text = Vec::new();
        for toggle in [0x60, 0x70].into_iter().cycle() {
            let [command, segment @ ..] = self.request(node, [toggle, 0, 0, 0, 0, 0, 0, 0]);
            text.extend(&segment[..7 - usize::from(command >> 1 & 7)]);
            if command & 1 != 0 {
                break;
            }
        }
        assert_eq!(text.len(), usize::from(length));
        String::from_utf8(text).unwrap()
    }

    /// Writes an object of as many bytes as there are.
    pub(super) fn write(&mut self, node: u16, index: u16, sub: u8, value: &[u8]) {
        let [low, high] = index.to_le_bytes();
        let mut request = [0x23 | (4 - value.len() as u8) << 2, low, high, sub, 0, 0, 0, 0];
        request[4..4 + value.len()].copy_from_slice(value);
        assert_eq!(self.request(node, request), [0x60, low, high, sub, 0, 0, 0, 0], "{index:04X}h");
    }
}

/// Lets virtual time pass.
fn pass(sim: &Sim, milliseconds: u64) {
    let now = || sim.control(&["state"])["time_us"].as_u64().unwrap();
    let end = now() + milliseconds * 1000;
    while now() < end {
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_master_finds_a_node() {
    let sim = Sim::start(&LINKS);
    let mut master = Master::new(&sim);
    assert_eq!(master.read_text(1, 0x1008), "TMCM-1140");
    assert_eq!((master.read(1, 0x1018, 1), master.read(1, 0x2707, 0), master.read(1, 0x2708, 0)), (0x286, 1000, 1));
    // Heartbeats tell the state, which the commands of the master change.
    master.write(1, 0x1017, 0, &20_u16.to_le_bytes());
    master.until(0x701, &[PRE_OPERATIONAL]);
    master.send(0, &[1, 1]);
    master.until(0x701, &[OPERATIONAL]);
    // On the way there it has sent its PDOs; SYNC makes it send others.
    master.send(0x80, &[]);
    assert_eq!(master.next(0x381).len(), 6);
    // Reset of the communication, and of the node.
    for command in [0x82, 0x81] {
        master.send(0, &[command, 0]);
        master.until(0x701, &BOOT_UP);
        assert_eq!(master.read(1, 0x1017, 0), 0);
    }
    // A remote frame asks for the state.
    master.send_remote(0x701);
    assert_eq!(master.next(0x701), [PRE_OPERATIONAL]);
    // What passes the controller follows the objects.
    master.write(1, 0x1400, 1, &0x8000_0201_u32.to_le_bytes());
    master.write(1, 0x1400, 1, &0x0000_0345_u32.to_le_bytes());
    master.send(0, &[1, 1]);
    master.send(0x345, &[0x06, 0]);
    assert_eq!(master.read(1, 0x6040, 0), 6);
}

#[test]
fn power_off_and_on_boots_a_node() {
    let sim = Sim::start(&LINKS);
    let mut master = Master::new(&sim);
    master.write(1, 0x1017, 0, &20_u16.to_le_bytes());
    master.until(0x701, &[PRE_OPERATIONAL]);
    assert_eq!(sim.control(&["power off", "power on"])["ok"], true);
    master.until(0x701, &BOOT_UP);
    assert_eq!(master.read(1, 0x1017, 0), 0);
}

#[test]
fn several_nodes_have_the_numbers_of_their_modules() {
    let sim = Sim::start(&[&LINKS[..], &["--modules", "3"]].concat());
    let mut master = Master::new(&sim);
    for node in 1..=3 {
        assert_eq!(u32::from(node), master.read(node, 0x2708, 0));
        master.write(node, 0x1017, 0, &[10 * node as u8, 0]);
    }
    // A command to all of them, and one to the second.
    master.send(0, &[1, 0]);
    (1..=3).for_each(|node| master.until(0x700 + node, &[OPERATIONAL]));
    master.send(0, &[128, 2]);
    master.until(0x702, &[PRE_OPERATIONAL]);
    assert_eq!(master.next(0x703), [OPERATIONAL]);
}

#[test]
fn without_links_there_is_a_can_adapter_and_what_a_master_writes_to_reach_it() {
    let output = run(&["sim", "--firmware", "canopen", "--modules", "2", "--exit-with-stdin"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.starts_with("2 virtual TMCM-1140s with CANopen firmware version 3.20."), "{said}");
    let address = said.lines().find_map(|line| line.strip_prefix("slcan-tcp: ")).unwrap();
    for line in [
        &format!("network.connect(interface=\"slcan\", channel=\"socket://{address}\")"),
        "network.add_node(1, \"docs/tmcm1140-canopen.eds\")",
        "network.add_node(2, \"docs/tmcm1140-canopen.eds\")",
        "ready",
    ] {
        assert!(said.lines().any(|found| found.trim() == line), "{line}: {said}");
    }
    assert!(!said.contains("\ntcp: ") && !said.contains("serial: "), "{said}");
}

#[test]
fn what_the_firmware_has_not_is_refused_with_the_reason() {
    let output = run(&["sim", "--firmware", "canopen", "--rs485", "/nowhere/bus"]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
    assert!(complaint(&output).contains("leaves the module's RS485 port off"), "{}", complaint(&output));
    let output = run(&["sim", "--firmware", "ethercat"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("tmcl, canopen"), "{}", complaint(&output));
}

#[test]
fn over_usb_a_node_tells_its_version_and_nothing_else() {
    let sim = Sim::start(&["--firmware", "canopen", "--tcp", "127.0.0.1:0", "--serial", "{}/usb"]);
    let mut host = sim.tcp();
    host.write(&request("136, 0, 0, 0"));
    assert_eq!(&host.read(), b"\x021140V320");
    assert_eq!(host.ok("136, 1, 0, 0"), 0x0474_0314);
    // Neither does it enter ASCII mode.
    for line in ["GAP 1, 0", "136, 2, 0, 0", "139, 0, 0, 0", "ROR 0, 100", "STAP 4, 0"] {
        let reply = host.ask(line);
        assert_eq!((reply.status, reply.module, reply.host), (6, 1, 2), "{line}");
    }
    let mut wrong = request("136, 1, 0, 0");
    wrong[8] ^= 1;
    host.write(&wrong);
    assert_eq!(host.read(), [2, 1, 1, 0, 0, 0, 0, 0, 4]);
    // The serial port is the same link.
    assert_eq!(sim.serial().ok("136, 1, 0, 0"), 0x0474_0314);
}

#[test]
fn a_disturbed_controller_is_told_of_when_that_is_possible() {
    let sim = Sim::start(&[&LINKS[..], &["--modules", "2"]].concat());
    let mut master = Master::new(&sim);
    master.write(1, 0x1017, 0, &20_u16.to_le_bytes());
    assert_eq!(sim.control(&["can passive", "state"])["can"], "passive");
    assert_eq!(master.next(0x81)[..2], 0x8120_u16.to_le_bytes());
    // It takes part all the same.
    assert_eq!(master.read(1, 0x2708, 0), 1);
    assert_eq!(sim.control(&["can off", "state"])["can"], "off");
    master.send(0x601, &[0x40, 0x08, 0x27, 0, 0, 0, 0, 0]);
    pass(&sim, 100);
    // What was said before is read; then there is nothing.
    assert_eq!(master.read(2, 0x2708, 0), 2);
    master.listen();
    master.heard.clear();
    pass(&sim, 50);
    master.listen();
    assert_eq!(master.heard, [], "off the bus it is not heard");
    sim.control(&["can on"]);
    assert_eq!(master.next(0x81)[..2], 0x8140_u16.to_le_bytes());
    master.until(0x701, &[PRE_OPERATIONAL]);
    // What was asked meanwhile has not arrived.
    assert_eq!(master.read(1, 0x1000, 0), 0x0004_0192);
    // However short it was, and whichever module it was.
    sim.control(&["module 2 can off", "module 2 can on"]);
    assert_eq!(master.next(0x82)[..2], 0x8140_u16.to_le_bytes());
    // A node that starts with its controller off boots when it recovers.
    sim.control(&["module 2 can off", "module 2 power off", "module 2 power on"]);
    pass(&sim, 50);
    sim.control(&["module 2 can on"]);
    assert_eq!(master.next(0x702), BOOT_UP);
    assert_eq!(sim.control(&["can"])["error"], "usage: can passive|off|on");
}

#[test]
fn a_tmcl_module_is_not_on_the_bus_while_its_controller_is_off() {
    let sim = Sim::start(&["--slcan-tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let mut master = Master::new(&sim);
    let set = |value: i32| [&[5, 4, 0][..], &value.to_be_bytes()].concat();
    sim.control(&["can off"]);
    master.send(1, &set(777));
    pass(&sim, 50);
    sim.control(&["can passive"]);
    // Neither has the command arrived, nor does its reply come late.
    master.send(1, &[6, 4, 0, 0, 0, 0, 0]);
    assert_eq!(master.next(2), [&[1, 100, 6][..], &1000_i32.to_be_bytes()].concat());
    sim.control(&["can on"]);
    master.send(1, &set(778));
    assert_eq!(master.next(2), [&[1, 100, 5][..], &778_i32.to_be_bytes()].concat());
}

#[test]
fn what_is_saved_is_in_the_file() {
    let arguments = [&LINKS[..], &["--eeprom", "{}/eeprom.bin"]].concat();
    let sim = Sim::start(&arguments);
    let mut master = Master::new(&sim);
    master.write(1, 0x2705, 0, &[9]);
    master.write(1, 0x1017, 0, &20_u16.to_le_bytes());
    master.write(1, 0x1010, 1, b"save");
    // Who has nothing more to say gets the reply all the same.
    master.write(1, 0x2003, 0, &[77]);
    master.send(0x601, &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e']);
    master.stream.shutdown(Shutdown::Write).unwrap();
    assert_eq!(master.next(0x581), [0x60, 0x10, 0x10, 1, 0, 0, 0, 0]);
    let (status, folder) = sim.end(Signal::TERM);
    assert!(status.success());
    let sim = Sim::start_in(folder, &arguments);
    let mut master = Master::new(&sim);
    master.until(0x709, &[PRE_OPERATIONAL]);
    assert_eq!((master.read(9, 0x2708, 0), master.read(9, 0x2003, 0)), (9, 77));
}

/// Runs modules with one EEPROM, one after the other.
#[test]
fn two_firmwares_share_a_file() {
    let canopen = [&LINKS[..], &["--eeprom", "{}/eeprom.bin"]].concat();
    let tmcl = ["--tcp", "127.0.0.1:0", "--eeprom", "{}/eeprom.bin"];
    let contents = |sim: &Sim| std::fs::read(sim.path("eeprom.bin")).unwrap();
    let sim = Sim::start(&tmcl);
    let mut host = sim.tcp();
    host.ok("SAP 4, 0, 1234");
    host.ok("STAP 4, 0");
    let stored = contents(&sim);
    let (_, folder) = sim.end(Signal::TERM);
    // The settings of TMCL are defaults to a node, and stay while it saves nothing.
    let sim = Sim::start_in(folder, &canopen);
    let mut master = Master::new(&sim);
    assert_eq!(master.read(1, 0x2708, 0), 1);
    master.write(1, 0x2705, 0, &[9]);
    pass(&sim, 50);
    assert!(contents(&sim) == stored);
    let (_, folder) = sim.end(Signal::TERM);
    let sim = Sim::start_in(folder, &tmcl);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1234);
    let (_, folder) = sim.end(Signal::TERM);
    // Once it saves, they are gone; and then those of the node are defaults to TMCL, and stay likewise.
    let sim = Sim::start_in(folder, &canopen);
    let mut master = Master::new(&sim);
    master.write(1, 0x2705, 0, &[9]);
    master.write(1, 0x1010, 1, b"save");
    // The second copies are written behind the confirmation.
    pass(&sim, 200);
    let saved = contents(&sim);
    assert!(saved != stored);
    let (_, folder) = sim.end(Signal::TERM);
    let sim = Sim::start_in(folder, &tmcl);
    let mut host = sim.tcp();
    assert_eq!((host.ok("GAP 4, 0"), host.ok("GGP 71, 0")), (1000, 1));
    assert!(contents(&sim) == saved);
    host.ok("SAP 4, 0, 1500");
    host.ok("STAP 4, 0");
    let (_, folder) = sim.end(Signal::TERM);
    let sim = Sim::start_in(folder, &canopen);
    assert_eq!(Master::new(&sim).read(1, 0x2708, 0), 1);
}
