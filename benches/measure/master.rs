//! A master of CANopen that talks to the module, alone with it on the bus.

use hal_sim::board::Board;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::mcu::{CanFrame, Machine, Step};
use hal_sim::world::config::WorldConfig;

use super::host::{CYCLES_PER_MICROSECOND, Failure, START, duration};

/// The node ID of a fresh module.
pub(crate) const NODE: u32 = 1;
/// Identifiers, without the node ID where they have one.
pub(crate) const COMMAND: u32 = 0;
pub(crate) const SYNC: u32 = 0x80;
pub(crate) const EMERGENCY: u32 = 0x80 + NODE;
pub(crate) const REPLY: u32 = 0x580 + NODE;
pub(crate) const REQUEST: u32 = 0x600 + NODE;
/// Identifiers of the PDOs that the node sends and receives, the first of four each.
pub(crate) const TRANSMITTED: u32 = 0x180 + NODE;
pub(crate) const RECEIVED: u32 = 0x200 + NODE;
/// Distance of the identifiers of two PDOs.
pub(crate) const NEXT_PDO: u32 = 0x100;
/// Number of PDOs in each direction.
pub(crate) const PDOS: u32 = 4;

/// Commands of network management.
pub(crate) const GO_OPERATIONAL: u8 = 1;

/// Modes of operation.
pub(crate) const POSITION: u8 = 1;
pub(crate) const VELOCITY: u8 = 3;
pub(crate) const HOMING: u8 = 6;

/// How long the master waits for a reply, and how often it looks.
const PATIENCE: Nanos = 200 * MILLISECOND;
const LOOK: Nanos = 100 * MICROSECOND;

/// A frame of the node, with the core cycles at which it began and ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heard {
    pub(crate) begin: u64,
    pub(crate) end: u64,
    pub(crate) frame: CanFrame,
}

/// A node and its master.
pub(crate) struct Master {
    pub(crate) machine: Machine,
}

impl Master {
    /// Switches on a node with the image `elf`, in the world that the text describes.
    pub(crate) fn in_world(elf: &[u8], world: &str) -> Result<Self, Failure> {
        let board = Board::new(&WorldConfig::parse(world)?, 0);
        let mut master = Self { machine: Machine::new(elf, board)? };
        master.run(START)?;
        master.heard();
        Ok(master)
    }

    /// Switches on a node with the image `elf`.
    pub(crate) fn start(elf: &[u8]) -> Result<Self, Failure> {
        Self::in_world(elf, "")
    }

    /// The same, with its drive enabled in a mode, in operational state.
    pub(crate) fn enabled(elf: &[u8], mode: u8) -> Result<Self, Failure> {
        let mut master = Self::start(elf)?;
        master.enable(mode)?;
        master.command(GO_OPERATIONAL)?;
        Ok(master)
    }

    /// Has the drive enter OPERATION ENABLED in a mode.
    pub(crate) fn enable(&mut self, mode: u8) -> Result<(), Failure> {
        self.write(0x6060, 0, &[mode])?;
        for word in [0x80, 6, 7, 0xF] {
            self.write(0x6040, 0, &[word, 0])?;
        }
        Ok(())
    }

    /// Has PDOs act and be sent by SYNC: the first `received`, and all that are sent.
    pub(crate) fn synchronise(&mut self, received: u16) -> Result<(), Failure> {
        for pdo in 0..received {
            self.write(0x1400 + pdo, 2, &[1])?;
        }
        for pdo in 0..PDOS as u16 {
            self.write(0x1800 + pdo, 2, &[1])?;
        }
        Ok(())
    }

    /// Lets time pass.
    pub(crate) fn run(&mut self, span: Nanos) -> Result<(), Failure> {
        Ok(self.machine.run(span)?)
    }

    /// Lets time pass and shows each step of the core.
    pub(crate) fn watch(&mut self, span: Nanos, observer: &mut dyn FnMut(Step)) -> Result<(), Failure> {
        Ok(self.machine.observe_until(self.machine.now() + span, observer)?)
    }

    /// The core cycle of a time.
    pub(crate) fn cycle(&self, at: Nanos) -> u64 {
        let (now, cycles) = (self.machine.now(), self.machine.counters().cycles);
        if at > now {
            cycles + (at - now) * CYCLES_PER_MICROSECOND / 1_000
        } else {
            cycles - (now - at) * CYCLES_PER_MICROSECOND / 1_000
        }
    }

    /// Sends a frame as soon as the bus is free; gives the core cycle at which it ends on a bus that is free now.
    pub(crate) fn send(&mut self, id: u32, bytes: &[u8]) -> u64 {
        let mut data = [0; 8];
        for (to, byte) in data.iter_mut().zip(bytes) {
            *to = *byte;
        }
        let frame = CanFrame { id, extended: false, remote: false, length: bytes.len() as u8, data };
        self.machine.can().send(frame);
        self.cycle(self.machine.now() + duration(&frame))
    }

    /// Takes the frames that the node has sent since the last call.
    pub(crate) fn heard(&mut self) -> Vec<Heard> {
        let sent = self.machine.can().take_sent();
        let heard = |(end, frame): &(Nanos, CanFrame)| Heard {
            begin: self.cycle(end - duration(frame)),
            end: self.cycle(*end),
            frame: *frame,
        };
        sent.iter().map(heard).collect()
    }

    /// Sends a command of network management.
    pub(crate) fn command(&mut self, command: u8) -> Result<(), Failure> {
        self.send(COMMAND, &[command, NODE as u8]);
        self.run(MILLISECOND)
    }

    /// Sends the fourth PDO of the defaults, controlword and target velocity; gives the core cycle at which it ends.
    pub(crate) fn turn_at(&mut self, controlword: u8, target: i32) -> u64 {
        let [a, b, c, d] = target.to_le_bytes();
        self.send(RECEIVED + 3 * NEXT_PDO, &[controlword, 0, a, b, c, d])
    }

    /// Sends what a master sends in a cycle: the four PDOs of the defaults, and the SYNC.
    pub(crate) fn send_all(&mut self, controlword: u8, mode: u8, target: i32) {
        self.send(RECEIVED, &[controlword, 0]);
        self.send(RECEIVED + NEXT_PDO, &[controlword, 0, mode]);
        self.send(RECEIVED + 2 * NEXT_PDO, &[controlword, 0, 0, 0, 0, 0]);
        self.turn_at(controlword, target);
        self.send(SYNC, &[]);
    }

    /// Sends an SDO request and waits for the reply; gives the core cycle at which the request ended. Other frames are
    /// thrown away.
    pub(crate) fn ask(&mut self, request: [u8; 8]) -> Result<(u64, Heard), Failure> {
        self.ask_by(request, &mut |machine, to| machine.run_until(to))
    }

    /// The same, and shows each step of the core.
    pub(crate) fn observe(
        &mut self,
        request: [u8; 8],
        observer: &mut dyn FnMut(Step),
    ) -> Result<(u64, Heard), Failure> {
        self.ask_by(request, &mut |machine, to| machine.observe_until(to, observer))
    }

    fn ask_by(
        &mut self,
        request: [u8; 8],
        run: &mut dyn FnMut(&mut Machine, Nanos) -> Result<(), hal_sim::mcu::Stop>,
    ) -> Result<(u64, Heard), Failure> {
        self.heard();
        let asked = self.send(REQUEST, &request);
        let end = self.machine.now() + PATIENCE;
        while self.machine.now() < end {
            let to = self.machine.now() + LOOK;
            run(&mut self.machine, to)?;
            if let Some(reply) = self.heard().into_iter().find(|heard| heard.frame.id == REPLY) {
                return Ok((asked, reply));
            }
        }
        Err(format!("no reply to the SDO request {request:02X?}").into())
    }

    /// Reads an object of at most four bytes.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Result<u32, Failure> {
        let (_, reply) = self.ask(upload(index, sub))?;
        let [command, _, _, _, value @ ..] = reply.frame.data;
        let value = u32::from_le_bytes(value);
        if command & 0xE2 == 0x42 { Ok(value) } else { Err(refusal(index, sub, value).into()) }
    }

    /// Writes an object of at most four bytes, which the node must take.
    pub(crate) fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> Result<(), Failure> {
        let (_, reply) = self.ask(write(index, sub, value))?;
        let [command, _, _, _, code @ ..] = reply.frame.data;
        if command == 0x60 { Ok(()) } else { Err(refusal(index, sub, u32::from_le_bytes(code)).into()) }
    }
}

/// The request for an object.
pub(crate) const fn upload(index: u16, sub: u8) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [0x40, low, high, sub, 0, 0, 0, 0]
}

/// The request to write at most four bytes to an object.
pub(crate) const fn write(index: u16, sub: u8, value: &[u8]) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    let unused = 4 - value.len();
    let mut request = [0x23 | (unused as u8) << 2, low, high, sub, 0, 0, 0, 0];
    let mut place = 0;
    while place < value.len() {
        request[4 + place] = value[place];
        place += 1;
    }
    request
}

fn refusal(index: u16, sub: u8, code: u32) -> String {
    format!("object {index:04X}h.{sub}: the node answers {code:08X}h")
}
