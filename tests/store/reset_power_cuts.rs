//! The supply fails while a module puts all its settings back, or makes the EEPROM of a sister its own. Whoever looks
//! after the next start finds all settings as they were, or all of them as they come from the factory: never some of
//! both.

use crate::power_cuts::{read_all, settings};
use common::{Bench, OK, telegram};
use hal_sim::clock::{MILLISECOND, Nanos};
use tmcm::module::Source;
use tmcm::param::{COORDINATES, STORED_USER_VARIABLES};
use tmcm_sim::{Product, VirtualModule};

/// Time after which all is written and the module is up again, whatever it was told.
const LATER: Nanos = 700 * MILLISECOND;
/// Products with EEPROMs of the same size.
const SISTERS: [(Product, Product); 4] = [
    (Product::Tmcm6110, Product::Tmcm3110),
    (Product::Tmcm3110, Product::Tmcm6110),
    (Product::Tmcm1140, Product::Tmcm1110),
    (Product::Tmcm1110, Product::Tmcm1140),
];
/// Command 137, which is not answered.
const RESET: &str = "137, 0, 0, 1234";

/// An EEPROM in which everything that a product stores has another value than its default.
fn all_stored(product: Product) -> Vec<u8> {
    /// Global parameters with which the module could not be asked as before, or does not keep what is stored.
    const LINKS: [u8; 10] = [64, 65, 66, 67, 68, 73, 75, 81, 82, 87];
    let mut bench = Bench::of(product);
    let spec = product.spec();
    let others = |(low, high): (i32, i32), default: i32| {
        let values = [default.saturating_add(1), default.saturating_sub(1), low, high];
        values.into_iter().filter(move |value| *value != default)
    };
    for axis in 0..spec.axes {
        for row in spec.axis.rows.iter().map(|p| p.row).filter(|row| row.stored()) {
            let set = |value| format!("SAP {}, {axis}, {value}", row.number);
            assert!(others(row.ranges[0], row.default).any(|value| bench.ask(&set(value)).0 == OK), "{row:?}");
            bench.ok(&format!("STAP {}, {axis}", row.number));
        }
        for number in 1..COORDINATES {
            bench.ok(&format!("SCO {number}, {axis}, {}", 9 + number));
        }
    }
    bench.ok("SCO 0, 255, 0");
    for row in spec.global.rows.iter().map(|p| p.row).filter(|row| row.stored() && !LINKS.contains(&row.number)) {
        let set = |value| format!("SGP {}, 0, {value}", row.number);
        assert!(others(row.ranges[0], row.default).any(|value| bench.ask(&set(value)).0 == OK), "{row:?}");
    }
    for number in 0..STORED_USER_VARIABLES {
        bench.ok(&format!("SGP {number}, 2, {}", 5 + number));
        bench.ok(&format!("STGP {number}, 2"));
    }
    bench.eeprom()
}

/// An EEPROM in which only a user variable has been stored, so that the first page of the settings is empty.
fn one_stored(product: Product) -> Vec<u8> {
    let mut bench = Bench::of(product);
    bench.ok("SGP 55, 2, 5");
    bench.ok("STGP 55, 2");
    bench.eeprom()
}

/// The settings that a product finds.
fn found(product: Product, eeprom: &[u8]) -> Vec<i32> {
    read_all(&mut Bench::resumed_as(product, eeprom, 1))
}

/// When the supply fails.
#[derive(Clone, Copy, Debug)]
enum Cut {
    /// After so many bytes that the EEPROM exchanges.
    Byte(u64),
    /// After so long a time.
    Time(Nanos),
}

impl Cut {
    /// Cuts all through what a product does with an EEPROM when it is told something: `bytes` and `times` many of each.
    fn all(product: Product, eeprom: &[u8], lines: &[&str], bytes: u64, times: u64) -> Vec<Self> {
        let mut bench = Bench::resumed_as(product, eeprom, 1);
        let state = |bench: &Bench| (bench.module.board().borrow().eeprom_bytes(), bench.page_writes());
        let (first, written) = state(&bench);
        tell(&mut bench, lines);
        // Up to the last page that is written: behind it there is only the reading of the next start.
        let (mut last, mut pages, mut span) = (first, written, 0);
        for time in (0..LATER).step_by(MILLISECOND as usize) {
            bench.run(MILLISECOND);
            let now = state(&bench);
            if now.1 > pages {
                (last, pages, span) = (now.0, now.1, time + 8 * MILLISECOND);
            }
        }
        assert!(pages > written, "{product:?}: {lines:?}");
        let bytes = (0..bytes).map(|n| Cut::Byte(1 + n * (last - first + 100) / bytes));
        bytes.chain((0..times).map(|n| Cut::Time(n * span / times))).collect()
    }

    /// Returns the bytes in the EEPROM after this cut. Each seed tears a page in another way.
    fn leaves(self, product: Product, eeprom: &[u8], lines: &[&str], seed: u32) -> Vec<u8> {
        let mut bench = Bench::resumed_as(product, eeprom, seed);
        if let Cut::Byte(byte) = self {
            let mut board = bench.module.board().borrow_mut();
            let before = board.eeprom_bytes();
            board.cut_power_at_byte(before + byte);
        }
        tell(&mut bench, lines);
        bench.run(if let Cut::Time(time) = self { time } else { LATER });
        bench.module.set_power(false);
        bench.eeprom()
    }
}

/// Sends lines, without the replies: the last one stores.
fn tell(bench: &mut Bench, lines: &[&str]) {
    let [before @ .., last] = lines else { return };
    for line in before {
        bench.exchange(Source::Usb, telegram(line));
    }
    bench.post(Source::Usb, last);
}

/// Counts what is found: the settings of before, or those of the factory.
struct Tally {
    product: Product,
    old: Vec<i32>,
    factory: Vec<i32>,
    seen: [usize; 2],
}

impl Tally {
    fn of(product: Product, eeprom: &[u8]) -> Self {
        let (old, factory) = (found(product, eeprom), read_all(&mut Bench::of(product)));
        assert_ne!(old, factory);
        Tally { product, old, factory, seen: [0; 2] }
    }

    fn check(&mut self, eeprom: &[u8], what: &str) {
        let got = found(self.product, eeprom);
        let Some(outcome) = [&self.old, &self.factory].iter().position(|whole| **whole == got) else {
            let names = settings(self.product);
            let shown = |whole: &[i32]| {
                let differ = names.iter().zip(whole.iter().zip(&got)).filter(|(_, (whole, got))| whole != got);
                differ.map(|(name, (_, got))| format!("{name} is {got}")).take(4).collect::<Vec<_>>().join(", ")
            };
            let (old, factory) = (shown(&self.old), shown(&self.factory));
            panic!("{:?}, {what}: not as before: {old}; not as from the factory: {factory}", self.product)
        };
        self.seen[outcome] += 1;
    }
}

#[test]
fn a_factory_reset_is_whole_or_has_not_begun() {
    for product in Product::ALL {
        for eeprom in [all_stored(product), one_stored(product)] {
            let mut tally = Tally::of(product, &eeprom);
            for (seed, cut) in (1..).zip(Cut::all(product, &eeprom, &[RESET], 50, 20)) {
                let left = cut.leaves(product, &eeprom, &[RESET], seed);
                tally.check(&left, &format!("{cut:?}"));
                // The supply fails once more, during the start or a second try.
                for second in [Cut::Time(u64::from(seed) % 20 * MILLISECOND), Cut::Byte(u64::from(seed) * 3)] {
                    tally.check(&second.leaves(product, &left, &[RESET], seed), &format!("{cut:?}, then {second:?}"));
                }
            }
            assert!(tally.seen.iter().all(|times| *times > 5), "{product:?}: {:?}", tally.seen);
        }
    }
}

/// Another magic number (64) than the default makes the next start put all settings back: also if the supply fails
/// meanwhile, and once more.
#[test]
fn settings_that_a_start_puts_back_are_those_of_the_factory() {
    let product = Product::Tmcm1110;
    let mut bench = Bench::resumed_as(product, &all_stored(product), 1);
    bench.ok("SGP 64, 0, 0");
    let (eeprom, factory) = (bench.eeprom(), read_all(&mut Bench::of(product)));
    let mut whole = 0;
    let cuts = (0..60).map(|n| Cut::Byte(1 + 2 * n)).chain((0..40).map(|n| Cut::Time(n * MILLISECOND / 4)));
    for (seed, cut) in (1..).zip(cuts) {
        let left = cut.leaves(product, &eeprom, &[], seed);
        assert_eq!(found(product, &left), factory, "{cut:?}");
        let second = Cut::Byte(u64::from(seed) * 3).leaves(product, &left, &[], seed);
        assert_eq!(found(product, &second), factory, "{cut:?}, and once more");
        // Where the number has been put back as well, nothing is written any more.
        let mut bench = Bench::resumed_as(product, &left, 1);
        bench.run(LATER);
        whole += u32::from(bench.eeprom() == left);
    }
    assert!((10..90).contains(&whole), "{whole} cuts came when all was written");
}

/// Two products with EEPROMs of the same size use one, the second after the first.
#[test]
fn a_sister_takes_an_eeprom_over_or_leaves_it() {
    for (first, second) in SISTERS {
        for eeprom in [all_stored(first), one_stored(first)] {
            let mut tally = Tally::of(first, &eeprom);
            for lines in [&["SAP 4, 0, 77", "STAP 4, 0"][..], &["SGP 76, 0, 9"], &[RESET]] {
                for (seed, cut) in (1..).zip(Cut::all(second, &eeprom, lines, 60, 25)) {
                    let left = cut.leaves(second, &eeprom, lines, seed);
                    tally.check(&left, &format!("{second:?}: {lines:?}: {cut:?}"));
                    if seed % 5 == 0 {
                        // It goes on with what it had begun, and is cut again.
                        let again = cut.leaves(second, &left, &["SGP 77, 0, 1"], seed);
                        tally.check(&again, &format!("{second:?}: {lines:?}: {cut:?}, twice"));
                    }
                }
                let mut bench = Bench::resumed_as(second, &eeprom, 1);
                tell(&mut bench, lines);
                bench.run(LATER);
                tally.check(&bench.eeprom(), "in the end");
                assert_eq!(found(first, &bench.eeprom()), tally.factory, "{second:?}: {lines:?}");
                assert!(bench.eeprom()[..14_336] == eeprom[..14_336], "programs are left alone");
            }
            assert!(tally.seen.iter().all(|times| *times > 3), "{first:?}: {:?}", tally.seen);
        }
    }
}

/// Values that the second product has found there stay its own: it has the defaults, or what it has stored.
#[test]
fn who_takes_an_eeprom_over_finds_what_it_has_stored() {
    for (first, second) in SISTERS {
        let eeprom = all_stored(first);
        let names = settings(second);
        let stored = names.iter().position(|name| name == "GAP 4, 0").unwrap();
        let factory = read_all(&mut Bench::of(second));
        let mut new = factory.clone();
        new[stored] = 77;
        let lines = ["SAP 4, 0, 77", "STAP 4, 0"];
        for (seed, cut) in (1..).zip(Cut::all(second, &eeprom, &lines, 50, 25)) {
            let got = found(second, &cut.leaves(second, &eeprom, &lines, seed));
            assert!(got == factory || got == new, "{second:?}: {cut:?}");
        }
        let mut bench = Bench::resumed_as(second, &eeprom, 1);
        lines.iter().for_each(|line| assert_eq!(bench.ask(line).0, OK));
        assert_eq!(found(second, &bench.eeprom()), new);
        // And the first one takes it back.
        let mut bench = Bench::resumed_as(first, &bench.eeprom(), 1);
        lines.iter().for_each(|line| assert_eq!(bench.ask(line).0, OK));
        assert_eq!(found(second, &bench.eeprom()), factory);
        bench.power_cycle();
        assert_eq!(bench.ok("GAP 4, 0"), 77);
    }
}

/// An EEPROM in which an earlier firmware of the sister has overwritten a part of the settings: a mixture, until the
/// sister stores something.
#[test]
fn a_mixture_ends_with_the_next_store_of_the_sister() {
    let mut eeprom = all_stored(Product::Tmcm6110);
    let sister = all_stored(Product::Tmcm3110);
    let own = 20 * 2 * 64;
    let start = eeprom.len() - own;
    eeprom[start..].copy_from_slice(&sister[start..]);
    let mut bench = Bench::resumed_as(Product::Tmcm3110, &eeprom, 1);
    let before = read_all(&mut bench);
    assert_eq!(before, found(Product::Tmcm3110, &sister));
    bench.ok("SGP 77, 0, 0");
    let writes = bench.page_writes();
    bench.ok("SGP 77, 0, 1");
    assert_eq!(bench.page_writes(), writes + 1, "it is cleared once");
    assert_eq!(found(Product::Tmcm3110, &bench.eeprom()), before);
    let factory = read_all(&mut Bench::of(Product::Tmcm6110));
    assert_eq!(found(Product::Tmcm6110, &bench.eeprom()), factory);
}
