//! GPIO: a port of 16 pins (RM0090 8.4).

use super::peripheral::{Access, Peripheral, Refusal, bit, field};

const MODER: u32 = 0x00;
const OTYPER: u32 = 0x04;
const OSPEEDR: u32 = 0x08;
const PUPDR: u32 = 0x0C;
const IDR: u32 = 0x10;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const LCKR: u32 = 0x1C;
const AFRL: u32 = 0x20;
const AFRH: u32 = 0x24;

const INPUT: u32 = 0;
const OUTPUT: u32 = 1;
const ALTERNATE: u32 = 2;
const PULL_UP: u32 = 1;

/// The registers' values after reset: those pins of ports A and B that a debugger uses.
#[derive(Clone, Copy, Debug)]
struct Reset {
    moder: u32,
    ospeedr: u32,
    pupdr: u32,
}

/// A port.
#[derive(Debug)]
pub(super) struct Gpio {
    reset: Reset,
    moder: u32,
    otyper: u32,
    ospeedr: u32,
    pupdr: u32,
    odr: u32,
    afr: [u32; 2],
    /// Pins that are driven from outside, and their levels.
    driven: u32,
    outside: u32,
    /// Pins that are outputs, are not analog, and have a pull-up resistor of their own, as the registers say.
    outputs: u32,
    digital: u32,
    pulled_up: u32,
}

impl Gpio {
    /// Port `index`: 0 is A.
    pub(super) fn new(index: usize) -> Self {
        let reset = match index {
            0 => Reset { moder: 0xA800_0000, ospeedr: 0x0C00_0000, pupdr: 0x6400_0000 },
            1 => Reset { moder: 0x0000_0280, ospeedr: 0x0000_00C0, pupdr: 0x0000_0100 },
            _ => Reset { moder: 0, ospeedr: 0, pupdr: 0 },
        };
        let mut port = Self {
            reset,
            moder: 0,
            otyper: 0,
            ospeedr: 0,
            pupdr: 0,
            odr: 0,
            afr: [0; 2],
            driven: 0,
            outside: 0,
            outputs: 0,
            digital: 0,
            pulled_up: 0,
        };
        port.reset();
        port
    }

    /// The pins in `mask` are driven from outside to `levels`.
    pub(super) fn drive(&mut self, mask: u32, levels: u32) {
        self.driven |= mask;
        self.outside = self.outside & !mask | levels & mask;
    }

    /// The pins in `mask` are not driven from outside any more.
    pub(super) fn release(&mut self, mask: u32) {
        self.driven &= !mask;
    }

    /// The level that the port drives pin `pin` to; none where it leaves it to others.
    pub(super) fn output(&self, pin: u32) -> Option<bool> {
        bit(self.drives(), pin).then(|| bit(self.odr, pin))
    }

    /// The pins that are outputs, one bit each.
    pub(super) fn outputs(&self) -> u32 {
        self.outputs
    }

    /// Whether the pin's own resistor pulls it up.
    pub(super) fn is_pulled_up(&self, pin: u32) -> bool {
        bit(self.pulled_up, pin)
    }

    /// The number of the alternate function the pin has, if it has one.
    pub(super) fn alternate(&self, pin: u32) -> Option<u32> {
        let register = if pin < 8 { self.afr[0] } else { self.afr[1] };
        (self.mode(pin) == ALTERNATE).then(|| field(register, 4 * (pin % 8), 4))
    }

    /// The levels of the pins: what IDR reads.
    pub(super) fn levels(&self) -> u32 {
        let drives = self.drives();
        let left = self.outside & self.driven | self.pulled_up & !self.driven;
        self.odr & drives | left & !drives
    }

    /// The pins that the port drives.
    fn drives(&self) -> u32 {
        self.outputs & !(self.otyper & self.odr)
    }

    fn mode(&self, pin: u32) -> u32 {
        field(self.moder, 2 * pin, 2)
    }

    /// Finds out what the registers say of all pins.
    fn sort_pins(&mut self) {
        let pins = |is: &dyn Fn(u32) -> bool| (0..16).filter(|&pin| is(pin)).fold(0, |mask, pin| mask | 1 << pin);
        self.outputs = pins(&|pin| self.mode(pin) == OUTPUT);
        self.digital = pins(&|pin| matches!(self.mode(pin), INPUT..=ALTERNATE));
        self.pulled_up = pins(&|pin| field(self.pupdr, 2 * pin, 2) == PULL_UP);
    }
}

impl Peripheral for Gpio {
    fn read(&mut self, offset: u32) -> Access<u32> {
        match offset {
            MODER => Ok(self.moder),
            OTYPER => Ok(self.otyper),
            OSPEEDR => Ok(self.ospeedr),
            PUPDR => Ok(self.pupdr),
            // Pins in analog mode read zero.
            IDR => Ok(self.levels() & self.digital),
            ODR => Ok(self.odr),
            BSRR | LCKR => Ok(0),
            AFRL => Ok(self.afr[0]),
            AFRH => Ok(self.afr[1]),
            _ => Err(Refusal::Register),
        }
    }

    fn write(&mut self, offset: u32, value: u32) -> Access {
        match offset {
            MODER => self.moder = value,
            OTYPER => self.otyper = value & 0xFFFF,
            OSPEEDR => self.ospeedr = value,
            PUPDR => self.pupdr = value,
            ODR => self.odr = value & 0xFFFF,
            // A pin that is both set and cleared is set.
            BSRR => self.odr = self.odr & !(value >> 16) | value & 0xFFFF,
            AFRL => self.afr[0] = value,
            AFRH => self.afr[1] = value,
            LCKR => return Err(Refusal::Use("locking pins is not modelled")),
            _ => return Err(Refusal::Register),
        }
        if matches!(offset, MODER | PUPDR) {
            self.sort_pins();
        }
        Ok(())
    }

    fn reset(&mut self) {
        self.moder = self.reset.moder;
        self.ospeedr = self.reset.ospeedr;
        self.pupdr = self.reset.pupdr;
        self.otyper = 0;
        self.odr = 0;
        self.afr = [0; 2];
        self.sort_pins();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_is_driven_by_the_port_by_others_or_pulled() {
        let mut port = Gpio::new(4);
        assert_eq!((port.output(1), port.levels()), (None, 0));
        port.write(PUPDR, 1 << 2).unwrap();
        assert_eq!(port.read(IDR), Ok(2));
        port.drive(2, 0);
        assert_eq!(port.read(IDR), Ok(0));
        port.write(BSRR, 2).unwrap();
        port.write(MODER, 1 << 2).unwrap();
        assert_eq!((port.output(1), port.read(IDR)), (Some(true), Ok(2)));
        port.write(BSRR, 2 << 16).unwrap();
        assert_eq!(port.output(1), Some(false));
        port.write(BSRR, 2 << 16 | 2).unwrap();
        assert_eq!(port.output(1), Some(true));
        port.write(OTYPER, 2).unwrap();
        assert_eq!(port.output(1), None);
        port.write(MODER, 2 << 2).unwrap();
        port.write(AFRL, 7 << 4).unwrap();
        assert_eq!((port.alternate(1), port.alternate(2)), (Some(7), None));
    }
}
