//! What the microcontroller's pins are connected to on a board, as data: a further board is one more value of [`Pinout`].
//! The peripherals behind the pins are the same on all of them: SPI1 has the motion chips, SPI3 the EEPROM, USART3 the RS485
//! transceiver, CAN1 the CAN transceiver, TIM4 the encoder, MCO1 the clock of the motion controllers.

use crate::board::{BoardKind, Chip, TMCM_1140, TMCM_3212, TMCM_6110};

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
    /// The TMCM-1140, with the pins of its closest sibling; which of the sibling's inputs and outputs are the digital ones is
    /// a choice of the firmware's. Nothing is known of its analog channels: PC0 and PC1, and a divider by eleven.
    pub const TMCM_1140: Self = Self {
        kind: &TMCM_1140,
        selects: &[((A, 4), Chip::Tmc429(0)), ((C, 3), Chip::Tmc262(0)), ((A, 15), Chip::At25)],
        motion_bus: [(A, 5), (A, 6), (A, 7)],
        eeprom_bus: [(C, 10), (C, 11), (C, 12)],
        motion_clock: (A, 8),
        rs485: [(B, 10), (B, 11), (E, 15)],
        can: [(D, 0), (D, 1)],
        leds: [(C, 5), (C, 4)],
        outputs: &[(D, 10), (D, 11)],
        pull_ups: &[(D, 14)],
        inputs: &[(D, 8), (D, 12), (D, 13), (D, 9)],
        enable: None,
        homes: &[],
        stalls: &[((E, 0), 0)],
        disable: (E, 1),
        encoder: Some([(D, 12), (D, 13)]),
        // SWDIO and SWCLK.
        pads: [(A, 13), (A, 14)],
        analog: &[10],
        supply: 11,
        supply_full_scale: 363,
    };

    /// A board for the TMCM-6110. All pins are a choice of the firmware's: nothing is known of the module's own.
    pub const TMCM_6110: Self = Self {
        kind: &TMCM_6110,
        selects: &[
            ((A, 4), Chip::Tmc429(0)),
            ((A, 3), Chip::Tmc429(1)),
            ((E, 8), Chip::Tmc262(0)),
            ((E, 9), Chip::Tmc262(1)),
            ((E, 10), Chip::Tmc262(2)),
            ((E, 11), Chip::Tmc262(3)),
            ((E, 12), Chip::Tmc262(4)),
            ((E, 13), Chip::Tmc262(5)),
            ((A, 15), Chip::At25),
        ],
        outputs: &[(B, 12), (B, 13), (B, 14), (B, 15), (C, 6), (C, 7), (C, 8), (C, 9)],
        pull_ups: &[(B, 8), (B, 9)],
        inputs: &[(D, 8), (D, 9), (D, 10), (D, 11), (D, 12), (D, 13), (D, 14), (D, 15)],
        homes: &[((D, 2), 0), ((D, 3), 1), ((D, 4), 2), ((D, 5), 3), ((D, 6), 4), ((D, 7), 5)],
        stalls: &[((E, 2), 0), ((E, 3), 1), ((E, 4), 2), ((E, 5), 3), ((E, 6), 4), ((E, 7), 5)],
        encoder: None,
        analog: &[10, 12],
        ..Self::TMCM_1140
    };

    /// A board for the TMCM-3212, whose pins are a choice of the firmware's as well. The home switches are not at the chips.
    pub const TMCM_3212: Self = Self {
        kind: &TMCM_3212,
        selects: &[
            ((E, 8), Chip::Tmc5160(0)),
            ((E, 9), Chip::Tmc5160(1)),
            ((E, 10), Chip::Tmc5160(2)),
            ((A, 15), Chip::At25),
        ],
        outputs: &[(B, 12), (B, 13), (B, 14), (B, 15)],
        pull_ups: &[],
        inputs: &[(D, 8), (D, 9), (D, 10), (D, 11)],
        enable: Some((D, 12)),
        homes: &[((D, 2), 0), ((D, 3), 1), ((D, 4), 2)],
        stalls: &[],
        encoder: None,
        analog: &[0, 1, 2, 3],
        supply_full_scale: 627,
        ..Self::TMCM_1140
    };

    /// The pins of a board; `None` if they are not known.
    pub(super) fn of(kind: &BoardKind) -> Option<&'static Self> {
        [&Self::TMCM_1140, &Self::TMCM_6110, &Self::TMCM_3212].into_iter().find(|pinout| pinout.kind == kind)
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

const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
const D: usize = 3;
const E: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Input;
    use crate::world::pin::Pin as Switch;
    use std::collections::HashSet;

    /// Each part of the board has its pin, and no pin has two parts but where an encoder is at inputs.
    #[test]
    fn the_pins_are_those_of_the_parts_of_the_board() {
        for pinout in [Pinout::TMCM_1140, Pinout::TMCM_6110, Pinout::TMCM_3212] {
            let Pinout { kind, selects, outputs, pull_ups, inputs, homes, stalls, analog, .. } = pinout;
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
