//! Input that must not bring the module down: broken telegrams, noise, a motion bus that is stuck, and telegrams made
//! of random numbers.

use std::panic::{AssertUnwindSafe, catch_unwind};
use tmcm_sim::{Product, VirtualModule};

use common::bombardment::{ask, assert_sane, bombard};
use common::random::Random;
use common::{Bench, NOT_AVAILABLE, OK, WRONG_CHECKSUM, random_inputs, telegram};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Framer, Telegram};
use tmcm::tmcl::text;
use tmcm::units::Micros;

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
    /// All bytes that were put on the line.
    bytes: Vec<u8>,
}

impl Wire {
    /// A byte at 9600 baud.
    const BYTE: Nanos = 1042 * MICROSECOND;

    fn new() -> Self {
        Wire { bench: Bench::new(), framer: Framer::new(), bytes: Vec::new() }
    }

    /// Puts bytes on the line one after the other.
    fn put(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.bench.run(Self::BYTE);
            let now = Micros(self.bench.module.now() / MICROSECOND);
            self.bytes.push(*byte);
            if self.framer.push(*byte, now) {
                self.bench.module.receive(Source::Rs485, *self.bytes.last_chunk().unwrap());
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

/// A telegram right behind another one needs no silence in between.
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
        bench.post(Source::Rs485, line);
    }
    let replies: Vec<_> = bench.listen(SECOND).iter().map(|reply| (reply.opcode, reply.status, reply.value)).collect();
    assert_eq!(
        replies,
        [(9, OK, 1), (10, OK, 1), (7, OK, 0), (5, OK, 3), (9, OK, 0), (137, 4, 1), (10, OK, 0)],
        "one reply each"
    );
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
    // What the driver has told last is known, what is for the motion controller or asks it is refused.
    for line in ["GAP 206, 0", "GAP 208, 0"] {
        assert_eq!(bench.ask(line).0, OK, "{line}");
    }
    for line in ["SAP 4, 0, 900", "GAP 1, 0", "GAP 3, 0", "MVP ABS, 0, 100", "MST 0", "ROL 0, 1"] {
        bench.refused(line, NOT_AVAILABLE);
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
    bench.refused("ROR 0, 100", NOT_AVAILABLE);
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
}

// ---- random telegrams

#[test]
fn random_telegrams() {
    const SEEDS: u64 = 8;
    const ROUND: u64 = 300;
    for product in Product::ALL {
        for seed in 1..=SEEDS {
            let mut bench = Bench::of_in_world(product, "[stage]\nleft = -5000\nright = 5000\n");
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
            assert!(run.is_ok(), "{product:?}, seed {seed}");
        }
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
        // This is answered only if replies were not suppressed already.
        ask(&mut bench, "SGP 255, 0, 0");
        assert_eq!(ask(&mut bench, "SGP 67, 0, 0"), Some(0), "no start in ASCII mode");
        bench.power_cycle();
        assert_sane(&mut bench);
    }
}
