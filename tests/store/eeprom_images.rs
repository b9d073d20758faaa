//! Whatever the EEPROM holds, the module starts, is answered for, stores, and finds what it has stored. The images are
//! ours with bits flipped, pages damaged, mixed up, of another firmware or of another version, and pure noise; how many
//! is said by the environment: `RANDOM_INPUTS=10000 cargo test --test store eeprom_images`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use tmcm_sim::VirtualModule;

use crate::pages::{FIRST_OF_SETTINGS, PAGE, PAGES, seal};
use common::bombardment::{ask, assert_sane, bombard};
use common::program::STORED;
use common::random::Random;
use common::{Bench, OK, random_inputs};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm_sim::client::Client;

/// Returns contents of an EEPROM that a user leaves behind, of whom nobody knows where he was when the power went. They
/// are settings, a program, one that is protected, a download and an erasure cut short, another firmware's data,
/// nothing.
fn left_behind() -> Vec<Vec<u8>> {
    let mut images = vec![vec![0xFF; PAGE * PAGES], vec![0; PAGE * PAGES]];
    let program = ["SGP 1, 2, 1", "ROR 0, 100", "WAIT TICKS, 0, 1", "MST 0", "JA 0"].repeat(20);
    let mut bench = Bench::with_program(&program);
    for line in ["SAP 4, 0, 500", "STAP 4, 0", "SAP 140, 0, 4", "STAP 140, 0", "SGP 7, 2, 77", "STGP 7, 2"] {
        bench.ok(line);
    }
    for line in ["SGP 84, 0, 1", "SCO 1, 0, 11", "SCO 20, 0, 20", "SGP 68, 0, 0", "SGP 66, 0, 3", "SGP 83, 0, 77"] {
        bench.ok(line);
    }
    images.push(bench.eeprom());
    bench.ok("SGP 77, 0, 1");
    images.push(bench.eeprom());
    for line in ["SGP 77, 0, 0", "SGP 81, 0, 3"] {
        bench.ok(line);
    }
    images.push(bench.eeprom());
    let mut erasing = Bench::with_eeprom(&bench.eeprom());
    erasing.module.hear(Source::Usb, Client::default(), &[1, 9, 81, 0, 0, 0, 0, 0, 91]);
    erasing.run(30 * MILLISECOND);
    images.push(erasing.eeprom());
    bench.ok("SGP 81, 0, 0");
    bench.ok("132");
    for _ in 0..30 {
        assert_eq!(bench.ask("SGP 2, 2, 2").0, STORED);
    }
    images.push(bench.eeprom());
    images
}

/// A page, of the settings as often as of the program.
fn page(random: &mut Random) -> usize {
    let first = if random.one_in(2) { FIRST_OF_SETTINGS } else { 0 };
    first + random.below((PAGES - first) as u64) as usize
}

/// Does something to an image that a write cut short, old age or another firmware does.
fn damage(random: &mut Random, image: &mut [u8]) {
    let number = page(random);
    let other = page(random);
    let copied = image[other * PAGE..][..PAGE].to_vec();
    let page = &mut image[number * PAGE..][..PAGE];
    let at = random.below(PAGE as u64) as usize;
    match random.below(8) {
        0 => page[at] ^= 1 << random.below(8),
        1 => random.fill(page),
        2 => page[at..].fill(random.pick(&[0x00, 0xFF, 0x55])),
        3 => page[..at].fill(random.pick(&[0x00, 0xFF, 0x55])),
        4 => page[at..].copy_from_slice(&copied[at..]),
        5 => page.copy_from_slice(&copied),
        6 => (0..=random.below(64))
            .for_each(|_| image[random.below((PAGE * PAGES) as u64) as usize] ^= 1 << random.below(8)),
        // A valid page with values that are none.
        _ => {
            let number = FIRST_OF_SETTINGS + random.below((PAGES - FIRST_OF_SETTINGS) as u64) as usize;
            let page = &mut image[number * PAGE..][..PAGE];
            page[3] = ((number - FIRST_OF_SETTINGS) / 2) as u8;
            for value in page[4..PAGE - 4].chunks_exact_mut(4) {
                match random.below(4) {
                    0 => random.fill(value),
                    1 => value.copy_from_slice(&(random.below(300) as i32).to_be_bytes()),
                    2 => value.copy_from_slice(&random.pick(&[-1, 0, 1, i32::MIN, i32::MAX]).to_be_bytes()),
                    _ => {}
                }
            }
            if random.one_in(4) {
                random.fill(&mut page[..3]);
            }
            seal(page);
        }
    }
}

/// An image that was left behind, and what may have been done to it.
fn image(random: &mut Random, left_behind: &[Vec<u8>]) -> Vec<u8> {
    let mut image = left_behind[random.below(left_behind.len() as u64) as usize].clone();
    match random.below(12) {
        0 => random.fill(&mut image),
        1 => random.fill(&mut image[FIRST_OF_SETTINGS * PAGE..]),
        2 => random.fill(&mut image[..FIRST_OF_SETTINGS * PAGE]),
        _ => (0..=random.below(6)).for_each(|_| damage(random, &mut image)),
    }
    image
}

/// Brings a module that may have started in ASCII mode, with a program that runs, with a heartbeat or without replies
/// to where a host can talk to it.
fn settle(bench: &mut Bench) {
    // An erasure that was cut short is ended at the start.
    bench.run(2 * SECOND);
    for letter in b'?'..=b'~' {
        bench.module.hear(Source::Usb, Client::default(), &[b'\r', letter, b'B', b'I', b'N', b'\r']);
        bench.run(2 * MILLISECOND);
        bench.module.silence(Source::Usb, Client::default());
        while bench.module.sent().is_some() {}
    }
    for line in ["SGP 255, 0, 0", "128", "SGP 67, 0, 0", "SGP 68, 0, 0", "SGP 82, 0, 0", "SGP 77, 0, 0", "SGP 75, 0, 0"]
    {
        ask(bench, line);
    }
    assert_eq!(ask(bench, "GGP 128, 0"), Some(0));
    // What is protected is erased now: that takes longer than anybody waits for the reply to a random telegram.
    ask(bench, "SGP 81, 0, 0");
    bench.run(2 * SECOND);
    while bench.module.sent().is_some() {}
    assert_eq!(ask(bench, "GGP 81, 0"), Some(0));
    // The other links leave ASCII mode, too.
    bench.power_cycle();
}

/// Asserts that what the module says it has stored is there after a restart, whatever else was in the EEPROM.
fn stores(bench: &mut Bench, random: &mut Random) {
    let value = random.below(2000) as i32 + 1;
    for line in [
        format!("SAP 4, 0, {value}"),
        "STAP 4, 0".into(),
        format!("SGP 55, 2, {value}"),
        "STGP 55, 2".into(),
        "SGP 85, 0, 0".into(),
        format!("SGP 70, 0, {value}"),
        "SGP 84, 0, 0".into(),
        format!("SCO 20, 0, {value}"),
        "SCO 20, 255, 0".into(),
        "SGP 81, 0, 0".into(),
    ] {
        assert_eq!(bench.ask(&line).0, OK, "{line}");
    }
    bench.download(2000, &[&format!("SGP 9, 2, {value}"), "STOP"]);
    for restart in 0..2 {
        bench.power_cycle();
        bench.ok("GCO 20, 255");
        let found = ["GAP 4, 0", "GGP 55, 2", "GGP 70, 0", "GCO 20, 0"].map(|line| bench.ok(line));
        assert_eq!(found, [value; 4], "restart {restart}");
        bench.run_to_end(2000);
        assert_eq!(bench.variable(9), value, "restart {restart}");
    }
}

#[test]
fn random_images() {
    let left_behind = left_behind();
    for seed in 1..=random_inputs(300) {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let image = image(&mut random, &left_behind);
        let run = catch_unwind(AssertUnwindSafe(|| {
            let mut bench = Bench::with_eeprom(&image);
            settle(&mut bench);
            bombard(&mut bench, &mut random, 10);
            // A program that starts by itself would move what the check moves.
            ask(&mut bench, "SGP 77, 0, 0");
            ask(&mut bench, "128");
            assert_sane(&mut bench);
            stores(&mut bench, &mut random);
        }));
        assert!(run.is_ok(), "seed {seed}");
    }
}
