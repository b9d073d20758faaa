//! A virtual module that runs the firmware's flash image on the emulated microcontroller. It has the same interface,
//! [`VirtualModule`], as a [`NativeModule`](crate::native::NativeModule), which runs the firmware's core.
//!
//! The module's links are the peripherals of the microcontroller: bytes and frames take their time on the wire, and are
//! received only once the firmware has started.

mod asked;
mod cable;
mod encoder;
mod frames;
mod marker;

use std::collections::VecDeque;

use hal_sim::board::Board;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::fault::CanState;
use hal_sim::mcu::{CanBus, LogLine, Machine, Part, Stop, Waiting};
use hal_sim::world::config::WorldConfig;
use tmcm::can::Frame;
use tmcm::module::Source;
use tmcm::tmcl::Command;

use crate::client::{Client, Sent};
use crate::module::{Hearing, Rs485, VirtualModule};
use crate::native::Product;
use crate::pieces::Pieces;
use asked::{Answer, Asked, SILENCE};
use cable::{Cable, GAP};
use encoder::MissingEncoder;
use frames::{from_bus, to_bus};

pub use marker::model;

/// Interval at which bytes and frames that the module has sent are collected.
const POLL: Nanos = 250 * MICROSECOND;
/// Time that the firmware gets for its start.
const START: Nanos = 200 * MILLISECOND;
/// Longest time that the firmware's USB may take for its start.
const USB_START: Nanos = 2 * SECOND;
/// Time without any byte or frame after which no further reply of the module is expected.
const QUIET: Nanos = 100 * MILLISECOND;

/// The connections of a module, and how much of its log is printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Setup {
    /// True if a host is connected to USB.
    pub usb: bool,
    /// True if the whole log is printed, not only warnings and errors.
    pub log: bool,
}

/// A module with its board and world.
pub struct ImageModule {
    machine: Machine,
    setup: Setup,
    powered: bool,
    /// True while the USB cable is plugged in.
    plugged: bool,
    cable: Cable,
    /// The requests of the host that has the cable, and on the RS485 bus.
    asked_usb: Asked,
    asked_rs485: Asked,
    /// Until when a reply to a frame is expected.
    frames_until: Nanos,
    /// The telegram that the host on the RS485 bus has begun to send.
    rs485: Pieces,
    /// End of the silence on the RS485 bus that must follow the host's last bytes.
    silent_until: Nanos,
    sent: VecDeque<Sent>,
    frames: VecDeque<Frame>,
    encoder: MissingEncoder,
    /// When a byte or frame last went to the module or came from it.
    last_traffic: Nanos,
    /// The next time at which bytes and frames are collected, a multiple of [`POLL`]: so it does not depend on the
    /// times up to which the owner runs the module.
    poll: Nanos,
    /// When they were collected last.
    polled: Nanos,
    log: Vec<String>,
    stopped: Option<String>,
}

impl ImageModule {
    /// A TMCM-1140 that runs the image `elf` in the world described by `config`, and has started. `eeprom` has the
    /// contents of the EEPROM (fresh if `None`), `seed` starts all random numbers.
    ///
    /// # Errors
    /// The file is no image for this microcontroller, or the firmware cannot start.
    pub fn new(elf: &[u8], config: &WorldConfig, eeprom: Option<&[u8]>, seed: u32, setup: Setup) -> Result<Self, Stop> {
        Self::of(Product::Tmcm1140, elf, config, eeprom, seed, setup)
    }

    /// A module of any product for which there is an image, as [`ImageModule::new`] has it.
    ///
    /// # Errors
    /// Nothing is known of the product's microcontroller, the file is no image for it, or the firmware cannot start.
    pub fn of(
        product: Product,
        elf: &[u8],
        config: &WorldConfig,
        eeprom: Option<&[u8]>,
        seed: u32,
        setup: Setup,
    ) -> Result<Self, Stop> {
        let mut board = Board::of_kind(product.kind(), config, seed.into());
        if let Some(contents) = eeprom {
            board.at25_mut().load(contents);
        }
        let mut machine = Machine::new(elf, board)?;
        machine.usb().plug(setup.usb);
        machine.run(START)?;
        let mut log = Vec::new();
        if setup.usb {
            while !machine.usb().device().open && machine.now() < USB_START {
                machine.run(MILLISECOND)?;
            }
            let usb = machine.usb();
            let device = usb.device();
            if !device.open {
                let why = device.failed.unwrap_or("no device shows itself");
                log.push(format!("the image offers no serial port on USB: {why}"));
            }
        }
        if setup.log && !machine.log().is_readable() {
            log.push("the image has no log that can be read: it is to be built with defmt and defmt-rtt".into());
        }
        let mut module = ImageModule {
            poll: machine.now(),
            polled: machine.now(),
            machine,
            setup,
            powered: true,
            plugged: setup.usb,
            cable: Cable::default(),
            asked_usb: Asked::default(),
            asked_rs485: Asked::default(),
            frames_until: 0,
            rs485: Pieces::default(),
            silent_until: 0,
            sent: VecDeque::new(),
            frames: VecDeque::new(),
            encoder: MissingEncoder::of(product),
            last_traffic: 0,
            log,
            stopped: None,
        };
        module.look_after();
        Ok(module)
    }

    /// The emulated microcontroller.
    pub fn machine(&mut self) -> &mut Machine {
        &mut self.machine
    }

    /// Lets virtual time pass until `to`. If the firmware does something that cannot be emulated, virtual time stops
    /// for good, and [`VirtualModule::stopped`] tells why.
    pub fn run_until(&mut self, to: Nanos) {
        while self.stopped.is_none() && self.machine.now() < to {
            if let Err(stop) = self.machine.run_until(to.min(self.poll)) {
                self.stopped = Some(stop.to_string());
            }
            if self.machine.now() >= self.poll {
                self.look_after();
            }
        }
    }

    /// Collects what the module has sent, and brings it what waits.
    fn look_after(&mut self) {
        self.collect();
        self.feed();
        // A module may send by itself after a start with another bit rate.
        self.connect_can();
        self.polled = self.machine.now();
        self.poll = (self.polled / POLL + 1) * POLL;
    }

    /// Connects the CAN controller to its bus, which takes on the module's bit rate. A module whose controller is not
    /// running misses the frames of the bus.
    fn connect_can(&mut self) {
        let state = self.machine.board().can();
        let (inhabited, shorted) = (state == CanState::On, state == CanState::Off);
        let bit_rate = self.machine.bit_rates().can;
        let mut can = self.machine.can();
        let bus = CanBus { bit_rate: bit_rate.unwrap_or(can.bus().bit_rate), inhabited, shorted };
        if can.bus() != bus {
            can.set_bus(bus);
        }
    }

    /// Sends waiting bytes of the hosts over USB, and resets the cable if that is due.
    fn feed(&mut self) {
        let now = self.machine.now();
        if !self.cable.has_unread() || !self.machine.usb().device().open || self.machine.waiting().usb > 0 {
            return;
        }
        if self.machine.board().at25().is_writing() {
            self.cable.wait(now);
        }
        if self.cable.must_be_reset(now) {
            self.machine.usb().reset();
            self.asked_usb = Asked::default();
        } else if let (before, Some(bytes)) = (self.cable.speaker(), self.cable.next(now)) {
            if self.cable.speaker() != before {
                self.asked_usb = Asked::default();
            }
            self.asked_usb.ask(&bytes, now);
            self.machine.usb().send(&bytes);
            self.last_traffic = now;
        }
    }

    /// Sends bytes to the module on the RS485 bus, at the module's own bit rate. When the last of them will have come.
    fn send_rs485(&mut self, bytes: &[u8], gap: bool) -> Nanos {
        let Some(baud) = self.machine.bit_rates().rs485 else { return 0 };
        let now = self.machine.now();
        let end = self.machine.rs485().send_at(now.max(self.silent_until), bytes, baud);
        self.silent_until = if gap { end.max(now) + GAP } else { 0 };
        self.last_traffic = now;
        end.max(now)
    }

    /// The number of these answers of the module.
    fn count(&mut self, answers: &[Answer]) -> u64 {
        self.log.extend(answers.iter().filter_map(|answer| self.encoder.send_answer(answer)));
        answers.len() as u64
    }

    /// Collects the bytes, frames and log lines that the module has sent.
    fn collect(&mut self) {
        let now = self.machine.now();
        let waiting = self.sent.len() + self.frames.len();
        for character in self.machine.rs485().take_sent().into_iter().filter(|character| character.driven) {
            let (at, source, client, bytes) = (character.end, Source::Rs485, Client::default(), vec![character.value]);
            let answers = self.asked_rs485.hear(&bytes, now);
            let replies = self.count(&answers);
            self.sent.push_back(Sent { at, source, client, bytes, replies });
        }
        for (at, bytes) in self.machine.usb().take() {
            let client = self.cable.hear(now, bytes.len());
            let answers = self.asked_usb.hear(&bytes, now);
            let replies = self.count(&answers);
            self.sent.push_back(Sent { at, source: Source::Usb, client, bytes, replies });
        }
        for frame in self.machine.can().take_sent().into_iter().filter_map(|(_, frame)| from_bus(&frame)) {
            self.log.extend(self.encoder.send_frame(&frame));
            self.frames.push_back(frame);
        }
        if self.sent.len() + self.frames.len() > waiting {
            self.last_traffic = now;
        }
        if let Some(end) = self.machine.board().at25().next_event() {
            self.asked_usb.works(end);
            self.asked_rs485.works(end);
            if self.polled < self.frames_until {
                self.frames_until = self.frames_until.max(end + SILENCE);
            }
        }
        let told = |line: &LogLine| self.setup.log || matches!(line.level.as_str(), "warn" | "error");
        let lines = self.machine.log().take().into_iter().filter(told);
        self.log.extend(lines.map(|LogLine { timestamp, level, text }| format!("{timestamp} {level}: {text}")));
    }
}

impl VirtualModule for ImageModule {
    type BoardMut<'a> = Part<'a, Board>;

    fn board_mut(&mut self) -> Part<'_, Board> {
        self.machine.board()
    }

    fn now(&self) -> Nanos {
        self.machine.now()
    }

    fn run_until(&mut self, to: Nanos) {
        ImageModule::run_until(self, to);
    }

    fn next_event(&self) -> Option<Nanos> {
        self.stopped.is_none().then_some(self.poll)
    }

    fn set_power(&mut self, on: bool) {
        if on != self.powered {
            self.powered = on;
            self.machine.set_power(on);
            self.cable.cut();
            (self.asked_usb, self.asked_rs485, self.frames_until) = (Asked::default(), Asked::default(), 0);
            self.rs485 = Pieces::default();
            self.silent_until = 0;
            self.sent.clear();
            self.frames.clear();
        }
    }

    fn plug_usb(&mut self, on: bool) {
        if on != self.plugged {
            self.plugged = on;
            self.machine.usb().plug(on);
            self.cable.cut();
            self.asked_usb = Asked::default();
            self.sent.retain(|sent| sent.source != Source::Usb);
        }
    }

    fn hear(&mut self, source: Source, client: Client, bytes: &[u8]) {
        match source {
            _ if !self.powered => {}
            Source::Usb if !self.plugged => {}
            Source::Usb => {
                self.cable.push(client, bytes);
                self.feed();
            }
            Source::Rs485 => {
                for whole in self.rs485.push(bytes) {
                    let end = self.send_rs485(&whole, false);
                    self.asked_rs485.ask(&whole, end);
                }
            }
            Source::Can => {}
        }
    }

    fn overhear(&mut self, byte: u8) {
        let end = self.send_rs485(&[byte], false);
        // Another module has answered in this one's place.
        self.asked_rs485.hear(&[byte], end);
    }

    fn silence(&mut self, source: Source, client: Client) {
        match source {
            Source::Usb => {
                self.cable.silence(client);
                self.feed();
            }
            Source::Rs485 => {
                if let Some(rest) = self.rs485.silence() {
                    self.send_rs485(&rest, true);
                }
            }
            Source::Can => {}
        }
    }

    fn sent(&mut self) -> Option<Sent> {
        self.sent.pop_front()
    }

    fn receive_frame(&mut self, frame: &Frame) {
        self.connect_can();
        // On wires that touch each other the others do not send, either.
        if self.machine.board().can() == CanState::Off {
            return;
        }
        self.encoder.hear_frame(frame);
        self.machine.can().send(to_bus(frame));
        self.last_traffic = self.machine.now();
        self.frames_until = self.frames_until.max(self.last_traffic + SILENCE);
    }

    fn frame(&mut self) -> Option<Frame> {
        self.frames.pop_front()
    }

    /// While the controller is to be off, the wires of its bus touch each other; while it is to be passive, nobody
    /// acknowledges its frames. So it gets there with the next frame that it wants to send.
    fn set_can(&mut self, state: CanState) {
        self.machine.board().set_can(state);
        self.connect_can();
    }

    fn rs485(&self) -> Option<Rs485> {
        self.machine.bit_rates().rs485.map(|baud| Rs485 { baud: baud.into(), pause: None })
    }

    fn unread(&self, source: Source, client: Client) -> usize {
        match source {
            Source::Usb => self.cable.unread(client),
            Source::Rs485 => self.machine.waiting().rs485,
            Source::Can => 0,
        }
    }

    fn unread_frames(&self) -> usize {
        // Frames do not wait for a module whose CAN controller is not running.
        self.machine.bit_rates().can.map_or(0, |_| self.machine.waiting().can)
    }

    fn owes(&self, source: Source, client: Client) -> bool {
        source == Source::Usb && self.cable.owes(self.machine.now(), client)
    }

    /// Whether the firmware starts anew, is not seen from outside.
    fn hearing(&self, source: Source) -> Hearing {
        if self.powered && (self.plugged || source != Source::Usb) { Hearing::Now } else { Hearing::Off }
    }

    fn awaits(&self, source: Source, client: Client) -> bool {
        match source {
            Source::Usb => {
                let waits = self.cable.speaker() == client && self.asked_usb.waits(self.polled);
                self.plugged && (waits || self.cable.waiting(client).any(asked::is_answered))
            }
            Source::Rs485 => self.asked_rs485.waits(self.polled),
            Source::Can => !self.frames.is_empty() || self.unread_frames() > 0 || self.polled < self.frames_until,
        }
    }

    fn forget(&mut self, client: Client) {
        self.cable.forget(client);
    }

    fn take_ended(&mut self) -> Vec<Client> {
        self.cable.take_ended()
    }

    fn is_busy(&self) -> bool {
        let Waiting { rs485, usb, can } = self.machine.waiting();
        let unread = self.cable.has_unread() || rs485 + usb + can > 0;
        self.powered && (unread || self.machine.now() < self.last_traffic + QUIET)
    }

    fn peek(&mut self, _: Command) -> Result<i32, String> {
        Err("a module that runs its image tells its parameters only over a link: use what the world shows, such as \
             'position' and 'velocity'"
            .into())
    }

    fn take_log(&mut self) -> Vec<String> {
        std::mem::take(&mut self.log)
    }

    fn stopped(&self) -> Option<String> {
        self.stopped.clone()
    }
}
