//! Examples that the manual prints (firmware V1.05): its telegrams, its two programs, and its refusals. Its misprints
//! are noted.

use super::bench;
use common::{Bench, INVALID_VALUE, OK, WRONG_CHECKSUM};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::can::{CanFrame, Frame, Id, StandardId};
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Telegram};
use tmcm::tmcl::text;
use tmcm_sim::VirtualModule;

/// The requests of sections 3.6.1 to 3.6.4, and how they are written.
#[rustfmt::skip]
const REQUESTS: [(Telegram, &str); 5] = [
    ([0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0xC8, 0x00, 0xCA], "ROR 0, 51200"),
    ([0x01, 0x02, 0x00, 0x00, 0x00, 0x00, 0xC8, 0x00, 0xCB], "ROL 0, 51200"),
    ([0x01, 0x03, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x04], "MST 0"),
    // The manual prints 10h for byte 2 of the value; 90000 is 15F90h, and the printed checksum is that of 01h.
    ([0x01, 0x04, 0x00, 0x00, 0x00, 0x01, 0x5F, 0x90, 0xF5], "MVP ABS, 0, 90000"),
    ([0x01, 0x04, 0x01, 0x00, 0xFF, 0xFF, 0xD8, 0xF0, 0xCC], "MVP REL, 0, -10000"),
];

/// MVP ABS, 0, 90000 as it is printed, with its wrong byte.
const MISPRINTED: Telegram = [0x01, 0x04, 0x00, 0x00, 0x00, 0x10, 0x5F, 0x90, 0xF5];

/// Sends the bytes of a telegram, and gives status and value of the reply.
fn exchange(bench: &mut Bench, source: Source, telegram: Telegram) -> (u8, i32) {
    let sent = bench.exchange(source, telegram).unwrap().telegram().unwrap();
    let reply = binary::decode_reply(&sent).unwrap();
    (reply.status, reply.value)
}

#[test]
fn the_telegrams_are_carried_out() {
    for source in [Source::Usb, Source::Rs485] {
        let mut bench = bench();
        for (telegram, line) in REQUESTS {
            assert_eq!(binary::encode_command(1, text::parse(line).unwrap()), telegram, "{line}");
        }
        let [ror, rol, mst, absolute, relative] = REQUESTS.map(|(telegram, _)| telegram);
        assert_eq!(exchange(&mut bench, source, ror), (OK, 51_200));
        bench.run(2 * SECOND);
        assert_eq!((bench.ok("GAP 2, 0"), bench.ok("GAP 3, 0")), (51_200, 51_200));
        assert_eq!(exchange(&mut bench, source, rol), (OK, 51_200));
        bench.run(3 * SECOND);
        assert_eq!((bench.ok("GAP 2, 0"), bench.ok("GAP 3, 0")), (-51_200, -51_200));
        // Section 3.6.3 says that MST sets axis parameter 0 to zero. It is the target speed, 2; 0 is the target
        // position.
        assert_eq!(exchange(&mut bench, source, mst), (OK, 0));
        bench.run(2 * SECOND);
        assert_eq!((bench.ok("GAP 2, 0"), bench.ok("GAP 3, 0")), (0, 0));
        assert_eq!(exchange(&mut bench, source, absolute), (OK, 90_000));
        bench.run_until(10 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
        assert_eq!((bench.ok("GAP 1, 0"), bench.rotor()), (90_000, 90_000));
        assert_eq!(exchange(&mut bench, source, relative), (OK, 80_000));
        bench.run_until(10 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
        assert_eq!((bench.ok("GAP 1, 0"), bench.rotor()), (80_000, 80_000));
    }
}

/// The misprint is noticed by its checksum.
#[test]
fn the_telegram_with_the_misprint_is_refused() {
    let mut bench = bench();
    assert_eq!(exchange(&mut bench, Source::Usb, MISPRINTED).0, WRONG_CHECKSUM);
    bench.run(SECOND);
    assert_eq!((bench.ok("GAP 0, 0"), bench.ok("GAP 1, 0")), (0, 0));
}

/// On CAN the same commands come without address and checksum.
#[test]
fn the_commands_come_over_can_too() {
    let mut bench = bench();
    for (telegram, line) in REQUESTS {
        bench.module.receive_frame(Frame::new(Id::Standard(StandardId::new(1).unwrap()), &telegram[1..8]).unwrap());
        bench.run(20 * MILLISECOND);
        let reply = bench.module.frame().unwrap();
        assert_eq!(reply.data()[..3], [1, OK, telegram[1]], "{line}");
    }
}

/// "Moving to an absolute position in the range from -2147483648...2147483647", at the shorter way: from 2^31 - 1 it is
/// one microstep to -2^31.
#[test]
fn positions_have_32_bits() {
    let mut bench = bench();
    bench.ok("SAP 1, 0, 2147483647");
    assert_eq!(bench.ok("MVP ABS, 0, -2147483648"), i32::MIN);
    bench.run_until(SECOND, |bench| bench.ok("GAP 8, 0") == 1);
    assert_eq!((bench.ok("GAP 1, 0"), bench.rotor()), (i32::MIN, 1));
    assert_eq!(bench.ok("MVP REL, 0, -3"), i32::MAX - 2);
    bench.run_until(SECOND, |bench| bench.ok("GAP 8, 0") == 1);
    assert_eq!((bench.ok("GAP 1, 0"), bench.rotor()), (i32::MAX - 2, -2));
}

/// The value of ROR and ROL is printed with 32 bits (as -2147483648...2147583647, a misprint); the motor gets the range
/// of parameter 2. Parameters 2 and 4 have their ranges themselves.
#[test]
fn ror_and_rol_are_limited_where_parameters_are_refused() {
    let mut bench = bench();
    for (line, echo, speed) in [
        ("ROR 0, 7999774", 7_999_774, 7_999_774),
        ("ROR 0, 7999775", 7_999_775, 7_999_774),
        ("ROR 1, 2147483647", i32::MAX, 7_999_774),
        ("ROL 1, 2147483647", i32::MAX, -7_999_774),
        ("ROL 2, -2147483648", i32::MIN, 7_999_774),
        ("ROR 2, -2147483648", i32::MIN, -7_999_774),
        ("ROL 2, 7999775", 7_999_775, -7_999_774),
        ("ROL 2, -5", -5, 5),
    ] {
        let motor = text::parse(line).unwrap().motor;
        assert_eq!((bench.ok(line), bench.ok(&format!("GAP 2, {motor}"))), (echo, speed), "{line}");
        bench.ok(&format!("MST {motor}"));
    }
    for value in [7_999_775, -7_999_775, i32::MAX, i32::MIN] {
        bench.refused(&format!("SAP 2, 0, {value}"), INVALID_VALUE);
        bench.refused(&format!("SAP 4, 0, {value}"), INVALID_VALUE);
    }
    assert_eq!((bench.ok("GAP 2, 0"), bench.ok("GAP 4, 0")), (0, 51_200));
}

/// The program of section 2.4. Its comments speak of speeds 10000 and 50000 where the commands have 51200; and its
/// accelerations and speeds are the defaults.
#[test]
fn the_first_program() {
    let mut bench = bench();
    bench.download(
        0,
        &[
            "ROL 0, 51200",
            "WAIT TICKS, 0, 500",
            "MST 0",
            "ROR 0, 51200",
            "WAIT TICKS, 0, 500",
            "MST 0",
            "SAP 4, 0, 51200",
            "SAP 5, 0, 51200",
            "MVP ABS, 0, 512000",
            "WAIT POS, 0, 0",
            "MVP ABS, 0, -512000",
            "WAIT POS, 0, 0",
            "JA 8",
        ],
    );
    bench.start(0);
    bench.run(3 * SECOND);
    assert_eq!(bench.ok("GAP 3, 0"), -51_200);
    bench.run(4 * SECOND);
    // A second to stop, from there a second to turn the other way.
    assert_eq!(bench.ok("GAP 3, 0"), 51_200);
    for target in [512_000, -512_000, 512_000] {
        bench.run_until(40 * SECOND, |bench| bench.rotor() == target);
    }
    assert_eq!((bench.program_counter(), bench.ok("GAP 0, 0")), (11, -512_000));
}

/// The program of section 3.5.6.4: output 3 changes in each half second, and output 0 with each interrupt of timer 0.
#[test]
fn the_program_with_an_interrupt() {
    let mut bench = bench();
    bench.download(
        0,
        &[
            "VECT 0, 9",
            "SGP 0, 3, 1000",
            "EI 0",
            "EI 255",
            "SIO 3, 2, 1",
            "WAIT TICKS, 0, 50",
            "SIO 3, 2, 0",
            "WAIT TICKS, 0, 50",
            "JA 4",
            "GIO 0, 2",
            "JC NZ, 13",
            "SIO 0, 2, 1",
            "RETI",
            "SIO 0, 2, 0",
            "RETI",
        ],
    );
    bench.start(0);
    for half in 0..8 {
        bench.run(250 * MILLISECOND);
        let outputs = [bench.ok("GIO 3, 2"), bench.ok("GIO 0, 2")];
        assert_eq!(outputs, [i32::from(half % 2 == 0), i32::from(half / 2 % 2 == 1)], "half second {half}");
        bench.run(250 * MILLISECOND);
    }
}
