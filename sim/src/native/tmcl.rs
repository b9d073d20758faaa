//! The TMCL firmware on a simulated board.

use std::task::Poll;

use hal_sim::board;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::fault::CanState;
use tmcm::can::Frame;
use tmcm::module::{LinkSettings, Module, Product, Source, deliver, serve};
use tmcm::store::LoadReport;
use tmcm::tmcl::{Command, Reply, Status, can};
use tmcm::units::Micros;
use tmcm::vm::Machine;

use super::board::{Simulated, Wired, parts};
use super::firmware::{Firmware, Start, messages};
use super::peek;
use super::ports::Ports;
use super::quiet::Quiet;
use super::surroundings::{Surroundings, keeper};
use super::traffic::{Ends, Traffic};
use crate::module::Rs485;
use crate::tracer::{Step, Tracer};

/// Number of turns that are left out at once at most.
const LONGEST: u64 = 10_000;

/// The TMCL firmware of product `P`.
struct Tmcl<P: Wired + Product, const AXES: usize, const N: usize> {
    module: Module<Simulated<Tracer, P, N>, AXES>,
    around: Surroundings<AXES>,
    quiet: Quiet,
    ports: Ports,
    baud: u64,
}

/// Starts the TMCL firmware of product `P`; the messages for a person are about its EEPROM.
pub(super) fn start<P: Wired + Product, const AXES: usize, const N: usize>(
    Start { board, clock, seed, tracing, .. }: Start<'_>,
) -> (Box<dyn Firmware>, Vec<String>) {
    let mut keeper = keeper(board);
    let mut report = LoadReport::default();
    let mut module = Module::<Simulated<Tracer, P, N>, AXES>::new(parts(board), Tracer::new(tracing), seed);
    module.start(clock, |store| report = keeper.load(store));
    let firmware = Tmcl {
        around: Surroundings::new(board, keeper, clock),
        quiet: Quiet::new(Module::<Simulated<Tracer, P, N>, AXES>::ROTATION),
        ports: Ports::new(module.link_settings().start),
        baud: module.baud_rate().into(),
        module,
    };
    (Box::new(firmware), messages(&report))
}

impl<P: Wired + Product, const AXES: usize, const N: usize> Tmcl<P, AXES, N> {
    /// For how long nothing happens from the turn on that begins next, and whether a motor turns; `None` if the firmware is
    /// in the middle of something.
    fn calm(&self) -> Option<(board::Calm, bool)> {
        let (until, room) = self.module.calm().filter(|_| !self.ports.has_unread())?;
        let board = self.around.board().borrow();
        if board.now() > self.deadline() {
            return None;
        }
        let calm = board.calm(&room);
        Some((board::Calm { until: calm.until.min(self.around.when(until)), ..calm }, room != [0; AXES]))
    }

    /// Looks at the turn that begins next, which is due. For how long turns may be left out, and whether a motor turns; `None`
    /// if none may be.
    fn look(&mut self) -> Option<(board::Calm, bool)> {
        let due = self.deadline();
        let calm = self.calm().filter(|(calm, _)| calm.until.min(calm.readable) >= due + MILLISECOND);
        let Tmcl { around, quiet, .. } = self;
        let board = around.board().borrow();
        quiet.begin(&board, due, calm.is_some(), around.asked());
        calm.filter(|_| quiet.lasts(&board))
    }

    /// Leaves turns out, of which the first is due at `due` and begins next, and all of which are over by `to`. Returns when
    /// the first turn that is not left out is due. Never inlined: polls that begin no turn are not to have its stack frame.
    #[inline(never)]
    fn leave_out(&mut self, due: Nanos, to: Nanos) -> Nanos {
        let Some((calm, turning)) = self.look() else { return due };
        let fresh = if turning { Module::<Simulated<Tracer, P, N>, AXES>::FRESH } else { 0 };
        let turns = self.turns_until(calm.until.min(to)).saturating_sub(fresh.into());
        let turns = turns.min(self.turns_until(calm.readable)).min(LONGEST);
        let rotations = turns / u64::from(Module::<Simulated<Tracer, P, N>, AXES>::ROTATION);
        if rotations == 0 {
            return due;
        }
        let outputs = self.module.pass(rotations as u32);
        let Tmcl { around, quiet, .. } = self;
        around.write(&outputs);
        let board = around.board().clone();
        around.pass(quiet.pass(&mut board.borrow_mut(), due, rotations as usize));
        let due = self.deadline();
        board.borrow_mut().advance_to(due);
        self.look();
        due
    }

    /// Number of turns from the one on that begins next that are over by `end`.
    fn turns_until(&self, end: Nanos) -> u64 {
        end.saturating_sub(self.deadline()) / MILLISECOND
    }
}

impl<P: Wired + Product, const AXES: usize, const N: usize> Firmware for Tmcl<P, AXES, N> {
    fn deadline(&self) -> Nanos {
        self.around.when(self.module.deadline())
    }

    fn acts(&self) -> Nanos {
        let due = self.deadline();
        if !self.begins_turn() || !self.quiet.lasts(&self.around.board().borrow()) {
            return due;
        }
        self.calm().map_or(due, |(calm, _)| due + self.turns_until(calm.until).min(LONGEST) * MILLISECOND)
    }

    /// Each turn that is polled is looked at before, also that behind others that were left out: it reads anew what follows
    /// from positions, so that others may be left out behind it.
    fn skip(&mut self, to: Nanos) -> Nanos {
        let next = self.module.deadline();
        let due = self.around.when(next);
        if due <= to && self.module.takes_inputs(next) { self.leave_out(due, to) } else { due }
    }

    fn begins_turn(&self) -> bool {
        self.module.takes_inputs(self.module.deadline())
    }

    fn poll(&mut self, traffic: &mut Traffic) -> bool {
        let Tmcl { module, around, ports, .. } = self;
        let due = module.deadline();
        let (now, outputs) = loop {
            let now = around.now();
            let inputs = around.inputs(module.takes_inputs(now));
            if let Some(outputs) = module.poll(now, inputs) {
                break (now, outputs);
            }
            // While the deadline stays, it is past, and another piece comes next; but what a link has brought goes first.
            if module.deadline() != due || ports.has_unread() || !traffic.frames_in.is_empty() {
                return false;
            }
        };
        // The slices of a program come in between.
        if let Some(written) = around.keep(now, || module.store().next_job()) {
            module.stored(written);
        }
        around.write(&outputs);
        let board = around.board();
        let arrived = board.borrow().now();
        deliver(module, &mut Ends { traffic, ports, board, arrived });
        outputs.restart
    }

    fn serve(&mut self, traffic: &mut Traffic) -> bool {
        let Tmcl { module, around, ports, .. } = self;
        let (board, now) = (around.board(), around.now());
        let arrived = board.borrow().now();
        let before = module.subscriber();
        let served = serve(module, &mut Ends { traffic: &mut *traffic, ports, board, arrived }, || now);
        if served {
            self.quiet.disturb();
        }
        if module.subscriber() != before && traffic.served.is_some() {
            traffic.subscriber = traffic.served;
        }
        served
    }

    fn is_restarting(&self) -> bool {
        self.module.is_restarting()
    }

    fn accepts(&self, frame: &Frame) -> bool {
        can::decode(frame).is_some()
    }

    fn is_addressed(&self, frame: &Frame) -> bool {
        let settings = self.module.link_settings();
        let own = [Some(settings.can_id), settings.can_secondary];
        can::decode(frame).is_some_and(|request| own.contains(&Some(request.id)))
    }

    /// The firmware leaves everything to its controller.
    fn set_can(&mut self, _: CanState, _: &mut Traffic) {}

    fn rs485(&self) -> Option<Rs485> {
        let pause = Nanos::from(self.module.link_settings().pause) * MILLISECOND;
        Some(Rs485 { baud: self.baud, pause: Some(pause) })
    }

    fn ports(&self) -> (&Ports, &LinkSettings) {
        (&self.ports, self.module.link_settings())
    }

    fn ports_mut(&mut self) -> (&mut Ports, &LinkSettings) {
        (&mut self.ports, self.module.link_settings())
    }

    fn position(&self, axis: usize) -> Option<(i32, Option<i32>)> {
        let axis = self.module.axes().get(axis)?;
        Some((axis.last_position(), axis.target_position()))
    }

    fn forget(&mut self, source: Source) {
        self.quiet.disturb();
        self.module.forget(source);
    }

    fn subscriber(&self) -> Option<Source> {
        self.module.subscriber().map(|(source, _)| source)
    }

    fn awaits(&self, source: Source) -> bool {
        self.module.awaits(source)
    }

    fn machine(&self) -> Option<&Machine> {
        Some(self.module.machine())
    }

    fn read(&mut self, command: Command) -> Option<i32> {
        self.quiet.disturb();
        let now = self.around.now();
        match self.module.execute(now, Source::Usb, command) {
            Poll::Ready(Some(Reply::Plain { status: Status::Ok, value, .. })) => Some(value),
            _ => None,
        }
    }

    fn peek(&mut self, command: Command) -> Result<i32, String> {
        peek::check(P::SPEC, command)?;
        let refused = |status: Status| format!("the module does not read this: {}", status.meaning());
        self.module.peek(self.around.now(), command).map_err(refused)
    }

    fn trace(&mut self, on: bool) {
        self.module.hooks().record(on);
    }

    fn take_steps(&mut self) -> Vec<Step> {
        let mut steps = self.module.hooks().take();
        for step in &mut steps {
            // The recorder has the firmware's time.
            step.at = self.around.when(Micros(step.at / MICROSECOND));
        }
        steps
    }
}
