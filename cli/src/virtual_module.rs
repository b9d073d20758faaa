//! A virtual module: the firmware's core on the simulated board, in virtual time.
//!
//! Whoever owns it says how far time goes; in between it polls the firmware whenever that is due. Bytes
//! go in at the present time and come out with the time at which they are on the wire.

use std::cell::RefMut;
use std::collections::VecDeque;
use std::marker::PhantomData;
use std::task::Poll;

use hal_sim::board::{Board, Chip, SharedBoard, SimPin, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::world::Outputs;
use hal_sim::world::config::WorldConfig;
use hal_sim::world::stage::Abn;
use tmcm::can::Frame;
use tmcm::chip::at25::At25;
use tmcm::chip::tmc429::Tmc429;
use tmcm::device::{self, Controller, Inputs, Parts};
use tmcm::module::{
    Desk, Hooks, LinkEnds, LinkMode, LinkSettings, Module, Origin, Platform, Request, Source, TMCM_1140_AXES, Tmcm1140,
};
use tmcm::motion::Sensors;
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::store::{Integrity, Keeper, Report, Store};
use tmcm::tmcl::binary::Telegram;
use tmcm::tmcl::can;
use tmcm::tmcl::{Command, Reply, Status};
use tmcm::units::Micros;
use tmcm::vm::Machine;

use crate::client::{Client, Sent};
use crate::device::{Device, Rs485};
use crate::ports::{Arrived, Ports};
use crate::tracer::{Step, Tracer};

/// SPI clock of the TMC429: 84 MHz / 64, as on the target.
const TMC429_HZ: u32 = 1_312_500;
/// SPI clock of the TMC262: 84 MHz / 32.
const TMC262_HZ: u32 = 2_625_000;
/// SPI clock of the EEPROM: 42 MHz / 16.
const AT25_HZ: u32 = 2_625_000;
/// A USB transfer takes a frame: no reply comes sooner. Hosts count on it: they look at the speed right
/// after MVP and would take 0 for "arrived".
const USB_FRAME: Nanos = MILLISECOND;

/// The simulated board as a platform, with additions `H`.
#[derive(Debug)]
pub struct Simulated<H>(PhantomData<H>);

impl<H: Hooks> device::Board for Simulated<H> {
    type Product = Tmcm1140;
    type Hardware = Tmc429Tmc262<SimSpi, SimSpi>;
    type Controllers = [Controller<Self::Hardware>; 1];
    type Enable = SimPin;
    type Store = Box<Store<Tmcm1140>>;
}

impl<H: Hooks> Platform for Simulated<H> {
    type Hooks = H;
}

/// The parts of which a device on a simulated board is made.
pub fn parts<H: Hooks>(board: &SharedBoard) -> Parts<Simulated<H>, TMCM_1140_AXES> {
    Parts {
        controllers: [Controller::new(Tmc429::new(board.spi(Chip::Tmc429(0), TMC429_HZ)))],
        axes: Tmc429Tmc262::axes([board.spi(Chip::Tmc262(0), TMC262_HZ)]),
        enable: board.enable_pin(),
        store: Box::new(Store::new()),
    }
}

/// The firmware as a type.
type Core = Module<Simulated<Tracer>, TMCM_1140_AXES>;

/// The running firmware.
struct Firmware {
    core: Core,
    desk: Desk,
    keeper: Keeper<SimSpi>,
    /// Its byte links.
    ports: Ports,
    /// When it was started, and what its clock showed then.
    started: Nanos,
    clock: Micros,
    /// Edges of the encoder's null track that it has been told of: low, high.
    null_edges: [u64; 2],
    /// Bit rate of the RS485 interface since the start.
    baud: u64,
    /// When the EEPROM is looked after next.
    keep: Micros,
}

impl Firmware {
    fn time(&self, now: Nanos) -> Micros {
        self.clock.after(Micros((now - self.started) / MICROSECOND))
    }

    /// Where the encoder's null track became low, and high, since the last call.
    fn null_edges(&mut self, abn: Abn) -> [Option<u16>; 2] {
        let edges = [abn.null_low, abn.null_high];
        let before = std::mem::replace(&mut self.null_edges, edges.map(|edge| edge.times));
        std::array::from_fn(|n| (edges[n].times != before[n]).then_some(edges[n].count as u16))
    }

    fn deadline(&self) -> Nanos {
        self.started + self.core.deadline().since(self.clock).0 * MICROSECOND
    }
}

/// A module with its board and world.
pub struct VirtualModule {
    board: SharedBoard,
    firmware: Option<Firmware>,
    seed: u32,
    /// What the microcontroller's clock shows whenever the firmware starts.
    clock: Micros,
    /// The present for those who bring bytes. A request that takes time leaves it behind.
    present: Nanos,
    traffic: Traffic,
    /// The USB cable is in.
    plugged: bool,
    /// The commands of programs are recorded.
    tracing: bool,
    /// Messages for a person, such as that of an EEPROM with unknown contents.
    log: Vec<String>,
}

impl VirtualModule {
    /// A module in the world described by `config`, switched on at time 0. `eeprom` are the contents of the
    /// EEPROM, fresh if `None`; `seed` makes everything that is random.
    pub fn new(config: &WorldConfig, eeprom: Option<&[u8]>, seed: u32) -> Self {
        Self::with_clock(config, eeprom, seed, Micros(0))
    }

    /// The same, but whenever the firmware starts the microcontroller's clock shows `clock` already: so what happens after
    /// weeks, such as the wrapping of a ends of milliseconds, is seen within seconds.
    pub fn with_clock(config: &WorldConfig, eeprom: Option<&[u8]>, seed: u32, clock: Micros) -> Self {
        let mut board = Board::new(config, seed.into());
        if let Some(contents) = eeprom {
            board.at25_mut().load(contents);
        }
        let mut module = VirtualModule {
            board: SharedBoard::new(board),
            firmware: None,
            seed,
            clock,
            present: 0,
            traffic: Traffic::default(),
            plugged: true,
            tracing: false,
            log: Vec::new(),
        };
        module.boot();
        module
    }

    /// The board, with the chips and the world on it.
    pub fn board(&self) -> &SharedBoard {
        &self.board
    }

    /// Virtual time since the board was first switched on.
    pub fn now(&self) -> Nanos {
        self.board.borrow().now()
    }

    /// Lets time pass until `to`.
    pub fn run_until(&mut self, to: Nanos) {
        self.present = self.present.max(to);
        loop {
            self.deliver();
            let poll = self.firmware.as_ref().map(Firmware::deadline).filter(|at| *at <= to);
            self.board.borrow_mut().advance_to(poll.unwrap_or(to));
            if poll.is_none() {
                return;
            }
            self.poll();
        }
    }

    /// Lets `span` pass.
    pub fn run(&mut self, span: Nanos) {
        self.run_until(self.now() + span);
    }

    /// A telegram arrives over a link that nobody shares.
    pub fn receive(&mut self, source: Source, telegram: Telegram) {
        self.hear(source, Client::default(), &telegram);
    }

    /// Bytes from one of those who share a link arrive.
    pub fn hear(&mut self, source: Source, client: Client, bytes: &[u8]) {
        self.present = self.now();
        Device::hear(self, source, client, bytes);
    }

    /// Nothing has come from a client for so long that an unfinished telegram is given up.
    pub fn silence(&mut self, source: Source, client: Client) {
        if let Some(firmware) = &mut self.firmware {
            firmware.ports.silence(source, client);
        }
    }

    /// Sends a telegram over a link that nobody shares and waits for the reply, as a host does. What has come before is
    /// thrown away; there may be no reply within the time.
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

    /// The interpreter, to look at; `None` without power.
    pub fn machine(&self) -> Option<&Machine> {
        Some(self.firmware.as_ref()?.core.machine())
    }

    /// Where the firmware knows the motor to be, and where it is positioned to if it is; `None` without power. Looking
    /// costs the module no time.
    pub fn position(&self) -> Option<(i32, Option<i32>)> {
        let [axis] = self.firmware.as_ref()?.core.axes();
        Some((axis.last_position(), axis.target_position()))
    }

    /// What the firmware answers to a command that reads a value in its memory: at once and past all links.
    pub fn read(&mut self, command: Command) -> Option<i32> {
        let firmware = self.firmware.as_mut()?;
        let now = firmware.time(self.board.borrow().now());
        match firmware.core.execute(now, Source::Usb, command) {
            Poll::Ready(Some(Reply::Plain { status: Status::Ok, value, .. })) => Some(value),
            _ => None,
        }
    }

    /// Records the commands that programs execute, from now on or no more.
    pub fn trace(&mut self, on: bool) {
        self.tracing = on;
        if let Some(firmware) = &mut self.firmware {
            firmware.core.hooks().record(on);
        }
    }

    /// The commands that have been recorded since the last call.
    pub fn take_steps(&mut self) -> Vec<Step> {
        let Some(firmware) = &mut self.firmware else { return Vec::new() };
        let (started, clock) = (firmware.started, firmware.clock.0 * MICROSECOND);
        let mut steps = firmware.core.hooks().take();
        for step in &mut steps {
            step.at = started + (step.at - clock);
        }
        steps
    }

    /// A frame arrives on the CAN bus.
    pub fn receive_frame(&mut self, frame: Frame) {
        self.present = self.now();
        Device::receive_frame(self, &frame);
    }

    /// Frames that the module wants on the CAN bus by now, oldest first.
    pub fn frame(&mut self) -> Option<Frame> {
        self.traffic.frames_out.pop_front()
    }

    /// Replies that are on the wire by now, oldest first.
    pub fn sent(&mut self) -> Option<Sent> {
        self.present = self.now();
        Device::sent(self)
    }

    /// When something happens next that the owner may want to see: a reply or a poll, or the module can go on to the next
    /// request.
    pub fn next_event(&self) -> Option<Nanos> {
        let reply = self.traffic.outbox.iter().map(|sent| sent.at).min();
        let request = Some(self.now()).filter(|now| *now > self.present && self.has_unread());
        [reply, request, self.firmware.as_ref().map(Firmware::deadline)].into_iter().flatten().min()
    }

    fn has_unread(&self) -> bool {
        !self.traffic.frames_in.is_empty() || self.firmware.as_ref().is_some_and(|firmware| firmware.ports.has_unread())
    }

    /// Switches the supply off or on. What was on its way is lost; the EEPROM keeps its contents.
    pub fn set_power(&mut self, on: bool) {
        if on == self.firmware.is_some() {
            return;
        }
        if on {
            self.board.borrow_mut().power_on();
            self.boot();
        } else {
            self.firmware = None;
            self.traffic = Traffic::default();
            self.board.borrow_mut().power_off();
        }
    }

    /// Pulls the USB cable out or plugs it in, as [`Device::plug_usb`] has it.
    pub fn plug_usb(&mut self, on: bool) {
        if on == self.plugged {
            return;
        }
        self.plugged = on;
        self.traffic.outbox.retain(|sent| sent.source != Source::Usb);
        self.traffic.waiting.retain(|(source, _)| *source != Source::Usb);
        if let Some(firmware) = &mut self.firmware {
            firmware.core.forget(Source::Usb);
            firmware.ports.unplug_usb(firmware.core.link_settings().start);
        }
    }

    /// Messages for a person since the last call.
    pub fn take_log(&mut self) -> Vec<String> {
        std::mem::take(&mut self.log)
    }

    fn boot(&mut self) {
        let mut keeper = Keeper::new(At25::new(self.board.spi(Chip::At25, AT25_HZ)));
        let mut report = Report::default();
        let mut core = Core::new(parts(&self.board), Tracer::new(self.tracing), self.seed);
        core.start(self.clock, |store| report = keeper.load(store));
        if report.unreachable {
            self.log.push("EEPROM does not answer: defaults apply, nothing can be stored".into());
        } else if report.foreign > 0 {
            let (foreign, valid) = (report.foreign, report.valid);
            self.log.push(format!(
                "EEPROM: {foreign} settings pages are not this firmware's or damaged, {valid} are good; \
                 defaults or the older copies apply"
            ));
        }
        if report.program == Integrity::Incomplete {
            self.log.push("EEPROM: the program is damaged or its download was cut short: it will not run".into());
        }
        let baud = core.baud_rate().into();
        let abn = self.board.borrow().axis_inputs(0).abn;
        let null_edges = [abn.null_low.times, abn.null_high.times];
        let ports = Ports::new(core.link_settings().start);
        // Its clock starts when all is read.
        let started = self.now();
        let (clock, keep) = (self.clock, self.clock);
        self.firmware =
            Some(Firmware { core, desk: Desk::new(), keeper, ports, started, clock, null_edges, baud, keep });
        // The first poll is due at once: only then the module knows its inputs.
        self.poll();
    }

    fn poll(&mut self) {
        let Some(firmware) = &mut self.firmware else { return };
        let (now, seen, axis) = {
            let board = self.board.borrow();
            (firmware.time(board.now()), board.inputs(), board.axis_inputs(0))
        };
        let sensors = Sensors {
            stall: axis.stall,
            home: axis.home,
            encoder: axis.encoder,
            external: axis.abn.count as u16,
            null: firmware.null_edges(axis.abn),
        };
        let inputs = Inputs {
            axes: [sensors],
            digital: seen.digital as u16,
            analog: std::array::from_fn(|port| seen.analog.get(port).copied().unwrap_or_default()),
            supply: Some(seen.supply),
            temperature: seen.temperature.clamp(i16::MIN.into(), i16::MAX.into()) as i16,
        };
        let outputs = firmware.core.poll(now, &inputs);
        // The slices of a program come between the milliseconds.
        if now >= firmware.keep {
            firmware.keep = now.after(Micros::from_millis(1));
            if let Some(written) = firmware.keeper.poll(now, || firmware.core.store().next_job()) {
                firmware.core.stored(written);
            }
        }
        self.board.borrow_mut().set_outputs(Outputs {
            digital: outputs.digital.into(),
            pull_ups: outputs.pull_ups.into(),
            leds: [outputs.led, outputs.trouble],
        });
        self.collect();
        if outputs.restart {
            self.firmware = None;
            self.traffic.forget();
            self.board.borrow_mut().warm_reset();
            self.boot();
        }
    }

    /// Lets the firmware serve requests, as long as they take no time that is not there yet and keep it from no poll.
    fn deliver(&mut self) {
        while self.now() <= self.present && self.serve() {
            if self.firmware.as_ref().is_none_or(|firmware| firmware.deadline() <= self.now()) {
                return;
            }
        }
    }

    /// Serves the next request; false if there is none now.
    fn serve(&mut self) -> bool {
        let Some(firmware) = &mut self.firmware else { return false };
        let arrived = self.board.borrow().now();
        let now = firmware.time(arrived);
        let before = firmware.core.subscriber();
        let Firmware { core, desk, ports, .. } = firmware;
        let mut ends = Ends { traffic: &mut self.traffic, ports, board: &self.board, arrived };
        let served = desk.serve(core, &mut ends, || now);
        if core.subscriber() != before && self.traffic.served.is_some() {
            self.traffic.subscriber = self.traffic.served;
        }
        served
    }

    /// Takes the replies that have become due.
    fn collect(&mut self) {
        let arrived = self.now();
        let Some(Firmware { core, ports, .. }) = &mut self.firmware else { return };
        Desk::deliver(core, &mut Ends { traffic: &mut self.traffic, ports, board: &self.board, arrived });
    }
}

/// What is on its way between a module and those on its links.
#[derive(Default)]
struct Traffic {
    outbox: VecDeque<Sent>,
    /// Frames with requests that the module has not come to.
    frames_in: VecDeque<can::Request>,
    frames_out: VecDeque<Frame>,
    /// Whose request over each byte link has not been answered.
    waiting: Vec<(Source, Client)>,
    /// Whose request was the last to be served; nobody's if it came over the CAN bus.
    served: Option<Client>,
    /// Who has asked for the event of command 138 last, unless it has gone.
    subscriber: Option<Client>,
}

impl Traffic {
    /// Who waits for the answer over a link, and does no more.
    fn answered(&mut self, source: Source) -> Option<Client> {
        let place = self.waiting.iter().position(|(waiting, _)| *waiting == source)?;
        Some(self.waiting.remove(place).1)
    }

    /// The firmware ends, with what it knew of its links.
    fn forget(&mut self) {
        self.waiting.clear();
        self.subscriber = None;
    }
}

/// The links at the module's end, at one moment.
struct Ends<'a> {
    traffic: &'a mut Traffic,
    ports: &'a mut Ports,
    board: &'a SharedBoard,
    /// When that is. What the module does takes the board's clock further.
    arrived: Nanos,
}

impl LinkEnds for Ends<'_> {
    fn request(&mut self, source: Source, settings: &LinkSettings) -> Option<Request> {
        self.traffic.served = None;
        if source == Source::Can {
            return self.traffic.frames_in.pop_front().map(Request::Frame);
        }
        while let Some(Arrived { client, echo, request }) = self.ports.next(source, settings) {
            let at = on_the_wire(source, self.arrived, self.arrived);
            self.traffic.outbox.extend(Sent::new(at, source, client, &echo));
            if request.is_some() {
                self.traffic.waiting.push((source, client));
                self.traffic.served = Some(client);
                return request;
            }
        }
        None
    }

    fn answer(&mut self, to: Origin, reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings) {
        let source = to.source;
        if source == Source::Can {
            return self.traffic.frames_out.extend(reply.map(|reply| settings.frame(to, reply)));
        }
        let event = reply.is_some_and(Reply::is_event);
        let Some(client) = (if event { self.traffic.subscriber } else { self.traffic.answered(source) }) else {
            return;
        };
        let bytes = self.ports.answer((source, client), reply, mode, settings.reply_addresses());
        let now = self.board.borrow().now();
        let at = if mode.is_some() {
            on_the_wire(source, self.arrived, now)
        } else {
            // One that comes later goes out at once, but not before the replies ahead of it, which may wait for their
            // frame.
            let ahead = self.traffic.outbox.iter().filter(|sent| sent.source == source).map(|sent| sent.at).max();
            ahead.map_or(now, |ahead| ahead.max(now))
        };
        self.traffic.outbox.extend(Sent::new(at, source, client, &bytes));
    }
}

impl Device for VirtualModule {
    type Board<'a> = RefMut<'a, Board>;

    fn board_mut(&mut self) -> RefMut<'_, Board> {
        self.board.borrow_mut()
    }

    fn now(&self) -> Nanos {
        VirtualModule::now(self)
    }

    fn run_until(&mut self, to: Nanos) {
        VirtualModule::run_until(self, to);
    }

    fn next_event(&self) -> Option<Nanos> {
        VirtualModule::next_event(self)
    }

    fn set_power(&mut self, on: bool) {
        VirtualModule::set_power(self, on);
    }

    fn plug_usb(&mut self, on: bool) {
        VirtualModule::plug_usb(self, on);
    }

    fn hear(&mut self, source: Source, client: Client, bytes: &[u8]) {
        if let Some(firmware) = &mut self.firmware
            && (self.plugged || source != Source::Usb)
        {
            firmware.ports.push(source, client, bytes, firmware.core.link_settings());
            self.deliver();
        }
    }

    fn overhear(&mut self, byte: u8) {
        Device::hear(self, Source::Rs485, Client::default(), &[byte]);
    }

    fn silence(&mut self, source: Source, client: Client) {
        VirtualModule::silence(self, source, client);
    }

    fn sent(&mut self) -> Option<Sent> {
        let ready = self.traffic.outbox.iter().position(|sent| sent.at <= self.present)?;
        self.traffic.outbox.remove(ready)
    }

    fn receive_frame(&mut self, frame: &Frame) {
        if let (Some(_), Some(request)) = (&self.firmware, can::decode(frame)) {
            self.traffic.frames_in.push_back(request);
            self.deliver();
        }
    }

    fn frame(&mut self) -> Option<Frame> {
        VirtualModule::frame(self)
    }

    fn rs485(&self) -> Option<Rs485> {
        let firmware = self.firmware.as_ref()?;
        let pause = Nanos::from(firmware.core.link_settings().pause) * MILLISECOND;
        Some(Rs485 { baud: firmware.baud, pause: Some(pause) })
    }

    fn unread(&self, source: Source, client: Client) -> usize {
        self.firmware.as_ref().map_or(0, |firmware| firmware.ports.unread(source, client))
    }

    fn unread_frames(&self) -> usize {
        let Some(links) = self.firmware.as_ref().map(|firmware| firmware.core.link_settings()) else { return 0 };
        let own = [Some(links.can_id), links.can_secondary];
        self.traffic.frames_in.iter().filter(|frame| own.contains(&Some(frame.id))).count()
    }

    fn owes(&self, client: Client) -> bool {
        self.firmware.as_ref().is_some_and(|firmware| firmware.ports.owes(client))
            || self.traffic.outbox.iter().any(|sent| sent.client == client)
            || self.traffic.waiting.iter().any(|(_, waiting)| *waiting == client)
    }

    fn forget(&mut self, client: Client) {
        self.traffic.subscriber = self.traffic.subscriber.filter(|subscriber| *subscriber != client);
        if let Some(firmware) = &mut self.firmware {
            firmware.ports.forget(client);
        }
    }

    fn is_busy(&self) -> bool {
        let Some(firmware) = &self.firmware else { return false };
        let waited_for = match firmware.core.subscriber() {
            Some((Source::Can, _)) => true,
            Some(_) => self.traffic.subscriber.is_some(),
            None => false,
        };
        let owes = self.has_unread() || !self.traffic.outbox.is_empty() || !self.traffic.waiting.is_empty();
        owes || firmware.core.awaits(Source::Can) || waited_for
    }

    fn take_log(&mut self) -> Vec<String> {
        VirtualModule::take_log(self)
    }

    fn stopped(&self) -> Option<String> {
        None
    }
}

fn on_the_wire(source: Source, arrived: Nanos, ready: Nanos) -> Nanos {
    match source {
        Source::Usb => ready.max(arrived + USB_FRAME),
        Source::Rs485 | Source::Can => ready,
    }
}
