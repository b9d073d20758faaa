//! All peripherals of the chip.

use crate::mcu::adc::Adc;
use crate::mcu::can::Can;
use crate::mcu::dbgmcu::Dbgmcu;
use crate::mcu::dma::Dma;
use crate::mcu::exti::Exti;
use crate::mcu::flash::Flash;
use crate::mcu::gpio::Gpio;
use crate::mcu::iwdg::Iwdg;
use crate::mcu::peripheral::{Cycles, Peripheral};
use crate::mcu::pwr::Pwr;
use crate::mcu::rcc::{Cause, Rcc};
use crate::mcu::spi::Spi;
use crate::mcu::syscfg::Syscfg;
use crate::mcu::timer::Timer;
use crate::mcu::unit::PeripheralName;
use crate::mcu::usart::Usart;
use crate::mcu::usb::Otg;

/// Ports A to E.
const PORTS: usize = 5;

/// The peripherals, each of its own type. By its name [`of`](Self::of) finds one.
#[derive(Debug)]
pub(in crate::mcu) struct Peripherals {
    pub(in crate::mcu) ports: [Gpio; PORTS],
    pub(in crate::mcu) rcc: Rcc,
    pub(in crate::mcu) flash: Flash,
    pub(in crate::mcu) pwr: Pwr,
    pub(in crate::mcu) syscfg: Syscfg,
    pub(in crate::mcu) exti: Exti,
    pub(in crate::mcu) dbgmcu: Dbgmcu,
    pub(in crate::mcu) timers: [Timer; 4],
    pub(in crate::mcu) usarts: [Usart; 3],
    pub(in crate::mcu) spis: [Spi; 3],
    pub(in crate::mcu) dmas: [Dma; 2],
    pub(in crate::mcu) adc: Adc,
    pub(in crate::mcu) iwdg: Iwdg,
    pub(in crate::mcu) can: Can,
    pub(in crate::mcu) otg: Otg,
}

impl Peripherals {
    /// All of them as after power-on, when the core has counted `now` cycles.
    pub(super) fn new(now: Cycles) -> Self {
        Self {
            ports: std::array::from_fn(Gpio::new),
            rcc: Rcc::new(now, Cause::Power, 0),
            flash: Flash::new(),
            pwr: Pwr::new(),
            syscfg: Syscfg::default(),
            exti: Exti::default(),
            dbgmcu: Dbgmcu::default(),
            timers: [Timer::new(true), Timer::new(false), Timer::new(false), Timer::new(true)],
            usarts: std::array::from_fn(|_| Usart::new()),
            spis: std::array::from_fn(|_| Spi::new()),
            dmas: std::array::from_fn(Dma::new),
            adc: Adc::new(),
            iwdg: Iwdg::new(),
            can: Can::new(),
            otg: Otg::new(),
        }
    }

    /// The peripheral of this name.
    #[inline]
    pub(super) fn of(&mut self, unit: PeripheralName) -> &mut dyn Peripheral {
        match unit {
            PeripheralName::GpioA => &mut self.ports[0],
            PeripheralName::GpioB => &mut self.ports[1],
            PeripheralName::GpioC => &mut self.ports[2],
            PeripheralName::GpioD => &mut self.ports[3],
            PeripheralName::GpioE => &mut self.ports[4],
            PeripheralName::Rcc => &mut self.rcc,
            PeripheralName::Flash => &mut self.flash,
            PeripheralName::Pwr => &mut self.pwr,
            PeripheralName::Syscfg => &mut self.syscfg,
            PeripheralName::Exti => &mut self.exti,
            PeripheralName::Dbgmcu => &mut self.dbgmcu,
            PeripheralName::Tim2 => &mut self.timers[0],
            PeripheralName::Tim3 => &mut self.timers[1],
            PeripheralName::Tim4 => &mut self.timers[2],
            PeripheralName::Tim5 => &mut self.timers[3],
            PeripheralName::Usart1 => &mut self.usarts[0],
            PeripheralName::Usart2 => &mut self.usarts[1],
            PeripheralName::Usart3 => &mut self.usarts[2],
            PeripheralName::Spi1 => &mut self.spis[0],
            PeripheralName::Spi2 => &mut self.spis[1],
            PeripheralName::Spi3 => &mut self.spis[2],
            PeripheralName::Dma1 => &mut self.dmas[0],
            PeripheralName::Dma2 => &mut self.dmas[1],
            PeripheralName::Adc1 => &mut self.adc,
            PeripheralName::Iwdg => &mut self.iwdg,
            PeripheralName::Can1 => &mut self.can,
            PeripheralName::OtgFs => &mut self.otg,
        }
    }
}
