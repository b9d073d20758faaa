//! A virtual module: the firmware's core on the simulated board, in virtual time.
//!
//! Whoever owns it says how far time goes; in between it polls the firmware whenever that is due. Telegrams
//! go in at the present time and come out with the time at which they are on the wire.

use std::collections::VecDeque;

use hal_sim::board::{Board, Chip, SharedBoard, SimPin, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::world::Outputs;
use hal_sim::world::config::WorldConfig;
use hal_sim::world::stage::Abn;
use tmcm::chip::at25::At25;
use tmcm::module::{self, Answer, Inputs, Module, Parts, Source, TMCM_1140};
use tmcm::store::{Keeper, Store};
use tmcm::tmcl::binary::{self, Telegram};
use tmcm::tmcl::{Opcode, Status};
use tmcm::units::Micros;

/// SPI clock of the TMC429: 84 MHz / 64, as on the target.
const TMC429_HZ: u32 = 1_312_500;
/// SPI clock of the TMC262: 84 MHz / 32.
const TMC262_HZ: u32 = 2_625_000;
/// SPI clock of the EEPROM: 42 MHz / 16.
const AT25_HZ: u32 = 2_625_000;
/// A USB transfer takes a frame: no reply comes sooner. Hosts count on it: they look at the speed right
/// after MVP and would take 0 for "arrived".
const USB_FRAME: Nanos = MILLISECOND;

/// The firmware as a type: one axis, devices of the simulated board, no user functions.
type Core = Module<SimSpi, SimSpi, SimPin, (), 1>;

/// The running firmware.
struct Firmware {
    core: Core,
    keeper: Keeper<SimSpi>,
    /// When it was started: its own time counts from there.
    started: Nanos,
    /// Edges of the encoder's null track that it has been told of: low, high.
    null_edges: [u64; 2],
}

impl Firmware {
    fn time(&self, now: Nanos) -> Micros {
        Micros((now - self.started) / MICROSECOND)
    }

    /// Where the encoder's null track became low, and high, since the last call.
    fn null_edges(&mut self, abn: Abn) -> [Option<u16>; 2] {
        let edges = [abn.null_low, abn.null_high];
        let before = std::mem::replace(&mut self.null_edges, edges.map(|edge| edge.times));
        std::array::from_fn(|n| (edges[n].times != before[n]).then_some(edges[n].count as u16))
    }

    fn deadline(&self) -> Nanos {
        self.started + self.core.deadline().0 * MICROSECOND
    }
}

/// Who sent a telegram, where several share a link, as the connections to a TCP port do. The module does
/// not know of it; replies find their way back by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Client(pub u64);

/// A telegram on its way to the firmware.
#[derive(Clone, Copy, Debug)]
struct Request {
    source: Source,
    client: Client,
    telegram: Telegram,
}

/// A reply on its way to the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// When it is on the wire.
    pub at: Nanos,
    /// The link it goes to.
    pub source: Source,
    /// Whom on that link it is for.
    pub client: Client,
    /// The reply.
    pub telegram: Telegram,
}

/// A module with its board and world.
pub struct VirtualModule {
    board: SharedBoard,
    firmware: Option<Firmware>,
    seed: u32,
    /// Telegrams that wait until their link has its reply.
    inbox: VecDeque<Request>,
    outbox: VecDeque<Sent>,
    /// Who waits for a reply that comes later.
    waiting: Vec<(Source, Client)>,
    /// Who has asked for the event of command 138.
    subscriber: Option<Client>,
    /// Messages for a person, such as that of an EEPROM with unknown contents.
    log: Vec<String>,
}

impl VirtualModule {
    /// A module in the world described by `config`, switched on at time 0. `eeprom` are the contents of the
    /// EEPROM, fresh if `None`; `seed` makes everything that is random.
    pub fn new(config: &WorldConfig, eeprom: Option<&[u8]>, seed: u32) -> Self {
        let mut board = Board::new(config, seed.into());
        if let Some(contents) = eeprom {
            board.at25_mut().load(contents);
        }
        let mut module = VirtualModule {
            board: SharedBoard::new(board),
            firmware: None,
            seed,
            inbox: VecDeque::new(),
            outbox: VecDeque::new(),
            waiting: Vec::new(),
            subscriber: None,
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
        loop {
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
        self.receive_from(source, Client::default(), telegram);
    }

    /// A telegram from one of those who share a link arrives.
    pub fn receive_from(&mut self, source: Source, client: Client, telegram: Telegram) {
        if self.firmware.is_some() {
            self.inbox.push_back(Request { source, client, telegram });
            self.deliver();
        }
    }

    /// How many telegrams wait because their link still waits for a reply.
    pub fn backlog(&self) -> usize {
        self.inbox.len()
    }

    /// True while a telegram of this client has not been answered as it will be.
    pub fn owes(&self, client: Client) -> bool {
        self.inbox.iter().any(|request| request.client == client)
            || self.outbox.iter().any(|sent| sent.client == client)
            || self.waiting.iter().any(|(_, waiting)| *waiting == client)
    }

    /// A client has gone: it gets no event any more. What it has sent is carried out all the same.
    pub fn forget(&mut self, client: Client) {
        self.subscriber = self.subscriber.filter(|subscriber| *subscriber != client);
    }

    /// True while somebody may hear from the module without a further request.
    pub fn is_busy(&self) -> bool {
        !self.inbox.is_empty() || !self.outbox.is_empty() || !self.waiting.is_empty() || self.subscriber.is_some()
    }

    /// Replies that are on the wire by now, oldest first.
    pub fn sent(&mut self) -> Option<Sent> {
        let now = self.now();
        let ready = self.outbox.iter().position(|sent| sent.at <= now)?;
        self.outbox.remove(ready)
    }

    /// When something happens next that the owner may want to see: a reply or a poll.
    pub fn next_event(&self) -> Option<Nanos> {
        let reply = self.outbox.iter().map(|sent| sent.at).min();
        [reply, self.firmware.as_ref().map(Firmware::deadline)].into_iter().flatten().min()
    }

    /// Switches the supply off or on. What was on its way is lost; the EEPROM keeps its contents.
    pub fn set_power(&mut self, on: bool) {
        if on == self.board.borrow().is_powered() {
            return;
        }
        if on {
            self.board.borrow_mut().power_on();
            self.boot();
        } else {
            self.firmware = None;
            self.inbox.clear();
            self.outbox.clear();
            self.waiting.clear();
            self.subscriber = None;
            self.board.borrow_mut().power_off();
        }
    }

    /// Messages for a person since the last call.
    pub fn take_log(&mut self) -> Vec<String> {
        std::mem::take(&mut self.log)
    }

    fn boot(&mut self) {
        let started = self.now();
        let Ok(()) = module::halt(self.board.spi(Chip::Tmc429, TMC429_HZ));
        let mut eeprom = At25::new(self.board.spi(Chip::At25, AT25_HZ));
        let Ok(()) = eeprom.settle();
        let (store, report) = match Store::load(|address, page| eeprom.read(address, page)) {
            Ok(loaded) => loaded,
            Err(never) => match never {},
        };
        if report.foreign > 0 {
            let (foreign, valid) = (report.foreign, report.valid);
            self.log.push(format!(
                "EEPROM: {foreign} settings pages are not this firmware's or damaged, {valid} are good; \
                 defaults or the older copies apply"
            ));
        }
        let parts = Parts {
            tmc429: self.board.spi(Chip::Tmc429, TMC429_HZ),
            tmc262: [self.board.spi(Chip::Tmc262, TMC262_HZ)],
            enable: self.board.enable_pin(),
        };
        let abn = self.board.borrow().inputs().abn;
        let null_edges = [abn.null_low.times, abn.null_high.times];
        let now = Micros((self.now() - started) / MICROSECOND);
        let core = Module::new(&TMCM_1140, parts, (), store, now, self.seed);
        self.firmware = Some(Firmware { core, keeper: Keeper::new(eeprom), started, null_edges });
    }

    fn poll(&mut self) {
        let Some(firmware) = &mut self.firmware else { return };
        let (now, seen) = {
            let board = self.board.borrow();
            (firmware.time(board.now()), board.inputs())
        };
        let inputs = Inputs {
            digital: std::array::from_fn(|n| seen.digital >> n & 1 != 0),
            analog: seen.analog,
            supply: Some(seen.supply),
            temperature: seen.temperature.clamp(i16::MIN.into(), i16::MAX.into()) as i16,
            stall: seen.stall,
            encoder: seen.encoder,
            external: seen.abn.count as u16,
            null: firmware.null_edges(seen.abn),
        };
        let outputs = firmware.core.poll(now, &inputs);
        if let Some(written) = firmware.keeper.poll(now, || firmware.core.store().next_job()) {
            firmware.core.stored(written);
        }
        self.board.borrow_mut().set_outputs(Outputs {
            out: std::array::from_fn(|n| outputs.digital >> n & 1 != 0),
            pull_ups: outputs.pull_ups,
            leds: [outputs.led, false],
        });
        self.collect();
        self.deliver();
        if outputs.restart {
            self.firmware = None;
            self.waiting.clear();
            self.subscriber = None;
            self.board.borrow_mut().warm_reset();
            self.boot();
        }
    }

    /// Gives the firmware the telegrams whose links are free.
    fn deliver(&mut self) {
        let Some(firmware) = &mut self.firmware else { return };
        let mut index = 0;
        while let Some(Request { source, client, telegram }) = self.inbox.get(index).copied() {
            if firmware.core.awaits(source) {
                index += 1;
                continue;
            }
            self.inbox.remove(index);
            let arrived = self.board.borrow().now();
            match firmware.core.serial(firmware.time(arrived), source, &telegram) {
                Answer::Now(reply) => {
                    if let Some(wanted) = subscription(&telegram, &reply) {
                        self.subscriber = wanted.then_some(client);
                    }
                    let at = on_the_wire(source, arrived, self.board.borrow().now());
                    self.outbox.push_back(Sent { at, source, client, telegram: reply });
                }
                Answer::Later => self.waiting.push((source, client)),
                Answer::None => {}
            }
        }
    }

    /// Takes the replies that have become due.
    fn collect(&mut self) {
        let at = self.now();
        let Some(firmware) = &mut self.firmware else { return };
        while let Some((source, telegram)) = firmware.core.next_telegram() {
            let client = if is_event(&telegram) {
                self.subscriber
            } else {
                let place = self.waiting.iter().position(|(waiting, _)| *waiting == source);
                place.map(|place| self.waiting.remove(place).1)
            };
            if let Some(client) = client {
                // Not before the replies ahead of it, which may wait for their frame.
                let ahead = self.outbox.iter().filter(|sent| sent.source == source).map(|sent| sent.at).max();
                self.outbox.push_back(Sent { at: ahead.map_or(at, |ahead| ahead.max(at)), source, client, telegram });
            }
        }
    }
}

/// Whether this request has armed (true) or disarmed (false) the event of command 138.
fn subscription(request: &Telegram, reply: &Telegram) -> Option<bool> {
    let command = binary::decode_command(request)?;
    let taken = binary::decode_reply(reply)?.status() == Some(Status::Ok);
    (command.opcode == Opcode::PositionReachedEvent as u8 && taken).then_some(command.value != 0)
}

/// True for the second reply of command 138.
fn is_event(reply: &Telegram) -> bool {
    binary::decode_reply(reply).is_some_and(|reply| {
        reply.opcode == Opcode::PositionReachedEvent as u8 && reply.status() == Some(Status::PositionReached)
    })
}

fn on_the_wire(source: Source, arrived: Nanos, ready: Nanos) -> Nanos {
    match source {
        Source::Usb => ready.max(arrived + USB_FRAME),
        Source::Rs485 => ready,
    }
}
