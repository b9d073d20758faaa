//! The hardware of a module as every firmware has it: axes and their motion controllers, the drivers' enable, inputs
//! and outputs, the store, restart, and the turn of each millisecond.
//!
//! A device knows no language. The firmware that owns it - the TMCL firmware is [`crate::module`] - gives it time and
//! inputs by [`Device::begin`], [`Device::next_axis`] and [`Device::next_reading`], and commands its axes by
//! [`Device::axis`]. By itself the device stops what must not go on: all motors, when the supply is too low or a motion
//! controller is silent.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod calm;
mod command;
mod interpolation;
mod io;
mod safety;
mod turn;

pub use io::{ANALOG, Inputs, Outputs};
pub use safety::{LOCK, RELEASE, Supervised, Supply};
pub use turn::Piece;

use core::fmt;
use core::ops::DerefMut;

use embedded_hal::digital::OutputPin;

use crate::motion::{Axis, Error, Hardware, Joined, MotionController};
use crate::param::{AxisParameter, Parameter, Table};
use crate::store::{Memory, Store};
use crate::units::Micros;

/// The types of which a board is made.
pub trait Circuit {
    /// The product on the board, which says how large its EEPROM memory areas are.
    type Product: Memory;
    /// The ramp generator and driver on which each axis runs.
    type Hardware: Hardware;
    /// The array of the motion controllers. Axis n belongs to controller n / [`MotionController::AXES`].
    type Controllers: Controllers<Self::Hardware>;
    /// The pin ENN of all drivers: low switches them on.
    type Enable: OutputPin;
    /// The pointer by which the store is owned: the store is larger than a stack should be, so a device does not
    /// contain it.
    type Store: DerefMut<Target = Store<Self::Product>>;
}

/// An array of motion controllers.
pub trait Controllers<H: Hardware>: AsRef<[Controller<H>]> + AsMut<[Controller<H>]> {
    /// Number of motion controllers.
    const COUNT: usize;
}

impl<H: Hardware, const N: usize> Controllers<H> for [Controller<H>; N] {
    const COUNT: usize = N;
}

/// A motion controller, and what the device notes about it.
#[derive(Debug)]
pub struct Controller<H: Hardware> {
    /// The controller itself, as its axes share it.
    shared: H::Controller,
    /// Number of turns in a row, one in a millisecond, in which the controller has not answered.
    unanswered: u8,
    /// The axis of this controller, counted from 0, that takes the next reading.
    turn: u8,
    /// The number of that reading in the rotation of readings, wrapping at 256.
    rotation: u8,
}

impl<H: Hardware> Controller<H> {
    /// A controller to which nothing has been written yet.
    pub const fn new(shared: H::Controller) -> Self {
        Controller { shared, unanswered: 0, turn: 0, rotation: 0 }
    }
}

/// The parts of which a device is made.
#[derive(Debug)]
pub struct Parts<T: Circuit, const AXES: usize> {
    /// The motion controllers.
    pub controllers: T::Controllers,
    /// The hardware that each axis has for itself.
    pub axes: [T::Hardware; AXES],
    /// The pin ENN of all drivers.
    pub enable: T::Enable,
    /// A new store.
    pub store: T::Store,
}

/// The signals that are inverted; in both fields bit n stands for motion controller n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inversion {
    /// The inputs of the stop switches.
    pub switches: u8,
    /// The direction of the motors.
    pub shafts: u8,
}

/// A device: the hardware of a module with `AXES` axes.
pub struct Device<T: Circuit, const AXES: usize> {
    controllers: T::Controllers,
    axes: [Axis<T::Hardware>; AXES],
    enable: T::Enable,
    store: T::Store,
    inputs: Inputs<AXES>,
    outputs: Outputs,
    safety: safety::Safety,
    inversion: Inversion,
    /// The straight lines on which several axes go.
    interpolations: interpolation::Interpolations<AXES>,
    /// The orders before the last command to axes.
    before: command::Before<T, AXES>,
    /// The time at which a restart is due.
    restart: Option<Micros>,
    /// The time at which the next turn is due.
    next: Micros,
    /// The number of the next piece of the turn under way: first come the axes, then the readings of the motion
    /// controllers. Behind them the turn is over.
    upcoming: usize,
}

impl<T: Circuit, const AXES: usize> fmt::Debug for Device<T, AXES> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Device { inputs, outputs, safety, .. } = self;
        f.debug_struct("Device").field("inputs", inputs).field("outputs", outputs).field("safety", safety).finish()
    }
}

impl<T: Circuit, const AXES: usize> Device<T, AXES> {
    /// A device before its [start](Self::start). `table` has the axis parameters of the product.
    #[inline(always)]
    pub fn new(parts: Parts<T, AXES>, table: &'static Table<AxisParameter>) -> Self {
        const {
            let each = Shared::<T>::AXES;
            assert!(T::Controllers::COUNT == AXES.div_ceil(each), "each axis needs a place on a motion controller");
        }
        let Parts { controllers, axes, enable, store } = parts;
        Device {
            controllers,
            axes: axes.map(|hardware| Axis::new(hardware, table)),
            enable,
            store,
            inputs: Inputs::default(),
            outputs: Outputs::default(),
            safety: safety::Safety::default(),
            inversion: Inversion::default(),
            interpolations: interpolation::Interpolations::default(),
            before: command::Before::default(),
            restart: None,
            next: Micros(0),
            upcoming: Self::PIECES,
        }
    }

    /// Switches the drivers off and stops all motors. A firmware does this first of all: the motion controllers keep
    /// their registers when the firmware restarts, and would run on.
    pub fn halt(&mut self) {
        // An output pin of a microcontroller cannot fail; one that could would leave the drivers off.
        let _ = self.enable.set_high();
        for controller in self.controllers.as_mut() {
            // A controller that does not take its stop now is halted again by `start`.
            let _ = controller.shared.stop_all();
        }
    }

    /// Sets up all chips, with the motors standing at position 0; the first turn is due at `now`. If a motion
    /// controller does not answer, the motors stay locked and the drivers off: it is given up.
    pub fn start(&mut self, now: Micros, inversion: Inversion) {
        self.safety = safety::Safety::default();
        self.outputs.trouble = false;
        (self.restart, self.next, self.upcoming) = (None, now, Self::PIECES);
        if AXES > 1 {
            self.interpolations = interpolation::Interpolations::default();
        }
        for (n, controller) in (0_u8..).zip(self.controllers.as_mut()) {
            // Each fourth reading goes to a driver. With three readings between them, two controllers do not read
            // drivers in the same millisecond, nor does one of them read one while the other is asked for its version.
            (controller.unanswered, controller.turn, controller.rotation) = (0, 0, n.wrapping_mul(3));
        }
        if !(0..safety::PATIENCE).any(|_| self.set_up(now, inversion, |_| 0).is_ok()) {
            self.give_up();
        }
    }

    /// Sets up all chips, with each motor standing at a position in microsteps.
    fn set_up(
        &mut self,
        now: Micros,
        inversion: Inversion,
        position: impl Fn(&Axis<T::Hardware>) -> i32,
    ) -> Result<(), Error> {
        for controller in self.controllers.as_mut() {
            controller.shared.start()?;
        }
        self.invert(inversion)?;
        for number in 0..AXES {
            if let Some(mut axis) = self.axis(number) {
                let position = position(axis.state());
                axis.start(now, position)?;
            }
        }
        Ok(())
    }

    /// Switches the drivers of all axes on or off. After a motion controller was given up they stay off.
    pub fn enable_drivers(&mut self, on: bool) {
        let _ = if on && !self.safety.given_up { self.enable.set_low() } else { self.enable.set_high() };
    }

    /// Gives up the motion controllers: the drivers are off, and the error LED is lit. This lasts until the next start,
    /// or until the supply has been lost and has come back: that of all, or that of the controllers alone.
    fn give_up(&mut self) {
        self.safety.given_up = true;
        // An output pin of a microcontroller cannot fail.
        let _ = self.enable.set_high();
        self.outputs.trouble = true;
    }

    /// Inverts the inputs of stop switches and the directions of motors. The encoders of an axis follow its direction.
    ///
    /// # Errors
    /// [`Error::Chip`] when a motion controller has not taken its datagram; the others were written to all the same.
    pub fn invert(&mut self, inversion: Inversion) -> Result<(), Error> {
        self.inversion = inversion;
        let Inversion { switches, shafts } = inversion;
        let is_set = |bits: u8, n: usize| bits.unbounded_shr(n as u32) & 1 != 0;
        for (number, axis) in self.axes.iter_mut().enumerate() {
            axis.set_reverse(is_set(shafts, controller_of::<T>(number)));
        }
        let mut told = Ok(());
        for (n, controller) in self.controllers.as_mut().iter_mut().enumerate() {
            told = told.and(controller.shared.invert(is_set(switches, n), is_set(shafts, n)));
        }
        told
    }

    /// Gives an axis the stored value of a parameter, before [`Device::start`] writes it to the chips.
    pub fn preset(&mut self, axis: usize, parameter: &Parameter<AxisParameter>, value: i32) {
        if let Some(axis) = self.axes.get_mut(axis) {
            axis.preset(parameter, value);
        }
    }

    /// An axis together with its motion controller; `None` if the module has no such axis.
    pub fn axis(&mut self, number: usize) -> Option<Joined<'_, T::Hardware>> {
        let controller = self.controllers.as_mut().get_mut(controller_of::<T>(number))?;
        Some(self.axes.get_mut(number)?.on(&mut controller.shared))
    }

    /// The axes, to look at.
    pub const fn axes(&self) -> &[Axis<T::Hardware>; AXES] {
        &self.axes
    }

    /// The stop switches of an axis, left and right, as read last: true is closed. `None` if the module has no such
    /// axis.
    pub fn stop_switches(&self, number: usize) -> Option<[bool; 2]> {
        let controller = self.controllers.as_ref().get(controller_of::<T>(number))?;
        Some(self.axes.get(number)?.stop_switches(&controller.shared))
    }

    /// The store, to read from.
    pub fn store(&self) -> &Store<T::Product> {
        &self.store
    }

    /// The store, to write to, and to take the jobs from that are to be done in the EEPROM.
    pub fn store_mut(&mut self) -> &mut Store<T::Product> {
        &mut self.store
    }
}

/// A motion controller of a board, which several axes have in common.
type Shared<T> = <<T as Circuit>::Hardware as Hardware>::Controller;

/// The shape of the ramps of a board besides a top speed and an acceleration.
type ShapeOf<T> = <<T as Circuit>::Hardware as Hardware>::Shape;

/// The number of the motion controller of an axis.
fn controller_of<T: Circuit>(axis: usize) -> usize {
    axis.checked_div(Shared::<T>::AXES).unwrap_or_default()
}
