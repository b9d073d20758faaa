//! A firmware that runs on a simulated board: what a [`NativeModule`](super::NativeModule) needs of it, whichever it is.

use hal_sim::board::SharedBoard;
use hal_sim::clock::Nanos;
use tmcm::firmware::{OnBoard, pass_on};
use tmcm::module::Hooks;
use tmcm::store::{Integrity, LoadReport};
use tmcm::units::Micros;

use super::around::Around;
use super::board::{Simulated, Wired, parts};
use super::firmware::{Insight, Simulable};
use super::periphery::{Periphery, keeper};
use super::quiet::Quiet;
use super::traffic::Traffic;

/// A running firmware of any product.
pub(super) trait Running {
    /// When the firmware wants to be polled next.
    fn deadline(&self) -> Nanos;

    /// When the firmware may do something next that nobody can do in its place, so that it has to be polled.
    fn acts(&self, traffic: &Traffic) -> Nanos;

    /// Leaves polls out that come before `to` and change nothing. Firmware, board and deadline, which this returns, are then as
    /// if all of them had come.
    fn skip(&mut self, to: Nanos, traffic: &Traffic) -> Nanos;

    /// Polls the firmware, and passes on what has become due. True if the firmware is to start anew.
    fn poll(&mut self, traffic: &mut Traffic) -> bool;

    /// Serves what has come next over the links; false if there is nothing now.
    fn serve(&mut self, traffic: &mut Traffic) -> bool;

    /// Has the firmware look after its links.
    fn deliver(&mut self, traffic: &mut Traffic);

    /// What has been asked of the firmware may change what it is going to do.
    fn disturb(&mut self);

    /// The firmware, to look at.
    fn firmware(&self) -> &dyn Insight;

    /// The firmware, to be asked, with its time.
    fn ask(&mut self) -> (&mut dyn Insight, Micros);

    /// When the firmware's clock shows `time`.
    fn when(&self, time: Micros) -> Nanos;
}

/// A firmware with what is around it.
pub(super) struct Run<F, const AXES: usize> {
    pub(super) firmware: F,
    pub(super) periphery: Periphery<AXES>,
    pub(super) quiet: Quiet,
}

/// How a firmware is started.
pub(super) struct Start<'a> {
    pub(super) board: &'a SharedBoard,
    /// What the microcontroller's clock shows at the start.
    pub(super) clock: Micros,
    /// What the firmware has kept before a restart.
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
    F: Simulable<AXES> + OnBoard<AXES, Board = Simulated<H, P, N>>,
{
    let mut keeper = keeper(board);
    let mut report = LoadReport::default();
    let mut firmware = F::new(parts(board), seed);
    if let Some(kept) = kept {
        firmware.remember(kept);
    }
    firmware.start(clock, |store| report = keeper.load(store));
    firmware.trace(tracing);
    let messages = messages(&report, firmware.complaint());
    let run = Run { periphery: Periphery::new(board, keeper, clock), quiet: Quiet::new(F::ROTATION), firmware };
    (Box::new(run), messages)
}

/// What a person should know of the contents of the EEPROM, and of the start.
fn messages(report: &LoadReport, complaint: Option<&str>) -> Vec<String> {
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
    messages.extend(complaint.map(String::from));
    messages
}

impl<F: Simulable<AXES>, const AXES: usize> Running for Run<F, AXES> {
    fn deadline(&self) -> Nanos {
        self.due()
    }

    fn acts(&self, traffic: &Traffic) -> Nanos {
        self.acts_at(traffic)
    }

    fn skip(&mut self, to: Nanos, traffic: &Traffic) -> Nanos {
        self.skip_to(to, traffic)
    }

    fn poll(&mut self, traffic: &mut Traffic) -> bool {
        let Run { firmware, periphery, .. } = self;
        let due = firmware.deadline();
        let (now, outputs) = loop {
            let now = periphery.now();
            let inputs = periphery.inputs(firmware.takes_inputs(now));
            if let Some(outputs) = firmware.poll(now, inputs) {
                break (now, outputs);
            }
            // While the deadline stays, it is past, and another piece comes next; but what a link has brought goes first.
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

    fn disturb(&mut self) {
        self.quiet.disturb();
    }

    fn firmware(&self) -> &dyn Insight {
        &self.firmware
    }

    fn ask(&mut self) -> (&mut dyn Insight, Micros) {
        (&mut self.firmware, self.periphery.now())
    }

    fn when(&self, time: Micros) -> Nanos {
        self.periphery.when(time)
    }
}
