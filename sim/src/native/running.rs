//! A firmware that runs on a simulated board: what a [`NativeModule`](super::NativeModule) needs of it, whichever it
//! is.

use hal_sim::board::SharedBoard;
use tmcm::firmware::{OnBoard, pass_on};
use tmcm::module::Hooks;
use tmcm::store::LoadReport;
use tmcm::tmcl::Command;
use tmcm::units::Micros;

use super::around::Around;
use super::board::{Simulated, Wired, parts};
use super::due::{Due, Run};
use super::firmware::{Insight, Simulable};
use super::periphery::{Periphery, keeper, messages};
use super::quiet::Quiet;
use super::traffic::Traffic;
use crate::tracer::Step;

/// A running firmware of any product.
pub(super) trait Running: Due {
    /// Polls the firmware, and passes on what has become due. True if the firmware is to start anew.
    fn poll(&mut self, traffic: &mut Traffic) -> bool;

    /// Serves what has come next over the links; false if there is nothing now.
    fn serve(&mut self, traffic: &mut Traffic) -> bool;

    /// Has the firmware look after its links.
    fn deliver(&mut self, traffic: &mut Traffic);

    /// The firmware, to look at.
    fn firmware(&self) -> &dyn Insight;

    /// The firmware, to be asked, with its time; what is asked of it may change what it is going to do.
    fn ask(&mut self) -> (&mut dyn Insight, Micros);

    /// The value that a command would read, as [`Insight::peek`] has it, which changes nothing.
    fn peek(&mut self, command: Command) -> Result<i32, String>;

    /// The commands of programs that have been recorded since the last call.
    fn take_steps(&mut self) -> Vec<Step>;
}

/// How a firmware is started.
pub(super) struct Start<'a> {
    pub(super) board: &'a SharedBoard,
    /// The time that the microcontroller's clock shows at the start.
    pub(super) clock: Micros,
    /// The words that the firmware has kept before a restart.
    pub(super) kept: Option<[u32; 2]>,
    /// Starts the random numbers.
    pub(super) seed: u32,
    /// The commands of programs are recorded.
    pub(super) tracing: bool,
}

/// Starts a firmware of product `P`; the messages for a person are about its EEPROM.
pub(super) fn start<F, H: Hooks, P: Wired, const AXES: usize, const N: usize>(
    Start { board, clock, kept, seed, tracing }: Start<'_>,
) -> (Box<dyn Running>, Vec<String>)
where
    F: Simulable<AXES> + OnBoard<AXES, Circuit = Simulated<H, P, N>>,
{
    let mut keeper = keeper(board);
    let mut report = LoadReport::default();
    let mut firmware = F::new(parts(board), seed);
    if let Some(kept) = kept {
        firmware.remember(kept);
    }
    firmware.start(clock, |store| report = keeper.load(store));
    if let Some(tracer) = firmware.tracer() {
        tracer.record(tracing);
    }
    let mut messages = messages(&report);
    messages.extend(firmware.complaint().map(String::from));
    let run = Run { periphery: Periphery::new(board, keeper, clock), quiet: Quiet::new(F::ROTATION), firmware };
    (Box::new(run), messages)
}

impl<F: Simulable<AXES>, const AXES: usize> Running for Run<F, AXES> {
    fn poll(&mut self, traffic: &mut Traffic) -> bool {
        let Run { firmware, periphery, .. } = self;
        let due = firmware.deadline();
        let (now, outputs) = loop {
            let now = periphery.now();
            let inputs = periphery.inputs(firmware.takes_inputs(now));
            if let Some(outputs) = firmware.poll(now, inputs) {
                break (now, outputs);
            }
            // While the deadline stays, it is past, and another piece comes next; but what a link has brought goes
            // first.
            if firmware.deadline() != due || traffic.has_unread() {
                return false;
            }
        };
        let mut around = Around::at(now, periphery, traffic);
        pass_on(firmware, &mut around, &outputs);
        around.restarts
    }

    fn serve(&mut self, traffic: &mut Traffic) -> bool {
        let Run { firmware, periphery, quiet, .. } = self;
        let before = firmware.subscriber();
        let now = periphery.now();
        let served = firmware.serve(&mut Around::at(now, periphery, traffic));
        if served {
            quiet.disturb();
        }
        if firmware.subscriber() != before && traffic.served.is_some() {
            traffic.subscriber = traffic.served;
        }
        served
    }

    fn deliver(&mut self, traffic: &mut Traffic) {
        let Run { firmware, periphery, .. } = self;
        let now = periphery.now();
        firmware.deliver(&mut Around::at(now, periphery, traffic));
    }

    fn firmware(&self) -> &dyn Insight {
        &self.firmware
    }

    fn ask(&mut self) -> (&mut dyn Insight, Micros) {
        self.quiet.disturb();
        (&mut self.firmware, self.periphery.now())
    }

    fn peek(&mut self, command: Command) -> Result<i32, String> {
        self.firmware.peek(self.periphery.now(), command)
    }

    fn take_steps(&mut self) -> Vec<Step> {
        let Run { firmware, periphery, .. } = self;
        firmware.tracer().map(|tracer| tracer.take(|time| periphery.when(time))).unwrap_or_default()
    }
}
