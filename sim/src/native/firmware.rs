//! A running firmware of any product: what a [`NativeModule`](super::NativeModule) needs of it.

use std::task::Poll;

use hal_sim::board::{SharedBoard, SimSpi};
use hal_sim::clock::{MICROSECOND, Nanos};
use tmcm::chip::at25::At25;
use tmcm::device::Inputs;
use tmcm::module::{Desk, LinkSettings, Module, Product, Source};
use tmcm::store::{Integrity, Keeper, LoadReport};
use tmcm::tmcl::{Command, Reply, Status};
use tmcm::units::Micros;
use tmcm::vm::Machine;

use super::board::{Signals, Simulated, parts};
use super::ports::Ports;
use super::traffic::{Ends, Traffic};
use crate::tracer::{Step, Tracer};

/// SPI clock of the EEPROM: 42 MHz / 16, as on the target.
const AT25_HZ: u32 = 2_625_000;

/// A firmware that runs on a simulated board.
pub(super) trait Firmware {
    /// When the firmware wants to be polled next.
    fn deadline(&self) -> Nanos;

    /// True if the next poll begins the turn of a millisecond.
    fn begins_turn(&self) -> bool;

    /// Polls the firmware and the EEPROM, and writes the outputs of the board; then takes the replies that have become due.
    /// True if the firmware is to start anew.
    fn poll(&mut self, traffic: &mut Traffic) -> bool;

    /// Serves the next request; false if there is none now.
    fn serve(&mut self, traffic: &mut Traffic) -> bool;

    /// The module's ends of its byte links.
    fn ports(&self) -> &Ports;

    /// The module's ends of its byte links, with the link settings in force.
    fn ports_mut(&mut self) -> (&mut Ports, &LinkSettings);

    /// The link settings in force.
    fn link_settings(&self) -> &LinkSettings;

    /// The host at the other end of a link is gone.
    fn forget(&mut self, source: Source);

    /// The link on which a host waits for the event of command 138.
    fn subscriber(&self) -> Option<Source>;

    /// True while a command of a link waits for its reply.
    fn awaits(&self, source: Source) -> bool;

    /// Bit rate of the RS485 interface since the start of the firmware.
    fn baud(&self) -> u64;

    /// The interpreter.
    fn machine(&self) -> &Machine;

    /// The position of an axis in microsteps, as the firmware read it last, and its target in the modes that have one.
    fn position(&self, axis: usize) -> Option<(i32, Option<i32>)>;

    /// The answer to a command that reads a value in memory, past all links.
    fn read(&mut self, command: Command) -> Option<i32>;

    /// Records the commands that programs execute, or stops recording.
    fn trace(&mut self, on: bool);

    /// The commands that have been recorded since the last call.
    fn take_steps(&mut self) -> Vec<Step>;
}

/// How a firmware is started.
pub(super) struct Start<'a> {
    pub(super) board: &'a SharedBoard,
    /// What the microcontroller's clock shows at the start.
    pub(super) clock: Micros,
    /// Starts the random numbers.
    pub(super) seed: u32,
    /// The commands of programs are recorded.
    pub(super) tracing: bool,
}

/// The TMCL firmware of product `P`.
struct Tmcl<P: Product + 'static, const AXES: usize, const N: usize> {
    board: SharedBoard,
    module: Module<Simulated<Tracer, P, N>, AXES>,
    signals: Signals<AXES>,
    /// The inputs as they were read last.
    inputs: Inputs<AXES>,
    desk: Desk,
    keeper: Keeper<SimSpi>,
    ports: Ports,
    /// Virtual time of the start, and what the clock showed then.
    started: Nanos,
    clock: Micros,
    baud: u64,
    /// The time at which the EEPROM is looked after next.
    keep: Micros,
}

/// Starts the TMCL firmware of product `P`; the messages for a person are about its EEPROM.
pub(super) fn start<P: Product + 'static, const AXES: usize, const N: usize>(
    Start { board, clock, seed, tracing }: Start<'_>,
) -> (Box<dyn Firmware>, Vec<String>) {
    let mut keeper = Keeper::new(At25::new(board.spi(hal_sim::board::Chip::At25, AT25_HZ)));
    let mut report = LoadReport::default();
    let mut module = Module::<Simulated<Tracer, P, N>, AXES>::new(parts(board), Tracer::new(tracing), seed);
    module.start(clock, |store| report = keeper.load(store));
    let firmware = Tmcl {
        board: board.clone(),
        signals: Signals::new(board),
        inputs: Inputs::default(),
        desk: Desk::new(),
        keeper,
        ports: Ports::new(module.link_settings().start),
        // The firmware's clock starts when all is read.
        started: board.borrow().now(),
        clock,
        baud: module.baud_rate().into(),
        keep: clock,
        module,
    };
    (Box::new(firmware), messages(&report))
}

/// What a person should know of the contents of the EEPROM.
fn messages(report: &LoadReport) -> Vec<String> {
    let LoadReport { foreign, valid, .. } = *report;
    let mut messages = Vec::new();
    if report.unreachable {
        messages.push("EEPROM does not answer: defaults apply, nothing can be stored".into());
    } else if foreign > 0 {
        messages.push(format!(
            "EEPROM: {foreign} settings pages are not this firmware's or damaged, {valid} are good; \
             defaults or the older copies apply"
        ));
    }
    if report.program == Integrity::Incomplete {
        messages.push("EEPROM: the program is damaged or its download was cut short: it will not run".into());
    }
    messages
}

impl<P: Product + 'static, const AXES: usize, const N: usize> Tmcl<P, AXES, N> {
    /// The firmware's time.
    fn now(&self) -> Micros {
        self.clock.after(Micros((self.board.borrow().now() - self.started) / MICROSECOND))
    }
}

impl<P: Product + 'static, const AXES: usize, const N: usize> Firmware for Tmcl<P, AXES, N> {
    fn deadline(&self) -> Nanos {
        self.started + self.module.deadline().since(self.clock).0 * MICROSECOND
    }

    fn begins_turn(&self) -> bool {
        self.module.takes_inputs(self.module.deadline())
    }

    fn poll(&mut self, traffic: &mut Traffic) -> bool {
        let now = self.now();
        // The edges of an encoder that have been read are gone: so the inputs are read for the polls that look at them.
        if self.module.takes_inputs(now) {
            self.inputs = self.signals.read();
        }
        let Some(outputs) = self.module.poll(now, &self.inputs) else { return false };
        // The EEPROM has its turn once a millisecond; the slices of a program come in between.
        if now >= self.keep {
            self.keep = now.after(Micros::from_millis(1));
            if let Some(written) = self.keeper.poll(now, || self.module.store().next_job()) {
                self.module.stored(written);
            }
        }
        self.signals.write(&outputs);
        let arrived = self.board.borrow().now();
        let Tmcl { board, module, ports, .. } = self;
        Desk::deliver(module, &mut Ends { traffic, ports, board, arrived });
        outputs.restart
    }

    fn serve(&mut self, traffic: &mut Traffic) -> bool {
        let (now, arrived) = (self.now(), self.board.borrow().now());
        let before = self.module.subscriber();
        let Tmcl { board, module, desk, ports, .. } = self;
        let served = desk.serve(module, &mut Ends { traffic: &mut *traffic, ports, board, arrived }, || now);
        if module.subscriber() != before && traffic.served.is_some() {
            traffic.subscriber = traffic.served;
        }
        served
    }

    fn ports(&self) -> &Ports {
        &self.ports
    }

    fn ports_mut(&mut self) -> (&mut Ports, &LinkSettings) {
        (&mut self.ports, self.module.link_settings())
    }

    fn link_settings(&self) -> &LinkSettings {
        self.module.link_settings()
    }

    fn forget(&mut self, source: Source) {
        self.module.forget(source);
    }

    fn subscriber(&self) -> Option<Source> {
        self.module.subscriber().map(|(source, _)| source)
    }

    fn awaits(&self, source: Source) -> bool {
        self.module.awaits(source)
    }

    fn baud(&self) -> u64 {
        self.baud
    }

    fn machine(&self) -> &Machine {
        self.module.machine()
    }

    fn position(&self, axis: usize) -> Option<(i32, Option<i32>)> {
        let axis = self.module.axes().get(axis)?;
        Some((axis.last_position(), axis.target_position()))
    }

    fn read(&mut self, command: Command) -> Option<i32> {
        let now = self.now();
        match self.module.execute(now, Source::Usb, command) {
            Poll::Ready(Some(Reply::Plain { status: Status::Ok, value, .. })) => Some(value),
            _ => None,
        }
    }

    fn trace(&mut self, on: bool) {
        self.module.hooks().record(on);
    }

    fn take_steps(&mut self) -> Vec<Step> {
        let (started, clock) = (self.started, self.clock.0 * MICROSECOND);
        let mut steps = self.module.hooks().take();
        for step in &mut steps {
            step.at = started + (step.at - clock);
        }
        steps
    }
}
