//! A virtual module that runs the firmware's core on the simulated board.

mod around;
mod board;
mod canopen;
mod due;
mod firmware;
mod peek;
mod periphery;
mod ports;
mod product;
mod quiet;
mod running;
mod tmcl;
mod traffic;

use std::cell::RefMut;

use hal_sim::board::{Board, SharedBoard};
use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::fault::CanState;
use hal_sim::world::config::WorldConfig;
use tmcm::can::Frame;
use tmcm::module::Source;
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;
use tmcm::units::Micros;
use tmcm::vm::Machine;

pub use board::{Motion, Simulated, Tmc429s, Wired, parts};
pub use peek::check as may_peek;
pub use product::{FirmwareKind, Model, Product};

use crate::client::{Client, Sent};
use crate::module::{Hearing, Rs485, VirtualModule};
use crate::tracer::Step;
use running::{Running, Start};
use traffic::Traffic;

/// A module with its board and world. Between two calls of its owner it polls the firmware whenever that is due.
pub struct NativeModule {
    model: Model,
    board: SharedBoard,
    firmware: Option<Box<dyn Running>>,
    seed: u32,
    /// Bit rate of RS485 as it was when the firmware started; `None` if it leaves the port off.
    baud: Option<u32>,
    /// The time that the microcontroller's clock shows whenever the firmware starts.
    clock: Micros,
    /// The present for those who bring bytes. A request that takes time takes the board's clock beyond the present.
    present: Nanos,
    traffic: Traffic,
    /// The USB cable is in.
    plugged: bool,
    /// The commands of programs are recorded.
    tracing: bool,
    /// Polls that change nothing are left out.
    skips: bool,
    /// Messages for a person, such as that of an EEPROM with unknown contents.
    log: Vec<String>,
}

impl NativeModule {
    /// A TMCM-1140 with the TMCL firmware in the world described by `config`, switched on at time 0. `eeprom` are the
    /// contents of the EEPROM, fresh if `None`; `seed` makes everything that is random.
    pub fn new(config: &WorldConfig, eeprom: Option<&[u8]>, seed: u32) -> Self {
        Self::of(Model::default(), config, eeprom, seed)
    }

    /// A module of any product or firmware, as [`NativeModule::new`] has it.
    pub fn of(model: impl Into<Model>, config: &WorldConfig, eeprom: Option<&[u8]>, seed: u32) -> Self {
        Self::with_clock(model, config, eeprom, seed, Micros(0))
    }

    /// The same, but whenever the firmware starts the microcontroller's clock shows `clock` already. So what happens
    /// after weeks, such as the wrapping of a counter of milliseconds, is seen within seconds.
    pub fn with_clock(
        model: impl Into<Model>,
        config: &WorldConfig,
        eeprom: Option<&[u8]>,
        seed: u32,
        clock: Micros,
    ) -> Self {
        let model = model.into();
        let mut board = Board::of_kind(model.product().kind(), config, seed.into());
        if let Some(contents) = eeprom {
            board.at25_mut().load(contents);
        }
        let mut module = NativeModule {
            model,
            board: SharedBoard::new(board),
            firmware: None,
            seed,
            baud: None,
            clock,
            present: 0,
            traffic: Traffic::default(),
            plugged: true,
            tracing: false,
            skips: true,
            log: Vec::new(),
        };
        module.boot(None);
        module
    }

    /// The model of the module.
    pub fn model(&self) -> Model {
        self.model
    }

    /// The board, with the chips and the world on it.
    pub fn board(&self) -> &SharedBoard {
        &self.board
    }

    /// Lets `span` nanoseconds pass.
    pub fn run(&mut self, span: Nanos) {
        self.run_until(self.now() + span);
    }

    /// A telegram arrives now over a link that nobody shares.
    pub fn receive(&mut self, source: Source, telegram: Telegram) {
        self.hear(source, Client::default(), &telegram);
    }

    /// Bytes of one of the clients that share a link arrive now. Now is the module's own time, which a request may have
    /// taken beyond the time up to which the module was run.
    pub fn hear(&mut self, source: Source, client: Client, bytes: &[u8]) {
        self.present = self.now();
        VirtualModule::hear(self, source, client, bytes);
    }

    /// A frame arrives on the CAN bus now, in the module's own time.
    pub fn receive_frame(&mut self, frame: Frame) {
        self.present = self.now();
        VirtualModule::receive_frame(self, &frame);
    }

    /// The oldest of the replies that are on the wire now, in the module's own time.
    pub fn sent(&mut self) -> Option<Sent> {
        self.present = self.now();
        VirtualModule::sent(self)
    }

    /// Sends a telegram over a link that nobody shares and waits for the reply, as a host does. What has come before is
    /// thrown away; `None` if there is no reply within `patience` nanoseconds.
    pub fn exchange(&mut self, source: Source, telegram: Telegram, patience: Nanos) -> Option<Sent> {
        while self.sent().is_some() {}
        let end = self.now() + patience;
        self.receive(source, telegram);
        while self.now() < end {
            self.run_until(self.next_event().map_or(end, |next| next.min(end)));
            let reply = self.sent();
            if reply.is_some() {
                return reply;
            }
        }
        None
    }

    /// The interpreter, to look at; `None` without power, and in a firmware that executes no programs.
    pub fn machine(&self) -> Option<&Machine> {
        self.firmware.as_ref()?.firmware().machine()
    }

    /// Where the firmware knows the motor of an axis to be, and its target in the modes that have one, in microsteps;
    /// `None` without power, or without such an axis. Looking costs the module no time.
    pub fn position(&self, axis: usize) -> Option<(i32, Option<i32>)> {
        self.firmware.as_ref()?.firmware().position(axis)
    }

    /// True if the next poll of the firmware begins the turn of a millisecond; a turn has later pieces, too.
    pub fn begins_turn(&self) -> bool {
        self.firmware.as_ref().is_some_and(|running| {
            let firmware = running.firmware();
            firmware.takes_inputs(firmware.deadline())
        })
    }

    /// Leaves polls of the firmware out that change nothing, as it does from the start, or polls it each millisecond.
    /// There is no difference but in the time that it takes.
    pub fn skip(&mut self, on: bool) {
        self.skips = on;
    }

    /// The firmware's answer to a command that reads a value in its memory: at once and past all links.
    pub fn read(&mut self, command: Command) -> Option<i32> {
        let (firmware, now) = self.firmware.as_mut()?.ask();
        firmware.read(now, command)
    }

    /// Records the commands that programs execute, from now on or no more.
    pub fn trace(&mut self, on: bool) {
        self.tracing = on;
        if let Some(tracer) = self.firmware.as_mut().and_then(|firmware| firmware.ask().0.tracer()) {
            tracer.record(on);
        }
    }

    /// The commands that have been recorded since the last call.
    pub fn take_steps(&mut self) -> Vec<Step> {
        self.firmware.as_mut().map(|firmware| firmware.take_steps()).unwrap_or_default()
    }

    fn boot(&mut self, kept: Option<[u32; 2]>) {
        let Self { board, clock, seed, tracing, .. } = self;
        let start = Start { board, clock: *clock, kept, seed: *seed, tracing: *tracing };
        let (mut firmware, messages) = self.model.start(start);
        self.log.extend(messages);
        self.traffic.start(firmware.firmware().link_settings().start);
        self.baud = firmware.firmware().baud_rate();
        firmware.deliver(&mut self.traffic);
        self.firmware = Some(firmware);
        // What is due at once comes before all requests: only then the firmware knows its inputs.
        while self.firmware.as_ref().is_some_and(|firmware| firmware.deadline() <= self.now()) {
            self.poll();
        }
    }

    fn poll(&mut self) {
        if self.firmware.as_mut().is_some_and(|firmware| firmware.poll(&mut self.traffic)) {
            let kept = self.firmware.take().and_then(|running| running.firmware().kept());
            self.board.borrow_mut().warm_reset();
            self.boot(kept);
        }
    }

    /// Lets the firmware serve requests, as long as there are any, they take no time that is not there yet and keep it
    /// from no poll.
    fn deliver(&mut self) {
        while self.traffic.has_unread()
            && self.now() <= self.present
            && let Some(firmware) = &mut self.firmware
            && firmware.serve(&mut self.traffic)
        {
            if firmware.deadline() <= self.board.now() {
                return;
            }
        }
    }

    /// The module takes part in the CAN bus, as far as its controller is concerned.
    fn is_on_can(&self) -> bool {
        self.board.borrow().can() != CanState::Off
    }
}

impl VirtualModule for NativeModule {
    type BoardMut<'a> = RefMut<'a, Board>;

    fn board_mut(&mut self) -> RefMut<'_, Board> {
        self.board.borrow_mut()
    }

    fn now(&self) -> Nanos {
        self.board.now()
    }

    fn run_until(&mut self, to: Nanos) {
        self.present = self.present.max(to);
        loop {
            self.deliver();
            let skips = self.skips;
            let due = |firmware: &mut Box<dyn Running>| {
                if skips { firmware.skip(to, &self.traffic) } else { firmware.deadline() }
            };
            let poll = self.firmware.as_mut().map(due).filter(|at| *at <= to);
            self.board.advance_to(poll.unwrap_or(to));
            if poll.is_none() {
                return;
            }
            self.poll();
        }
    }

    fn next_event(&self) -> Option<Nanos> {
        let reply = self.traffic.outbox.iter().map(|sent| sent.at).min();
        let request = Some(self.now()).filter(|now| *now > self.present && self.traffic.has_unread());
        let poll = self
            .firmware
            .as_ref()
            .map(|firmware| if self.skips { firmware.acts(&self.traffic) } else { firmware.deadline() });
        [reply, request, poll].into_iter().flatten().min()
    }

    fn set_power(&mut self, on: bool) {
        if on == self.firmware.is_some() {
            return;
        }
        if on {
            self.board.borrow_mut().power_on();
            self.boot(None);
        } else {
            self.firmware = None;
            self.traffic = Traffic::default();
            self.board.borrow_mut().power_off();
        }
    }

    fn plug_usb(&mut self, on: bool) {
        if on == self.plugged {
            return;
        }
        self.plugged = on;
        self.traffic.outbox.retain(|sent| sent.source != Source::Usb);
        self.traffic.waiting.retain(|(source, _)| *source != Source::Usb);
        if let Some(firmware) = &mut self.firmware {
            firmware.ask().0.forget(Source::Usb);
            self.traffic.ports.unplug_usb(firmware.firmware().link_settings().start);
        }
    }

    fn hear(&mut self, source: Source, client: Client, bytes: &[u8]) {
        if let Some(firmware) = &mut self.firmware
            && (self.plugged || source != Source::Usb)
            && (self.baud.is_some() || source != Source::Rs485)
        {
            self.traffic.ports.push(source, client, bytes, firmware.firmware().link_settings());
            self.deliver();
        }
    }

    fn overhear(&mut self, byte: u8) {
        VirtualModule::hear(self, Source::Rs485, Client::default(), &[byte]);
    }

    fn silence(&mut self, source: Source, client: Client) {
        self.traffic.ports.silence(source, client);
    }

    fn sent(&mut self) -> Option<Sent> {
        let ready = self.traffic.outbox.iter().position(|sent| sent.at <= self.present)?;
        self.traffic.outbox.remove(ready)
    }

    fn receive_frame(&mut self, frame: &Frame) {
        if self.is_on_can()
            && self.firmware.as_ref().is_some_and(|firmware| firmware.firmware().accepts(frame, &self.traffic.filters))
        {
            self.traffic.frames_in.push_back(*frame);
            self.deliver();
        }
    }

    fn frame(&mut self) -> Option<Frame> {
        if !self.is_on_can() {
            self.traffic.frames_out.clear();
        }
        self.traffic.frames_out.pop_front()
    }

    fn set_can(&mut self, state: CanState) {
        self.board.borrow_mut().set_can(state);
        if let Some(firmware) = &mut self.firmware {
            firmware.deliver(&mut self.traffic);
        }
        if state == CanState::Off {
            self.traffic.frames_in.clear();
            self.traffic.frames_out.clear();
        }
    }

    fn rs485(&self) -> Option<Rs485> {
        let settings = self.firmware.as_ref()?.firmware().link_settings();
        let pause = Nanos::from(settings.pause) * MILLISECOND;
        self.baud.map(|baud| Rs485 { baud: baud.into(), pause: Some(pause) })
    }

    fn unread(&self, source: Source, client: Client) -> usize {
        self.traffic.ports.unread(source, client)
    }

    fn unread_frames(&self) -> usize {
        let Some(firmware) = &self.firmware else { return 0 };
        self.traffic.frames_in.iter().filter(|frame| firmware.firmware().is_addressed(frame)).count()
    }

    fn owes(&self, source: Source, client: Client) -> bool {
        self.traffic.ports.unread(source, client) > 0
            || self.traffic.outbox.iter().any(|sent| (sent.source, sent.client) == (source, client))
            || self.traffic.waiting.contains(&(source, client))
    }

    fn hearing(&self, source: Source) -> Hearing {
        match &self.firmware {
            Some(firmware) if self.plugged || source != Source::Usb => {
                if firmware.firmware().is_restarting() {
                    Hearing::Soon
                } else {
                    Hearing::Now
                }
            }
            _ => Hearing::Off,
        }
    }

    fn awaits(&self, source: Source, client: Client) -> bool {
        let Some(firmware) = &self.firmware else { return false };
        let Traffic { ports, outbox, frames_in, frames_out, waiting, .. } = &self.traffic;
        if source == Source::Can {
            return firmware.firmware().awaits(source) || !frames_in.is_empty() || !frames_out.is_empty();
        }
        let is_reply = |sent: &Sent| sent.replies > 0 && (sent.source, sent.client) == (source, client);
        waiting.contains(&(source, client))
            || outbox.iter().any(is_reply)
            || ports.has_request(source, client, firmware.firmware().link_settings())
    }

    fn forget(&mut self, client: Client) {
        self.traffic.subscriber = self.traffic.subscriber.filter(|subscriber| *subscriber != client);
        self.traffic.ports.forget(client);
    }

    fn is_busy(&self) -> bool {
        let Some(firmware) = &self.firmware else { return false };
        let waited_for = match firmware.firmware().subscriber() {
            Some((Source::Can, _)) => true,
            Some(_) => self.traffic.subscriber.is_some(),
            None => false,
        };
        let owes = self.traffic.has_unread() || !self.traffic.outbox.is_empty() || !self.traffic.waiting.is_empty();
        owes || firmware.firmware().awaits(Source::Can) || waited_for
    }

    fn peek(&mut self, command: Command) -> Result<i32, String> {
        let firmware = self.firmware.as_mut().ok_or("the module has no power, so it has no values")?;
        firmware.peek(command)
    }

    fn take_log(&mut self) -> Vec<String> {
        std::mem::take(&mut self.log)
    }

    fn stopped(&self) -> Option<String> {
        None
    }
}
