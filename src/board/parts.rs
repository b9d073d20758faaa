//! What a board is made of, whatever its pins.

use core::marker::PhantomData;

use embassy_stm32::adc::Adc;
use embassy_stm32::can::Can;
use embassy_stm32::gpio::Output;
use embassy_stm32::peripherals::{ADC1, IWDG, PB10, PB11, USB_OTG_FS};
use embassy_stm32::usb;
use embassy_stm32::wdg::IndependentWatchdog;

use super::eeprom::Eeprom;
use super::motion_bus::Chip;
use super::{analog, rs485};
use crate::chip::tmc429::Tmc429;
use crate::device::{self, Controller, Parts};
use crate::module::{Platform, Product};
use crate::motion::tmc429::Tmc429Tmc262;
use crate::store::{Memory, Store};

/// The pins of the RS485 interface.
pub(super) type Rs485 = rs485::Pins<PB11, PB10>;

/// All parts of a board with `AXES` axes on `N` motion controllers and the signals `S`, ready for use; the motor drivers
/// are off.
pub struct Board<S, const AXES: usize, const N: usize> {
    pub(super) motion: Motion<AXES, N>,
    pub(super) signals: S,
    pub(super) eeprom: Eeprom,
    pub(super) rs485: Rs485,
    pub(super) can: Can<'static>,
    pub(super) usb: usb::Driver<'static, USB_OTG_FS>,
    pub(super) adc: Adc<'static, ADC1>,
    pub(super) analog: analog::Inputs,
    pub(super) watchdog: IndependentWatchdog<'static, IWDG>,
    /// The pads that ask for factory settings are connected.
    pub(super) factory_reset: bool,
}

/// The chips that move the motors.
pub(super) struct Motion<const AXES: usize, const N: usize> {
    pub(super) tmc429: [Chip; N],
    pub(super) tmc262: [Chip; AXES],
    pub(super) enable: Output<'static>,
}

/// The chips of a board with `N` motion controllers, with an EEPROM that is divided as `P` says.
#[derive(Debug)]
pub struct Chips<P, const N: usize>(PhantomData<P>);

impl<P: Memory + 'static, const N: usize> device::Board for Chips<P, N> {
    type Product = P;
    type Hardware = Tmc429Tmc262<Chip, Chip>;
    type Controllers = [Controller<Self::Hardware>; N];
    type Enable = Output<'static>;
    type Store = &'static mut Store<P>;
}

impl<P: Product + 'static, const N: usize> Platform for Chips<P, N> {
    type Hooks = ();
}

impl<const AXES: usize, const N: usize> Motion<AXES, N> {
    /// The parts of a device.
    pub(super) fn parts<P: Memory>(self, store: &'static mut Store<P>) -> Parts<Chips<P, N>, AXES> {
        let Motion { tmc429, tmc262, enable } = self;
        let controllers = tmc429.map(|chip| Controller::new(Tmc429::new(chip)));
        Parts { controllers, axes: Tmc429Tmc262::axes(tmc262), enable, store }
    }
}
