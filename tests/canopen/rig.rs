//! The rig: a node on the simulated board in virtual time, and a master that talks to it by frames.

use std::collections::VecDeque;

use hal_sim::board::{self, AxisInputs, Board, Chip, SharedBoard, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::control::Line;
use hal_sim::world;
use hal_sim::world::config::WorldConfig;
use tmcm::can::{CanFrame, Frame, StandardId};
use tmcm::canopen::{Address, Node};
use tmcm::chip::at25::At25;
use tmcm::device::{self, Inputs};
use tmcm::motion::Sensors;
use tmcm::product::Tmcm1140Canopen;
use tmcm::store::{Keeper, LoadReport};
use tmcm::units::Micros;
use tmcm_sim::native::{self, parts};

/// The simulated board, as the firmware's types have it.
pub(crate) type Simulated = native::Simulated<(), Tmcm1140Canopen>;

/// Longest time that the master waits for a reply.
const PATIENCE: Nanos = 1_000 * MILLISECOND;

pub(crate) struct Rig {
    pub(crate) board: SharedBoard,
    pub(crate) node: Node<Simulated>,
    keeper: Keeper<SimSpi>,
    pub(crate) report: LoadReport,
    started: Nanos,
    keep: Micros,
    /// Frames of the node that the test has not looked at.
    heard: VecDeque<Frame>,
    /// Number of starts of the firmware.
    pub(crate) starts: u32,
    /// The board has no built-in encoder.
    pub(crate) lacks_encoder: bool,
}

impl Rig {
    /// A node with a fresh EEPROM that has just started.
    pub(crate) fn new() -> Self {
        Self::on(&SharedBoard::new(Board::of_kind(&board::TMCM_1140, &WorldConfig::default(), 1)), false)
    }

    /// A node whose EEPROM has these contents; `seed` makes what is random.
    pub(crate) fn with_eeprom(contents: &[u8], seed: u64) -> Self {
        let mut board = Board::of_kind(&board::TMCM_1140, &WorldConfig::default(), seed);
        board.at25_mut().load(contents);
        Self::on(&SharedBoard::new(board), false)
    }

    /// A node with a fresh EEPROM in a world that the text describes.
    pub(crate) fn in_world(toml: &str) -> Self {
        let world = WorldConfig::parse(toml).unwrap();
        Self::on(&SharedBoard::new(Board::of_kind(&board::TMCM_1140, &world, 1)), false)
    }

    /// A node with these contents of its EEPROM, on a board without a built-in encoder.
    pub(crate) fn without_encoder(contents: &[u8]) -> Self {
        let mut board = Board::of_kind(&board::TMCM_1140, &WorldConfig::default(), 1);
        board.at25_mut().load(contents);
        Self::on(&SharedBoard::new(board), true)
    }

    /// A node on a board.
    pub(crate) fn on(board: &SharedBoard, lacks_encoder: bool) -> Self {
        let (node, keeper, report) = start(board, None);
        let started = board.borrow().now();
        let mut rig = Rig {
            board: board.clone(),
            node,
            keeper,
            report,
            started,
            keep: Micros(0),
            heard: VecDeque::new(),
            starts: 1,
            lacks_encoder,
        };
        rig.poll();
        rig
    }

    /// A node in operational state, whose first frames have been heard.
    pub(crate) fn operational() -> Self {
        let mut rig = Self::new();
        rig.command(1);
        rig.run(2 * MILLISECOND);
        rig.frames();
        rig
    }

    fn restart(&mut self, kept: Option<Address>) {
        (self.node, self.keeper, self.report) = start(&self.board, kept);
        self.started = self.board.borrow().now();
        self.keep = Micros(0);
        self.starts += 1;
        self.poll();
    }

    /// The firmware's time.
    pub(crate) fn now(&self) -> Micros {
        Micros((self.board.borrow().now() - self.started) / MICROSECOND)
    }

    fn poll(&mut self) {
        let now = self.now();
        let mut inputs = read_inputs(&self.board);
        if self.lacks_encoder {
            inputs.axes[0].encoder = None;
        }
        let outputs = self.node.poll(now, &inputs);
        if now >= self.keep {
            self.keep = now.after(Micros::from_millis(1));
            if let Some(written) = self.keeper.poll(now, || self.node.store().next_job()) {
                self.node.stored(written);
            }
        }
        self.board.borrow_mut().set_outputs(world::Outputs {
            digital: outputs.digital.into(),
            pull_ups: outputs.pull_ups.into(),
            leds: [outputs.led, outputs.trouble],
        });
        self.hear();
        if outputs.restart {
            self.board.borrow_mut().warm_reset();
            self.restart(self.node.address());
        }
    }

    /// Takes what the node sends; without power it sends nothing.
    fn hear(&mut self) {
        if self.is_powered() {
            self.heard.extend(std::iter::from_fn(|| self.node.next_frame()));
        }
    }

    /// Lets virtual time pass.
    pub(crate) fn run(&mut self, span: Nanos) {
        let end = self.board.borrow().now() + span;
        while self.is_powered() {
            let due = self.started + self.node.deadline().0 * MICROSECOND;
            self.board.borrow_mut().advance_to(due.min(end));
            if due > end {
                return;
            }
            self.poll();
        }
        self.board.borrow_mut().advance_to(end);
    }

    /// Lets milliseconds pass.
    pub(crate) fn wait(&mut self, milliseconds: u64) {
        self.run(milliseconds * MILLISECOND);
    }

    pub(crate) fn is_powered(&self) -> bool {
        self.board.borrow().is_powered()
    }

    /// Gives the node a frame.
    pub(crate) fn give(&mut self, frame: &Frame) {
        let now = self.now();
        self.node.receive(now, frame);
        self.hear();
    }

    /// Sends a data frame.
    pub(crate) fn send(&mut self, id: u16, data: &[u8]) {
        self.give(&Frame::standard(id, data).unwrap());
    }

    /// Sends a remote frame.
    pub(crate) fn send_remote(&mut self, id: u16, length: usize) {
        self.give(&Frame::new_remote(StandardId::new(id).unwrap(), length).unwrap());
    }

    /// Sends a command of network management to the node.
    pub(crate) fn command(&mut self, command: u8) {
        let node = self.node.node_id();
        self.send(0, &[command, node]);
    }

    /// The frames of the node since the last call: identifiers and data.
    pub(crate) fn frames(&mut self) -> Vec<(u16, Vec<u8>)> {
        self.heard.drain(..).map(|frame| (id(&frame), frame.data().to_vec())).collect()
    }

    /// The data of the frames with this identifier since the last look; the others are thrown away.
    pub(crate) fn of(&mut self, wanted: u16) -> Vec<Vec<u8>> {
        self.frames().into_iter().filter(|(id, _)| *id == wanted).map(|(_, data)| data).collect()
    }

    /// Sends an SDO request and waits for the one reply; other frames are kept.
    pub(crate) fn request(&mut self, request: [u8; 8]) -> [u8; 8] {
        self.post(request).unwrap_or_else(|| panic!("no reply to {request:02X?}"))
    }

    /// Sends an SDO request and waits for the reply; `None` if the power goes before.
    pub(crate) fn post(&mut self, request: [u8; 8]) -> Option<[u8; 8]> {
        let node = u16::from(self.node.node_id());
        self.send(0x600 + node, &request);
        let end = self.board.borrow().now() + PATIENCE;
        loop {
            if let Some(place) = self.heard.iter().position(|frame| id(frame) == 0x580 + node) {
                return Some(self.heard.remove(place)?.bytes());
            }
            if !self.is_powered() || self.board.borrow().now() >= end {
                return None;
            }
            self.run(MILLISECOND / 4);
        }
    }

    /// Reads an object, in segments if the node answers so; the error is the abort code.
    pub(crate) fn upload(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        let [low, high] = index.to_le_bytes();
        let reply = self.request([0x40, low, high, sub, 0, 0, 0, 0]);
        checked(reply)?;
        assert_eq!(reply[1..4], [low, high, sub], "{index:04X}h:{sub}");
        if reply[0] & 2 != 0 {
            return Ok(reply[4..8 - usize::from(reply[0] >> 2 & 3)].to_vec());
        }
        let size = u32::from_le_bytes(reply[4..].try_into().unwrap()) as usize;
        let (mut data, mut toggle) = (Vec::new(), 0);
        loop {
            let reply = self.request([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            checked(reply)?;
            assert_eq!(reply[0] & 0xF0, toggle, "{index:04X}h:{sub}");
            data.extend(&reply[1..8 - usize::from(reply[0] >> 1 & 7)]);
            toggle ^= 0x10;
            if reply[0] & 1 != 0 {
                assert_eq!(data.len(), size);
                return Ok(data);
            }
        }
    }

    /// Reads a number without sign.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> u32 {
        let data = self.upload(index, sub).unwrap_or_else(|code| panic!("{index:04X}h:{sub}: {code:08X}h"));
        let mut bytes = [0; 4];
        bytes[..data.len()].copy_from_slice(&data);
        u32::from_le_bytes(bytes)
    }

    /// Writes an object of up to four bytes in one frame; the error is the abort code.
    pub(crate) fn download(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), u32> {
        let reply = self.request(expedited(index, sub, data));
        checked(reply)?;
        assert_eq!(reply, [0x60, expedited(index, sub, data)[1], (index >> 8) as u8, sub, 0, 0, 0, 0]);
        Ok(())
    }

    /// Writes a number with the length that the object has.
    pub(crate) fn write(&mut self, index: u16, sub: u8, value: u32) -> Result<(), u32> {
        let length = self.upload(index, sub).map_or(4, |data| data.len());
        self.download(index, sub, &value.to_le_bytes()[..length])
    }

    /// Writes a number that the node must take.
    pub(crate) fn set(&mut self, index: u16, sub: u8, value: u32) {
        let result = self.write(index, sub, value);
        result.unwrap_or_else(|code| panic!("{index:04X}h:{sub} = {value:X}h: {code:08X}h"));
    }

    /// Writes `save` or another signature.
    pub(crate) fn sign(&mut self, index: u16, sub: u8, signature: &[u8; 4]) -> Result<(), u32> {
        self.download(index, sub, signature)
    }

    /// Carries out a command of the control protocol.
    pub(crate) fn control(&mut self, line: &str) {
        let line = Line::parse(line).unwrap();
        line.control.apply(&mut self.board.borrow_mut()).unwrap();
    }

    /// The contents that the EEPROM would have after a power cut at this moment.
    pub(crate) fn eeprom(&self) -> Vec<u8> {
        self.board.borrow().at25().contents().to_vec()
    }

    /// Switches the supply off and on again.
    pub(crate) fn power_cycle(&mut self) {
        self.board.borrow_mut().power_off();
        let now = self.board.borrow().now();
        self.board.borrow_mut().advance_to(now + 10 * MILLISECOND);
        self.board.borrow_mut().power_on();
        self.heard.clear();
        self.restart(None);
        self.wait(1);
    }
}

/// The request that writes up to four bytes.
pub(crate) fn expedited(index: u16, sub: u8, data: &[u8]) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    let mut request = [0x23 | (4 - data.len() as u8) << 2, low, high, sub, 0, 0, 0, 0];
    request[4..4 + data.len()].copy_from_slice(data);
    request
}

/// The code of an abort.
pub(crate) fn checked(reply: [u8; 8]) -> Result<(), u32> {
    let code = u32::from_le_bytes(reply[4..].try_into().unwrap());
    if reply[0] == 0x80 { Err(code) } else { Ok(()) }
}

fn id(frame: &Frame) -> u16 {
    match frame.id() {
        tmcm::can::Id::Standard(id) => id.as_raw(),
        tmcm::can::Id::Extended(_) => panic!("a CANopen node sends no extended frames"),
    }
}

fn start(board: &SharedBoard, kept: Option<Address>) -> (Node<Simulated>, Keeper<SimSpi>, LoadReport) {
    let mut keeper = Keeper::new(At25::new(board.spi(Chip::At25, 2_625_000)));
    let mut report = LoadReport::default();
    let mut node = Node::new(parts(board));
    node.remember(kept);
    node.start(Micros(0), |store| report = keeper.load(store));
    (node, keeper, report)
}

fn read_inputs(board: &SharedBoard) -> Inputs<1> {
    let board = board.borrow();
    let (seen, axis) = (board.inputs(), board.axis_inputs(0));
    let mut analog = [0; device::ANALOG];
    analog[0] = seen.analog[0];
    let external = axis.abn.count as u16;
    let AxisInputs { stall, home, right, encoder, .. } = axis;
    let sensors = Sensors { stall, home, right, encoder, external, null: [None; 2] };
    Inputs {
        axes: [sensors],
        digital: seen.digital as u16,
        analog,
        supply: Some(seen.supply),
        temperature: seen.temperature as i16,
    }
}
