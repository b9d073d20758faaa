//! The questions that a board asks the chips that move its motors, whichever they are.

use super::kind::Chip;
use crate::chip::SpiSlave;
use crate::clock::Nanos;
use crate::fault::Fault;
use crate::world::Axis;

/// The surroundings of a chip beside its axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surroundings {
    pub(super) now: Nanos,
    /// Motor supply in 0.1 V; 0 without power.
    pub(super) supply: u16,
    /// Temperature in degrees Celsius.
    pub(super) temperature: i32,
}

/// How an axis goes on if nothing reaches its chips from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Prospect {
    /// The axis stands, and until this time all that its chips tell stays as it is.
    Rests(Nanos),
    /// The axis turns at a constant speed.
    Turns {
        /// The number of steps that it goes on so at least.
        steps: u64,
        /// How far a step moves the field, in 1/256 full steps.
        microsteps: u64,
        /// The direction in which the field turns.
        up: bool,
    },
    /// Anything else.
    Changes,
}

/// Values of the chips of an axis that can be seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observed {
    /// The position in the motion controller, in microsteps.
    pub position: i32,
    /// The velocity in the motion controller, in its internal unit.
    pub velocity: i32,
    /// The bridges drive the motor.
    pub bridges_on: bool,
    /// The effective current in 1/32 of full scale, 0..=32.
    pub current: u32,
    /// The last stallGuard2 value, 0..=1023.
    pub stall_guard: u16,
    /// The angle that the built-in encoder reads, 0..=1023 in a turn.
    pub encoder: u16,
}

/// The chips that move the motors of a board.
pub(super) trait MotionChips {
    /// Brings all chips to time `to`, and the axes with them.
    fn advance(&mut self, to: Nanos, axes: &mut [Axis]);
    /// The next time at which something is due in them; the maximum for none.
    fn next_due(&self) -> Nanos;
    /// As [`next_due`](Self::next_due), but steps that change nothing but the positions of the axes need not count.
    fn next_pressing(&mut self, _axes: &mut [Axis]) -> Nanos {
        self.next_due()
    }
    /// Whether a datagram to a chip that begins with `first` does and tells the same, whether steps that change nothing
    /// but positions have been made or not.
    fn ignores_steps(&self, _chip: Chip, _first: u8) -> bool {
        false
    }
    /// Takes the power from the chips, from now on.
    fn power_off(&mut self);
    /// Gives the chips power again: they start from their reset states.
    fn power_on(&mut self, now: Nanos, axes: &mut [Axis]);
    /// Sets the level of the pin that disables all drivers.
    fn set_disable_pin(&mut self, high: bool);
    /// Lets the clock at the clock inputs run, or stops it.
    fn set_clock(&mut self, now: Nanos, running: bool);
    /// Brings the levels between the chips and the world of one axis up to date.
    fn connect(&mut self, number: usize, axis: &mut Axis, around: Surroundings);
    /// Brings the inputs of the chips to the levels of the axes.
    fn sense(&mut self, now: Nanos, axes: &[Axis]);
    /// A chip, brought to the present time; `None` if there is none, or if it does not hear its chip select.
    fn slave(&mut self, chip: Chip, now: Nanos) -> Option<&mut dyn SpiSlave>;
    /// The fault "does not hear its chip select".
    fn deafness(&mut self, chip: Chip) -> Option<&mut bool>;
    /// Injects or removes a fault of the chips of an axis, other than deafness. Others change nothing.
    fn set_fault(&mut self, fault: Fault, number: usize, axis: &Axis, on: bool, now: Nanos);
    /// Gives what can be seen of an axis at a time.
    fn observe(&self, number: usize, axis: &Axis, now: Nanos) -> Observed;
    /// How an axis goes on from now.
    fn prospect(&self, number: usize, now: Nanos) -> Prospect;
    /// The time at which an axis that turns at a constant speed makes a step, counted from 1.
    fn time_of_step(&self, number: usize, step: u64) -> Nanos;
    /// The pin of the driver of an axis that tells of a stall.
    fn stall_pin(&self, number: usize, now: Nanos) -> bool;
}
