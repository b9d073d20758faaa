//! The flash image of the CANopen firmware on the emulated microcontroller, with a master on its bus, in virtual time.

use std::sync::OnceLock;

use crate::image as build;
use crate::image_host::{Host, START};
use hal_sim::board::Board;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::mcu::{CanBus, CanFrame};
use hal_sim::world::config::WorldConfig;

/// Longest time that the master waits for a reply.
const PATIENCE: Nanos = 100 * MILLISECOND;

/// Mode of operation (6060h): profile position.
pub const PP: u32 = 1;
/// Mode of operation (6060h): profile velocity.
pub const PV: u32 = 3;
/// Controlword: operation enabled.
pub const ENABLE: u32 = 0xF;
/// Controlword: operation enabled, with a new set-point at once.
pub const GO: u32 = 0x1F;

/// The bytes of the image, which is built at the first call.
pub fn image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| std::fs::read(build::canopen()).unwrap())
}

/// A node that runs the image, and its master.
pub struct NodeHost {
    /// The module, of whose links only USB and CAN answer.
    pub host: Host,
    /// The node ID that the master uses.
    pub node: u8,
    /// Frames of the node that the test has not looked at, with the times of their ends.
    heard: Vec<(Nanos, CanFrame)>,
}

impl NodeHost {
    /// A node that has started, with a fresh EEPROM, in the world that the text describes.
    pub fn new(world: &str) -> Self {
        let mut rig = Self::just_on(world, None);
        rig.run(START);
        rig
    }

    /// A node that was switched on a moment ago, with these contents of its EEPROM, or a fresh one.
    pub fn just_on(world: &str, eeprom: Option<&[u8]>) -> Self {
        let mut board = Board::new(&WorldConfig::parse(world).unwrap(), 0);
        if let Some(contents) = eeprom {
            board.at25_mut().load(contents);
        }
        NodeHost { host: Host::on(board, image()), node: 1, heard: Vec::new() }
    }

    /// A node whose motor turns in profile velocity mode with 500 internal units, and which sends its heartbeat every
    /// 20 ms. Frames and log up to here have been looked at.
    pub fn moving() -> Self {
        let mut rig = Self::new("");
        rig.set(0x1017, 0, 20);
        rig.enable(PV);
        rig.set(0x60FF, 0, 500);
        rig.run(200 * MILLISECOND);
        assert_eq!(rig.host.speed(), 500);
        rig.frames();
        rig.host.log();
        rig
    }

    /// Lets virtual time pass.
    pub fn run(&mut self, span: Nanos) {
        self.host.run(span);
        let new = self.host.machine.can().take_sent();
        self.heard.extend(new);
    }

    /// The frames of the node since the last call: identifiers and data.
    pub fn frames(&mut self) -> Vec<(u32, Vec<u8>)> {
        self.timed().into_iter().map(|(_, id, data)| (id, data)).collect()
    }

    /// The same with the times of their ends.
    pub fn timed(&mut self) -> Vec<(Nanos, u32, Vec<u8>)> {
        self.run(0);
        let data = |frame: &CanFrame| frame.data[..frame.length.into()].to_vec();
        self.heard.drain(..).map(|(at, frame)| (at, frame.id, data(&frame))).collect()
    }

    /// The data of the frames with this identifier since the last look; the others are thrown away.
    pub fn of(&mut self, wanted: u32) -> Vec<Vec<u8>> {
        self.frames().into_iter().filter(|(id, _)| *id == wanted).map(|(_, data)| data).collect()
    }

    /// The emergency messages since the last look, as code, error register and manufacturer's field; the other frames
    /// are thrown away.
    pub fn emergencies(&mut self) -> Vec<(u16, u8, [u8; 2])> {
        let id = 0x80 + u32::from(self.node);
        self.of(id).iter().map(|data| (u16::from_le_bytes([data[0], data[1]]), data[2], [data[3], data[4]])).collect()
    }

    /// Others send a data frame, as soon as the bus is free.
    pub fn send(&mut self, id: u32, data: &[u8]) {
        self.host.machine.can().send(frame(id, data));
    }

    /// Others send a remote frame.
    pub fn send_remote(&mut self, id: u32) {
        let remote = CanFrame { remote: true, length: 1, ..frame(id, &[]) };
        self.host.machine.can().send(remote);
    }

    /// Sends a command of network management to the node.
    pub fn command(&mut self, command: u8) {
        self.send(0, &[command, self.node]);
    }

    /// Sends an SDO request and waits for the reply; other frames are kept.
    pub fn request(&mut self, request: [u8; 8]) -> [u8; 8] {
        self.post(request).unwrap_or_else(|| panic!("no reply to {request:02X?}: {:?}", self.host.log()))
    }

    /// Sends an SDO request and waits for the reply; `None` if none comes.
    pub fn post(&mut self, request: [u8; 8]) -> Option<[u8; 8]> {
        let id = u32::from(self.node);
        self.send(0x600 + id, &request);
        let end = self.host.machine.now() + PATIENCE;
        while self.host.machine.now() < end {
            self.run(50 * MICROSECOND);
            if let Some(place) = self.heard.iter().position(|(_, frame)| frame.id == 0x580 + id) {
                return Some(self.heard.remove(place).1.data);
            }
        }
        None
    }

    /// Reads a number without sign, of at most four bytes.
    pub fn read(&mut self, index: u16, sub: u8) -> u32 {
        let (value, _) = self.upload(index, sub);
        value
    }

    /// A number, and its length in bytes.
    fn upload(&mut self, index: u16, sub: u8) -> (u32, usize) {
        let [low, high] = index.to_le_bytes();
        let [command, data @ ..] = self.request([0x40, low, high, sub, 0, 0, 0, 0]);
        assert!(command & 0xF3 == 0x43 && data[..3] == [low, high, sub], "{index:04X}h.{sub}: {command:X} {data:X?}");
        (u32::from_le_bytes(data[3..].try_into().unwrap()), 4 - usize::from(command >> 2 & 3))
    }

    /// Writes a number; the error is the abort code.
    pub fn write(&mut self, index: u16, sub: u8, value: u32) -> Result<(), u32> {
        let (_, length) = self.upload(index, sub);
        self.download(index, sub, &value.to_le_bytes()[..length])
    }

    /// Writes up to four bytes; the error is the abort code.
    pub fn download(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let mut request = [0x23 | (4 - data.len() as u8) << 2, low, high, sub, 0, 0, 0, 0];
        request[4..4 + data.len()].copy_from_slice(data);
        let [command, reply @ ..] = self.request(request);
        if command == 0x80 { Err(u32::from_le_bytes(reply[3..].try_into().unwrap())) } else { Ok(()) }
    }

    /// Writes a number that the node must take.
    pub fn set(&mut self, index: u16, sub: u8, value: u32) {
        self.write(index, sub, value).unwrap_or_else(|code| panic!("{index:04X}h.{sub} = {value:X}h: {code:08X}h"));
    }

    /// The statusword.
    pub fn status(&mut self) -> u32 {
        self.read(0x6041, 0)
    }

    /// Has the drive enter OPERATION ENABLED in a mode, in which nothing moves yet.
    pub fn enable(&mut self, mode: u32) {
        self.set(0x6060, 0, mode);
        for word in [0x80, 6, 7, ENABLE] {
            self.set(0x6040, 0, word);
        }
        assert_eq!(self.status() & 0x6F, 0x27, "operation enabled");
        assert!(self.host.bridges_on());
    }

    /// Resets the node by its master, and waits until it has booted up; it has this node ID and bit rate then. What it
    /// has sent before is thrown away.
    pub fn reset(&mut self, node: u8, bit_rate: u32) {
        self.frames();
        let starts = self.host.machine.counters().starts;
        self.command(0x81);
        self.run(5 * MILLISECOND);
        assert_eq!(self.host.machine.counters().starts, starts + 1);
        self.host.machine.can().set_bus(CanBus { bit_rate, ..CanBus::default() });
        self.node = node;
        self.run(2 * START);
        let boot_up = (0x700 + u32::from(node), vec![0]);
        assert_eq!(self.frames(), [boot_up], "{:?}", self.host.log());
    }

    /// Switches the supply off and on again, and waits until the node has started.
    pub fn power_cycle(&mut self) {
        self.host.machine.set_power(false);
        self.host.run(10 * MILLISECOND);
        self.host.machine.set_power(true);
        self.run(START);
    }
}

/// A data frame.
pub fn frame(id: u32, data: &[u8]) -> CanFrame {
    let mut bytes = [0; 8];
    bytes[..data.len()].copy_from_slice(data);
    CanFrame { id, extended: false, remote: false, length: data.len() as u8, data: bytes }
}
