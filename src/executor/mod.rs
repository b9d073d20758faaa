//! The executor: carries out the commands of TMCL that need no more than a [device](crate::device) and the registers of
//! the interpreter - motion, parameters, coordinates, inputs and outputs, arithmetic. Who owns one gives it one command
//! after the other, whether it comes over a link, out of a program or out of an object of CANopen.
//!
//! | file | contents |
//! |---|---|
//! | `spec`, `slots` | a product as data |
//! | `admit` | whether a command may be executed, and for this motor |
//! | `commands`, `act` | the executor at work: its device and its interpreter, and the match over all commands |
//! | `axes`, `banks`, `coordinates`, `io` | what the commands do |
//! | `globals` | the settings of bank 0 |
//! | `outcome` | what a command led to |
//! | `solo` | an executor for an owner who knows nothing of TMCL |

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod act;
mod admit;
mod axes;
mod banks;
mod commands;
mod coordinates;
mod globals;
mod io;
mod outcome;
pub mod ports;
mod slots;
mod solo;
pub mod spec;

pub use slots::Slots;
pub use spec::*;

pub(crate) use admit::{admit, check_motor, confirm};
pub(crate) use commands::Commands;
pub(crate) use globals::{Globals, SETTINGS};
pub(crate) use outcome::{Outcome, Undo};
pub(crate) use solo::{Answered, LENGTH, Solo};

use coordinates::Coordinates;

use crate::device::{Circuit, Device};
use crate::param::{GlobalParameter as G, USER_VARIABLES};
use crate::units::Micros;
use crate::vm::Machine;

/// The values that the commands of TMCL set and read beside a device and an interpreter: global parameters, user
/// variables, coordinates. With these two it is [at work](Executor::on).
#[derive(Debug)]
pub(crate) struct Executor<const AXES: usize> {
    /// The settings of bank 0.
    pub(crate) globals: Globals,
    /// The user variables, bank 2.
    pub(crate) variables: [i32; USER_VARIABLES],
    /// The coordinates of each axis.
    pub(crate) coordinates: Coordinates<AXES>,
    /// The state of the random numbers.
    random: u32,
    /// The time, in milliseconds wrapping at 32 bits, from which the tick timer counts; a write to the timer may put it
    /// into the future.
    tick_offset: u32,
}

impl<const AXES: usize> Executor<AXES> {
    /// An executor of a product, with the defaults of its parameters. `seed` starts the random numbers.
    #[inline(always)]
    pub(crate) fn new<P: Product>(seed: u32) -> Self {
        Executor {
            globals: Globals::defaults::<P>(),
            variables: [0; USER_VARIABLES],
            coordinates: Coordinates::default(),
            random: seed,
            tick_offset: 0,
        }
    }

    /// The executor together with what its commands act on, at `now`. While it is `barred` by its owner, no motor is
    /// started.
    #[inline(always)]
    pub(crate) const fn on<'a, T: Circuit>(
        &'a mut self,
        now: Micros,
        barred: bool,
        machine: &'a mut Machine,
        device: &'a mut Device<T, AXES>,
    ) -> Commands<'a, T, AXES> {
        Commands { now, barred, executor: self, machine, device }
    }

    /// Lets the tick timer count from `now`.
    pub(crate) const fn begin_ticks(&mut self, now: Micros) {
        self.tick_offset = now.millis() as u32;
    }

    /// Takes from the store of a device, before its start, everything that is to be restored then.
    pub(crate) fn restore<T: Circuit<Product: Product>>(&mut self, device: &mut Device<T, AXES>) {
        self.globals.reload(device.store());
        let Spec { axis: table, global, slots, .. } = T::Product::SPEC;
        let Some(slots) = slots else { return };
        // Another magic number (64) than the default asks for the defaults of all settings.
        if global.row(G::EepromMagic).is_some_and(|row| self.globals.get(G::EepromMagic) != row.default) {
            factory_reset::<T::Product>(device.store_mut());
            self.globals = Globals::defaults::<T::Product>();
        }
        let stored = |device: &Device<T, AXES>, slot: Option<usize>| device.store().get(slot?);
        if self.globals.get(G::DoNotRestoreVariables) == 0 {
            for (number, variable) in (0..=u8::MAX).zip(&mut self.variables) {
                *variable = stored(device, slots.variable(number)).unwrap_or_default();
            }
        }
        for axis in 0..AXES as u8 {
            for parameter in table.rows {
                let slot = parameter.row.slot().and_then(|slot| slots.axis(axis, slot));
                if let Some(value) = stored(device, slot) {
                    device.preset(axis.into(), parameter, value);
                }
            }
        }
        if self.globals.get(G::CoordinateStorage) != 0 {
            self.coordinates.restore(|axis, number| stored(device, slots.coordinate(axis, number)));
        }
    }
}
