//! The periphery of a firmware on a simulated board: a clock, inputs and outputs, and the keeper of the EEPROM.

use hal_sim::board::{Chip, SharedBoard, SimSpi};
use hal_sim::clock::{MICROSECOND, Nanos};
use tmcm::chip::at25::At25;
use tmcm::device::{Inputs, Outputs};
use tmcm::store::{Integrity, Job, Keeper, LoadReport};
use tmcm::units::Micros;

use super::board::Signals;

/// SPI clock of the EEPROM: 42 MHz / 16, as on the target.
const AT25_HZ: u32 = 2_625_000;

/// The keeper of the board's EEPROM.
pub(super) fn keeper(board: &SharedBoard) -> Keeper<SimSpi> {
    Keeper::new(At25::new(board.spi(Chip::At25, AT25_HZ)))
}

/// Messages for a person about the contents of the EEPROM.
pub(super) fn messages(report: &LoadReport) -> Vec<String> {
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

/// The periphery of a firmware with `AXES` axes.
pub(super) struct Periphery<const AXES: usize> {
    board: SharedBoard,
    signals: Signals<AXES>,
    /// The inputs as they were read last.
    inputs: Inputs<AXES>,
    keeper: Keeper<SimSpi>,
    /// The time at which the EEPROM is looked after next, and when that was asked last.
    keep: Micros,
    asked: Micros,
    /// Virtual time of the start, and what the clock showed then.
    started: Nanos,
    clock: Micros,
}

impl<const AXES: usize> Periphery<AXES> {
    /// Around a firmware that has just started: its clock, which shows `clock`, begins now.
    pub(super) fn new(board: &SharedBoard, keeper: Keeper<SimSpi>, clock: Micros) -> Self {
        Periphery {
            board: board.clone(),
            signals: Signals::new(board),
            inputs: Inputs::default(),
            keeper,
            keep: clock,
            asked: clock,
            started: board.now(),
            clock,
        }
    }

    pub(super) fn board(&self) -> &SharedBoard {
        &self.board
    }

    /// The firmware's time.
    pub(super) fn now(&self) -> Micros {
        self.time(self.board.now())
    }

    /// The time that the firmware's clock shows at a virtual time.
    fn time(&self, at: Nanos) -> Micros {
        self.clock.after(Micros((at - self.started) / MICROSECOND))
    }

    /// Virtual time when the firmware's clock shows `time`.
    pub(super) fn when(&self, time: Micros) -> Nanos {
        self.started.saturating_add(time.since(self.clock).0.saturating_mul(MICROSECOND))
    }

    /// When it was asked last whether the EEPROM is to be looked after.
    pub(super) fn asked(&self) -> Nanos {
        self.when(self.asked)
    }

    /// Turns are left out in which the EEPROM has nothing to do, and at these times it would have been asked for.
    pub(super) fn pass(&mut self, asked: impl Iterator<Item = Nanos>) {
        for at in asked {
            self.ask(self.time(at));
        }
    }

    /// The inputs. The edges of an encoder that have been read are gone: so the inputs are read `anew` for the polls
    /// that look at them.
    pub(super) fn inputs(&mut self, anew: bool) -> &Inputs<AXES> {
        if anew {
            self.inputs = self.signals.read();
        }
        &self.inputs
    }

    pub(super) fn write(&self, outputs: &Outputs) {
        self.signals.write(outputs);
    }

    /// Looks after the EEPROM, once in a millisecond; takes the `next` job. Tells how a job has gone that has ended.
    pub(super) fn keep(&mut self, now: Micros, next: impl FnOnce() -> Option<Job>) -> Option<bool> {
        if self.ask(now) { self.keeper.poll(now, next) } else { None }
    }

    /// True if the EEPROM is to be looked after now: it has not been for a millisecond.
    fn ask(&mut self, now: Micros) -> bool {
        self.asked = now;
        let due = now >= self.keep;
        if due {
            self.keep = now.after(Micros::from_millis(1));
        }
        due
    }
}
