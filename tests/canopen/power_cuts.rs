//! The supply fails at every byte that the EEPROM receives, and all through its write cycles, while the master saves
//! and restores. After the start each object has its old or its new value: the new one if the request was confirmed.

use crate::driving::SWITCH_ON_DISABLED;
use crate::rig::{Rig, expedited};
use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::fault::Fault;
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::binary::{decode_reply, encode_command};
use tmcm::tmcl::text;
use tmcm_sim::{NativeModule, VirtualModule};

/// A step of the master: objects that it writes, then the signature that makes them durable.
type Step = (&'static [(u16, u8, u32)], (u16, u8), &'static [u8; 4]);

const SCRIPT: [Step; 6] = [
    (&[(0x2003, 0, 11), (0x6083, 0, 500), (0x609A, 0, 700)], (0x1010, 4), b"save"),
    (&[(0x2705, 0, 5), (0x2704, 0, 500)], (0x2706, 1), b"save"),
    (
        &[
            (0x1800, 1, 0x8000_0181),
            (0x1A00, 0, 0),
            (0x1A00, 1, 0x6064_0020),
            (0x1A00, 2, 0x6041_0010),
            (0x1A00, 0, 2),
            (0x1800, 1, 0x181),
            (0x2003, 0, 12),
            (0x1017, 0, 100),
        ],
        (0x1010, 1),
        b"save",
    ),
    (&[], (0x1011, 4), b"load"),
    (&[(0x2003, 0, 13)], (0x1010, 4), b"save"),
    (&[], (0x1011, 1), b"load"),
];

/// Objects that are looked at after each start.
const WATCHED: [(u16, u8); 13] = [
    (0x2003, 0),
    (0x6083, 0),
    (0x609A, 0),
    (0x2705, 0),
    (0x2704, 0),
    (0x1800, 1),
    (0x1A00, 0),
    (0x1A00, 1),
    (0x1A00, 2),
    (0x1017, 0),
    (0x2000, 0),
    (0x1401, 2),
    (0x60FF, 0),
];

/// Carries out a step; `None` if the power goes before its confirmation, or the time of the cut has come.
fn carry_out(rig: &mut Rig, (objects, (index, sub), signature): &Step, cut: Nanos) -> Option<()> {
    let ask = |rig: &mut Rig, request| {
        let reply = rig.post(request).filter(|_| rig.board.borrow().now() < cut)?;
        assert_ne!(reply[0], 0x80, "{request:02X?}: {reply:02X?}");
        Some(reply)
    };
    for &(index, sub, value) in *objects {
        let [low, high] = index.to_le_bytes();
        let reply = ask(rig, [0x40, low, high, sub, 0, 0, 0, 0])?;
        let length = 4 - usize::from(reply[0] >> 2 & 3);
        ask(rig, expedited(index, sub, &value.to_le_bytes()[..length]))?;
    }
    ask(rig, expedited(*index, *sub, *signature)).map(|_| ())
}

/// Reads the values that a start with this EEPROM finds. There is no fault, whatever has become of a save.
fn found(eeprom: &[u8]) -> Vec<u32> {
    let mut rig = Rig::with_eeprom(eeprom, 1);
    rig.wait(3);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
    WATCHED.map(|(index, sub)| rig.read(index, sub)).to_vec()
}

/// The values after a start between the steps, before the first one at first; how many bytes the script takes, and how
/// long.
fn rehearse() -> (Vec<Vec<u32>>, std::ops::Range<u64>, std::ops::Range<Nanos>) {
    let mut rig = Rig::new();
    let state = |rig: &Rig| (rig.board.borrow().eeprom_bytes(), rig.board.borrow().now());
    let (first, start) = state(&rig);
    let mut expected = vec![found(&rig.eeprom())];
    for step in &SCRIPT {
        carry_out(&mut rig, step, Nanos::MAX).unwrap();
        expected.push(found(&rig.eeprom()));
    }
    // 2003h after each step.
    assert!(expected.iter().map(|values| values[0]).eq([128, 11, 11, 12, 128, 13, 128]), "{expected:X?}");
    let (last, end) = state(&rig);
    (expected, first..last, start..end)
}

/// Runs the script until the power goes, and checks what the next start finds.
fn check(mut rig: Rig, cut: Nanos, expected: &[Vec<u32>], what: &str) {
    let confirmed = SCRIPT.iter().take_while(|step| carry_out(&mut rig, step, cut).is_some()).count();
    if rig.is_powered() {
        rig.board.borrow_mut().power_off();
    }
    let got = found(&rig.eeprom());
    let old = &expected[confirmed];
    let new = expected.get(confirmed + 1).unwrap_or(old);
    assert!(
        got == *old || got == *new,
        "{what}, {confirmed} steps confirmed: {got:X?} is neither {old:X?} nor {new:X?}"
    );
}

#[test]
fn at_every_byte_the_eeprom_receives() {
    let (expected, bytes, _) = rehearse();
    assert!(bytes.end - bytes.start > 500, "{bytes:?}");
    for byte in bytes.clone() {
        let rig = Rig::new();
        rig.board.borrow_mut().cut_power_at_byte(byte + 1);
        check(rig, Nanos::MAX, &expected, &format!("cut after byte {}", byte - bytes.start));
    }
}

#[test]
fn all_through_the_write_cycles() {
    let (expected, _, time) = rehearse();
    // A torn page is a mix of old, new and erased bytes; each seed is another mix.
    for seed in 1..=4 {
        for at in time.clone().step_by(MILLISECOND as usize / 4) {
            let rig = Rig::with_eeprom(&[0xFF; 16_384], seed);
            check(rig, at, &expected, &format!("cut at {at} ns, seed {seed}"));
        }
    }
}

/// Objects of several pages, with other values than their defaults.
const CHANGED: Step = (
    &[(0x2003, 0, 11), (0x6083, 0, 500), (0x609A, 0, 700), (0x2000, 0, 5), (0x1017, 0, 100), (0x1401, 2, 1)],
    (0x1010, 1),
    b"save",
);

/// An EEPROM in which these are saved.
fn changed() -> Vec<u8> {
    let mut rig = Rig::new();
    carry_out(&mut rig, &CHANGED, Nanos::MAX).unwrap();
    rig.eeprom()
}

/// Returns the bytes that are left if the supply fails after so many of the bytes that a step exchanges with the
/// EEPROM; `None` if it ends before.
fn cut_after(eeprom: &[u8], byte: u64, step: &Step) -> Option<Vec<u8>> {
    let mut rig = Rig::with_eeprom(eeprom, byte);
    let before = rig.board.borrow().eeprom_bytes();
    rig.board.borrow_mut().cut_power_at_byte(before + byte);
    carry_out(&mut rig, step, Nanos::MAX).is_none().then(|| rig.eeprom())
}

/// The second copies are written behind the confirmation, over the copies of the settings before. Wherever that is cut,
/// the new values are there, and a save after that is as good as any.
#[test]
fn at_every_byte_of_the_second_copies() {
    let mut rig = Rig::with_eeprom(&changed(), 1);
    const AGAIN: Step = (&[(0x2003, 0, 21), (0x6083, 0, 901), (0x1017, 0, 77)], (0x1010, 1), b"save");
    carry_out(&mut rig, &AGAIN, Nanos::MAX).unwrap();
    let confirmed = rig.board.borrow().eeprom_bytes();
    let expected = found(&rig.eeprom());
    rig.wait(100);
    let end = rig.board.borrow().eeprom_bytes();
    assert!(end - confirmed > 9 * 64, "{confirmed} {end}");
    for byte in confirmed..end {
        let mut rig = Rig::with_eeprom(&changed(), byte);
        rig.board.borrow_mut().cut_power_at_byte(byte + 1);
        carry_out(&mut rig, &AGAIN, Nanos::MAX).unwrap();
        rig.wait(100);
        assert!(!rig.is_powered());
        assert_eq!(found(&rig.eeprom()), expected, "cut after byte {}", byte - confirmed);
    }
}

/// Restoring all defaults (1011h, 1) happens altogether or not at all, however often the supply fails meanwhile.
#[test]
fn all_defaults_are_restored_or_none() {
    const LOAD: Step = (&[], (0x1011, 1), b"load");
    let eeprom = changed();
    let (old, default) = (found(&eeprom), found(&[0xFF; 16_384]));
    assert!(old.iter().zip(&default).filter(|(old, default)| old != default).count() >= 5, "{old:X?}");
    let mut seen = [0, 0];
    for byte in 1.. {
        let Some(left) = cut_after(&eeprom, byte, &LOAD) else { break };
        let twice = cut_after(&left, 500_u64.saturating_sub(byte), &LOAD).unwrap_or_else(|| left.clone());
        for left in [left, twice] {
            let got = found(&left);
            let outcome = [&old, &default].into_iter().position(|whole| *whole == got);
            seen[outcome.unwrap_or_else(|| panic!("cut after byte {byte}: {got:X?}"))] += 1;
        }
    }
    assert!(seen.iter().all(|times| *times > 50), "{seen:?}");
}

/// The EEPROM fails while all is restored, which is told, and works again: what is saved from then on is there after a
/// start.
#[test]
fn what_is_saved_after_a_restore_that_failed_is_saved() {
    let mut rig = Rig::with_eeprom(&changed(), 1);
    rig.board.borrow_mut().set_fault(Fault::Eeprom, 0, true);
    let reply = rig.post(expedited(0x1011, 1, b"load")).unwrap();
    assert_eq!((reply[0], &reply[4..]), (0x80, 0x0606_0000_u32.to_le_bytes().as_slice()));
    rig.board.borrow_mut().set_fault(Fault::Eeprom, 0, false);
    carry_out(&mut rig, &(&[(0x2003, 0, 12)], (0x1010, 4), b"save"), Nanos::MAX).unwrap();
    let got = found(&rig.eeprom());
    assert_eq!(got[..3], [12, 500, 700], "{got:X?}");
}

/// The other firmware of the module, with settings of its own in the same place, takes the EEPROM over or leaves it.
#[test]
fn the_firmwares_take_the_eeprom_over_from_each_other() {
    const LINES: [&str; 6] = ["GAP 4, 0", "GAP 6, 0", "GAP 140, 0", "GGP 76, 0", "GGP 55, 2", "GGP 3, 2"];
    const STORED: [&str; 10] = [
        "SAP 4, 0, 500",
        "STAP 4, 0",
        "SAP 6, 0, 50",
        "STAP 6, 0",
        "SAP 140, 0, 4",
        "STAP 140, 0",
        "SGP 76, 0, 9",
        "SGP 55, 2, 5",
        "STGP 55, 2",
        "SGP 76, 0, 8",
    ];
    let module = |eeprom: &[u8]| NativeModule::new(&WorldConfig::default(), Some(eeprom), 1);
    let ask = |module: &mut NativeModule, line: &str| {
        let telegram = encode_command(1, text::parse(line).unwrap());
        let sent = module.exchange(Source::Usb, telegram, 1000 * MILLISECOND).unwrap();
        let reply = decode_reply(&sent.telegram().unwrap()).unwrap();
        assert_eq!(reply.status, 100, "{line}");
        reply.value
    };
    let tmcl = |eeprom: &[u8]| LINES.map(|line| ask(&mut module(eeprom), line));
    let mut stored = module(&[0xFF; 16_384]);
    STORED.iter().for_each(|line| _ = ask(&mut stored, line));
    let stored = stored.board_mut().at25().contents().to_vec();

    // The CANopen firmware on the EEPROM of the TMCL firmware.
    let (old, default) = (tmcl(&stored), tmcl(&[0xFF; 16_384]));
    assert!(old.iter().zip(&default).filter(|(old, default)| old != default).count() >= 5, "{old:?}");
    let mut seen = [0, 0];
    for byte in (1..).step_by(31) {
        let Some(left) = cut_after(&stored, byte, &CHANGED) else { break };
        let twice = cut_after(&left, 3 * byte, &CHANGED).unwrap_or_else(|| left.clone());
        for left in [left, twice] {
            let got = tmcl(&left);
            let outcome = [old, default].iter().position(|whole| *whole == got);
            seen[outcome.unwrap_or_else(|| panic!("cut after byte {byte}: {got:?}"))] += 1;
        }
    }
    assert!(seen.iter().all(|times| *times > 1), "{seen:?}");

    // And the other way round: a store and a factory reset.
    let eeprom = changed();
    let (old, default) = (found(&eeprom), found(&[0xFF; 16_384]));
    let mut seen = [0, 0];
    for line in ["SGP 76, 0, 9", "137, 0, 0, 1234"] {
        for time in (0..400).step_by(3) {
            let mut module = NativeModule::new(&WorldConfig::default(), Some(&eeprom), time);
            module.receive(Source::Usb, encode_command(1, text::parse(line).unwrap()));
            module.run_until(module.now() + u64::from(time) * MILLISECOND);
            module.set_power(false);
            let got = found(module.board_mut().at25().contents());
            let outcome = [&old, &default].into_iter().position(|whole| *whole == got);
            seen[outcome.unwrap_or_else(|| panic!("{line} cut after {time} ms: {got:X?}"))] += 1;
        }
    }
    assert!(seen.iter().all(|times| *times > 1), "{seen:?}");
}
