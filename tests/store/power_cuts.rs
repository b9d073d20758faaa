//! The supply fails at every byte that the EEPROM receives, and all through its write cycles, during a script
//! of storing commands. After the restart every setting has the old or the new value: the new one if the
//! command was answered, and nothing else has changed.

use crate::common::{Bench, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use tmcm::module::Source;
use tmcm::module::TMCM_1140;
use tmcm::param::{COORDINATES, STORED_USER_VARIABLES};
use tmcm::tmcl::{binary, text};
use tmcm_sim::VirtualModule;

/// What is stored by whom: the lines that make a change, the last of which stores it, and the settings it
/// changes.
const SCRIPT: &[(&[&str], &[&str])] = &[
    (&["SAP 4, 0, 1234", "STAP 4, 0"], &["GAP 4, 0"]),
    (&["SAP 218, 0, 99", "STAP 218, 0"], &["GAP 218, 0"]),
    (&["SGP 76, 0, 9"], &["GGP 76, 0"]),
    (&["SGP 3, 2, -3", "STGP 3, 2"], &["GGP 3, 2"]),
    (&["SGP 55, 2, 77", "STGP 55, 2"], &["GGP 55, 2"]),
    (&["SCO 1, 0, 111"], &["GCO 1, 0"]),
    (&["SCO 20, 0, -222"], &["GCO 20, 0"]),
    (&["SAP 4, 0, 1235", "STAP 4, 0"], &["GAP 4, 0"]),
    (&["SAP 4, 0, 1236", "STAP 4, 0"], &["GAP 4, 0"]),
    (&["SGP 90, 0, 1"], &["GGP 90, 0"]),
];

/// Every setting that is restored at start-up.
fn settings() -> Vec<String> {
    let axis = TMCM_1140.axis.rows.iter().filter(|p| p.row.stored()).map(|p| format!("GAP {}, 0", p.row.number));
    let global = TMCM_1140.global.rows.iter().filter(|p| p.row.stored());
    let global = global.map(|p| format!("GGP {}, 0", p.row.number));
    let variables = (0..STORED_USER_VARIABLES).map(|n| format!("GGP {n}, 2"));
    let coordinates = (1..COORDINATES).map(|n| format!("GCO {n}, 0"));
    axis.chain(global).chain(variables).chain(coordinates).collect()
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

fn read_all(bench: &mut Bench) -> Vec<i32> {
    settings().iter().map(|line| send(bench, line).unwrap_or_else(|| panic!("no answer to {line}"))).collect()
}

/// An EEPROM in which every setting that the script touches has been stored before, with another value.
fn prepared() -> Vec<u8> {
    let mut bench = Bench::new();
    for line in
        ["SGP 84, 0, 1", "SAP 4, 0, 500", "STAP 4, 0", "SGP 3, 2, 5", "STGP 3, 2", "SCO 1, 0, 7", "SCO 20, 0, 8"]
    {
        assert!(send(&mut bench, line).is_some());
    }
    bench.eeprom()
}

/// Runs the script until the power goes, at `cut` at the latest, switches it on again and checks every setting.
fn check(mut bench: Bench, cut: Nanos, before: &[i32], after: &[Vec<i32>], what: &str) {
    let mut answered = 0;
    for (lines, _) in SCRIPT {
        if !lines.iter().all(|line| send_until(&mut bench, line, cut).is_some()) {
            break;
        }
        answered += 1;
    }
    bench.module.set_power(false);
    bench.module.set_power(true);
    bench.run(2 * MILLISECOND);
    let got = read_all(&mut bench);
    let old = if answered == 0 { before } else { &after[answered - 1] };
    let new = after.get(answered).map_or(old, Vec::as_slice);
    assert!(
        got == old || got == new,
        "{what}, {answered} steps answered: {:?}",
        settings().iter().zip(&got).zip(old).filter(|((_, got), old)| got != old).collect::<Vec<_>>()
    );
}

/// The settings after each step, and how many bytes and how much time the script takes.
fn rehearse(eeprom: &[u8]) -> (Vec<i32>, Vec<Vec<i32>>, std::ops::Range<u64>, std::ops::Range<Nanos>) {
    let mut bench = Bench::resumed(eeprom, 1);
    let before = read_all(&mut bench);
    let mut bench = Bench::resumed(eeprom, 1);
    let bytes = |bench: &Bench| bench.module.board().borrow().eeprom_bytes();
    let (first, start) = (bytes(&bench), bench.module.now());
    let mut expected = before.clone();
    let mut after = vec![];
    for (lines, changed) in SCRIPT {
        assert!(lines.iter().all(|line| send(&mut bench, line).is_some()));
        for name in *changed {
            let place = settings().iter().position(|line| line == name).unwrap();
            expected[place] = text::parse(lines[0]).unwrap().value;
        }
        after.push(expected.clone());
    }
    let spent = first..bytes(&bench);
    let took = start..bench.module.now();
    // What the script stores is what the table says.
    bench.power_cycle();
    assert_eq!(&read_all(&mut bench), after.last().unwrap());
    (before, after, spent, took)
}

#[test]
fn at_every_byte_the_eeprom_receives() {
    let eeprom = prepared();
    let (before, after, bytes, _) = rehearse(&eeprom);
    let cuts = bytes.end - bytes.start;
    assert!(cuts > 1000, "{cuts}");
    for byte in bytes.clone() {
        let bench = Bench::resumed(&eeprom, 1);
        bench.module.board().borrow_mut().cut_power_at_byte(byte + 1);
        check(bench, Nanos::MAX, &before, &after, &format!("cut after byte {}", byte - bytes.start));
    }
    println!("{cuts} power cuts, one after each byte");
}

#[test]
fn all_through_the_write_cycles() {
    let eeprom = prepared();
    let (before, after, _, time) = rehearse(&eeprom);
    let mut cuts = 0;
    // A torn page is a mix of old, new and erased bytes; each seed is another mix.
    for seed in 1..=4 {
        for at in time.clone().step_by(250_000) {
            cuts += 1;
            check(Bench::resumed(&eeprom, seed), at, &before, &after, &format!("cut at {at} ns, seed {seed}"));
        }
    }
    println!("{cuts} power cuts, every 250 us");
}

/// One bit of each page in turn is wrong: the older copy or the default takes its place, somebody is told, and
/// nothing is written before the first store.
#[test]
fn a_flipped_bit_in_each_page() {
    let mut bench = Bench::resumed(&prepared(), 1);
    for (lines, _) in SCRIPT {
        for line in *lines {
            assert!(send(&mut bench, line).is_some());
        }
    }
    let eeprom = bench.eeprom();
    let mut fresh = Bench::resumed(&vec![0xFF; eeprom.len()], 1);
    let (whole, defaults) = (read_all(&mut Bench::resumed(&eeprom, 1)), read_all(&mut fresh));
    let older = read_all(&mut Bench::resumed(&prepared(), 1));
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
            settings().iter().zip(&got).zip(&whole).zip(defaults.iter().zip(&older))
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
