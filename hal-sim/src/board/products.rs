//! The boards of the products: what they consist of, and at which pins of the microcontroller that is.

use super::kind::{AbnPins, BoardKind, Input, MotionChips};
use crate::chip::at25::{AT25128, AT25256, AT25512};
use crate::world::pin::Pin;

/// The TMCM-1140: one axis on one TMC429. IN0 is the analog input, IN1 to IN3 are the switches.
pub static TMCM_1140: BoardKind = BoardKind {
    name: "TMCM-1140",
    motion: MotionChips::Tmc429Tmc262,
    controllers: &[1],
    inputs: &[Input::Analog, Input::Switch(0, Pin::Left), Input::Switch(0, Pin::Right), Input::Switch(0, Pin::Home)],
    enable_input: None,
    outputs: 2,
    pull_ups: 1,
    full_current: 2_000,
    magnetic_encoders: true,
    abn: AbnPins::Switches,
    eeprom: AT25128,
};

/// The TMCM-1110: one axis on one TMC429, with pins for an ABN encoder. IN0 is the analog input; the stop switches and
/// the home switch have pins of their own. Its full current is that without jumpers; its EEPROM is not published.
pub static TMCM_1110: BoardKind = BoardKind {
    name: "TMCM-1110",
    inputs: &[Input::Analog, Input::Free, Input::Free, Input::Free],
    outputs: 5,
    pull_ups: 0,
    full_current: 1_000,
    magnetic_encoders: false,
    abn: AbnPins::Own,
    ..TMCM_1140
};

/// The TMCM-6110: six axes on two TMC429s, without encoders. Switches, also home switches, have pins of their own; IN0
/// and IN4 are the analog inputs. Its EEPROM is not published.
pub static TMCM_6110: BoardKind = BoardKind {
    name: "TMCM-6110",
    motion: MotionChips::Tmc429Tmc262,
    controllers: &[3, 3],
    inputs: &[
        Input::Analog,
        Input::Free,
        Input::Free,
        Input::Free,
        Input::Analog,
        Input::Free,
        Input::Free,
        Input::Free,
    ],
    enable_input: None,
    outputs: 8,
    pull_ups: 2,
    full_current: 1_100,
    magnetic_encoders: false,
    abn: AbnPins::None,
    eeprom: AT25256,
};

/// The TMCM-3110: three axes on one TMC429, each with pins for an ABN encoder. Its full current is the one that
/// TMCM-Lib, which was written for it, reckons with.
pub static TMCM_3110: BoardKind = BoardKind {
    name: "TMCM-3110",
    controllers: &[3],
    pull_ups: 1,
    full_current: 2_800,
    abn: AbnPins::Own,
    ..TMCM_6110
};

/// The TMCM-3212: three axes, each on a TMC5160 with an ABN encoder. All of its inputs are analog, too; switches, also
/// home switches, have pins of their own.
pub static TMCM_3212: BoardKind = BoardKind {
    name: "TMCM-3212",
    motion: MotionChips::Tmc5160,
    controllers: &[1, 1, 1],
    inputs: &[Input::Analog; 4],
    enable_input: Some(10),
    outputs: 4,
    pull_ups: 0,
    full_current: 3_000,
    magnetic_encoders: false,
    abn: AbnPins::Own,
    eeprom: AT25512,
};

/// At which pins the parts are.
#[cfg(feature = "mcu")]
mod pins {
    use super::{TMCM_1140, TMCM_3212, TMCM_6110};
    use crate::board::kind::Chip;
    use crate::mcu::pinout::Pinout;

    const A: usize = 0;
    const B: usize = 1;
    const C: usize = 2;
    const D: usize = 3;
    const E: usize = 4;

    impl Pinout {
        /// All boards whose pins are known.
        pub const ALL: [&Self; 3] = [&Self::TMCM_1140, &Self::TMCM_6110, &Self::TMCM_3212];

        /// The pins that the boards share: those of ports, LEDs and pads. A board with another one has it in its own
        /// entry.
        const SHARED: Self = Self {
            kind: &TMCM_1140,
            selects: &[],
            motion_bus: [(A, 5), (A, 6), (A, 7)],
            eeprom_bus: [(C, 10), (C, 11), (C, 12)],
            motion_clock: (A, 8),
            rs485: [(B, 10), (B, 11), (E, 15)],
            can: [(D, 0), (D, 1)],
            leds: [(C, 5), (C, 4)],
            outputs: &[],
            pull_ups: &[],
            inputs: &[],
            enable: None,
            homes: &[],
            stalls: &[],
            disable: (E, 1),
            encoder: None,
            // SWDIO and SWCLK.
            pads: [(A, 13), (A, 14)],
            analog: &[],
            supply: 11,
            supply_full_scale: 363,
        };

        /// The TMCM-1140, with the pins of its closest sibling; which of the sibling's inputs and outputs are the
        /// digital ones is a choice of the firmware's. Nothing is known of its analog channels: PC0 and PC1, and a
        /// divider by eleven.
        pub const TMCM_1140: Self = Self {
            selects: &[((A, 4), Chip::Tmc429(0)), ((C, 3), Chip::Tmc262(0)), ((A, 15), Chip::At25)],
            outputs: &[(D, 10), (D, 11)],
            pull_ups: &[(D, 14)],
            inputs: &[(D, 8), (D, 12), (D, 13), (D, 9)],
            stalls: &[((E, 0), 0)],
            encoder: Some([(D, 12), (D, 13)]),
            analog: &[10],
            ..Self::SHARED
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
            analog: &[10, 12],
            ..Self::SHARED
        };

        /// A board for the TMCM-3212, whose pins are a choice of the firmware's as well. The home switches are not at
        /// the chips.
        pub const TMCM_3212: Self = Self {
            kind: &TMCM_3212,
            selects: &[
                ((E, 8), Chip::Tmc5160(0)),
                ((E, 9), Chip::Tmc5160(1)),
                ((E, 10), Chip::Tmc5160(2)),
                ((A, 15), Chip::At25),
            ],
            outputs: &[(B, 12), (B, 13), (B, 14), (B, 15)],
            inputs: &[(D, 8), (D, 9), (D, 10), (D, 11)],
            enable: Some((D, 12)),
            homes: &[((D, 2), 0), ((D, 3), 1), ((D, 4), 2)],
            analog: &[0, 1, 2, 3],
            supply_full_scale: 627,
            ..Self::SHARED
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_counted_through_the_controllers() {
        let kind = BoardKind { controllers: &[3, 2], ..TMCM_1140 };
        let motors: Vec<_> = (0..6).map(|axis| kind.motor(axis)).collect();
        let expected = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1)].map(Some);
        assert_eq!((&motors[..5], motors[5]), (expected.as_slice(), None));
        assert_eq!(kind.axes(), 5);
        assert_eq!(kind.check_axis(5), Err("no axis 5: the TMCM-1140 has axes 0 to 4".into()));
        assert_eq!(TMCM_1140.check_axis(1), Err("no axis 1: the TMCM-1140 has one, axis 0".into()));
    }

    #[test]
    fn analog_channels_have_the_numbers_of_their_inputs() {
        let kind = BoardKind { inputs: &[Input::Analog, Input::Free, Input::Analog], ..TMCM_1140 };
        assert_eq!(kind.analog().collect::<Vec<_>>(), [0, 2]);
    }
}
