//! Pins that the firmware uses for something else than the emulated board has there. The pins of a board stand twice,
//! with the firmware and as a [`Pinout`], and a run does not go on where they contradict each other.

use core::fmt;

use super::gpio::Gpio;
use super::pinout::{Pin, Pinout};

/// A pin about which firmware and board disagree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Misfit {
    /// The pin.
    pub pin: Pin,
    /// The use that the firmware makes of the pin.
    pub firmware: &'static str,
    /// The name of the board.
    pub board: &'static str,
    /// The part that the board has there.
    pub part: &'static str,
}

impl Misfit {
    /// A pin with which the firmware does something that does not fit what the board has there.
    pub(super) fn of(pinout: &Pinout, pin: Pin, firmware: &'static str) -> Self {
        let part = pinout.parts().find(|(other, ..)| *other == pin).map_or("nothing", |(_, part, _)| part);
        Self { pin, firmware, board: pinout.kind.name, part }
    }
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pin: (port, pin), firmware, board, part } = self;
        let port = b"ABCDE".get(*port).copied().map_or('?', char::from);
        write!(f, "pin P{port}{pin}: the firmware {firmware}, the emulated {board} has {part} there")
    }
}

/// The pins that the microcontroller drives on a board, one bit for each of a port.
#[derive(Debug)]
pub(super) struct OutputPins([u32; 5]);

impl OutputPins {
    pub(super) fn of(pinout: &Pinout) -> Self {
        let mut outputs = [0; 5];
        for ((port, pin), _, _) in pinout.parts().filter(|(_, _, output)| *output) {
            if let Some(port) = outputs.get_mut(port) {
                *port |= 1 << pin;
            }
        }
        Self(outputs)
    }

    /// A pin that the firmware drives although it is no output on the board.
    pub(super) fn misfit(&self, ports: &[Gpio], pinout: &Pinout) -> Option<Misfit> {
        let driven = ports.iter().zip(self.0).map(|(port, outputs)| port.outputs() & !outputs);
        let (port, pins) = driven.enumerate().find(|(_, pins)| *pins != 0)?;
        Some(Misfit::of(pinout, (port, pins.trailing_zeros()), "drives it"))
    }
}
