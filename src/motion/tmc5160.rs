//! The hardware of an axis that runs on a TMC5160, which is ramp generator, driver and encoder counter in one: each
//! axis is on a motion controller of its own.
//!
//! Here is all that this chip demands: its unit of time (`unit.rs`), ramps of six points (`ramp.rs`, `settings.rs`),
//! and the driver's many settings (`configuration.rs`). It also demands a way to stop at once although its speed cannot
//! be written. Most of what is known of the motor comes with two datagrams in each millisecond (`readings.rs`). They
//! bring the actual position and, in rotation, one of the other readings. The stop switches are in the status byte of
//! each datagram. By its supply the chip can be reset: then it has lost all registers, and the motor stands.

mod configuration;
mod controller;
mod driver;
mod foreseeable;
mod generator;
mod ramp;
mod readings;
mod settings;
mod switches;
#[cfg(test)]
mod tests;
mod unit;

use core::marker::PhantomData;

use embedded_hal::spi::SpiDevice;

use super::hardware::{Hardware, Known, Readings};
use crate::chip::tmc5160::Tmc5160;
use crate::param::AxisParameter as P;
pub use ramp::Shape;
use unit::SpeedUnit;

/// For how many turns, one in a millisecond, readings may still be older than what the chip was told.
#[derive(Clone, Copy, Debug, Default)]
struct Delays {
    /// For how many turns a reading of the speed may still be older than the goal.
    settling: u8,
    /// For how many turns the switches still stop the motor at once, whatever they are.
    halting: u8,
    /// For how many turns the driver's flags may still be those of a shut-down that has been ended.
    releasing: u8,
}

impl Delays {
    /// True while one of the delays is left.
    const fn are_left(self) -> bool {
        self.settling > 0 || self.halting > 0 || self.releasing > 0
    }
}

/// Whether the chip stops the motor when it stalls.
#[derive(Clone, Copy, Debug, Default)]
struct Stall {
    /// A stall stops the motor.
    armed: bool,
    /// A stall has stopped the motor.
    stopped: bool,
}

/// The silent mode of the driver, in which it regulates the voltage.
#[derive(Clone, Copy, Debug, Default)]
struct StealthChop {
    /// stealthChop is switched on.
    on: bool,
    /// stealthChop is to be switched on, when the motor stands.
    waits: bool,
}

/// The hardware of an axis on a TMC5160, without the chip itself. `D` is the SPI device of the chip.
#[derive(Debug)]
pub struct Tmc5160Axis<D> {
    known: Known,
    /// The shape of the ramps, where it is not that of the parameters.
    shape: Option<Shape>,
    /// The number of the next reading in the rotation, wrapping at 256.
    rotation: u8,
    delays: Delays,
    /// SW_MODE as the profile of the motor has it, but for sg_stop.
    switches: u32,
    /// The stop switches as read last, left and right.
    closed: [bool; 2],
    stall: Stall,
    /// The encoder deviates.
    deviates: bool,
    stealth_chop: StealthChop,
    /// DRV_STATUS as read last.
    driver: u32,
    /// The unit of speeds.
    unit: SpeedUnit,
    /// The top speed of the profile, in that unit.
    top_speed: i32,
    device: PhantomData<D>,
}

impl<D: SpiDevice> Tmc5160Axis<D> {
    /// The hardware of the axes of a module. The chips are not told anything yet.
    pub fn axes<const N: usize>() -> [Self; N] {
        [(); N].map(|()| Tmc5160Axis {
            known: Known::default(),
            shape: None,
            rotation: 0,
            delays: Delays::default(),
            switches: 0,
            closed: [false; 2],
            stall: Stall::default(),
            deviates: false,
            stealth_chop: StealthChop::default(),
            driver: 0,
            unit: SpeedUnit::Pps,
            top_speed: 0,
            device: PhantomData,
        })
    }

    /// True if the motor stands where it is to stand, by readings that are younger than its goal.
    pub(super) fn rests(&self) -> bool {
        self.delays.settling == 0 && self.known.speed == 0 && self.known.ahead() == 0
    }
}

impl<D: SpiDevice> Hardware for Tmc5160Axis<D> {
    type Controller = Tmc5160<D>;

    type Shape = Shape;

    type Bound<'a>
        = Bound<'a, D>
    where
        Self: 'a;

    const DRIVEN: &'static [P] =
        &[P::MaximumCurrent, P::StandbyCurrent, P::PowerDownDelay, P::StopOnStall, P::SmartEnergyThresholdSpeed];

    fn bind<'a>(&'a mut self, chip: &'a mut Tmc5160<D>) -> Bound<'a, D> {
        Bound { axis: self, chip }
    }

    fn known(&self) -> &Known {
        &self.known
    }

    #[inline(always)]
    fn readings(&self, chip: &Tmc5160<D>) -> Readings {
        self.last_readings(chip)
    }

    fn known_mut(&mut self) -> &mut Known {
        &mut self.known
    }
}

/// An axis with its TMC5160.
#[derive(Debug)]
pub struct Bound<'a, D> {
    axis: &'a mut Tmc5160Axis<D>,
    chip: &'a mut Tmc5160<D>,
}
