//! The use of the pins by the image of the TMCM-1140, held against the start of the published firmware of its closest
//! sibling, whose board may be wired alike. No pin that is an input there may be driven here, for then two outputs work
//! against each other.

use common::image_host::{Host, START, image};
use hal_sim::board::{Board, Chip};
use hal_sim::clock::MICROSECOND;
use hal_sim::mcu::{Machine, Pin, Pinout};
use hal_sim::world::config::WorldConfig;
use std::collections::BTreeMap;

const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
const D: usize = 3;
const E: usize = 4;

/// Pins that the sibling's firmware makes outputs, and the level of each when it does: low, high.
const OUTPUTS: [&[Pin]; 2] = [
    &[(B, 7), (E, 13), (E, 14), (E, 15)],
    &[(A, 4), (A, 15), (B, 14), (B, 15), (C, 3), (D, 10), (D, 11), (D, 14), (D, 15), (E, 1)],
];

/// Pins that it makes inputs.
const INPUTS: [Pin; 21] = [
    (A, 0),
    (A, 1),
    (A, 2),
    (B, 5),
    (B, 6),
    (B, 12),
    (B, 13),
    (C, 13),
    (C, 14),
    (D, 8),
    (D, 9),
    (D, 12),
    (D, 13),
    (E, 0),
    (E, 3),
    (E, 4),
    (E, 5),
    (E, 6),
    (E, 9),
    (E, 10),
    (E, 11),
];

/// Outputs of both firmwares that may start with any level: the LEDs, and SWDIO, which is driven while the firmware
/// looks whether the pads are connected.
const EITHER: [Pin; 3] = [(C, 4), (C, 5), (A, 13)];

/// The levels of the pins that the microcontroller drives now.
fn driven(host: &mut Host) -> BTreeMap<Pin, bool> {
    let wiring = host.machine.wiring();
    let pins = (A..=E).flat_map(|port| (0..16).map(move |number| (port, number)));
    pins.filter_map(|pin| Some((pin, wiring.driven(pin)?))).collect()
}

#[test]
fn an_output_is_one_of_the_siblings_and_starts_with_its_level() {
    let mut host = Host::just_on("");
    let mut first = BTreeMap::new();
    while host.machine.now() < START {
        host.run(2 * MICROSECOND);
        for (pin, level) in driven(&mut host) {
            first.entry(pin).or_insert(level);
        }
    }
    assert!(EITHER.iter().all(|pin| first.remove(pin).is_some()));
    for (pin, high) in first {
        assert!(!INPUTS.contains(&pin), "{pin:?} is an input of the sibling's");
        assert!(OUTPUTS[usize::from(high)].contains(&pin), "{pin:?} starts as an output that is high: {high}");
    }
}

/// OUT0 and OUT1 are off as long as nobody has switched them on: the level that the sibling starts with is that of an
/// output that is off. The pull-up resistors are on.
#[test]
fn the_outputs_keep_the_level_they_start_with_until_they_are_switched() {
    let [out0, out1, pull_ups] = [(D, 10), (D, 11), (D, 14)];
    let mut host = Host::new("");
    let levels = |host: &mut Host| {
        let driven = driven(host);
        [out0, out1, pull_ups].map(|pin| driven[&pin])
    };
    assert_eq!(levels(&mut host), [true; 3]);
    assert_eq!((host.ok("GIO 0, 2"), host.ok("GIO 1, 2")), (0, 0));
    host.ok("SIO 0, 2, 1");
    assert_eq!(levels(&mut host), [false, true, true]);
    host.ok("SIO 1, 2, 1");
    host.ok("SIO 0, 0, 0");
    assert_eq!(levels(&mut host), [false; 3]);
    host.ok("SIO 255, 2, 0");
    host.ok("SIO 0, 0, 1");
    assert_eq!(levels(&mut host), [true; 3]);
}

/// The emulated board has its inputs at inputs of the sibling's; A and B of the encoder are at those that a timer can
/// count. That the image reads them there is seen wherever a test turns the encoder or closes a switch.
#[test]
fn the_emulated_board_has_inputs_where_the_sibling_has() {
    let Pinout { inputs, encoder, outputs, pull_ups, .. } = Pinout::TMCM_1140;
    assert!(inputs.iter().all(|pin| INPUTS.contains(pin)), "{inputs:?}");
    assert_eq!((encoder, &inputs[1..3]), (Some([(D, 12), (D, 13)]), [(D, 12), (D, 13)].as_slice()));
    let [_, high] = OUTPUTS;
    assert!([outputs, pull_ups].concat().iter().all(|pin| high.contains(pin)), "{outputs:?}, {pull_ups:?}");
}

/// Runs this image on a board with these pins, and returns what ends the run.
fn stop(pinout: &'static Pinout) -> String {
    let board = Board::new(&WorldConfig::parse("").unwrap(), 0);
    let mut machine = Machine::wired(image(), board, pinout).unwrap();
    machine.run(START).map_or_else(|stop| stop.to_string(), |()| "goes on".into())
}

/// The pins of a board stand with the firmware and with the emulator: where they differ, the run ends with the pin.
#[test]
fn a_pin_that_the_board_has_otherwise_is_named() {
    static SELECT: Pinout = Pinout {
        selects: &[((B, 0), Chip::Tmc429(0)), ((C, 3), Chip::Tmc262(0)), ((A, 15), Chip::At25)],
        ..Pinout::TMCM_1140
    };
    static BUS: Pinout = Pinout { motion_bus: [(B, 3), (A, 6), (A, 7)], ..Pinout::TMCM_1140 };
    static INPUT: Pinout =
        Pinout { inputs: &[(D, 10), (D, 12), (D, 13), (D, 9)], outputs: &[(D, 8), (D, 11)], ..Pinout::TMCM_1140 };
    assert_eq!(stop(&Pinout::TMCM_1140), "goes on");
    static ENN: Pinout = Pinout { disable: (E, 7), ..Pinout::TMCM_1140 };
    static OUTPUT: Pinout = Pinout { outputs: &[(E, 8), (D, 11)], ..Pinout::TMCM_1140 };
    static LED: Pinout = Pinout { leds: [(C, 5), (E, 8)], ..Pinout::TMCM_1140 };
    static DIRECTION: Pinout = Pinout { rs485: [(B, 10), (B, 11), (B, 1)], ..Pinout::TMCM_1140 };
    static RS485: Pinout =
        Pinout { rs485: [(B, 10), (D, 9), (E, 15)], inputs: &[(D, 8), (D, 12), (D, 13), (D, 7)], ..Pinout::TMCM_1140 };
    static CAN: Pinout = Pinout { can: [(B, 8), (B, 9)], ..Pinout::TMCM_1140 };
    for (pinout, pin) in [(&SELECT, "PA4"), (&ENN, "PE1"), (&OUTPUT, "PD10"), (&LED, "PC4"), (&DIRECTION, "PE15")] {
        let told = format!("pin {pin}: the firmware drives it, the emulated TMCM-1140 has nothing there");
        assert_eq!(stop(pinout), told);
    }
    assert_eq!(stop(&RS485), "pin PD9: the firmware uses USART3 without it, the emulated TMCM-1140 has RS485 there");
    assert_eq!(stop(&CAN), "pin PB8: the firmware uses CAN1 without it, the emulated TMCM-1140 has CAN there");
    assert_eq!(
        stop(&BUS),
        "pin PB3: the firmware uses SPI1 without it, the emulated TMCM-1140 has the clock of SPI1 there"
    );
    assert_eq!(stop(&INPUT), "pin PD10: the firmware drives it, the emulated TMCM-1140 has a digital input there");
}
