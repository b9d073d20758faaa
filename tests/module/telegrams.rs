//! The wire formats: every example telegram of the manual (with its errata put right), on byte links and on
//! CAN, in both directions.

use common::{Bench, OK};
use tmcm::can::StandardId;
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::{Command, Instruction, Opcode, Reply, Status, can, text};

/// A request on the wire, and on paper.
#[rustfmt::skip]
const REQUESTS: &[(Telegram, &str)] = &[
    ([0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0x03, 0xE8, 0xED], "ROR 0, 1000"),
    ([0x01, 0x02, 0x00, 0x00, 0x00, 0x00, 0x03, 0xE8, 0xEE], "ROL 0, 1000"),
    ([0x01, 0x03, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x04], "MST 0"),
    ([0x01, 0x04, 0x00, 0x00, 0x00, 0x01, 0x5F, 0x90, 0xF5], "MVP ABS, 0, 90000"),
    ([0x01, 0x04, 0x01, 0x00, 0xFF, 0xFF, 0xD8, 0xF0, 0xCC], "MVP REL, 0, -10000"),
    ([0x01, 0x04, 0x02, 0x00, 0x00, 0x00, 0x00, 0x08, 0x0F], "MVP COORD, 0, 8"),
    ([0x01, 0x05, 0x04, 0x00, 0x00, 0x00, 0x03, 0xE8, 0xF5], "SAP 4, 0, 1000"),
    ([0x01, 0x06, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x08], "GAP 1, 0"),
    ([0x01, 0x07, 0x06, 0x00, 0x00, 0x00, 0x00, 0x00, 0x0E], "STAP 6, 0"),
    ([0x01, 0x08, 0x06, 0x00, 0x00, 0x00, 0x00, 0x00, 0x0F], "RSAP 6, 0"),
    ([0x01, 0x09, 0x42, 0x00, 0x00, 0x00, 0x00, 0x03, 0x4F], "SGP 66, 0, 3"),
    ([0x01, 0x0A, 0x42, 0x00, 0x00, 0x00, 0x00, 0x00, 0x4D], "GGP 66, 0"),
    ([0x01, 0x0B, 0x2A, 0x02, 0x00, 0x00, 0x00, 0x00, 0x38], "STGP 42, 2"),
    ([0x01, 0x0C, 0x2A, 0x02, 0x00, 0x00, 0x00, 0x00, 0x39], "RSGP 42, 2"),
    ([0x01, 0x0D, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x0E], "RFS START, 0"),
    ([0x01, 0x0E, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x12], "SIO 0, 2, 1"),
    ([0x01, 0x0F, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x11], "GIO 0, 1"),
    ([0x01, 0x13, 0x02, 0x00, 0xFF, 0xFF, 0xEC, 0x78, 0x78], "CALC MUL, -5000"),
    ([0x01, 0x14, 0x00, 0x00, 0x00, 0x00, 0x03, 0xE8, 0x00], "COMP 1000"),
    ([0x01, 0x15, 0x05, 0x00, 0x00, 0x00, 0x00, 0x0A, 0x25], "JC GE, 10"),
    ([0x01, 0x16, 0x00, 0x00, 0x00, 0x00, 0x00, 0x0A, 0x21], "JA 10"),
    ([0x01, 0x17, 0x00, 0x00, 0x00, 0x00, 0x00, 0x64, 0x7C], "CSUB 100"),
    ([0x01, 0x18, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x19], "RSUB"),
    ([0x01, 0x1B, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x1D], "WAIT POS, 0, 0"),
    ([0x01, 0x1C, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x1D], "STOP"),
    ([0x01, 0x1E, 0x01, 0x00, 0x00, 0x00, 0x03, 0xE8, 0x0B], "SCO 1, 0, 1000"),
    ([0x01, 0x1F, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x21], "GCO 1, 0"),
    ([0x01, 0x20, 0x03, 0x00, 0x00, 0x00, 0x00, 0x00, 0x24], "CCO 3, 0"),
    ([0x01, 0x21, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x24], "CALCX MUL"),
    ([0x01, 0x22, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x23], "AAP 0, 0"),
    ([0x01, 0x23, 0x2A, 0x02, 0x00, 0x00, 0x00, 0x00, 0x50], "AGP 42, 2"),
    ([0x01, 0x24, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x26], "CLE ETO"),
    ([0x01, 0x19, 0xFF, 0x00, 0x00, 0x00, 0x00, 0x00, 0x19], "EI 255"),
    ([0x01, 0x1A, 0xFF, 0x00, 0x00, 0x00, 0x00, 0x00, 0x1A], "DI 255"),
    ([0x01, 0x25, 0x00, 0x00, 0x00, 0x00, 0x00, 0x32, 0x58], "VECT 0, 50"),
    ([0x01, 0x26, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x27], "RETI"),
    ([0x01, 0x27, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x29], "ACO 1, 0"),
    // Control commands have no mnemonic: they are written as their four numbers.
    ([0x01, 0x80, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x81], "128, 0, 0, 0"),
    ([0x01, 0x88, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x8A], "136, 1, 0, 0"),
    ([0x01, 0x89, 0x00, 0x00, 0x00, 0x00, 0x04, 0xD2, 0x60], "137, 0, 0, 1234"),
    ([0x01, 0x8A, 0x01, 0x00, 0x00, 0x00, 0x00, 0x01, 0x8D], "138, 1, 0, 1"),
    ([0x01, 0xFF, 0x00, 0x00, 0x00, 0x00, 0x04, 0xD2, 0xD6], "255, 0, 0, 1234"),
    // A number that means nothing survives, too.
    ([0x01, 0x11, 0x22, 0x33, 0xFF, 0xFF, 0xFF, 0xFF, 0x63], "17, 34, 51, -1"),
];

/// A reply of module 1 to host 2 on the wire, and what it says.
#[rustfmt::skip]
const REPLIES: &[(Telegram, Status, u8, i32)] = &[
    // GIO 0, 1 reads 302.
    ([0x02, 0x01, 0x64, 0x0F, 0x00, 0x00, 0x01, 0x2E, 0xA5], Status::Ok, 15, 302),
    // CALC MUL, -5000: the operand comes back.
    ([0x02, 0x01, 0x64, 0x13, 0xFF, 0xFF, 0xEC, 0x78, 0xDC], Status::Ok, 19, -5000),
    // 136, type 1: module 1140, version 1.42.
    ([0x02, 0x01, 0x64, 0x88, 0x04, 0x74, 0x01, 0x2A, 0x92], Status::Ok, 136, 0x0474_012A),
    // The event of command 138 for motor 0.
    ([0x02, 0x01, 0x80, 0x8A, 0x00, 0x00, 0x00, 0x01, 0x0E], Status::PositionReached, 138, 1),
    // A telegram with a wrong checksum was received.
    ([0x02, 0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x04], Status::WrongChecksum, 0, 0),
    ([0x02, 0x01, 0x65, 0x05, 0x00, 0x00, 0x03, 0xE8, 0x58], Status::Loaded, 5, 1000),
];

/// Status bytes by the protocol's numbers.
const STATUSES: [(u8, Status); 9] = [
    (100, Status::Ok),
    (101, Status::Loaded),
    (128, Status::PositionReached),
    (1, Status::WrongChecksum),
    (2, Status::InvalidCommand),
    (3, Status::WrongType),
    (4, Status::InvalidValue),
    (5, Status::EepromLocked),
    (6, Status::NotAvailable),
];

#[test]
fn what_is_written_becomes_the_telegram() {
    for (telegram, line) in REQUESTS {
        let command = text::parse(line).unwrap_or_else(|error| panic!("{line}: {error}"));
        assert_eq!(&binary::encode_command(1, command), telegram, "{line}");
    }
}

#[test]
fn a_telegram_is_shown_as_it_is_written() {
    for (telegram, line) in REQUESTS {
        assert_eq!(binary::decode_command(telegram).unwrap().to_string(), *line);
    }
}

#[test]
fn the_address_is_the_first_byte_and_counts_in_the_checksum() {
    for (telegram, line) in REQUESTS {
        let command = text::parse(line).unwrap();
        let mut expected = *telegram;
        expected[0] = 0xFE;
        expected[8] = expected[8].wrapping_add(0xFD);
        assert_eq!(binary::encode_command(0xFE, command), expected, "{line}");
        assert_eq!(binary::decode_command(&expected), Some(command), "{line}");
    }
}

#[test]
fn replies_in_both_directions() {
    for &(telegram, status, opcode, value) in REPLIES {
        let reply = Reply::Plain { status, opcode, value };
        assert_eq!(binary::encode_reply(2, 1, &reply), telegram, "{reply:?}");
        let received = Received { host: 2, module: 1, status: status as u8, opcode, value };
        assert_eq!(binary::decode_reply(&telegram), Some(received));
        assert_eq!(received.status(), Some(status));
    }
}

/// The version string has neither module address nor checksum; a command out of program memory has no
/// status.
#[test]
fn special_replies() {
    let stored = text::parse("ROR 0, 1000").unwrap();
    assert_eq!(binary::encode_reply(2, 1, &Reply::Version(*b"1140V142")), *b"\x021140V142");
    assert_eq!(binary::encode_reply(2, 1, &Reply::Memory(stored)), [2, 1, 0, 0, 0, 0, 0x03, 0xE8, 0xEE]);
    assert_eq!(
        can::encode_reply(StandardId::new(1).unwrap(), 8, &Reply::Version(*b"1140V142")).as_slice(),
        b"1140V142"
    );
    assert_eq!(
        can::encode_reply(StandardId::new(1).unwrap(), 8, &Reply::Memory(stored)).as_slice(),
        [1, 0, 0, 0, 0, 0x03, 0xE8, 0]
    );
}

#[test]
fn a_byte_changed_on_the_way_is_noticed() {
    let flips = (0..9).flat_map(|place| (1..=u8::MAX).map(move |flip| (place, flip)));
    for (place, flip) in flips {
        for (telegram, line) in REQUESTS {
            let mut changed = *telegram;
            changed[place] ^= flip;
            assert_eq!(binary::decode_command(&changed), None, "{line}: byte {place}");
        }
        for (telegram, ..) in REPLIES {
            let mut changed = *telegram;
            changed[place] ^= flip;
            assert_eq!(binary::decode_reply(&changed), None, "byte {place}");
        }
    }
}

/// On CAN the same seven bytes travel without address and checksum.
#[test]
fn can_carries_what_is_between_address_and_checksum() {
    for (telegram, line) in REQUESTS {
        let command = text::parse(line).unwrap();
        let data = can::encode_command(command);
        assert_eq!((&data[..7], data[7]), (&telegram[1..8], 0), "{line}");
        for length in 0..=8 {
            let expected = (length >= 7).then_some(command);
            assert_eq!(can::decode_command(&data[..length]), expected, "{line} in {length} bytes");
        }
    }
}

/// A reply starts with the low byte of the module's own identifier and has the length of its request.
#[test]
fn can_replies_mirror_the_length_of_the_request() {
    for &(telegram, status, opcode, value) in REPLIES {
        let reply = Reply::Plain { status, opcode, value };
        for id in [0x001, 0x07F, 0x7FF] {
            let own = StandardId::new(id).unwrap();
            let whole = can::encode_reply(own, 8, &reply);
            assert_eq!((whole.len(), whole[0], whole[7]), (8, (id & 0xFF) as u8, 0));
            assert_eq!(whole[1..7], telegram[2..8], "{reply:?}");
            assert_eq!(can::encode_reply(own, 7, &reply).as_slice(), &whole[..7]);
        }
    }
}

/// Every number there is survives all three forms, known or not.
#[test]
fn unknown_numbers_survive() {
    for opcode in 0..=u8::MAX {
        let command = Command::new(opcode, 255, 254, i32::MIN);
        assert_eq!(binary::decode_command(&binary::encode_command(9, command)), Some(command));
        assert_eq!(can::decode_command(&can::encode_command(command)), Some(command));
        let named = Opcode::from_number(opcode).is_some_and(|opcode| !opcode.instruction().mnemonic.is_empty());
        if !named {
            assert_eq!(text::parse(&command.to_string()), Ok(command));
        }
        let status = STATUSES.iter().find(|(number, _)| *number == opcode).map(|(_, status)| *status);
        assert_eq!(Status::from_number(opcode), status, "status {opcode}");
    }
}

/// Every mnemonic is in the table of examples above, but for the user functions.
#[test]
fn no_mnemonic_is_left_out() {
    for instruction in Instruction::all().filter(|i| !i.mnemonic.is_empty() && !i.mnemonic.starts_with("UF")) {
        let shown = REQUESTS.iter().any(|(_, line)| line.split(' ').next() == Some(instruction.mnemonic));
        assert!(shown, "{} has no example", instruction.mnemonic);
    }
}

/// The manual's exchanges with a module: the bytes sent, and the bytes that come back.
#[test]
fn a_module_answers_in_these_bytes() {
    let mut bench = Bench::new();
    let mut exchange = |request: &str, reply: Telegram| {
        let request = binary::encode_command(1, text::parse(request).unwrap());
        assert_eq!(
            bench.exchange(Source::Rs485, request).and_then(|sent| sent.telegram()),
            Some(reply),
            "{request:02X?}"
        );
    };
    let plain = |opcode, value| binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode, value });
    exchange("CALC MUL, -5000", REPLIES[1].0);
    exchange("136, 1", REPLIES[2].0);
    exchange("136, 0", *b"\x021140V142");
    exchange("MST 0", [0x02, 0x01, 0x64, 0x03, 0x00, 0x00, 0x00, 0x00, 0x6A]);
    exchange("SGP 66, 0, 3", plain(9, 3));
    bench.control("analog 0 302");
    bench.run(2 * hal_sim::clock::MILLISECOND);
    let request = binary::encode_command(3, text::parse("GIO 0, 1").unwrap());
    let reply = bench.exchange(Source::Rs485, request).unwrap().telegram().unwrap();
    let received = binary::decode_reply(&reply).unwrap();
    assert_eq!((received.module, received.status, received.value), (3, OK, 302));
}
