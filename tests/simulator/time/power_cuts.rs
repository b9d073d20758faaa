//! The power is cut at a given time while a parameter is stored: afterwards the old value is there or the new one.

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use tmcm::tmcl::binary::encode_command;
use tmcm::tmcl::{Command, Opcode};
use tmcm_sim::VirtualModule;

use super::rig::{HOST, Paused, replies};

const OLD: i32 = 321;
const NEW: i32 = 654;

/// A module with the old value stored, and the new one set.
fn prepared() -> Paused {
    let mut paused = Paused::new();
    paused.ok(&format!("SAP 4, 0, {OLD}"));
    paused.ok("STAP 4, 0");
    // The EEPROM has come to rest.
    paused.fleet.run(50 * MILLISECOND);
    paused.ok(&format!("SAP 4, 0, {NEW}"));
    paused
}

/// The value after the next start.
fn after_power_on(paused: &mut Paused) -> i32 {
    paused.control("power off");
    paused.fleet.run(10 * MILLISECOND);
    paused.control("power on");
    paused.fleet.run(10 * MILLISECOND);
    paused.ok("GAP 4, 0")
}

/// How long a STAP takes that is not disturbed.
fn duration() -> Nanos {
    let mut paused = prepared();
    let (bytes, took) = paused.exchange("STAP 4, 0");
    assert_eq!(replies(&bytes)[0].status, 100);
    assert_eq!(after_power_on(&mut paused), NEW);
    took
}

#[test]
fn at_a_hundred_places_of_a_store_the_old_or_the_new_value_is_found() {
    const PLACES: u64 = 100;
    let whole = duration();
    let (mut old, mut new, mut torn) = (0, 0, 0);
    for place in 0..PLACES {
        let mut paused = prepared();
        let delay = whole * place / PLACES;
        paused.at(delay, "power off");
        let before = paused.fleet.modules_mut()[0].board_mut().at25().contents().to_vec();
        let (bytes, took) = paused.exchange("STAP 4, 0");
        assert!(bytes.is_empty(), "{delay}: a reply comes before all is stored");
        assert_eq!(took, delay, "no time passes for a module without power");
        // A page that was being written is neither old nor new.
        let after = paused.fleet.modules_mut()[0].board_mut().at25().contents().to_vec();
        torn += u32::from(before != after);
        match after_power_on(&mut paused) {
            OLD => old += 1,
            NEW => new += 1,
            other => panic!("{delay}: {other} is found"),
        }
    }
    assert!(old > 10 && new > 0 && torn > 10, "{old} times the old value, {new} times the new one, {torn} pages torn");
}

#[test]
fn a_power_cut_after_the_reply_loses_nothing() {
    let whole = duration();
    for later in [0, 1, MICROSECOND, MILLISECOND / 2, MILLISECOND] {
        let mut paused = prepared();
        paused.at(whole + later, "power off");
        let (bytes, took) = paused.exchange("STAP 4, 0");
        assert_eq!((replies(&bytes)[0].status, took), (100, whole), "{later}");
        paused.fleet.run(later);
        assert!(!paused.control("state").unwrap().power);
        assert_eq!(after_power_on(&mut paused), NEW, "{later}");
    }
}

/// A reply that is on the wire when the power goes stays there, also if its host takes it later.
#[test]
fn a_reply_that_has_come_is_not_lost() {
    let mut paused = Paused::new();
    paused.at(MILLISECOND, "power off");
    paused.fleet.hear_usb(HOST, &encode_command(1, Command::new(Opcode::Gap as u8, 4, 0, 0)));
    paused.fleet.run(10 * MILLISECOND);
    let sent = paused.sent();
    assert_eq!((sent.len(), replies(&sent[0].bytes)[0].value), (1, 1000));
    let mut paused = Paused::new();
    paused.at(MILLISECOND - 1, "power off");
    paused.fleet.hear_usb(HOST, &encode_command(1, Command::new(Opcode::Gap as u8, 4, 0, 0)));
    paused.fleet.run(10 * MILLISECOND);
    assert!(paused.sent().is_empty());
}
