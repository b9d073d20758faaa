//! The turn of each millisecond. A turn has pieces, so that the firmware's owner can serve the links in between: its
//! [beginning](Device::begin), in which the inputs are taken and motion controllers and supply supervised, and then
//! [one axis](Device::next_axis) after the other.

use super::{Board, Device, Inputs, Outputs, Supervised, controller_of};
use crate::motion::{Events, Hardware};
use crate::units::Micros;

/// Time between two turns.
const PERIOD: Micros = Micros::from_millis(1);

impl<T: Board, const AXES: usize> Device<T, AXES> {
    /// The time at which the next piece of a turn is due: within a turn a time in the past, else the beginning of the
    /// next turn.
    pub const fn deadline(&self) -> Micros {
        if self.is_in_turn() { self.turn() } else { self.next }
    }

    /// The time at which the turn under way, or the last one, was due to begin.
    pub const fn turn(&self) -> Micros {
        self.next.since(PERIOD)
    }

    /// True while axes of the turn have not been polled.
    pub const fn is_in_turn(&self) -> bool {
        self.upcoming < AXES
    }

    /// Begins a turn with the inputs as they are now. The next turn is due one millisecond after this turn was; but if
    /// this one begins more than a millisecond late, one millisecond from `now`, so that missed turns are not made up
    /// for in a burst.
    pub fn begin(&mut self, now: Micros, inputs: &Inputs<AXES>) -> Supervised {
        self.inputs = *inputs;
        let due = self.next.after(PERIOD);
        self.next = if due > now { due } else { now.after(PERIOD) };
        self.upcoming = 0;
        self.supervise()
    }

    /// Polls the next axis of the turn. Returns its number and its events since the poll before.
    pub fn next_axis(&mut self, now: Micros) -> (usize, Events) {
        let number = self.upcoming;
        self.upcoming = number.saturating_add(1);
        let sensors = self.inputs.axes.get(number).copied().unwrap_or_default();
        let Some(controller) = self.controllers.as_mut().get_mut(controller_of::<T>(number)) else {
            return (number, Events::default());
        };
        let is_its_turn = number.checked_rem(T::Hardware::AXES) == Some(controller.turn.into());
        let reading = is_its_turn.then_some(controller.rotation);
        let events = match self.axes.get_mut(number) {
            Some(axis) => axis.on(&mut controller.shared).poll(now, sensors, reading),
            None => Events::default(),
        };
        if !self.is_in_turn() {
            self.rotate_readings();
        }
        (number, events)
    }

    /// Advances each controller's rotation of readings. The axes of a controller take turns: only one of them takes one
    /// reading in a millisecond, so a controller with three axes needs no more datagrams for readings than one with a
    /// single axis.
    fn rotate_readings(&mut self) {
        for (n, controller) in self.controllers.as_mut().iter_mut().enumerate() {
            let axes = AXES.saturating_sub(n.saturating_mul(T::Hardware::AXES)).min(T::Hardware::AXES);
            controller.turn = controller.turn.saturating_add(1);
            if usize::from(controller.turn) >= axes {
                (controller.turn, controller.rotation) = (0, controller.rotation.wrapping_add(1));
            }
        }
    }

    /// The inputs as they were at the beginning of the turn.
    pub const fn inputs(&self) -> &Inputs<AXES> {
        &self.inputs
    }

    /// The outputs as the board is to set them.
    pub const fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// The outputs, for the firmware to set; the error LED is set by the device itself.
    pub const fn outputs_mut(&mut self) -> &mut Outputs {
        &mut self.outputs
    }

    /// Asks for a restart of the firmware at a time.
    pub const fn restart_at(&mut self, at: Micros) {
        self.restart = Some(at);
    }

    /// The time at which a restart is due; `None` without one.
    pub const fn restart(&self) -> Option<Micros> {
        self.restart
    }
}
