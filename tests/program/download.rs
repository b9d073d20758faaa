//! Downloads: where their commands go, whose link they belong to, and when they are durable (manual section 3.7.38).

use common::program::{MEMORY, STORED, command};
use common::{Bench, INVALID_COMMAND, INVALID_VALUE, NOT_AVAILABLE, OK, WRONG_CHECKSUM};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::can::{CanFrame, Frame};
use tmcm::module::Source;
use tmcm::tmcl::can;
use tmcm::tmcl::{Command, binary};
use tmcm_sim::VirtualModule;

/// Small routines go to their places and leave the rest of the memory alone.
#[test]
fn downloads_at_several_addresses() {
    let mut bench = Bench::new();
    bench.download(40, &["SGP 9, 2, 9"; 60]);
    let mut expected = bench.listing(38, 64);
    for (address, lines) in [(50, ["ROR 0, 1", "STOP"]), (60, ["ROL 0, 2", "STOP"]), (80, ["MST 0", "0, 0, 0, 0"])] {
        bench.download(address, &lines);
        for (n, line) in lines.iter().enumerate() {
            expected[address as usize - 38 + n] = command(line);
        }
    }
    assert_eq!(bench.listing(38, 64), expected);
    bench.power_cycle();
    assert_eq!(bench.listing(38, 64), expected);
    // One command in the middle, and none at all.
    bench.download(70, &["GAP 1, 0"]);
    bench.download(71, &[]);
    expected[70 - 38] = command("GAP 1, 0");
    assert_eq!(bench.listing(38, 64), expected);
}

/// All numbers below 128 are stored as they are, known or not, whatever stands in their fields; control commands
/// are carried out.
#[test]
fn numbers_below_128_are_stored() {
    let mut bench = Bench::new();
    bench.ok("132, 0, 0, 100");
    let stored = |opcode: u8| Command::new(opcode, opcode ^ 0x55, 200 - opcode, i32::from(opcode) * -70_001);
    for opcode in 0..128 {
        let reply = bench.send(stored(opcode));
        assert_eq!((reply.status, reply.opcode, reply.value), (STORED, opcode, stored(opcode).value));
    }
    for (line, status) in
        [("136, 1", OK), ("135, 0", OK), ("135, 2", OK), ("138, 0, 0, 0", OK), ("200", INVALID_COMMAND), ("128", OK)]
    {
        assert_eq!(bench.ask(line).0, status, "{line}");
    }
    // Memory pointer: behind what has been stored.
    assert_eq!(bench.memory_status().pointer, 228);
    assert_eq!(bench.ask("GGP 66, 0").0, STORED);
    bench.ok("133");
    let expected: Vec<Command> = (0..128).map(stored).chain([command("GGP 66, 0"), Command::default()]).collect();
    assert_eq!(bench.listing(100, 130), expected);
    // Nothing of it has been carried out.
    assert_eq!((bench.ok("GAP 0, 0"), bench.ok("GIO 0, 2"), bench.ok("GAP 4, 0")), (0, 0, 1000));
}

#[test]
fn download_mode_is_a_global_parameter() {
    let mut bench = Bench::new();
    assert_eq!(bench.ok("GGP 129, 0"), 0);
    bench.ok("132");
    assert_eq!(bench.ok_beside("GGP 129, 0"), 1);
    bench.ok("133");
    assert_eq!(bench.ok("GGP 129, 0"), 0);
}

/// A download is a matter of one link: what comes over the others is carried out.
#[test]
fn other_links_are_not_downloading() {
    let mut bench = Bench::new();
    bench.ok("132");
    bench.ok_beside("SAP 4, 0, 777");
    assert_eq!(bench.ok_beside("GAP 4, 0"), 777);
    assert_eq!(bench.ask("SAP 4, 0, 888").0, STORED);
    assert_eq!(bench.ok_beside("GAP 4, 0"), 777);
    let unknown = bench.ask_over(Source::Rs485, 1, "0, 0, 0, 0").unwrap();
    assert_eq!(unknown.status, INVALID_COMMAND);
    bench.ok("133");
    assert_eq!(bench.listing(0, 2), [command("SAP 4, 0, 888"), Command::default()]);
}

/// Only the link that downloads can tell that all is there; another one can neither end its download nor begin one of
/// its own. A reset does, should the host have vanished, and what is left is no program.
#[test]
fn a_download_belongs_to_its_link() {
    let mut bench = Bench::new();
    bench.ok("132");
    assert_eq!(bench.ask("SGP 1, 2, 1").0, STORED);
    for line in ["133", "132", "132, 0, 0, 50"] {
        assert_eq!(bench.ask_over(Source::Rs485, 1, line).unwrap().status, NOT_AVAILABLE, "{line}");
    }
    assert_eq!(bench.ask("STOP").0, STORED);
    bench.ok("133");
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 1);
    bench.ok("132");
    bench.ok_beside("255, 0, 0, 1234");
    bench.run(SECOND);
    bench.refused("129", NOT_AVAILABLE);
    bench.ok_beside("132");
}

/// The program is being written after 133: a download that another link begins now would take it away before the
/// answer.
#[test]
fn a_download_begins_when_the_last_one_is_written() {
    let mut bench = Bench::new();
    bench.ok("132");
    for _ in 0..100 {
        assert_eq!(bench.ask("SGP 1, 2, 1").0, STORED);
    }
    bench.module.receive(Source::Usb, binary::encode_command(1, command("133")));
    bench.run(MILLISECOND);
    assert_eq!(bench.ask_over(Source::Rs485, 1, "132").unwrap().status, NOT_AVAILABLE);
    bench.run(SECOND);
    let reply = binary::decode_reply(&bench.module.sent().unwrap().telegram().unwrap()).unwrap();
    assert_eq!((reply.status, reply.opcode), (OK, 133));
    bench.ok_beside("132");
}

/// Over CAN a download goes like everywhere else, in frames of eight or seven bytes, mixed as one likes.
#[test]
fn a_download_over_can() {
    for lengths in [[8, 8, 8, 8], [7, 7, 7, 7], [8, 7, 8, 7], [7, 8, 7, 8]] {
        let mut bench = Bench::new();
        let send = |bench: &mut Bench, line: &str, length: usize| {
            let mut data = can::encode_command(command(line));
            data.truncate(length);
            bench.module.receive_frame(Frame::standard(1, &data).unwrap());
            bench.run(SECOND);
            bench.module.frame().unwrap().data()[1]
        };
        let lines = [("132", OK), ("SGP 1, 2, 5", STORED), ("STOP", STORED), ("133", OK)];
        for ((line, status), length) in lines.into_iter().zip(lengths) {
            assert_eq!(send(&mut bench, line, length), status, "{line} in {length} bytes");
            // USB is another link.
            assert_eq!(bench.ok("SGP 9, 2, 1"), 1);
        }
        bench.run_to_end(0);
        assert_eq!(bench.variable(1), 5);
    }
}

#[test]
fn downloads_end_with_the_memory() {
    let mut bench = Bench::new();
    bench.ok(&format!("132, 0, 0, {}", MEMORY - 2));
    assert_eq!(bench.ask("SGP 1, 2, 1").0, STORED);
    assert_eq!(bench.ask("STOP").0, STORED);
    for _ in 0..3 {
        bench.refused("SGP 2, 2, 1", INVALID_VALUE);
    }
    bench.ok("133");
    assert_eq!(bench.listing(0, 2), [Command::default(); 2]);
    assert_eq!(bench.listing(MEMORY - 2, 2), [command("SGP 1, 2, 1"), command("STOP")]);
    for address in [MEMORY, 65_536, -1, i32::MIN] {
        bench.refused(&format!("132, 0, 0, {address}"), INVALID_VALUE);
        assert_eq!(bench.ok("GGP 129, 0"), 0);
    }
    bench.run_to_end(MEMORY - 2);
    assert_eq!(bench.variable(1), 1);
}

/// A telegram with a wrong checksum is not stored, and the next one takes its place.
#[test]
fn damaged_telegrams_are_not_stored() {
    let mut bench = Bench::new();
    bench.ok("132");
    let mut telegram = binary::encode_command(1, command("ROR 0, 500"));
    telegram[8] ^= 1;
    let reply = bench.exchange(Source::Usb, telegram).unwrap().telegram().unwrap();
    assert_eq!(binary::decode_reply(&reply).unwrap().status, WRONG_CHECKSUM);
    assert_eq!(bench.ask("ROR 0, 400").0, STORED);
    bench.ok("133");
    assert_eq!(bench.listing(0, 2), [command("ROR 0, 400"), Command::default()]);
}

/// Another 132 during a download goes to another place.
#[test]
fn a_second_132_moves_the_pointer() {
    let mut bench = Bench::new();
    bench.ok("132");
    assert_eq!(bench.ask("ROR 0, 1").0, STORED);
    bench.ok("132, 0, 0, 200");
    assert_eq!(bench.memory_status().pointer, 200);
    assert_eq!(bench.ask("ROR 0, 2").0, STORED);
    bench.ok("133");
    assert_eq!([0, 1, 200].map(|n| bench.memory(n).value), [1, 0, 2]);
}

/// The reply to 133 says that all is durable: a module with a copy of the EEPROM has the program.
#[test]
fn what_133_has_answered_is_durable() {
    let mut bench = Bench::new();
    let lines: Vec<String> = (0..200).map(|n| format!("SGP 1, 2, {n}")).collect();
    bench.download(7, &lines.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(!bench.module.board().borrow().at25().is_writing());
    let mut copy = Bench::with_eeprom(&bench.eeprom());
    let expected: Vec<Command> = lines.iter().map(|line| command(line)).collect();
    assert_eq!(copy.listing(7, 200), expected);
    copy.run_to_end(7);
    assert_eq!(copy.variable(1), 199);
}
