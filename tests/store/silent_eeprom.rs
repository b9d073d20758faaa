//! An EEPROM that does not answer: what is refused, and what is there again after the repair. And one full of contents
//! that nobody knows.

use common::random::Random;
use common::table::{AXIS, GLOBAL, INTERRUPT, tables};
use common::{Bench, EEPROM_LOCKED, OK, telegram};
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm_sim::{Product, VirtualModule};

/// Commands that store, with what leads up to them and where their effect could be seen.
const STORING: [(&[&str], &str, &str); 7] = [
    (&["SAP 4, 0, 77"], "STAP 4, 0", "GAP 4, 0"),
    (&["SGP 1, 2, 77"], "STGP 1, 2", "GGP 1, 2"),
    (&[], "SGP 66, 0, 77", "GGP 66, 0"),
    (&["CALC LOAD, 77"], "AGP 68, 0", "GGP 68, 0"),
    (&["SCO 1, 0, 77"], "SCO 1, 255, 0", "GCO 1, 0"),
    (&["SGP 84, 0, 1", "SCO 1, 0, 5"], "SCO 1, 0, 77", "GCO 1, 0"),
    (&["SGP 84, 0, 1", "SAP 1, 0, 77"], "CCO 20, 0", "GCO 20, 0"),
];

#[test]
fn storing_without_an_eeprom_is_status_5_and_changes_nothing() {
    for (before, command, look) in STORING {
        let mut bench = Bench::new();
        for line in before {
            bench.ok(line);
        }
        let value = bench.ok(look);
        let memory = bench.eeprom();
        bench.control("fault eeprom on");
        for _ in 0..3 {
            bench.refused(command, EEPROM_LOCKED);
            assert_eq!(bench.ok(look), value, "{command}");
            // The next telegram is served.
            assert_eq!(bench.ok("GGP 67, 0"), 0);
        }
        bench.control("fault eeprom off");
        assert!(bench.eeprom() == memory, "{command}");
        assert_eq!(bench.ask(command).0, OK);
        let changed = bench.ok(look);
        bench.power_cycle();
        if command.starts_with("SCO 1, 255") {
            bench.ok("GCO 1, 255");
        }
        assert_eq!((bench.ok(look), changed), (77, 77), "{command} after the repair");
    }
}

/// Values that were stored are known while the module runs: restoring them takes no EEPROM.
#[test]
fn what_is_stored_can_be_restored_without_an_eeprom() {
    let mut bench = Bench::new();
    bench.configure(&["SAP 4, 0, 777", "STAP 4, 0", "SGP 1, 2, 55", "STGP 1, 2", "SAP 4, 0, 500", "SGP 1, 2, 6"]);
    bench.control("fault eeprom on");
    for (restore, look, stored) in [("RSAP 4, 0", "GAP 4, 0", 777), ("RSGP 1, 2", "GGP 1, 2", 55)] {
        assert_ne!(bench.ok(look), stored);
        assert_eq!(bench.ask(restore).0, OK, "{restore}");
        assert_eq!(bench.ok(look), stored, "{restore}");
    }
}

/// A refused change of switch polarity or shaft direction is not in force either.
#[test]
fn refused_settings_are_not_in_force() {
    let mut bench = Bench::new();
    bench.control("fault eeprom on");
    for line in ["SGP 79, 0, 1", "SGP 90, 0, 1", "SGP 66, 0, 8", "SGP 76, 0, 8"] {
        bench.refused(line, EEPROM_LOCKED);
    }
    bench.run(10 * MILLISECOND);
    assert_eq!((bench.ok("GAP 9, 0"), bench.ok("GAP 10, 0"), bench.ok("GAP 11, 0")), (0, 0, 0));
    bench.ok("MVP ABS, 0, 300");
    bench.run(SECOND);
    assert_eq!((bench.rotor(), bench.ok("GAP 209, 0")), (300, 300));
    let reply = bench.ask_over(Source::Rs485, 1, "GAP 4, 0").expect("the address is the old one");
    assert_eq!((reply.host, reply.module), (2, 1));
}

/// A coordinate goes back to what it was in RAM, which need not be what the EEPROM has.
#[test]
fn a_refused_coordinate_keeps_its_value() {
    let mut bench = Bench::new();
    for line in ["SCO 1, 0, 11", "SCO 2, 0, 22", "SGP 84, 0, 1"] {
        bench.ok(line);
    }
    bench.control("fault eeprom on");
    bench.refused("SCO 1, 0, 99", EEPROM_LOCKED);
    assert_eq!((bench.ok("GCO 1, 0"), bench.ok("GCO 2, 0")), (11, 22));
    // Coordinate 0 is never stored.
    bench.ok("SCO 0, 0, 3");
    assert_eq!(bench.ok("GCO 0, 0"), 3);
}

/// Storing commands of two links fail together, each with its own reply.
#[test]
fn both_links_hear_of_the_failure() {
    let mut bench = Bench::new();
    bench.ok("SGP 84, 0, 1");
    bench.control("fault eeprom on");
    bench.post(Source::Usb, "SCO 1, 0, 5");
    bench.post(Source::Rs485, "SCO 1, 0, 6");
    let replies = bench.listen(100 * MILLISECOND);
    let mut heard: Vec<_> = replies.iter().map(|reply| (reply.status, reply.value)).collect();
    heard.sort_unstable();
    assert_eq!(heard, [(EEPROM_LOCKED, 5), (EEPROM_LOCKED, 6)]);
    assert_eq!(bench.ok("GCO 1, 0"), 0);
}

/// The part fails while a page is being written.
#[test]
fn an_eeprom_that_fails_during_a_write() {
    for tick in 0..80 {
        let mut bench = Bench::new();
        bench.ok("SGP 68, 0, 1");
        bench.post(Source::Usb, "SGP 68, 0, 2");
        bench.run(tick * 100 * MICROSECOND);
        bench.control("fault eeprom on");
        let replies = bench.listen(200 * MILLISECOND);
        assert_eq!(replies.len(), 1, "fails after {} us", tick * 100);
        let expected = match replies[0].status {
            OK => 2,
            status => {
                assert_eq!(status, EEPROM_LOCKED);
                1
            }
        };
        assert_eq!(bench.ok("GGP 68, 0"), expected);
        bench.control("fault eeprom off");
        assert_eq!(bench.ok("SGP 68, 0, 3"), 3);
        bench.power_cycle();
        assert_eq!(bench.ok("GGP 68, 0"), 3);
    }
}

/// With an EEPROM that is dead from the start the module works on defaults. When the part comes back, what
/// is in it has never been seen: nothing is written over it before a restart has read it.
#[test]
fn an_eeprom_that_is_dead_at_the_start() {
    let mut bench = Bench::new();
    for line in ["SGP 68, 0, 1", "SGP 68, 0, 2", "SGP 68, 0, 3", "SAP 4, 0, 4", "STAP 4, 0"] {
        bench.ok(line);
    }
    bench.module.set_power(false);
    bench.control("fault eeprom on");
    bench.module.set_power(true);
    let memory = bench.eeprom();
    assert_eq!((bench.ok("GGP 68, 0"), bench.ok("GAP 4, 0")), (0, 1000));
    bench.ok("MVP ABS, 0, 1000");
    bench.run(SECOND);
    assert_eq!(bench.rotor(), 1000);
    bench.refused("SGP 68, 0, 9", EEPROM_LOCKED);
    bench.control("fault eeprom off");
    bench.refused("SGP 68, 0, 9", EEPROM_LOCKED);
    assert!(bench.eeprom() == memory);
    assert_eq!(bench.ok("255, 0, 0, 1234"), 1234);
    bench.run(SECOND / 5);
    assert_eq!(bench.ok("GGP 68, 0"), 3);
    assert_eq!(bench.ok("GAP 4, 0"), 4);
    bench.ok("SGP 68, 0, 9");
    bench.power_cycle();
    assert_eq!(bench.ok("GGP 68, 0"), 9);
}

/// A factory reset without an EEPROM: nothing is erased; the module restarts with what is there.
#[test]
fn a_factory_reset_that_cannot_be() {
    let mut bench = Bench::new();
    bench.ok("SGP 68, 0, 5");
    let memory = bench.eeprom();
    bench.control("fault eeprom on");
    assert_eq!(bench.exchange(Source::Usb, telegram("137, 0, 0, 1234")), None);
    bench.control("fault eeprom off");
    assert!(bench.eeprom() == memory);
    bench.power_cycle();
    assert_eq!(bench.ok("GGP 68, 0"), 5);
}

/// An EEPROM that does not answer at the start: even a value that it may well hold already is not stored.
#[test]
fn nothing_is_stored_where_nothing_could_be_read() {
    let mut bench = Bench::new();
    bench.ok("SAP 4, 0, 1500");
    bench.ok("STAP 4, 0");
    bench.control("fault eeprom on");
    bench.power_cycle();
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
    for line in ["STAP 4, 0", "SGP 66, 0, 1", "SGP 66, 0, 7", "STGP 0, 2", "SCO 0, 255, 0"] {
        assert_eq!(bench.ask(line).0, EEPROM_LOCKED, "{line}");
    }
    // Nor does it when it answers again, before a restart has read it.
    bench.control("fault eeprom off");
    assert_eq!(bench.ask("STAP 4, 0").0, EEPROM_LOCKED);
    bench.power_cycle();
    assert_eq!(bench.ok("GAP 4, 0"), 1500);
    bench.ok("STAP 4, 0");
}

/// Another firmware's data is left alone until something is to be stored.
#[test]
fn foreign_contents_of_the_eeprom() {
    let mut random = Random(7);
    let foreign: Vec<u8> = (0..16_384).map(|_| random.below(256) as u8).collect();
    let mut bench = Bench::with_eeprom(&foreign);
    assert!(!bench.module.take_log().is_empty(), "a person is told");
    for table in [AXIS, GLOBAL, INTERRUPT] {
        for row in table.stored() {
            assert_eq!(Some(table.value(&mut bench, row)), row.default(), "{}", row.name);
        }
    }
    bench.ok("SAP 4, 0, 5");
    bench.ok("ROR 0, 100");
    bench.power_cycle();
    assert!(bench.eeprom() == foreign);
    // The first store takes what it needs of the settings' last 2048 bytes; the rest is the program's.
    bench.ok("SGP 68, 0, 5");
    bench.power_cycle();
    assert_eq!((bench.ok("GGP 68, 0"), bench.ok("GAP 4, 0"), bench.ok("GGP 66, 0")), (5, 1000, 1));
    assert!(bench.eeprom()[..14_336] == foreign[..14_336]);
}

/// An EEPROM that comes from another product: its settings and its program are foreign, and are left alone.
#[test]
fn the_eeprom_of_another_product() {
    let mut donor = Bench::new();
    for line in ["SGP 66, 0, 7", "SAP 4, 0, 5", "STAP 4, 0", "SGP 77, 0, 1", "SGP 84, 0, 1", "SCO 1, 0, 99"] {
        donor.ok(line);
    }
    donor.ok("132, 0, 0, 0");
    for line in ["SAP 6, 0, 1", "STOP"] {
        donor.ask(line);
    }
    donor.ok("133, 0, 0, 0");
    for product in [Product::Tmcm3110, Product::Tmcm6110] {
        // The settings are in the last pages of either EEPROM.
        let mut eeprom = donor.eeprom();
        eeprom.resize(32_768 - 2048, 0xFF);
        eeprom.extend(&donor.eeprom()[14_336..]);
        let mut bench = Bench::resumed_as(product, &eeprom, 1);
        assert!(!bench.module.take_log().is_empty(), "a person is told");
        for table in tables(product) {
            for row in table.stored() {
                assert_eq!(Some(table.value(&mut bench, row)), row.default(), "{}", row.name);
            }
        }
        assert_eq!((bench.ok("GCO 1, 0"), bench.ok("GGP 128, 0"), bench.ok("GAP 6, 0")), (0, 0, 128));
        bench.ok("MVP ABS, 0, 1000");
        bench.run(MILLISECOND);
        bench.power_cycle();
        assert!(bench.eeprom() == eeprom, "{product:?} has written to it");
    }
}

/// A page of another firmware that happens to look erased, all zero or all alike.
#[test]
fn uniform_contents_of_the_eeprom() {
    for byte in [0x00, 0x55, 0xAA, 0xFE, 0xFF] {
        let mut bench = Bench::with_eeprom(&[byte; 16_384]);
        let settings = (AXIS.settings(&mut bench), GLOBAL.settings(&mut bench));
        let mut fresh = Bench::new();
        assert!(settings == (AXIS.settings(&mut fresh), GLOBAL.settings(&mut fresh)), "all {byte:02X}");
    }
}
