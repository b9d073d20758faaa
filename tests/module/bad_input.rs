//! What must not bring the module down: broken telegrams, noise, chips that do not answer, memory full of
//! somebody else's data, and telegrams made of random numbers.

use std::panic::{AssertUnwindSafe, catch_unwind};
use tmcm_sim::VirtualModule;

use crate::common::bombardment::{ask, assert_sane, bombard};
use crate::common::random::Random;
use crate::common::table::{AXIS, GLOBAL, INTERRUPT};
use crate::common::{Bench, EEPROM_LOCKED, OK, WRONG_CHECKSUM, random_inputs};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Framer, Telegram};
use tmcm::tmcl::text;
use tmcm::units::Micros;

fn telegram(line: &str) -> Telegram {
    binary::encode_command(1, text::parse(line).unwrap())
}

/// The telegram with a checksum that is one off.
fn broken(line: &str) -> Telegram {
    let mut telegram = telegram(line);
    telegram[8] = telegram[8].wrapping_add(1);
    telegram
}

// ---- telegrams that are none

#[test]
fn a_wrong_checksum_is_answered_and_nothing_is_done() {
    for source in [Source::Usb, Source::Rs485] {
        let mut bench = Bench::new();
        for line in ["SAP 4, 0, 5", "ROR 0, 500", "SGP 66, 0, 9", "137, 0, 0, 1234", "255, 0, 0, 1234", "99, 0, 0, 0"] {
            let reply = bench.exchange(source, broken(line)).and_then(|sent| sent.telegram());
            assert_eq!(reply, Some([2, 1, WRONG_CHECKSUM, 0, 0, 0, 0, 0, 4]), "{line}");
        }
        assert_eq!((bench.ok("GAP 4, 0"), bench.ok("GAP 2, 0"), bench.ok("GGP 66, 0")), (1000, 0, 1));
        bench.run(SECOND);
        assert!(bench.ok("GGP 132, 0") > 1000, "it has not restarted");
        assert!(bench.eeprom().iter().all(|byte| *byte == 0xFF));
    }
}

/// On the bus the module is silent for others, broken telegrams included.
#[test]
fn telegrams_for_others_are_not_answered() {
    let mut bench = Bench::new();
    for address in (0..=u8::MAX).filter(|address| *address != 1) {
        let mut good = binary::encode_command(address, text::parse("SAP 4, 0, 5").unwrap());
        bench.module.receive(Source::Rs485, good);
        good[8] ^= 0x40;
        bench.module.receive(Source::Rs485, good);
        bench.run(20 * MILLISECOND);
        assert_eq!(bench.module.sent(), None, "address {address}");
    }
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
}

/// A serial line: bytes with the time they take, cut into telegrams as the links do it.
struct Wire {
    bench: Bench,
    framer: Framer,
}

impl Wire {
    /// A byte at 9600 baud.
    const BYTE: Nanos = 1042 * MICROSECOND;

    fn new() -> Self {
        Wire { bench: Bench::new(), framer: Framer::new() }
    }

    /// Puts bytes on the line one after the other.
    fn put(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.bench.run(Self::BYTE);
            let now = Micros(self.bench.module.now() / MICROSECOND);
            if let Some(telegram) = self.framer.push(*byte, now) {
                self.bench.module.receive(Source::Rs485, telegram);
            }
        }
    }

    /// Nothing for a while; gives the statuses of the replies that have come.
    fn silence(&mut self, span: Nanos) -> Vec<u8> {
        self.bench.listen(span).iter().map(|reply| reply.status).collect()
    }
}

#[test]
fn a_silence_brings_the_line_back_into_step() {
    for length in 1..9 {
        let mut wire = Wire::new();
        wire.put(&telegram("SAP 4, 0, 5")[..length]);
        assert!(wire.silence(6 * MILLISECOND).is_empty(), "{length} bytes are no telegram");
        wire.put(&telegram("SAP 5, 0, 6"));
        assert_eq!(wire.silence(20 * MILLISECOND), [OK], "after {length} bytes");
        assert_eq!((wire.bench.ok("GAP 4, 0"), wire.bench.ok("GAP 5, 0")), (1000, 6));
    }
}

/// A pause shorter than that is part of the telegram.
#[test]
fn a_slow_telegram_is_still_one() {
    let mut wire = Wire::new();
    for byte in telegram("SAP 4, 0, 5") {
        wire.put(&[byte]);
        wire.bench.run(3 * MILLISECOND);
    }
    assert_eq!(wire.silence(20 * MILLISECOND), [OK]);
}

/// Noise of any length: what looks like a telegram for this module is answered with status 1 at the most,
/// and after a silence all is well.
#[test]
fn noise_on_the_line() {
    let mut random = Random(1);
    let mut wire = Wire::new();
    for length in 1..200 {
        let noise: Vec<u8> = (0..length).map(|_| random.below(256) as u8).collect();
        wire.put(&noise);
        let statuses = wire.silence(30 * MILLISECOND);
        assert!(statuses.iter().all(|status| *status == WRONG_CHECKSUM), "{statuses:?} to {noise:02X?}");
        wire.put(&telegram("GAP 4, 0"));
        assert_eq!(wire.silence(30 * MILLISECOND), [OK], "after {length} bytes of noise");
    }
}

/// One telegram right behind the other needs no silence in between.
#[test]
fn telegrams_back_to_back() {
    let mut wire = Wire::new();
    wire.put(&[telegram("SAP 4, 0, 5"), telegram("SGP 77, 0, 1"), telegram("GAP 4, 0"), broken("MST 0")].concat());
    assert_eq!(wire.silence(50 * MILLISECOND), [OK, OK, OK, WRONG_CHECKSUM]);
}

/// A host that does not wait for replies: none is lost, and they come in order.
#[test]
fn requests_without_waiting_for_replies() {
    let mut bench = Bench::new();
    let lines = ["SGP 77, 0, 1", "GGP 77, 0", "STAP 4, 0", "SAP 4, 0, 3", "SGP 77, 0, 0", "137, 0, 0, 1", "GGP 77, 0"];
    for line in lines {
        bench.module.receive(Source::Rs485, telegram(line));
    }
    let replies: Vec<_> = bench.listen(SECOND).iter().map(|reply| (reply.opcode, reply.status, reply.value)).collect();
    assert_eq!(
        replies,
        [(9, OK, 1), (10, OK, 1), (7, OK, 0), (5, OK, 3), (9, OK, 0), (137, 4, 1), (10, OK, 0)],
        "one reply each"
    );
}

// ---- an EEPROM that does not answer

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
    bench.module.receive(Source::Usb, telegram("SCO 1, 0, 5"));
    bench.module.receive(Source::Rs485, telegram("SCO 1, 0, 6"));
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
        bench.module.receive(Source::Usb, telegram("SGP 68, 0, 2"));
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

// ---- a motion bus that is stuck

#[test]
fn a_stuck_motion_bus() {
    let mut bench = Bench::new();
    bench.ok("ROR 0, 500");
    bench.run(SECOND);
    bench.control("fault spi on");
    for line in ["GAP 4, 0", "GGP 66, 0", "SGP 68, 0, 3", "GIO 8, 1", "STAP 4, 0"] {
        assert_eq!(bench.ask(line).0, OK, "{line}");
    }
    for line in
        ["SAP 4, 0, 900", "GAP 1, 0", "GAP 3, 0", "GAP 206, 0", "GAP 208, 0", "MVP ABS, 0, 100", "MST 0", "ROL 0, 1"]
    {
        // Answered, with whatever status; the module does not hang.
        bench.ask(line);
    }
    bench.run(SECOND);
    bench.control("fault spi off");
    bench.ok("MST 0");
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 3, 0"), 0);
    // Started on a stuck bus it answers, too.
    bench.module.set_power(false);
    bench.control("fault spi on");
    bench.module.set_power(true);
    assert_eq!(bench.ok("GGP 68, 0"), 3);
    bench.ask("ROR 0, 100");
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
}

// ---- random telegrams

#[test]
fn random_telegrams() {
    const SEEDS: u64 = 8;
    const ROUND: u64 = 300;
    for seed in 1..=SEEDS {
        let mut bench = Bench::in_world("[stage]\nleft = -5000\nright = 5000\n");
        let mut random = Random(seed * 0x9E37_79B9);
        let run = catch_unwind(AssertUnwindSafe(|| {
            let mut left = random_inputs(12_000).div_ceil(SEEDS);
            while left > 0 {
                let round = left.min(ROUND);
                bombard(&mut bench, &mut random, round as usize);
                assert_sane(&mut bench);
                left -= round;
            }
        }));
        assert!(run.is_ok(), "seed {seed}");
    }
}

/// The same with chips failing and coming back at random.
#[test]
fn random_telegrams_on_failing_hardware() {
    for seed in 1..=4 {
        let mut bench = Bench::new();
        let mut random = Random(seed * 0x51ED_270B);
        for _ in 0..20 {
            let fault = random.pick(&["eeprom", "spi", "short-a", "open-b", "overtemperature", "encoder"]);
            bench.control(&format!("fault {fault} {}", random.pick(&["on", "off"])));
            bench.control(random.pick(&["supply 24", "supply 7", "load 1", "load 0", "press left", "release left"]));
            bombard(&mut bench, &mut random, 50);
        }
        for fault in ["eeprom", "spi", "short-a", "open-b", "overtemperature", "encoder"] {
            bench.control(&format!("fault {fault} off"));
        }
        bench.control("supply 24");
        bench.control("load 0");
        bench.control("release left");
        // No start in ASCII mode.
        ask(&mut bench, "SGP 67, 0, 0");
        bench.power_cycle();
        assert_sane(&mut bench);
    }
}
