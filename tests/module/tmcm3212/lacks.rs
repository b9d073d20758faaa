//! Features that the TMCM-3212 does not have: settings of axes in the EEPROM, ASCII mode, and a program memory as small
//! as its sisters'.

use super::bench;
use common::program::STORED;
use common::{INVALID_COMMAND, INVALID_VALUE, OK, WRONG_TYPE};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::{Command, Opcode, binary, text};

#[test]
fn the_version_is_that_of_the_manual() {
    let mut bench = bench();
    let sent = bench.exchange(Source::Usb, binary::encode_command(1, Command::new(136, 0, 0, 0))).unwrap();
    assert_eq!(&sent.telegram().unwrap(), b"\x023212V105");
    // The upper half is 3212, then 1 and 5.
    assert_eq!(bench.ok("136, 1, 0, 0"), 0x0C8C_0105);
}

/// STAP, RSAP and 139 are unknown, whatever their operands: also those that would be refused otherwise.
#[test]
fn axis_parameters_are_not_stored_and_there_is_no_ascii_mode() {
    let mut bench = bench();
    for source in [Source::Usb, Source::Rs485] {
        for (opcode, kind, motor) in [(7, 4, 0), (7, 0, 2), (7, 254, 0), (7, 4, 3), (8, 4, 0), (8, 4, 255), (139, 0, 0)]
        {
            let request = binary::encode_command(1, Command::new(opcode, kind, motor, 0));
            let reply = bench.exchange(source, request).unwrap().telegram().unwrap();
            assert_eq!(binary::decode_reply(&reply).unwrap().status, INVALID_COMMAND, "{opcode} {kind} {motor}");
        }
        // The link still takes telegrams, not lines.
        assert_eq!(bench.ask_over(source, 1, "GAP 4, 0").unwrap().value, 51_200);
    }
    for number in [67, 79, 90] {
        assert_eq!(bench.ask(&format!("GGP {number}, 0")).0, WRONG_TYPE);
        bench.refused(&format!("SGP {number}, 0, 1"), WRONG_TYPE);
    }
    bench.configure(&["SAP 4, 1, 700", "SAP 255, 2, 0", "SGP 84, 0, 1", "SCO 3, 2, -77", "SGP 5, 2, 9", "STGP 5, 2"]);
    bench.power_cycle();
    assert_eq!(
        (bench.ok("GAP 4, 1"), bench.ok("GAP 255, 2")),
        (51_200, 1),
        "axis parameters have their defaults again"
    );
    assert_eq!((bench.ok("GGP 84, 0"), bench.ok("GCO 3, 2"), bench.ok("GGP 5, 2")), (1, -77, 9));
}

/// In a program, a command that does not exist is skipped.
#[test]
fn a_program_goes_on_behind_a_command_that_the_module_lacks() {
    let mut bench = bench();
    let lines = ["STAP 4, 0", "RSAP 4, 0", "SGP 1, 2, 3", "STOP"];
    bench.download(0, &lines);
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 3);
    assert_eq!(bench.listing(0, 4), lines.map(|line| text::parse(line).unwrap()));
}

#[test]
fn all_of_program_memory_is_kept() {
    let mut bench = bench();
    assert_eq!(bench.ask("132, 0, 0, 0").0, OK);
    for address in 0..6144 {
        assert_eq!(bench.ask(&format!("SGP {}, 2, {address}", address % 256)).0, STORED, "{address}");
    }
    bench.refused("SGP 0, 2, 6144", INVALID_VALUE);
    bench.ok("133, 0, 0, 0");
    bench.power_cycle();
    for address in (0..6144).step_by(37).chain([6142, 6143]) {
        let expected = Command::new(Opcode::Sgp as u8, (address % 256) as u8, 2, address);
        assert_eq!(bench.memory(address), expected, "{address}");
    }
    // 6144 commands at 128 a millisecond; the program ends behind the last one.
    bench.start(0);
    bench.run(49 * MILLISECOND);
    bench.run_until(SECOND, |bench| bench.mode() == 0);
    assert_eq!((bench.variable(0), bench.variable(255)), (5888, 6143));
}
