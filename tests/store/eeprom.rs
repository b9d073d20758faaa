//! An EEPROM that keeps other bytes than it was given, that is silent, or that holds another firmware's data while that
//! gives way to ours. Other tests are about numbers in its pages that have come to their end.

use crate::pages::{PAGE, SETTINGS, seal};
use common::program::STORED;
use common::{Bench, EEPROM_LOCKED, NOT_AVAILABLE, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Received};
use tmcm::tmcl::{Command, text};
use tmcm_sim::VirtualModule;

/// Copies of pages of settings.
const COPIES: u32 = 32;
/// All that is foreign is ours by then: 32 pages of 5 ms, each of them waited for in steps of a millisecond.
const FORMATTED: Nanos = 250 * MILLISECOND;

/// Waits for the reply, in steps between which something may be done to the module.
fn reply(bench: &mut Bench, step: Nanos, mut between: impl FnMut(&mut Bench)) -> Received {
    for _ in 0..SECOND / step {
        bench.run(step);
        between(bench);
        if let Some(sent) = bench.module.sent() {
            return binary::decode_reply(&sent.telegram().unwrap()).unwrap();
        }
    }
    panic!("no reply");
}

/// Carries a command out while the EEPROM acknowledges what it is given and keeps one bit of each page otherwise; its
/// status.
fn on_worn_cells(bench: &mut Bench, line: &str) -> u8 {
    bench.post(Source::Usb, line);
    let mut before = bench.eeprom();
    let worn = |bench: &mut Bench| {
        let mut now = bench.eeprom();
        if let Some(changed) = now.iter().zip(&before).position(|(now, before)| now != before) {
            now[changed] ^= 0x10;
            bench.module.board().borrow_mut().at25_mut().load(&now);
        }
        before = now;
    };
    reply(bench, 50 * MICROSECOND, worn).status
}

/// An EEPROM full of another firmware's data.
fn foreign() -> Vec<u8> {
    (0..16_384_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}

/// Returns what a person is told when a module starts on the contents of this one's EEPROM.
fn told(bench: &Bench) -> Vec<String> {
    Bench::with_eeprom(&bench.eeprom()).module.take_log()
}

/// Puts a page of settings, unless it is empty, into the epoch that so many factory resets have begun.
fn set_epoch(page: &mut [u8], epoch: u16) {
    if page.iter().all(|byte| *byte == 0xFF) {
        return;
    }
    page[..2].copy_from_slice(&epoch.to_be_bytes());
    seal(page);
}

// ---- what the part does with what it is given

/// Bytes that have been written are read back: a reply never tells of something as stored that is not in there.
#[test]
fn other_bytes_than_were_given_are_noticed() {
    for (before, store, look, old) in [
        ("SAP 4, 0, 77", "STAP 4, 0", "GAP 4, 0", 1000),
        ("SGP 1, 2, 77", "STGP 1, 2", "GGP 1, 2", 0),
        ("GAP 4, 0", "SGP 68, 0, 77", "GGP 68, 0", 0),
        ("SGP 84, 0, 1", "SCO 1, 0, 77", "GCO 1, 0", 0),
    ] {
        let mut bench = Bench::new();
        bench.ok(before);
        assert_eq!(on_worn_cells(&mut bench, store), EEPROM_LOCKED, "{store}");
        assert_eq!(Bench::with_eeprom(&bench.eeprom()).ok(look), old, "{store}");
        // On cells that are good it is stored.
        bench.ok(store);
        assert_eq!(Bench::with_eeprom(&bench.eeprom()).ok(look), 77, "{store}");
    }
}

/// A program is only whole when all of its pages are what they should be.
#[test]
fn other_bytes_of_a_program_are_noticed() {
    let mut bench = Bench::new();
    bench.ok("132");
    for line in ["SGP 1, 2, 77", "STOP"] {
        assert_eq!(bench.ask(line).0, STORED);
    }
    assert_eq!(on_worn_cells(&mut bench, "133"), EEPROM_LOCKED);
    bench.refused("129, 1", NOT_AVAILABLE);
    bench.download(0, &["SGP 1, 2, 78", "STOP"]);
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 78);
}

/// A part that takes no write is known at once, not only when nothing has come of a write that it never began.
#[test]
fn a_silent_part_is_not_waited_for() {
    let mut bench = Bench::new();
    bench.control("fault eeprom on");
    for n in 0..10 {
        // At another moment of the millisecond each time.
        bench.run(n * 100 * MICROSECOND);
        bench.post(Source::Usb, "SGP 68, 0, 5");
        let asked = bench.module.now();
        assert_eq!(reply(&mut bench, 100 * MICROSECOND, |_| {}).status, EEPROM_LOCKED);
        assert!(bench.module.now() - asked <= 2 * MILLISECOND, "{n}");
    }
    assert_eq!(bench.page_writes(), 0);
}

// ---- what was in it before

/// The numbers of the epochs that factory resets begin come to their end after 65 536 of them, and start anew.
#[test]
fn the_numbers_of_factory_resets_start_anew() {
    let mut bench = Bench::new();
    for line in ["SAP 4, 0, 5", "STAP 4, 0", "SGP 68, 0, 5", "SGP 1, 2, 5", "STGP 1, 2"] {
        bench.ok(line);
    }
    let mut eeprom = bench.eeprom();
    eeprom[SETTINGS..].chunks_exact_mut(PAGE).for_each(|page| set_epoch(page, 0xFFFF));
    let found = |bench: &mut Bench| ["GAP 4, 0", "GGP 68, 0", "GGP 1, 2"].map(|line| bench.ok(line));
    let mut bench = Bench::with_eeprom(&eeprom);
    assert_eq!((found(&mut bench), told(&bench)), ([5; 3], vec![]));
    bench.post(Source::Usb, "137, 0, 0, 1234");
    bench.run(FORMATTED);
    assert_eq!(found(&mut bench), [1000, 0, 0]);
    for value in [6, 7, 8] {
        bench.ok(&format!("SAP 4, 0, {value}"));
        bench.ok("STAP 4, 0");
        bench.power_cycle();
        assert_eq!(found(&mut bench), [value, 0, 0]);
    }
}

/// The first page tells how often there was a factory reset: however many there were, settings that are older do not
/// come back. Where that page is lost the newest of the others tells, and the first store repairs it.
#[test]
fn settings_from_before_a_factory_reset_do_not_come_back() {
    let mut bench = Bench::new();
    for line in ["SAP 4, 0, 5", "STAP 4, 0", "SGP 55, 2, 5", "STGP 55, 2"] {
        bench.ok(line);
    }
    bench.post(Source::Usb, "137, 0, 0, 1234");
    bench.run(FORMATTED);
    let after = bench.eeprom();
    for resets in [1, 2, 0x7FFF, 0x8000, 0x8001, 0xFFFE, 0xFFFF] {
        let mut eeprom = after.clone();
        eeprom[SETTINGS..][..2 * PAGE].chunks_exact_mut(PAGE).for_each(|page| set_epoch(page, resets));
        let mut bench = Bench::with_eeprom(&eeprom);
        assert_eq!((bench.ok("GAP 4, 0"), bench.variable(55)), (1000, 0), "{resets}");
        bench.ok("SGP 55, 2, 6");
        bench.ok("STGP 55, 2");
        bench.power_cycle();
        assert_eq!((bench.ok("GAP 4, 0"), bench.variable(55)), (1000, 6), "{resets}");
        // Without the first page it is not known what is old; but what is stored from now on is there.
        let mut eeprom = bench.eeprom();
        eeprom[SETTINGS..][..2 * PAGE].fill(0xFF);
        let mut bench = Bench::with_eeprom(&eeprom);
        for line in ["SAP 4, 0, 7", "STAP 4, 0", "SGP 55, 2, 7", "STGP 55, 2", "SAP 194, 0, 7", "STAP 194, 0"] {
            bench.ok(line);
        }
        bench.power_cycle();
        assert_eq!((bench.ok("GAP 4, 0"), bench.variable(55), bench.ok("GAP 194, 0")), (7, 7, 7), "{resets}");
    }
    // Three pages, none of which is the newest to all others.
    let mut bench = Bench::new();
    for line in ["SAP 4, 0, 5", "STAP 4, 0", "SAP 218, 0, 5", "STAP 218, 0", "SGP 55, 2, 5", "STGP 55, 2"] {
        bench.ok(line);
    }
    let mut eeprom = bench.eeprom();
    let used = eeprom[SETTINGS..].chunks_exact_mut(PAGE).filter(|page| page.iter().any(|byte| *byte != 0xFF));
    used.zip([0, 0x5555, 0xAAAA]).for_each(|(page, epoch)| set_epoch(page, epoch));
    for store in [["SAP 4, 0, 6", "STAP 4, 0"], ["SAP 218, 0, 6", "STAP 218, 0"], ["SGP 55, 2, 6", "STGP 55, 2"]] {
        let mut bench = Bench::with_eeprom(&eeprom);
        let mut found = |lines: [&str; 2]| {
            for line in lines {
                bench.ok(line);
            }
            bench.power_cycle();
            [bench.ok("GAP 4, 0"), bench.ok("GAP 218, 0"), bench.variable(55)]
        };
        let once = found(store);
        assert!(once.contains(&6), "{store:?}: {once:?}");
        assert_eq!(found(["GAP 1, 0", "GAP 1, 0"]), once, "{store:?}");
    }
}

/// A page of which a power cut has damaged one copy is ours all the same: the next store writes what it stores, and
/// nothing to make that page ours.
#[test]
fn a_page_with_one_good_copy_is_no_stranger() {
    for damaged in [0, 1] {
        let mut bench = Bench::new();
        for line in ["SAP 4, 0, 5", "STAP 4, 0", "SAP 4, 0, 6", "STAP 4, 0"] {
            bench.ok(line);
        }
        let mut eeprom = bench.eeprom();
        let used = |page: &usize| eeprom[page * PAGE..][..PAGE].iter().any(|byte| *byte != 0xFF);
        let copies: Vec<usize> = (SETTINGS / PAGE..256).filter(used).collect();
        assert_eq!(copies.len(), 2);
        eeprom[copies[damaged] * PAGE + 20] ^= 1;
        let mut bench = Bench::with_eeprom(&eeprom);
        bench.ok("SGP 1, 2, 7");
        bench.ok("STGP 1, 2");
        assert_eq!(bench.page_writes(), 1);
        bench.power_cycle();
        assert_eq!((bench.variable(1), bench.ok("GAP 4, 0")), (7, [5, 6][damaged]));
    }
}

/// A write that fails while foreign pages are made ours fails the command that has begun it. Nothing of what the
/// command was to store is in force. The next command that stores goes on.
#[test]
fn a_write_fails_while_foreign_pages_are_made_ours() {
    let mut failed = 0;
    for moment in (0..FORMATTED / MILLISECOND).step_by(5) {
        let mut bench = Bench::with_eeprom(&foreign());
        bench.post(Source::Usb, "SGP 68, 0, 5");
        bench.run(moment * MILLISECOND);
        bench.control("fault eeprom on");
        let status = reply(&mut bench, MILLISECOND, |_| {}).status;
        assert!([OK, EEPROM_LOCKED].contains(&status), "after {moment} ms: {status}");
        failed += u32::from(status == EEPROM_LOCKED);
        let kept = if status == OK { 5 } else { 0 };
        assert_eq!(bench.ok("GGP 68, 0"), kept, "after {moment} ms");
        bench.control("fault eeprom off");
        let writes = bench.page_writes();
        bench.run(50 * MILLISECOND);
        assert_eq!(bench.page_writes(), writes, "after {moment} ms: nobody waits for more");
        bench.ok("SGP 75, 0, 6");
        assert_eq!(told(&bench), [""; 0], "after {moment} ms");
        bench.power_cycle();
        assert_eq!((bench.ok("GGP 75, 0"), bench.ok("GGP 68, 0")), (6, kept), "after {moment} ms");
        assert!(bench.eeprom()[..SETTINGS] == foreign()[..SETTINGS], "the program is not touched");
    }
    assert!(failed > 20, "{failed}");
}

/// A factory reset makes foreign pages ours like any other command that stores, and also when it comes over
/// another link while such a command is at it.
#[test]
fn a_factory_reset_while_foreign_pages_are_made_ours() {
    for moment in (0..FORMATTED / MILLISECOND).step_by(7) {
        let mut bench = Bench::with_eeprom(&foreign());
        if moment > 0 {
            bench.post(Source::Usb, "SGP 68, 0, 5");
            bench.run(moment * MILLISECOND);
        }
        bench.post(Source::Rs485, "137, 0, 0, 1234");
        bench.run(2 * FORMATTED);
        while bench.module.sent().is_some() {}
        assert_eq!((bench.ok("GGP 68, 0"), bench.ok("GAP 4, 0")), (0, 1000), "after {moment} ms");
        assert_eq!(told(&bench), [""; 0], "after {moment} ms");
        bench.ok("SGP 68, 0, 6");
        bench.power_cycle();
        assert_eq!((bench.ok("GGP 68, 0"), bench.ok("GAP 4, 0")), (6, 1000), "after {moment} ms");
    }
    let mut bench = Bench::with_eeprom(&foreign());
    bench.post(Source::Usb, "137, 0, 0, 1234");
    bench.run(FORMATTED);
    assert_eq!(bench.page_writes(), COPIES, "each once");
}

/// Erasing a program that was protected against being read fails half way. What is left of it gives way to no download:
/// it is erased first, by the same command again or by a restart.
#[test]
fn an_erasure_that_fails_is_ended_before_a_download_begins() {
    let mut failed = 0;
    for moment in 0..60 {
        let mut bench = Bench::with_program(&["SGP 1, 2, 1"; 30]);
        bench.ok("SGP 81, 0, 1");
        bench.post(Source::Usb, "SGP 81, 0, 0");
        bench.run(moment * MILLISECOND);
        bench.control("fault eeprom on");
        let status = reply(&mut bench, MILLISECOND, |_| {}).status;
        bench.control("fault eeprom off");
        // The intent may be recorded or not; nothing may run, or be seen, where it is.
        let protected = bench.ok("GGP 81, 0");
        assert_eq!(protected == 0, status == OK, "after {moment} ms");
        let runs = bench.ask("129, 1").0 == OK;
        bench.ok("128");
        let taken = bench.ask("132").0;
        assert_eq!(taken, if runs { OK } else { NOT_AVAILABLE }, "after {moment} ms");
        if taken == OK {
            continue;
        }
        failed += 1;
        assert_eq!(bench.memory(0), Command::default());
        if moment % 2 == 0 {
            bench.ok("SGP 81, 0, 0");
        } else {
            bench.power_cycle();
            bench.run(SECOND);
        }
        assert_eq!((bench.ok("GGP 81, 0"), bench.memory(0)), (0, Command::default()), "after {moment} ms");
        bench.download(0, &["SGP 2, 2, 2", "STOP"]);
        bench.run_to_end(0);
        assert_eq!((bench.variable(1), bench.variable(2)), (0, 2), "after {moment} ms");
    }
    assert!(failed > 5, "{failed}");
}

/// A setting that another link cannot store is no end of a download: what comes is not suddenly carried out, and the
/// program is whole when the part answers again.
#[test]
fn a_download_outlives_a_setting_that_cannot_be_stored() {
    let mut bench = Bench::new();
    bench.ok("132");
    assert_eq!(bench.ask("SGP 1, 2, 7").0, STORED);
    bench.control("fault eeprom on");
    assert_eq!(bench.ask_beside("SGP 68, 0, 60000"), EEPROM_LOCKED);
    assert_eq!(bench.ask("ROR 0, 500").0, STORED);
    bench.control("fault eeprom off");
    assert_eq!(bench.ask("STOP").0, STORED);
    assert_eq!((bench.speed(), bench.ok_beside("GGP 129, 0")), (0, 1));
    bench.ok("133");
    bench.power_cycle();
    assert_eq!(bench.memory(1), text::parse("ROR 0, 500").unwrap());
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 7);
}
