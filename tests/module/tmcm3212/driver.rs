//! Parameters that act in the driver: what a chip has of them in its registers, whenever they are written.

use super::bench;
use common::Bench;
use hal_sim::board::Chip;
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};

/// Registers of the chip.
const GSTAT: u8 = 0x01;
const IOIN: u8 = 0x04;
const IHOLD_IRUN: u8 = 0x10;
const TPOWERDOWN: u8 = 0x11;
const TCOOLTHRS: u8 = 0x14;
/// The bit of an address byte that makes a datagram a write.
const WRITE: u8 = 1 << 7;

fn register(bench: &Bench, axis: usize, address: u8) -> u32 {
    bench.module.board().borrow().tmc5160(axis).register(address)
}

/// A datagram to a chip that is not the firmware's, of bytes of 10 us.
fn write(bench: &Bench, axis: usize, datagram: [u8; 5]) {
    let shared = bench.module.board();
    let mut board = shared.borrow_mut();
    let (chip, begun) = (Chip::Tmc5160(axis), board.now());
    board.select(chip);
    for (byte, count) in datagram.into_iter().zip(1..) {
        board.advance_to(begun + count * 10 * MICROSECOND);
        board.byte(chip, byte);
    }
    board.advance_to(begun + 60 * MICROSECOND);
    board.deselect(chip);
}

/// The chip has both currents for itself, so it is told each when it is written: IHOLD in bits 0..4, IRUN in 8..12.
#[test]
fn currents_are_told_to_the_chip_at_once() {
    let mut bench = bench();
    bench.run(5 * SECOND);
    for (line, currents) in [
        // Also a current that is the same as the one that the motor has at rest.
        ("SAP 7, 1, 200", 25 | 16 << 8),
        ("SAP 6, 1, 200", 25 | 25 << 8),
        ("SAP 7, 1, 0", 25 << 8),
        ("SAP 6, 1, 255", 31 << 8),
        ("SAP 6, 1, 7", 0),
    ] {
        bench.ok(line);
        assert_eq!(register(&bench, 1, IHOLD_IRUN) & 0x1F1F, currents, "{line}");
        bench.run(20 * MILLISECOND);
        assert_eq!(register(&bench, 1, IHOLD_IRUN) & 0x1F1F, currents, "{line}");
    }
    assert_eq!(register(&bench, 0, IHOLD_IRUN) & 0x1F1F, 1 | 16 << 8, "the other axes have theirs");
}

/// Units of 10 ms become the chip's of 2^18 clocks, 16.384 ms: 2 s are 122.07.
#[test]
fn the_delay_of_the_standby_current_is_told_to_the_chip() {
    let mut bench = bench();
    assert_eq!(register(&bench, 0, TPOWERDOWN), 122);
    for (delay, units) in [(0, 0), (1, 1), (100, 61), (417, 255)] {
        bench.ok(&format!("SAP 214, 0, {delay}"));
        assert_eq!(register(&bench, 0, TPOWERDOWN), units, "{delay}");
    }
}

/// The chip has one threshold for both stall and coolStep, as a time: at 10000 pps 16e6 / 10000 = 1600 clocks are 1/256
/// of a full step. It gets the lower speed of the two.
#[test]
fn thresholds_are_told_to_a_chip_whose_motor_turns() {
    let mut bench = bench();
    bench.ok("ROR 2, 51200");
    bench.run(2 * SECOND);
    // coolStep is on while 172 is not 0.
    for (line, clocks) in
        [("SAP 181, 2, 20000", 800), ("SAP 181, 2, 10000", 1600), ("SAP 182, 2, 5000", 1600), ("SAP 172, 2, 4", 3200)]
    {
        bench.ok(line);
        let register = register(&bench, 2, TCOOLTHRS);
        assert!(register.abs_diff(clocks) <= clocks / 8, "{line}: {register}");
    }
}

const GCONF: u8 = 0x00;
const GLOBAL_SCALER: u8 = 0x0B;
const X_TARGET: u8 = 0x2D;
const SW_MODE: u8 = 0x34;
const CHOPCONF: u8 = 0x6C;
const COOLCONF: u8 = 0x6D;
const DCCTRL: u8 = 0x6E;
const PWMCONF: u8 = 0x70;

/// Every parameter of the driver, what it is set to, and the bits that must then stand in which register (TMC5160
/// datasheet, chapter 6): register, lowest bit, width, field.
#[test]
fn every_driver_parameter_reaches_its_field() {
    let table: &[(&[&str], u8, u32, u32, u32)] = &[
        (&["SAP 251, 1, 1"], GCONF, 4, 1, 1),
        (&["SAP 31, 1, 5"], IHOLD_IRUN, 16, 4, 5),
        (&["SAP 14, 1, 1"], SW_MODE, 4, 1, 1),
        (&["SAP 24, 1, 1"], SW_MODE, 3, 1, 1),
        (&["SAP 25, 1, 1"], SW_MODE, 2, 1, 1),
        (&["SAP 12, 1, 1"], SW_MODE, 0, 2, 0b01),
        (&["SAP 13, 1, 1"], SW_MODE, 0, 2, 0b10),
        (&["SAP 26, 1, 1"], SW_MODE, 11, 1, 1),
        (&["SAP 140, 1, 4"], CHOPCONF, 24, 4, 4),
        (&["SAP 140, 1, 0"], CHOPCONF, 24, 4, 8),
        (&["SAP 167, 1, 11"], CHOPCONF, 0, 4, 11),
        (&["SAP 166, 1, 6"], CHOPCONF, 4, 3, 6),
        (&["SAP 166, 1, 8"], CHOPCONF, 4, 3, 7),
        (&["SAP 165, 1, 9"], CHOPCONF, 7, 4, 9),
        (&["SAP 162, 1, 3"], CHOPCONF, 15, 2, 3),
        (&["SAP 164, 1, 1"], CHOPCONF, 12, 1, 1),
        (&["SAP 28, 1, 1"], CHOPCONF, 18, 1, 1),
        (&["SAP 27, 1, 1"], CHOPCONF, 19, 1, 1),
        (&["SAP 177, 1, 1"], CHOPCONF, 30, 2, 3),
        (&["SAP 162, 1, 1"], CHOPCONF, 20, 4, 4),
        // With constant off time bits 4 to 6 and 11 are the time of fast decay, and 7 to 10 the offset of the sine
        // wave.
        (&["SAP 163, 1, 1"], CHOPCONF, 14, 1, 1),
        (&["SAP 165, 1, 13", "SAP 163, 1, 1"], CHOPCONF, 4, 3, 5),
        (&["SAP 165, 1, 13", "SAP 163, 1, 1"], CHOPCONF, 11, 1, 1),
        (&["SAP 165, 1, 5", "SAP 163, 1, 1"], CHOPCONF, 11, 1, 0),
        (&["SAP 166, 1, 8", "SAP 163, 1, 1"], CHOPCONF, 7, 4, 8),
        (&["SAP 166, 1, 1", "SAP 163, 1, 1"], CHOPCONF, 7, 4, 1),
        (&["SAP 172, 1, 7"], COOLCONF, 0, 4, 7),
        (&["SAP 171, 1, 3"], COOLCONF, 5, 2, 3),
        (&["SAP 170, 1, 13"], COOLCONF, 8, 4, 13),
        (&["SAP 169, 1, 2"], COOLCONF, 13, 2, 2),
        (&["SAP 168, 1, 1"], COOLCONF, 15, 1, 1),
        (&["SAP 174, 1, -3"], COOLCONF, 16, 7, 0x7D),
        (&["SAP 174, 1, -4"], COOLCONF, 16, 7, 0x7C),
        (&["SAP 174, 1, 63"], COOLCONF, 16, 7, 0x3F),
        (&["SAP 173, 1, 0"], COOLCONF, 24, 1, 0),
        (&["SAP 173, 1, 1"], COOLCONF, 24, 1, 1),
        (&["SAP 32, 1, 700"], DCCTRL, 0, 10, 700),
        (&["SAP 33, 1, 200"], DCCTRL, 16, 8, 200),
        (&["SAP 188, 1, 77"], PWMCONF, 0, 8, 77),
        (&["SAP 187, 1, 9"], PWMCONF, 8, 8, 9),
        (&["SAP 191, 1, 3"], PWMCONF, 16, 2, 3),
        (&["SAP 192, 1, 0"], PWMCONF, 18, 2, 0),
        (&["SAP 192, 1, 1"], PWMCONF, 18, 2, 3),
        (&["SAP 204, 1, 2"], PWMCONF, 20, 2, 2),
    ];
    for &(lines, address, lowest, width, field) in table {
        let mut bench = bench();
        bench.configure(lines);
        bench.run(20 * MILLISECOND);
        let word = register(&bench, 1, address);
        assert_eq!(word >> lowest & ((1 << width) - 1), field, "{lines:?}: register {address:02X}h is {word:08X}h");
        assert_eq!(
            register(&bench, 0, address),
            register(&super::bench(), 0, address),
            "{lines:?} are for axis 1 alone"
        );
    }
}

/// The currents of the parameters are shares of the full one: GLOBAL_SCALER is 0, which is the whole (datasheet section
/// 6.1), also in a chip that has had another one before a warm start.
#[test]
fn currents_are_shares_of_the_full_one() {
    let mut bench = bench();
    assert_eq!([0, 1, 2].map(|axis| register(&bench, axis, GLOBAL_SCALER)), [0; 3]);
    write(&bench, 1, [WRITE | GLOBAL_SCALER, 0, 0, 0, 100]);
    assert_eq!(register(&bench, 1, GLOBAL_SCALER), 100);
    bench.ok("255, 0, 0, 1234");
    bench.run(SECOND);
    assert_eq!([0, 1, 2].map(|axis| register(&bench, axis, GLOBAL_SCALER)), [0; 3]);
}

/// A chip is asked for its version before it is told anything, and again once its reset is noted. What is set up after
/// that is set up in a chip that answers, and whose reset_flag is not the old one any more.
#[test]
fn a_chip_is_confirmed_before_and_after_its_reset_is_noted() {
    let mut bench = bench();
    bench.module.board().borrow_mut().take_datagrams();
    bench.ok("255, 0, 0, 1234");
    bench.run(SECOND);
    let datagrams = bench.module.board().borrow_mut().take_datagrams();
    for axis in 0..3 {
        let of_chip =
            datagrams.iter().filter(|datagram| datagram.chip == Chip::Tmc5160(axis)).map(|datagram| &*datagram.bytes);
        let all: Vec<&[u8]> = of_chip.collect();
        // The polls before the restart ask for positions.
        let begun = all.windows(3).position(|three| three[2][0] == WRITE | GSTAT).unwrap();
        let expected: [[u8; 5]; 6] = [
            [IOIN, 0, 0, 0, 0],
            [IOIN, 0, 0, 0, 0],
            // reset and drv_err are cleared by ones.
            [WRITE | GSTAT, 0, 0, 0, 0b11],
            [WRITE | GLOBAL_SCALER, 0, 0, 0, 0],
            [IOIN, 0, 0, 0, 0],
            [IOIN, 0, 0, 0, 0],
        ];
        assert_eq!(all[begun..begun + 6], expected, "axis {axis}");
    }
}

/// SAP 1 gives the motor another position where it stands: its target is the same, so that nothing moves.
#[test]
fn a_position_that_is_set_is_the_target_as_well() {
    let mut bench = bench();
    bench.ok("MVP ABS, 2, 5000");
    bench.run(3 * SECOND);
    let rotor = |bench: &Bench| bench.module.board().borrow().world().axis(2).motor().rotor();
    let stands = rotor(&bench);
    bench.ok("SAP 1, 2, -777");
    bench.run(SECOND);
    assert_eq!([0, 1].map(|number| bench.ok(&format!("GAP {number}, 2"))), [-777; 2]);
    assert_eq!((register(&bench, 2, X_TARGET) as i32, rotor(&bench), bench.ok("GAP 8, 2")), (-777, stands, 1));
    // Also one that has been turning, and has no target.
    bench.ok("ROR 2, 5000");
    bench.run(SECOND);
    bench.ok("MST 2");
    bench.run(3 * SECOND);
    assert_eq!(bench.ok("GAP 8, 2"), 0);
    bench.ok("SAP 1, 2, 42");
    bench.run(SECOND);
    assert_eq!((bench.ok("GAP 1, 2"), bench.ok("GAP 8, 2")), (42, 1));
}

/// A poll is two datagrams: one asks for the position, the other for something else in rotation, each second time for
/// the speed. In 32 turns the driver's state is asked for eight times, the ramp's four times, the encoder's three
/// times, and the version once. This holds whether the motor stands at zero or elsewhere, or turns, also where a stall
/// is to stop it.
#[test]
fn a_poll_is_two_datagrams_in_a_rotation_of_readings() {
    const ROTATION: [(u8, usize); 6] = [(0x21, 32), (0x22, 16), (0x6F, 8), (0x35, 4), (0x3B, 3), (IOIN, 1)];
    let moves = ["MVP ABS, 0, 0", "MVP ABS, 0, 1000", "MVP ABS, 0, -1", "ROR 0, 30000"];
    for (line, stall) in moves.into_iter().flat_map(|line| [(line, 0), (line, 10_000)]) {
        let mut bench = bench();
        bench.ok(&format!("SAP 181, 0, {stall}"));
        bench.ok(line);
        bench.run(5 * SECOND);
        bench.module.skip(false);
        bench.module.board().borrow_mut().take_datagrams();
        bench.run(10 * 32 * MILLISECOND);
        let datagrams = bench.module.board().borrow_mut().take_datagrams();
        let addresses: Vec<u8> =
            datagrams.iter().filter(|it| it.chip == Chip::Tmc5160(0)).map(|it| it.bytes[0]).collect();
        let counts = ROTATION.map(|(address, _)| (address, addresses.iter().filter(|it| **it == address).count() / 10));
        assert_eq!((counts, addresses.len()), (ROTATION, 640), "{line}, parameter 181 at {stall}");
    }
}
