//! A pin at the registers of its port: read where its level is wanted at once, and driven where nothing is set up yet
//! or nothing works any more.

use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::{GPIOA, GPIOB, RCC};

/// A pin of a port, whatever it is used for. After reset it is an input without a resistor.
#[derive(Clone, Copy)]
pub(crate) struct Line {
    port: Gpio,
    pin: usize,
}

impl Line {
    /// Pin `pin`, 0..=15, of a port.
    pub(crate) const fn new(port: Gpio, pin: usize) -> Self {
        Line { port, pin }
    }

    /// Pins that follow each other, from pin `first` of a port on.
    pub(crate) const fn row<const N: usize>(port: Gpio, first: usize) -> [Self; N] {
        let mut lines = [Line::new(port, first); N];
        let mut n = 0;
        while n < N {
            lines[n] = Line::new(port, first + n);
            n += 1;
        }
        lines
    }

    /// The number of the pin in its port. The remainder shows the compiler that no bit beyond a register is meant.
    pub(crate) const fn pin(self) -> usize {
        self.pin % 16
    }

    /// The number of the port, 0 for port A: the registers of the ports follow each other in memory.
    pub(crate) fn port(self) -> usize {
        let first = GPIOA.as_ptr() as usize;
        (self.port.as_ptr() as usize - first) / (GPIOB.as_ptr() as usize - first)
    }

    /// The level at the pin. The clock of its port has to be on.
    #[inline]
    pub(crate) fn is_high(self) -> bool {
        self.port.idr().read().0 >> self.pin & 1 != 0
    }

    /// Gives the pin a resistor that keeps it low while nobody drives it. The clock of its port has to be on.
    #[allow(dead_code, reason = "only some boards have signals that nobody may drive")]
    pub(crate) fn pull_down(self) {
        self.port.pupdr().modify(|w| w.set_pupdr(self.pin, Pupdr::PULL_DOWN));
    }

    /// Makes the pin an output with this level, and with a pull-up resistor that keeps a high level while the mode
    /// changes. The function uses only registers, so that it can be called at any time, also by a firmware that has
    /// failed.
    #[inline(always)]
    pub(crate) fn drive(self, high: bool) {
        let Line { port, pin } = self;
        RCC.ahb1enr().modify(|w| w.0 |= 1 << self.port());
        // The port is usable two bus cycles after its clock is on; this read lets them pass.
        let _ = RCC.ahb1enr().read();
        port.bsrr().write(|w| if high { w.set_bs(pin, true) } else { w.set_br(pin, true) });
        if high {
            port.pupdr().modify(|w| w.set_pupdr(pin, Pupdr::PULL_UP));
        }
        port.moder().modify(|w| w.set_moder(pin, Moder::OUTPUT));
    }
}
