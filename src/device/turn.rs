//! The turn of each millisecond. A turn has pieces, so that the firmware's owner can serve the links in between. First
//! comes its [beginning](Device::begin), in which the inputs are taken and motion controllers and supply supervised.
//! Then come [one axis](Device::next_axis) after the other, and [the straight lines](Device::next_interpolations) on
//! which several of them go. Half a millisecond later follows [a reading](Device::next_reading) of each motion
//! controller whose axis had no time for it, because its motor moves. As a rule a piece has the datagrams of one
//! reading at most; `motion/turn.rs` says which are longer.

use super::{Circuit, Controllers, Device, Inputs, Outputs, Shared, Supervised, controller_of};
use crate::motion::{Events, Joined, MotionController};
use crate::units::Micros;

/// Time between two turns.
const PERIOD: Micros = Micros::from_millis(1);
/// Time between the beginning of a turn and the readings that were left.
const READINGS: Micros = Micros(500);

/// The next piece of work of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// A turn [begins](Device::begin).
    Beginning,
    /// [An axis](Device::next_axis) is polled.
    Axis,
    /// [The straight lines](Device::next_interpolations) are looked after on which axes go.
    Interpolations,
    /// [A reading](Device::next_reading) is taken.
    Reading,
}

impl<T: Circuit, const AXES: usize> Device<T, AXES> {
    /// The pieces of a turn behind its axes in which its lines are looked after. One axis makes no line.
    const LINES: usize = if AXES > 1 { 1 } else { 0 };
    /// Number of the first reading among the pieces of a turn.
    const FIRST_READING: usize = AXES.saturating_add(Self::LINES);
    /// Number of pieces of a turn behind its beginning, at most: the axes, the lines, and a reading of each motion
    /// controller.
    pub(super) const PIECES: usize = Self::FIRST_READING.saturating_add(T::Controllers::COUNT);

    /// The piece that comes next.
    pub const fn next_piece(&self) -> Piece {
        if self.upcoming < AXES {
            Piece::Axis
        } else if self.upcoming < Self::FIRST_READING {
            Piece::Interpolations
        } else if self.upcoming < Self::PIECES {
            Piece::Reading
        } else {
            Piece::Beginning
        }
    }

    /// The time at which the next piece is due. For an axis, and for the lines, this is a time in the past.
    pub const fn deadline(&self) -> Micros {
        match self.next_piece() {
            Piece::Axis | Piece::Interpolations => self.turn(),
            Piece::Reading => self.turn().after(READINGS),
            Piece::Beginning => self.next,
        }
    }

    /// The time at which the turn under way, or the last one, was due to begin.
    pub const fn turn(&self) -> Micros {
        self.next.since(PERIOD)
    }

    /// Begins a turn with the inputs as they are now. The next turn is due one millisecond after this turn was. But if
    /// this one begins more than a millisecond late, the next is due one millisecond from `now`, so that missed turns
    /// are not made up for in a burst.
    pub fn begin(&mut self, now: Micros, inputs: &Inputs<AXES>) -> Supervised {
        self.inputs = *inputs;
        let due = self.next.after(PERIOD);
        self.next = if due > now { due } else { now.after(PERIOD) };
        self.upcoming = 0;
        for controller in self.controllers.as_mut() {
            controller.shared.begin_turn();
        }
        self.supervise(now)
    }

    /// Polls the next axis of the turn. Returns its number and its events since the poll before.
    pub fn next_axis(&mut self, now: Micros) -> (usize, Events) {
        let number = self.upcoming;
        self.upcoming = number.saturating_add(1);
        let on_line = AXES > 1 && self.is_interpolated(number);
        let sensors = self.inputs.axes.get(number).copied().unwrap_or_default();
        let Some(controller) = self.controllers.as_mut().get_mut(controller_of::<T>(number)) else {
            return (number, Events::default());
        };
        let Some(axis) = self.axes.get_mut(number) else { return (number, Events::default()) };
        let is_its_turn = number.checked_rem(Shared::<T>::AXES) == Some(controller.turn.into());
        // A search takes the other readings itself. With one axis there is time for them all the same.
        let is_wanted = AXES == 1 || !axis.searches() || !Shared::<T>::is_of_motion(controller.rotation);
        let reading = (is_its_turn && is_wanted).then_some(controller.rotation);
        let events = axis.on(&mut controller.shared).poll(now, sensors, reading, on_line);
        if AXES > 1 {
            self.look_at_interpolation(now, number, events);
        }
        self.pass_taken();
        (number, events)
    }

    /// Looks after the lines, when all axes of the turn have been polled.
    pub fn next_interpolations(&mut self) {
        self.upcoming = Self::FIRST_READING;
        self.follow_interpolations();
        self.pass_taken();
    }

    /// Takes the next of the readings that were left.
    pub fn next_reading(&mut self) {
        if let Some(mut axis) = self.upcoming.checked_sub(Self::FIRST_READING).and_then(|n| self.reading_axis(n)) {
            axis.refresh();
        }
        self.pass_taken();
    }

    /// Passes the lines if there are none, and the motion controllers whose readings have been taken, and advances the
    /// rotation of each. The axes of a controller take turns: only one of them takes one reading in a millisecond. So a
    /// controller with three axes needs no more datagrams for readings than one with a single axis.
    fn pass_taken(&mut self) {
        if AXES > 1 && self.upcoming == AXES && self.interpolations.members == 0 {
            self.upcoming = Self::FIRST_READING;
        }
        while let Some(n) = self.upcoming.checked_sub(Self::FIRST_READING)
            && !self.reading_axis(n).is_some_and(|axis| axis.state().has_reading())
            && let Some(controller) = self.controllers.as_mut().get_mut(n)
        {
            let axes = AXES.saturating_sub(n.saturating_mul(Shared::<T>::AXES)).min(Shared::<T>::AXES);
            controller.turn = controller.turn.saturating_add(1);
            if usize::from(controller.turn) >= axes {
                (controller.turn, controller.rotation) = (0, controller.rotation.wrapping_add(1));
            }
            self.upcoming = self.upcoming.saturating_add(1);
        }
    }

    /// The axis of a motion controller whose turn it is to take a reading.
    fn reading_axis(&mut self, controller: usize) -> Option<Joined<'_, T::Hardware>> {
        let turn = self.controllers.as_ref().get(controller)?.turn;
        self.axis(controller.saturating_mul(Shared::<T>::AXES).saturating_add(turn.into()))
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
