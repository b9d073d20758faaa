//! The supply fails at every byte that the EEPROM receives, and all through its write cycles, during a script
//! of storing commands. After the restart every setting has the old or the new value: the new one if the
//! command was answered, and nothing else has changed.

use common::{Bench, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use std::ops::Range;
use tmcm::module::Source;
use tmcm::param::{COORDINATES, STORED_USER_VARIABLES};
use tmcm::tmcl::{binary, text};
use tmcm_sim::{Product, VirtualModule};

/// Changes that are stored: the lines that make a change, the last of which stores it, and the setting that is changed.
type Script = Vec<(Vec<String>, String)>;

/// The script for a product: its first axis and its last have a part in it. Where no axis parameter is stored,
/// coordinates take their place.
fn script(product: Product) -> Script {
    let spec = product.spec();
    let last = spec.axes - 1;
    let highest = spec.axis.rows.iter().rfind(|p| p.row.stored()).map(|p| p.row.number);
    let last_global = spec.global.rows.iter().rfind(|p| p.row.stored()).unwrap().row.number;
    let step = |lines: &[String], setting: String| (lines.to_vec(), setting);
    let axis = |number: u8, axis: u8, value: i32| {
        let lines = [format!("SAP {number}, {axis}, {value}"), format!("STAP {number}, {axis}")];
        step(&lines, format!("GAP {number}, {axis}"))
    };
    let global = |number: u8, value: i32| step(&[format!("SGP {number}, 0, {value}")], format!("GGP {number}, 0"));
    let variable = |number: u8, value: i32| {
        let lines = [format!("SGP {number}, 2, {value}"), format!("STGP {number}, 2")];
        step(&lines, format!("GGP {number}, 2"))
    };
    let coordinate = |number: u8, axis: u8, value: i32| {
        step(&[format!("SCO {number}, {axis}, {value}")], format!("GCO {number}, {axis}"))
    };
    let first = |value: i32| if highest.is_some() { axis(4, 0, value) } else { coordinate(2, 0, value) };
    vec![
        first(1234),
        highest.map_or_else(|| coordinate(19, last, 5), |highest| axis(highest, last, 1)),
        global(76, 9),
        variable(3, -3),
        variable(55, 77),
        coordinate(1, 0, 111),
        coordinate(20, last, -222),
        first(1235),
        first(1236),
        global(last_global, 1),
    ]
}

/// Every setting that is restored at start-up.
pub(crate) fn settings(product: Product) -> Vec<String> {
    let spec = product.spec();
    let axes = |axis: u8| {
        let parameters = spec.axis.rows.iter().filter(|p| p.row.stored());
        let parameters = parameters.map(move |p| format!("GAP {}, {axis}", p.row.number));
        parameters.chain((1..COORDINATES).map(move |n| format!("GCO {n}, {axis}")))
    };
    let global = spec.global.rows.iter().filter(|p| p.row.stored());
    let global = global.map(|p| format!("GGP {}, 0", p.row.number));
    let variables = (0..STORED_USER_VARIABLES).map(|n| format!("GGP {n}, 2"));
    (0..spec.axes).flat_map(axes).chain(global).chain(variables).collect()
}

/// Sends a line over RS485 and waits for the answer; `None` if the power goes before that, at `cut` at the
/// latest.
fn send_until(bench: &mut Bench, line: &str, cut: Nanos) -> Option<i32> {
    bench.post(Source::Rs485, line);
    let end = bench.module.now() + 100 * MILLISECOND;
    while bench.module.now() < end {
        bench.run(100 * MICROSECOND);
        if bench.module.now() >= cut || !bench.module.board().borrow().is_powered() {
            return None;
        }
        if let Some(sent) = bench.module.sent() {
            let reply = binary::decode_reply(&sent.telegram().unwrap()).unwrap();
            assert_eq!(reply.status, OK, "{line}");
            return Some(reply.value);
        }
    }
    panic!("no answer to {line}");
}

fn send(bench: &mut Bench, line: &str) -> Option<i32> {
    send_until(bench, line, Nanos::MAX)
}

pub(crate) fn read_all(bench: &mut Bench) -> Vec<i32> {
    let settings = settings(bench.product());
    settings.iter().map(|line| send(bench, line).unwrap_or_else(|| panic!("no answer to {line}"))).collect()
}

/// An EEPROM in which every setting that the script touches has been stored before, with another value.
fn prepared(product: Product) -> Vec<u8> {
    let mut bench = Bench::of(product);
    let last = product.spec().axes - 1;
    let lines = ["SGP 84, 0, 1", "SGP 3, 2, 5", "STGP 3, 2", "SCO 1, 0, 7"];
    let first = if product == Product::Tmcm3212 { vec!["SCO 2, 0, 500"] } else { vec!["SAP 4, 0, 500", "STAP 4, 0"] };
    let lines = lines.into_iter().chain(first).map(String::from);
    for line in lines.chain([format!("SCO 20, {last}, 8")]) {
        assert!(send(&mut bench, &line).is_some());
    }
    bench.eeprom()
}

/// A script on a product, and what it comes to.
struct Case {
    product: Product,
    script: Script,
    /// The EEPROM before it.
    eeprom: Vec<u8>,
    /// The settings before it, and after each step.
    before: Vec<i32>,
    after: Vec<Vec<i32>>,
    /// The bytes that the EEPROM receives, and the time that passes, meanwhile.
    bytes: Range<u64>,
    time: Range<Nanos>,
}

impl Case {
    fn of(product: Product) -> Self {
        let (script, eeprom, names) = (script(product), prepared(product), settings(product));
        let mut bench = Bench::resumed_as(product, &eeprom, 1);
        let before = read_all(&mut bench);
        let mut bench = Bench::resumed_as(product, &eeprom, 1);
        let bytes = |bench: &Bench| bench.module.board().borrow().eeprom_bytes();
        let (first, start) = (bytes(&bench), bench.module.now());
        let mut expected = before.clone();
        let mut after = vec![];
        for (lines, setting) in &script {
            assert!(lines.iter().all(|line| send(&mut bench, line).is_some()));
            let place = names.iter().position(|line| line == setting).unwrap();
            expected[place] = text::parse(&lines[0]).unwrap().value;
            after.push(expected.clone());
        }
        let (bytes, time) = (first..bytes(&bench), start..bench.module.now());
        // What the script stores is what the table says.
        bench.power_cycle();
        assert_eq!(&read_all(&mut bench), after.last().unwrap());
        Case { product, script, eeprom, before, after, bytes, time }
    }

    /// A module before the script.
    fn start(&self, seed: u32) -> Bench {
        Bench::resumed_as(self.product, &self.eeprom, seed)
    }

    /// Runs the script until the power goes, at `cut` at the latest, switches it on again and checks every setting.
    fn check(&self, mut bench: Bench, cut: Nanos, what: &str) {
        let mut answered = 0;
        for (lines, _) in &self.script {
            if !lines.iter().all(|line| send_until(&mut bench, line, cut).is_some()) {
                break;
            }
            answered += 1;
        }
        bench.module.set_power(false);
        bench.module.set_power(true);
        bench.run(2 * MILLISECOND);
        let got = read_all(&mut bench);
        let old = if answered == 0 { &self.before } else { &self.after[answered - 1] };
        let new = self.after.get(answered).unwrap_or(old);
        assert!(
            got == *old || got == *new,
            "{:?}, {what}, {answered} steps answered: {:?}",
            self.product,
            settings(self.product).iter().zip(&got).zip(old).filter(|((_, got), old)| got != old).collect::<Vec<_>>()
        );
    }
}

#[test]
fn at_every_byte_the_eeprom_receives() {
    for case in Product::ALL.map(Case::of) {
        let cuts = case.bytes.end - case.bytes.start;
        assert!(cuts > 1000, "{cuts}");
        for byte in case.bytes.clone() {
            let bench = case.start(1);
            bench.module.board().borrow_mut().cut_power_at_byte(byte + 1);
            case.check(bench, Nanos::MAX, &format!("cut after byte {}", byte - case.bytes.start));
        }
        println!("{}: {cuts} power cuts, one after each byte", case.product.name());
    }
}

#[test]
fn all_through_the_write_cycles() {
    for case in Product::ALL.map(Case::of) {
        let mut cuts = 0;
        // A torn page is a mix of old, new and erased bytes; each seed is another mix.
        for seed in 1..=4 {
            for at in case.time.clone().step_by(250_000) {
                cuts += 1;
                case.check(case.start(seed), at, &format!("cut at {at} ns, seed {seed}"));
            }
        }
        println!("{}: {cuts} power cuts, every 250 us", case.product.name());
    }
}

/// A single bit of each page in turn is wrong: the older copy or the default takes its place, somebody is told, and
/// nothing is written before the first store.
#[test]
fn a_flipped_bit_in_each_page() {
    let product = Product::Tmcm1140;
    let mut bench = Bench::resumed(&prepared(product), 1);
    for line in script(product).iter().flat_map(|(lines, _)| lines) {
        assert!(send(&mut bench, line).is_some());
    }
    let eeprom = bench.eeprom();
    let mut fresh = Bench::resumed(&vec![0xFF; eeprom.len()], 1);
    let (whole, defaults) = (read_all(&mut Bench::resumed(&eeprom, 1)), read_all(&mut fresh));
    let older = read_all(&mut Bench::resumed(&prepared(product), 1));
    let mut damaged_pages = 0;
    for page in (14_336..16_384).step_by(64) {
        let mut damaged = eeprom.clone();
        damaged[page + 17] ^= 4;
        let mut bench = Bench::resumed(&damaged, 1);
        let written = eeprom[page..page + 64].iter().any(|byte| *byte != 0xFF);
        assert_eq!(!bench.module.take_log().is_empty(), written || damaged[page + 17] != 0xFF, "page at {page}");
        damaged_pages += usize::from(written);
        let got = read_all(&mut bench);
        for (((line, got), whole), (default, older)) in
            settings(product).iter().zip(&got).zip(&whole).zip(defaults.iter().zip(&older))
        {
            // Parameter 4 was stored three times: the copy before the last has 1235.
            let before = *older == *got || (line == "GAP 4, 0" && *got == 1235);
            assert!(got == whole || got == default || before, "page at {page}: {line} is {got}");
        }
        bench.run(100 * MILLISECOND);
        assert!(bench.eeprom() == damaged, "page at {page}: written without being asked");
        assert!(send(&mut bench, "SGP 76, 0, 11").is_some() && bench.eeprom() != damaged);
    }
    assert!(damaged_pages > 5, "{damaged_pages}");
}
