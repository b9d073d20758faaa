//! Hosts of a fleet whose time is paused.

use hal_sim::clock::{Nanos, SECOND};
use hal_sim::control::{Line, State};
use tmcm::can::{CanFrame, Frame, Id};
use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::{can, text};
use tmcm_sim::client::{Client, Sent};
use tmcm_sim::fleet::{Fleet, Heard, Node};
use tmcm_sim::{Model, NativeModule, VirtualModule, WorldConfig};

/// The client on USB, where there is only one.
pub(crate) const HOST: Client = Client(7);
/// The adapter on the CAN bus.
pub(crate) const ADAPTER: u64 = 3;

/// The telegram of a command in text.
pub(crate) fn telegram(address: u8, line: &str) -> Telegram {
    binary::encode_command(address, text::parse(line).unwrap())
}

/// The frame of a command in text.
pub(crate) fn tmcl_frame(id: u16, line: &str) -> Frame {
    Frame::standard(id, &can::encode_command(text::parse(line).unwrap())).unwrap()
}

/// The frame that reads an object of a CANopen node.
pub(crate) fn sdo_read(node: u16, index: u16, sub: u8) -> Frame {
    let [low, high] = index.to_le_bytes();
    Frame::standard(0x600 + node, &[0x40, low, high, sub, 0, 0, 0, 0]).unwrap()
}

/// The frame that writes an object of a CANopen node.
pub(crate) fn sdo_write(node: u16, index: u16, sub: u8, value: &[u8]) -> Frame {
    let [low, high] = index.to_le_bytes();
    let mut data = [0x23 | (4 - value.len() as u8) << 2, low, high, sub, 0, 0, 0, 0];
    data[4..4 + value.len()].copy_from_slice(value);
    Frame::standard(0x600 + node, &data).unwrap()
}

/// The telegrams in what has come.
pub(crate) fn replies(bytes: &[u8]) -> Vec<Received> {
    let (telegrams, rest) = bytes.as_chunks();
    assert!(rest.is_empty(), "part of a telegram: {bytes:?}");
    telegrams.iter().map(|telegram| binary::decode_reply(telegram).unwrap()).collect()
}

/// The identifier of a frame of a module.
pub(crate) fn id(heard: &Heard) -> Option<u16> {
    let Id::Standard(id) = heard.frame.id() else { return None };
    matches!(heard.from, Node::Module(_)).then_some(id.as_raw())
}

/// A fleet whose owner lets no time pass unasked.
pub(crate) struct Paused<M = NativeModule> {
    pub(crate) fleet: Fleet<M>,
}

impl Paused {
    /// A fleet of one TMCM-1140.
    pub(crate) fn new() -> Self {
        Self::of(Model::default(), 1)
    }

    /// So many modules.
    pub(crate) fn of(model: impl Into<Model>, count: usize) -> Self {
        Paused { fleet: Fleet::of(model, &WorldConfig::default(), &vec![None; count], 1) }
    }
}

impl<M: VirtualModule> Paused<M> {
    /// Serves all that is outstanding; gives the time that this took.
    pub(crate) fn serve(&mut self) -> Nanos {
        let begun = self.fleet.now();
        while self.fleet.serve(begun + 60 * SECOND) {}
        self.fleet.now() - begun
    }

    /// The messages that have been sent over the USB link of module 1.
    pub(crate) fn sent(&mut self) -> Vec<Sent> {
        std::iter::from_fn(|| self.fleet.sent()).map(|(module, sent)| (module == 0).then_some(sent).unwrap()).collect()
    }

    /// Sends a command over USB, serves it, and gives the bytes that come back and how long it took.
    pub(crate) fn exchange(&mut self, line: &str) -> (Vec<u8>, Nanos) {
        self.fleet.hear_usb(HOST, &telegram(1, line));
        let took = self.serve();
        (self.sent().into_iter().flat_map(|sent| sent.bytes).collect(), took)
    }

    /// The same for a command that succeeds: its value.
    pub(crate) fn ok(&mut self, line: &str) -> i32 {
        let (bytes, _) = self.exchange(line);
        let [reply] = replies(&bytes)[..] else { panic!("{line}: {bytes:?}") };
        assert_eq!(reply.status, 100, "{line}");
        reply.value
    }

    /// The same on the RS485 bus.
    pub(crate) fn exchange_rs485(&mut self, address: u8, line: &str) -> (Vec<u8>, Nanos) {
        self.fleet.send_rs485(&telegram(address, line));
        let took = self.serve();
        (self.fleet.rs485(), took)
    }

    /// The same on the CAN bus: the frames of modules.
    pub(crate) fn exchange_can(&mut self, frame: Frame) -> (Vec<Heard>, Nanos) {
        self.fleet.send_can(ADAPTER, frame);
        let took = self.serve();
        (self.heard(), took)
    }

    /// The frames of modules since the last call.
    pub(crate) fn heard(&mut self) -> Vec<Heard> {
        std::iter::from_fn(|| self.fleet.can()).filter(|heard| id(heard).is_some()).collect()
    }

    /// The event of command 138 comes when the motor has arrived, is no reply, and lets no time pass by itself.
    pub(crate) fn event_moves_no_time(&mut self) {
        self.ok("138, 0, 0, 1");
        self.ok("MVP REL, 0, 100");
        let answered = self.fleet.answered();
        assert_eq!(self.serve(), 0);
        self.fleet.run(SECOND);
        let sent = self.sent();
        assert_eq!((sent.len(), sent[0].bytes[2], self.fleet.answered()), (1, 128, answered));
    }

    /// Carries out a command of the control protocol.
    pub(crate) fn control(&mut self, line: &str) -> Option<State> {
        self.fleet.control(&Line::parse(line).unwrap()).unwrap()
    }

    /// The same when `delay` has passed.
    pub(crate) fn at(&mut self, delay: Nanos, line: &str) {
        self.fleet.at(delay, Line::parse(line).unwrap()).unwrap();
    }
}
