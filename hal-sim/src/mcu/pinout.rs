//! The connections of the microcontroller's pins on a board, as data: a further board is one more value of [`Pinout`],
//! in `board/products.rs`. The peripherals behind the pins are the same on all of them: SPI1 has the motion chips, SPI3
//! the EEPROM, USART3 the RS485 transceiver, CAN1 the CAN transceiver, TIM4 the encoder, MCO1 the clock of the motion
//! controllers.

use crate::board::kind::{BoardKind, Chip};

/// Port (0 is A) and number of a pin.
pub type Pin = (usize, u32);

/// The pins of a board. Outputs that nothing drives are off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pinout {
    /// The board.
    pub kind: &'static BoardKind,
    /// Chip selects, pulled up.
    pub selects: &'static [(Pin, Chip)],
    /// Clock, input and output of SPI1: the motion chips.
    pub motion_bus: [Pin; 3],
    /// Clock, input and output of SPI3: the EEPROM.
    pub eeprom_bus: [Pin; 3],
    /// Clock inputs of the TMC429s or TMC5160s, all of them at once.
    pub motion_clock: Pin,
    /// RS485 transceiver: data to it and from it, and its direction (pulled down); while it sends, it does not receive.
    pub rs485: [Pin; 3],
    /// CAN transceiver.
    pub can: [Pin; 2],
    /// LED1 and LED2.
    pub leds: [Pin; 2],
    /// Digital outputs, OUT0 first; low is on.
    pub outputs: &'static [Pin],
    /// Groups of the inputs' pull-ups.
    pub pull_ups: &'static [Pin],
    /// Digital inputs, IN0 first.
    pub inputs: &'static [Pin],
    /// The ENABLE input, which has a number of its own among the digital inputs; `None` on a board without it.
    pub enable: Option<Pin>,
    /// Home switches that are at none of the digital inputs, with the numbers of their axes.
    pub homes: &'static [(Pin, usize)],
    /// SG_TST of drivers, with the numbers of their axes.
    pub stalls: &'static [(Pin, usize)],
    /// ENN of all drivers, pulled up unless the resistor is taken off.
    pub disable: Pin,
    /// Tracks A and B of the ABN encoder of axis 0, at TIM4; `None` on a board without it.
    pub encoder: Option<[Pin; 2]>,
    /// The pads for a factory reset, which can be connected with each other.
    pub pads: [Pin; 2],
    /// Channels of the analog inputs, in their order.
    pub analog: &'static [u8],
    /// Channel of the supply voltage, behind its divider.
    pub supply: u8,
    /// The supply voltage, in 0.1 V, at which the divider gives the converter's full scale.
    pub supply_full_scale: u16,
}

impl Pinout {
    /// The pins of a board; `None` if they are not known.
    pub(super) fn of(kind: &BoardKind) -> Option<&'static Self> {
        Self::ALL.into_iter().find(|pinout| pinout.kind == kind)
    }

    /// Lists what is connected to the pins: of each the part, and whether the microcontroller drives it as an output.
    pub(super) fn parts(&self) -> impl Iterator<Item = (Pin, &'static str, bool)> {
        let spi1 = ["the clock of SPI1", "the input of SPI1", "the output of SPI1"];
        let spi3 = ["the clock of SPI3", "the input of SPI3", "the output of SPI3"];
        let [sends, receives, direction] = self.rs485;
        let all = |pins: &'static [Pin], part, output| pins.iter().map(move |pin| (*pin, part, output));
        let of_axes = |pins: &'static [(Pin, usize)], part| pins.iter().map(move |(pin, _)| (*pin, part, false));
        let buses = self.motion_bus.into_iter().zip(spi1).chain(self.eeprom_bus.into_iter().zip(spi3));
        buses
            .map(|(pin, part)| (pin, part, false))
            .chain(self.selects.iter().map(|(pin, _)| (*pin, "a chip select", true)))
            .chain([(self.motion_clock, "the clock of the motion chips", false), (self.disable, "ENN", true)])
            .chain([(sends, "RS485", false), (receives, "RS485", false), (direction, "the direction of RS485", true)])
            .chain(self.can.map(|pin| (pin, "CAN", false)))
            .chain(self.leds.map(|pin| (pin, "an LED", true)))
            .chain(self.pads.map(|pin| (pin, "the debug port", true)))
            .chain(all(self.outputs, "a digital output", true))
            .chain(all(self.pull_ups, "pull-up resistors", true))
            .chain(all(self.inputs, "a digital input", false))
            .chain(self.enable.map(|pin| (pin, "the ENABLE input", false)))
            .chain(of_axes(self.homes, "a home switch"))
            .chain(of_axes(self.stalls, "SG_TST of a driver"))
    }

    /// The digital inputs with their numbers.
    pub(super) fn numbered_inputs(&self) -> impl Iterator<Item = (usize, Pin)> {
        self.inputs.iter().copied().enumerate().chain(self.kind.enable_input.zip(self.enable))
    }

    /// The ports that the board drives pins of, one bit each.
    pub(super) fn driven_ports(&self) -> u32 {
        let switches = self.homes.iter().chain(self.stalls).map(|(pin, _)| *pin);
        let inputs = self.numbered_inputs().map(|(_, pin)| pin);
        inputs.chain(switches).fold(0, |ports, (port, _)| ports | 1 << port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::kind::Input;
    use crate::world::pin::Pin as Switch;
    use std::collections::HashSet;

    /// Each part of the board has its pin, and no pin has two parts but where an encoder is at inputs.
    #[test]
    fn the_pins_are_those_of_the_parts_of_the_board() {
        for pinout in Pinout::ALL {
            let Pinout { kind, selects, outputs, pull_ups, inputs, homes, stalls, analog, .. } = *pinout;
            let axes = kind.axes();
            let chips =
                |chips: &mut dyn Iterator<Item = Chip>| chips.map(|chip| format!("{chip:?}")).collect::<HashSet<_>>();
            let selected = chips(&mut selects.iter().map(|(_, chip)| *chip));
            let expected = chips(&mut kind.motion_bus().chain([Chip::At25]));
            assert_eq!((&selected, selects.len()), (&expected, expected.len()), "{}", kind.name);
            assert_eq!((outputs.len(), pull_ups.len()), (kind.outputs as usize, kind.pull_ups as usize));
            assert_eq!((inputs.len(), analog.len()), (kind.inputs.len(), kind.analog().count()));
            assert_eq!(pinout.enable.is_some(), kind.enable_input.is_some());
            let at_inputs = |axis: usize| kind.inputs.contains(&Input::Switch(axis, Switch::Home));
            let expected: Vec<usize> = (0..axes).filter(|axis| !at_inputs(*axis)).collect();
            assert_eq!(homes.iter().map(|(_, axis)| *axis).collect::<Vec<_>>(), expected);
            // Only the TMC262 has the pin.
            let drivers = kind.motion_bus().filter(|chip| matches!(chip, Chip::Tmc262(_))).count();
            assert!(stalls.iter().map(|(_, axis)| *axis).eq(0..drivers));

            let of_axes = homes.iter().chain(stalls).map(|(pin, _)| *pin);
            let single = [pinout.motion_clock, pinout.disable];
            let groups = [pinout.motion_bus, pinout.eeprom_bus, pinout.rs485].concat();
            let pairs = [pinout.can, pinout.leds, pinout.pads].concat();
            let listed = [outputs, pull_ups, inputs, pinout.enable.as_slice(), &single, &groups, &pairs].concat();
            let pins: Vec<Pin> = selects.iter().map(|(pin, _)| *pin).chain(of_axes).chain(listed).collect();
            assert_eq!(pins.iter().collect::<HashSet<_>>().len(), pins.len(), "{}: {pins:?}", kind.name);
        }
    }
}
