//! What a board is made of, whatever its pins.

use core::marker::PhantomData;

use embassy_stm32::can::Can;
use embassy_stm32::gpio::Output;
use embassy_stm32::peripherals::{IWDG, USB_OTG_FS};
use embassy_stm32::usb;
use embassy_stm32::wdg::IndependentWatchdog;

use super::analog;
use super::eeprom::Eeprom;
use crate::device::{self, Controllers, Parts};
use crate::module::{Platform, Product};
use crate::motion::Hardware;
use crate::store::{Memory, Store};

/// All parts of a board with the motors `M`, the signals `S` and the RS485 interface `R`, ready for use; the motor drivers
/// are off.
pub(super) struct Board<M, S, R> {
    pub(super) motors: M,
    pub(super) signals: S,
    pub(super) eeprom: Eeprom,
    pub(super) rs485: R,
    pub(super) can: Can<'static>,
    pub(super) usb: usb::Driver<'static, USB_OTG_FS>,
    pub(super) analog: analog::Inputs,
    pub(super) watchdog: IndependentWatchdog<'static, IWDG>,
    /// The pads that ask for factory settings are connected.
    pub(super) factory_reset: bool,
}

/// The chips that move the motors of a board with `AXES` axes, and the pin that enables all drivers.
pub trait Motors<const AXES: usize> {
    /// What each axis runs on.
    type Hardware: Hardware + 'static;
    /// The motion controllers.
    type Controllers: Controllers<Self::Hardware> + 'static;

    /// The parts of a device.
    fn parts<P: Memory>(self, store: &'static mut Store<P>) -> Parts<Chips<P, Self, AXES>, AXES>
    where
        Self: Sized;
}

/// The types of a board with `AXES` axes, which the motors `M` move, and with an EEPROM that is divided as `P` says.
#[derive(Debug)]
pub struct Chips<P, M, const AXES: usize>(PhantomData<(P, M)>);

impl<P: Memory + 'static, M: Motors<AXES>, const AXES: usize> device::Board for Chips<P, M, AXES> {
    type Product = P;
    type Hardware = M::Hardware;
    type Controllers = M::Controllers;
    type Enable = Output<'static>;
    type Store = &'static mut Store<P>;
}

impl<P: Product + 'static, M: Motors<AXES>, const AXES: usize> Platform for Chips<P, M, AXES> {
    type Hooks = ();
}
