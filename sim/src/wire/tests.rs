//! The lines of the log, each written out as it has to be.

use hal_sim::clock::{MICROSECOND, SECOND};
use tmcm::can::{CanFrame, ExtendedId, Frame, StandardId};
use tmcm::tmcl::{Command, Reply, Status, binary, text};

use super::{CAN, Place, Transcript};
use crate::client::Client;
use crate::native::{Model, Product};

const USB: Place = Place::of("usb", Client(3));

/// A request to module 1.
fn request(line: &str) -> binary::Telegram {
    binary::encode_command(1, text::parse(line).unwrap())
}

/// A reply of module 1 to host 2.
fn plain(status: Status, opcode: u8, value: i32) -> binary::Telegram {
    binary::encode_reply(2, 1, &Reply::Plain { status, opcode, value })
}

/// The texts behind the direction, without padding.
fn said(log: &mut Transcript) -> Vec<String> {
    let text = log.take();
    let behind = |line: &str| line.split(['>', '<']).nth(1).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    text.lines().map(behind).collect()
}

fn log() -> Transcript {
    Transcript::of([Model::Tmcl(Product::Tmcm1140)])
}

#[test]
fn a_line_has_columns() {
    let mut log = log();
    log.hear(12_000_999, USB, &request("GAP 1, 0"));
    log.answer(75 * SECOND + 13 * MICROSECOND, USB, 0, &plain(Status::Ok, 6, -7));
    log.hear(100_000 * SECOND, Place::alone("rs485"), &request("MST 0"));
    assert_eq!(
        log.take(),
        "    0.012000  usb 3    >  01 06 01 00 00 00 00 00 08   to 1: GAP 1, 0\n   \
         75.000013  usb 3    <  02 01 64 06 FF FF FF F9 63   from 1: -7 microsteps (actual position), status 100 ok\n\
         100000.000000  rs485    >  01 03 00 00 00 00 00 00 04   to 1: MST 0\n"
    );
    assert_eq!(log.take(), "");
}

#[test]
fn telegrams_are_cut_out_of_bytes_and_torn_ones_are_told() {
    let mut log = log();
    let bytes = [request("GAP 1, 0"), request("MVP ABS, 0, 51200")].concat();
    log.hear(0, USB, &bytes[..4]);
    assert_eq!(log.take(), "");
    log.hear(0, USB, &bytes[4..]);
    assert_eq!(
        said(&mut log),
        ["01 06 01 00 00 00 00 00 08 to 1: GAP 1, 0", "01 04 00 00 00 00 C8 00 CD to 1: MVP ABS, 0, 51200"]
    );
    log.hear(0, USB, &bytes[..4]);
    log.silence(0, USB);
    log.silence(0, USB);
    let mut wrong = request("GAP 1, 0");
    wrong[8] ^= 1;
    log.hear(0, USB, &wrong);
    log.answer(0, USB, 0, &plain(Status::WrongChecksum, 0, 0));
    assert_eq!(
        said(&mut log),
        [
            "01 06 01 00 torn: 4 of 9 bytes",
            "01 06 01 00 00 00 00 00 09 wrong checksum: to 1: GAP 1, 0",
            "02 01 01 00 00 00 00 00 04 from 1: status 1 wrong checksum",
        ]
    );
    log.hear(0, USB, &request("GAP 1, 0"));
    log.answer(0, USB, 0, &plain(Status::Ok, 6, 0)[..3]);
    log.give_up(0, USB, 0);
    log.give_up(0, USB, 0);
    let mut wrong = plain(Status::Ok, 6, 0);
    wrong[8] ^= 1;
    log.answer(0, USB, 0, &wrong);
    assert_eq!(
        said(&mut log)[1..],
        ["02 01 64 torn: 3 of 9 bytes", "no reply", "02 01 64 06 00 00 00 00 6C wrong checksum"]
    );
}

#[test]
fn a_reply_is_read_by_its_command() {
    let mut log = log();
    // The first one is never answered.
    for line in ["GAP 4, 0", "136, 0", "134, 0, 0, 12", "GGP 66, 0", "SAP 4, 0, 5000"] {
        log.hear(0, USB, &request(line));
    }
    log.take();
    let stored = Reply::Memory(text::parse("MVP REL, 0, 100").unwrap());
    for reply in [
        binary::encode_reply(2, 1, &Reply::Version(*b"1140V142")),
        binary::encode_reply(2, 1, &stored),
        plain(Status::Ok, 10, 1),
        plain(Status::InvalidValue, 5, 5000),
        plain(Status::PositionReached, 138, 1),
        plain(Status::Ok, 6, 3),
    ] {
        log.answer(0, USB, 0, &reply);
    }
    let behind: Vec<String> = said(&mut log).iter().map(|line| line[27..].to_owned()).collect();
    assert_eq!(
        behind,
        [
            "version 1140V142",
            "stored MVP REL, 0, 100",
            "from 1: 1 (serial address), status 100 ok",
            "from 1: status 4 value, motor or bank out of range",
            "from 1: event, target position reached",
            "from 1: to command 6: 3, status 100 ok",
        ]
    );
}

#[test]
fn a_module_that_tells_what_it_is_has_names_from_then_on() {
    let mut log = Transcript::of_module(None);
    let mut ask = |line: &str, value| {
        let command = text::parse(line).unwrap();
        log.hear(0, USB, &binary::encode_command(1, command));
        log.answer(0, USB, 0, &plain(Status::Ok, command.opcode, value));
        said(&mut log)[1][27..].to_owned()
    };
    assert_eq!(ask("GAP 4, 0", 1), "from 1: 1, status 100 ok");
    assert_eq!(ask("136, 1", 0x0C26_010E), "from 1: TMCM-3110, firmware version 1.14, status 100 ok");
    assert_eq!(ask("GAP 4, 0", 1), "from 1: 1 int (maximum positioning speed), status 100 ok");
    assert_eq!(ask("136, 1", 0x0C8C_010E), "from 1: TMCM-3212, firmware version 1.14, status 100 ok");
    // Whether it has pps is a setting of the axis.
    assert_eq!(ask("GAP 4, 0", 1), "from 1: 1 (maximum positioning speed), status 100 ok");
}

#[test]
fn lines_of_ascii_mode() {
    let mut log = log();
    log.hear(0, USB, &request("139"));
    log.answer(0, USB, 0, &plain(Status::Ok, 139, 0));
    log.hear(0, USB, b"AGAP 1");
    // Who types may take his time.
    log.silence(0, USB);
    log.answer(0, USB, 0, b"AGAP 1");
    log.hear(0, USB, b", 0\r");
    log.answer(0, USB, 0, b", 0\rBA 100 -5\r");
    log.hear(0, USB, b"AGAQ 1\rABIN\r");
    assert_eq!(
        said(&mut log),
        [
            "01 8B 00 00 00 00 00 00 8C to 1: 139, 0, 0, 0 (enter ASCII mode)",
            "02 01 64 8B 00 00 00 00 F2 from 1: 0, status 100 ok",
            "41 47 41 50 20 31 2C 20 30 0D line \"AGAP 1, 0\"",
            "41 47 41 50 20 31 2C 20 30 0D echo \"AGAP 1, 0\"",
            "42 41 20 31 30 30 20 2D 35 0D line \"BA 100 -5\": status 100 ok",
            "41 47 41 51 20 31 0D line \"AGAQ 1\": unknown command",
            "41 42 49 4E 0D line \"ABIN\": back to binary mode",
        ]
    );
}

#[test]
fn hosts_that_share_a_link_are_told_apart() {
    let mut log = log();
    let other = Place::of("usb", Client(4));
    log.hear(0, USB, &request("GAP 1, 0")[..5]);
    log.hear(0, other, &request("136, 0"));
    log.hear(0, USB, &request("GAP 1, 0")[5..]);
    log.answer(0, USB, 0, &plain(Status::Ok, 6, 1));
    log.answer(0, other, 0, b"\x021140V142");
    let text = log.take();
    let hosts: Vec<&str> = text.lines().map(|line| &line[14..24]).collect();
    assert_eq!(hosts, ["usb 4    >", "usb 3    >", "usb 3    <", "usb 4    <"]);
    assert!(text.ends_with("version 1140V142\n"), "{text}");
}

fn standard(id: u16, data: &[u8]) -> Frame {
    Frame::standard(id, data).unwrap()
}

#[test]
fn frames_of_tmcl() {
    let mut log = Transcript::of([Model::Tmcl(Product::Tmcm1140), Model::Tmcl(Product::Tmcm3110)]);
    let adapter = Place::of(CAN, Client(5));
    let bus = Place::alone(CAN);
    let gap = Command::new(6, 4, 0, 0).to_bytes();
    log.frame(0, adapter, None, &standard(2, &gap));
    log.frame(0, bus, Some(1), &standard(0x2, &[2, 100, 6, 0, 0, 3, 0xE8]));
    log.frame(0, adapter, None, &standard(1, &[136, 0, 0, 0, 0, 0, 0, 0]));
    log.lose_frame(0, bus, 0, &standard(2, b"1140V142"));
    log.frame(0, bus, Some(0), &standard(2, &[1, 128, 138, 0, 0, 0, 1, 0]));
    log.frame(0, adapter, None, &standard(1, &[1, 2]));
    log.frame(0, adapter, None, &Frame::new_remote(StandardId::ZERO, 2).unwrap());
    log.frame(0, adapter, None, &Frame::new(ExtendedId::new(5).unwrap(), &[]).unwrap());
    assert_eq!(
        said(&mut log),
        [
            "002 06 04 00 00 00 00 00 to 2: GAP 4, 0",
            "002 02 64 06 00 00 03 E8 from 2: 1000 int (maximum positioning speed), status 100 ok",
            "001 88 00 00 00 00 00 00 00 to 1: 136, 0, 0, 0 (what module is this)",
            "002 31 31 34 30 56 31 34 32 lost: version 1140V142",
            "002 01 80 8A 00 00 00 01 00 from 1: event, target position reached",
            "001 01 02 2 bytes: no command, which has 7 or 8",
            "000 remote, 2 bytes no frame for a module",
            "00000005 no frame for a module",
        ]
    );
}

#[test]
fn frames_of_canopen() {
    let mut log = Transcript::of([Model::Canopen]);
    for (id, data, meaning) in [
        (0x000, &[1, 0][..], "NMT to all: start"),
        (0x000, &[0x81, 3], "NMT to 3: reset node"),
        (0x000, &[1], "NMT: 1 of 2 bytes"),
        (0x080, &[], "SYNC"),
        (0x081, &[0x11, 0x86, 0x21, 0, 0, 0, 0, 0], "EMCY of 1: 8611h following error, error register 21h"),
        (0x081, &[0x12, 0x86, 0x21, 0, 0, 0, 0, 0], "EMCY of 1: 8612h unknown, error register 21h"),
        (0x081, &[0x12], "EMCY of 1: 1 of 8 bytes"),
        (0x701, &[0], "boot-up of 1"),
        (0x701, &[0x85], "state of 1: operational"),
        (0x181, &[0x37, 2], "TPDO1 of 1"),
        (0x201, &[6, 0], "RPDO1 of 1"),
        (0x4FF, &[0; 6], "TPDO4 of 127"),
        (0x501, &[0; 6], "RPDO4 of 1"),
        (0x601, &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0], "SDO to 1: read 6041h.0 Statusword"),
        (0x581, &[0x4B, 0x41, 0x60, 0, 0x37, 2, 0, 0], "SDO from 1: 6041h.0 Statusword is 567"),
        (0x601, &[0x2F, 0x60, 0x60, 0, 0xFF, 0, 0, 0], "SDO to 1: write 6060h.0 Modes of operation = -1"),
        (0x601, &[0x22, 0x7A, 0x60, 0, 0, 0, 0, 0x80], "SDO to 1: write 607Ah.0 Target position = -2147483648"),
        (0x601, &[0x2B, 0x02, 0x14, 2, 1, 0, 0, 0], "SDO to 1: write 1402h.2 RPDO3 transmission type = 01 00"),
        (0x581, &[0x60, 0x60, 0x60, 0, 0, 0, 0, 0], "SDO from 1: 6060h.0 Modes of operation written"),
        (
            0x581,
            &[0x80, 0x99, 0x99, 9, 0, 0, 2, 6],
            "SDO from 1: 9999h.9 refused, 06020000h there is no object with this index",
        ),
        (0x581, &[0x80, 0x99, 0x99, 9, 1, 0, 2, 6], "SDO from 1: 9999h.9 refused, 06020001h unknown"),
        (
            0x581,
            &[0x41, 0x08, 0x10, 0, 9, 0, 0, 0],
            "SDO from 1: 1008h.0 Manufacturer device name, 9 bytes in segments",
        ),
        (0x601, &[0x60, 0, 0, 0, 0, 0, 0, 0], "SDO to 1: read segment"),
        (0x581, &[0x1B, b'4', b'0', 0, 0, 0, 0, 0], "SDO from 1: read segment 34 30, the last"),
        (0x601, &[0x21, 0x23, 0x10, 1, 8, 0, 0, 0], "SDO to 1: write 1023h.1 TMCL command, 8 bytes in segments"),
        (0x601, &[0x00, 6, 1, 0, 0, 0, 0, 0], "SDO to 1: write segment 06 01 00 00 00 00 00"),
        (0x581, &[0x20, 0, 0, 0, 0, 0, 0, 0], "SDO from 1: segment written"),
        (0x601, &[0x40], "SDO to 1: 1 of 8 bytes"),
        (0x601, &[0xE0, 0, 0, 0, 0, 0, 0, 0], "SDO to 1: unknown request"),
        (0x77F, &[], "state of 127: 0 of 1 bytes"),
        (0x780, &[], "no frame of a node"),
        (0x100, &[], "no frame of a node"),
    ] {
        let frame = standard(id, data);
        log.frame(0, Place::alone(CAN), None, &frame);
        let text = log.take();
        assert!(text.ends_with(&format!("  {meaning}\n")), "{text:?} is not {meaning:?}");
    }
    let guarding = Frame::new_remote(StandardId::new(0x702).unwrap(), 1).unwrap();
    log.frame(0, Place::alone(CAN), None, &guarding);
    assert_eq!(said(&mut log), ["702 remote, 1 bytes guarding of 2"]);
}
