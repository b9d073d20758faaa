//! Pins that the firmware uses for something else than the emulated board has there: the pins of a board stand twice, with the
//! firmware and as a [`Pinout`], and a run does not go on where they contradict each other.

use core::fmt;

use super::gpio::Gpio;
use super::pinout::{Pin, Pinout};

/// A pin about which firmware and board disagree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Misfit {
    /// The pin.
    pub pin: Pin,
    /// What the firmware does with it.
    pub firmware: &'static str,
    /// The name of the board.
    pub board: &'static str,
    /// What the board has there.
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

/// The pins of a board that the microcontroller must not drive as outputs, and all that are connected, one bit each.
#[derive(Debug)]
pub(super) struct Pins {
    others: [u32; 5],
    connected: [u32; 5],
}

impl Pins {
    pub(super) fn of(pinout: &Pinout) -> Self {
        let mask = |outputs: bool| {
            let mut mask = [0; 5];
            for ((port, pin), _, _) in pinout.parts().filter(|(_, _, output)| outputs || !output) {
                if let Some(mask) = mask.get_mut(port) {
                    *mask |= 1 << pin;
                }
            }
            mask
        };
        Self { others: mask(false), connected: mask(true) }
    }

    /// A pin that the firmware drives although it is no output on the board.
    pub(super) fn driven(&self, ports: &[Gpio], pinout: &Pinout) -> Option<Misfit> {
        let pin = first(ports, &self.others, |port, mask| port.outputs() & mask)?;
        Some(Misfit::of(pinout, pin, "drives it"))
    }

    /// A pin that the firmware drives low although nothing is connected there: it may be meant for a chip select.
    pub(super) fn low(&self, ports: &[Gpio], pinout: &Pinout) -> Option<Misfit> {
        let pin = first(ports, &self.connected, |port, mask| port.outputs() & !port.levels() & !mask)?;
        Some(Misfit::of(pinout, pin, "drives it low, while no chip is selected that it talks to"))
    }
}

/// The first pin of those that `found` has for a port and its mask.
fn first(ports: &[Gpio], masks: &[u32; 5], found: impl Fn(&Gpio, u32) -> u32) -> Option<Pin> {
    let found = ports.iter().zip(masks).map(|(port, &mask)| found(port, mask));
    found.enumerate().find(|(_, pins)| *pins != 0).map(|(port, pins)| (port, pins.trailing_zeros()))
}
