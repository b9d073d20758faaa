//! The hardware of an axis that runs on a ramp generator of the TMC429 and on a TMC262 driver of its own.
//!
//! Here is all that these two chips demand. The TMC429's positions have 24 bits (`position.rs`). Its braking ramps need
//! a parameter that is worked out for them ([`ramp`]). In velocity mode its speed limit is not that of positioning.
//! Registers are written in such an order that none of them acts before the others are right. A register that already
//! has its value costs no datagram: the drivers in [`crate::chip`] see to that.

mod configuration;
mod controller;
mod driver;
mod foreseeable;
mod generator;
mod position;
pub mod ramp;
mod settings;
mod shape;
mod switches;

use core::marker::PhantomData;

use embedded_hal::spi::SpiDevice;

use super::hardware::{Hardware, Known, Readings};
use crate::chip::tmc262::{Tmc262, flags};
use crate::chip::tmc429::{RampGenerator, Tmc429};
use crate::param::AxisParameter as P;
use settings::Settings;
pub use shape::Trapezoid;

/// The driver's flags that mean that it has switched the motor off.
const SHUT_DOWN: u32 = (flags::OVERTEMPERATURE | flags::SHORT_A | flags::SHORT_B) as u32;

/// Whether the position of a motor has to be read. Its known speed may be some milliseconds old; since then the motor
/// may have been set going and told to stop again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rest {
    /// The motor may move.
    Moves,
    /// The speed has been read as zero after the motor was sent to where it is, so its position is read once more.
    Stands,
    /// The known position is that at which the motor stands.
    Rests,
}

/// The hardware of an axis on a TMC429 and a TMC262: the driver, and one of the three ramp generators. `M` is the SPI
/// device of the TMC429, `D` that of the TMC262.
#[derive(Debug)]
pub struct Tmc429Tmc262<M, D> {
    generator: RampGenerator,
    driver: Tmc262<D>,
    known: Known,
    /// The target that the chip was given, in microsteps: a waypoint on the way to the motor's target, or that target
    /// itself.
    waypoint: i32,
    /// The right stop switch as read last; the left one comes in the status byte of each datagram.
    right: bool,
    rest: Rest,
    /// The settings that the chip has; `None` if not all datagrams of the last settings have got through.
    settled: Option<Settings>,
    braking: ramp::BrakingMemo,
    controller: PhantomData<M>,
}

impl<M, D: SpiDevice> Tmc429Tmc262<M, D> {
    /// The hardware of the axes of a module, in the order of their drivers; each TMC429 moves three of them. The chips
    /// are not told anything yet.
    pub fn axes<const N: usize>(drivers: [D; N]) -> [Self; N] {
        let mut generators = RampGenerator::ALL.into_iter().cycle();
        drivers.map(|driver| Tmc429Tmc262 {
            generator: generators.next().unwrap_or(RampGenerator::First),
            driver: Tmc262::new(driver),
            known: Known::default(),
            waypoint: 0,
            right: false,
            rest: Rest::Moves,
            settled: None,
            braking: ramp::BrakingMemo::default(),
            controller: PhantomData,
        })
    }
}

impl<M: SpiDevice, D> Tmc429Tmc262<M, D> {
    /// The stop switches, left and right: the left one is as old as the last datagram, the right one at most eight
    /// turns of readings of this axis.
    fn last_switches(&self, chip: &Tmc429<M>) -> [bool; 2] {
        [chip.left_switch(self.generator), self.right]
    }
}

impl<M: SpiDevice, D: SpiDevice> Hardware for Tmc429Tmc262<M, D> {
    type Controller = Tmc429<M>;

    type Shape = Trapezoid;

    type Bound<'a>
        = Bound<'a, M, D>
    where
        Self: 'a;

    const DRIVEN: &'static [P] = &[];

    fn bind<'a>(&'a mut self, chip: &'a mut Tmc429<M>) -> Bound<'a, M, D> {
        Bound { axis: self, chip }
    }

    fn known(&self) -> &Known {
        &self.known
    }

    /// Always inlined, because a poll needs one or two of them at a time.
    #[inline(always)]
    fn readings(&self, chip: &Tmc429<M>) -> Readings {
        let flags = self.driver.flags().into();
        Readings {
            load: self.driver.load(),
            current: self.driver.current(),
            flags,
            shut_downs: flags & SHUT_DOWN,
            switches: self.last_switches(chip),
            ..Readings::default()
        }
    }

    fn known_mut(&mut self) -> &mut Known {
        &mut self.known
    }
}

/// An axis with the TMC429 that moves it and two others.
#[derive(Debug)]
pub struct Bound<'a, M, D> {
    axis: &'a mut Tmc429Tmc262<M, D>,
    chip: &'a mut Tmc429<M>,
}
