//! The parts that a board is made of, whatever its pins.

use core::marker::PhantomData;

use embassy_stm32::can::Can;
use embassy_stm32::gpio::Output;
use embassy_stm32::peripherals::{IWDG, USB_OTG_FS};
use embassy_stm32::usb;
use embassy_stm32::wdg::IndependentWatchdog;

use crate::board::stm32f4::analog;
use crate::board::stm32f4::eeprom::Eeprom;
use crate::device::{self, Controllers, Parts};
use crate::module::{Hooks, Platform, Product};
use crate::motion::Hardware;
use crate::store::{Memory, Store};

/// All parts of a board with the motors `M`, the signals `S` and the RS485 interface `R`, ready for use; the motor
/// drivers are off.
pub(crate) struct Components<M, S, R> {
    pub(crate) motors: M,
    pub(crate) signals: S,
    pub(crate) eeprom: Eeprom,
    pub(crate) rs485: R,
    pub(crate) can: Can<'static>,
    pub(crate) usb: usb::Driver<'static, USB_OTG_FS>,
    pub(crate) analog: analog::Inputs,
    pub(crate) watchdog: IndependentWatchdog<'static, IWDG>,
    /// The pads that ask for factory settings are connected.
    pub(crate) factory_reset: bool,
}

/// The chips that move the motors of a board with `AXES` axes, and the pin that enables all drivers.
pub trait Motors<const AXES: usize> {
    /// The hardware that each axis runs on.
    type Hardware: Hardware + 'static;
    /// The motion controllers.
    type Controllers: Controllers<Self::Hardware> + 'static;

    /// The parts of a device.
    fn parts<P: Memory, H: Hooks>(self, store: &'static mut Store<P>) -> Parts<Chips<P, H, Self, AXES>, AXES>
    where
        Self: Sized;
}

/// The types of a board with `AXES` axes, which the motors `M` move, with an EEPROM that is divided as `P` says, and of
/// a firmware with additions `H`.
#[derive(Debug)]
pub struct Chips<P, H, M, const AXES: usize>(PhantomData<(P, H, M)>);

impl<P: Memory + 'static, H: Hooks, M: Motors<AXES>, const AXES: usize> device::Circuit for Chips<P, H, M, AXES> {
    type Product = P;
    type Hardware = M::Hardware;
    type Controllers = M::Controllers;
    type Enable = Output<'static>;
    type Store = &'static mut Store<P>;
}

impl<P: Product + 'static, H: Hooks, M: Motors<AXES>, const AXES: usize> Platform for Chips<P, H, M, AXES> {
    type Hooks = H;
}
