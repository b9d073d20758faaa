//! Saved settings of which a part cannot be read. With one good copy nothing is lost, which is told as a warning.
//! Without one the drive is in FAULT, until the objects concerned have been written or saved anew.

use crate::driving::{FAULT, FAULT_RESET, SWITCH_ON_DISABLED};
use crate::rig::Rig;

/// The settings: nine pages of 64 bytes in use, each in two copies side by side, from here on.
pub(crate) const SETTINGS: usize = 16_384 - 2 * 16 * PAGE;
pub(crate) const PAGE: usize = 64;
const PAGES: usize = 9;

/// Objects of all pages, with values that are not their defaults.
pub(crate) const SAVED: [(u16, u8, u32); 10] = [
    (0x2705, 0, 9),
    (0x2704, 0, 500),
    (0x1017, 0, 100),
    (0x1401, 2, 1),
    (0x1801, 2, 1),
    (0x1A03, 1, 0),
    (0x2003, 0, 40),
    (0x20A4, 0, 77),
    (0x607D, 2, 5_000),
    (0x6099, 1, 321),
];
/// Bytes of a warning, and of the message of a loss: code, 1001h, two bytes.
const WORN: [u8; 5] = [0x10, 0x63, 0x21, 1, 255];
const LOST: [u8; 5] = [0x10, 0x63, 0x21, 0, 255];

/// An EEPROM in which these are saved, twice each.
pub(crate) fn saved() -> Vec<u8> {
    let mut rig = Rig::new();
    for (index, sub, value) in SAVED {
        if index == 0x1A03 {
            rig.set(0x1803, 1, 0x8000_0481);
            rig.set(0x1A03, 0, 0);
        }
        rig.set(index, sub, value);
    }
    rig.sign(0x1010, 1, b"save").unwrap();
    rig.wait(100);
    let eeprom = rig.eeprom();
    for page in 0..PAGES {
        let at = |copy: usize| &eeprom[SETTINGS + (2 * page + copy) * PAGE..][..PAGE];
        assert_eq!(at(0), at(1), "page {page}");
    }
    eeprom
}

/// All objects that are saved, as they are read.
fn values(rig: &mut Rig) -> Vec<u32> {
    SAVED.map(|(index, sub, _)| rig.read(index, sub)).to_vec()
}

/// The emergencies that a node has sent: all bytes.
pub(crate) fn told(rig: &mut Rig) -> Vec<Vec<u8>> {
    let id = 0x80 + u16::from(rig.node.node_id());
    rig.of(id)
}

pub(crate) fn flipped(eeprom: &[u8], page: usize, bit: usize, copies: &[usize]) -> Vec<u8> {
    let mut eeprom = eeprom.to_vec();
    for copy in copies {
        eeprom[SETTINGS + (2 * page + copy) * PAGE + bit / 8] ^= 1 << (bit % 8);
    }
    eeprom
}

/// Each bit of each copy: all values are there, and it is told. The copy is written again, which is looked at now and
/// then.
#[test]
fn each_bit_of_one_copy() {
    let eeprom = saved();
    let expected: Vec<u32> = SAVED.map(|(_, _, value)| value).to_vec();
    for (page, copy) in (0..PAGES).flat_map(|page| [(page, 0), (page, 1)]) {
        for bit in 0..8 * PAGE {
            let mut rig = Rig::with_eeprom(&flipped(&eeprom, page, bit, &[copy]), 1);
            rig.wait(2);
            let place = format!("page {page}, copy {copy}, bit {bit}");
            let told = told(&mut rig);
            assert!(told.len() == 1 && told[0][..5] == WORN, "{place}: {told:02X?}");
            assert_eq!((rig.drive_state(), rig.read(0x603F, 0)), (SWITCH_ON_DISABLED, 0x6310), "{place}");
            if bit % 97 == 0 {
                assert_eq!(values(&mut rig), expected, "{place}");
                rig.wait(20);
                assert_eq!(rig.eeprom(), eeprom, "{place}");
            }
        }
    }
}

/// Each bit of both copies of a page behind the first one: other values never without FAULT.
#[test]
fn each_bit_of_both_copies() {
    let eeprom = saved();
    for page in 1..PAGES {
        for bit in 0..8 * PAGE {
            let mut rig = Rig::with_eeprom(&flipped(&eeprom, page, bit, &[0, 1]), 1);
            rig.wait(3);
            let place = format!("page {page}, bit {bit}");
            let told = told(&mut rig);
            assert!(told.len() == 1 && told[0][..5] == LOST, "{place}: {told:02X?}");
            assert_eq!((rig.drive_state(), rig.read(0x1001, 0), rig.read(0x603F, 0)), (FAULT, 0x21, 0x6310), "{place}");
        }
    }
}

/// A node whose motor's current is lost.
fn lost_current() -> (Rig, Vec<(u16, u8)>) {
    // Slots of 14 values: the page of 2003h.
    let eeprom = saved();
    for page in 1..PAGES {
        let mut rig = Rig::with_eeprom(&flipped(&eeprom, page, 99, &[0, 1]), 1);
        rig.wait(3);
        if rig.read(0x2003, 0) == 128 {
            let told = told(&mut rig);
            let first = (u16::from_le_bytes([told[0][5], told[0][6]]), told[0][7]);
            return (rig, vec![first]);
        }
    }
    panic!("2003h is in no page");
}

/// The first object concerned is named. The fault stays until all of them have been written, as a master does that
/// downloads its list. The next start finds the page as bad as before.
#[test]
fn a_list_that_is_downloaded_takes_the_place_of_what_is_lost() {
    let (mut rig, first) = lost_current();
    let lost = page_of(first[0]);
    assert!(lost.contains(&(0x2003, 0)) && lost.len() == 14, "{lost:04X?}");
    rig.word(FAULT_RESET);
    rig.word(0);
    assert_eq!(rig.drive_state(), FAULT);
    for (index, sub) in &lost {
        rig.word(FAULT_RESET);
        rig.word(0);
        assert_eq!(rig.drive_state(), FAULT, "before {index:04X}h:{sub}");
        let value = if *index == 0x2003 { 40 } else { rig.read(*index, *sub) };
        rig.set(*index, *sub, value);
        rig.wait(2);
    }
    rig.word(FAULT_RESET);
    assert_eq!((rig.drive_state(), rig.read(0x1001, 0), rig.read(0x2003, 0)), (SWITCH_ON_DISABLED, 0, 40));
    rig.power_cycle();
    rig.wait(3);
    assert_eq!((rig.drive_state(), rig.read(0x2003, 0)), (FAULT, 128));
}

/// The objects of the page that begins with this one, in the order of the table.
pub(crate) fn page_of(first: (u16, u8)) -> Vec<(u16, u8)> {
    let slots = tmcm::canopen::ROWS.iter().flat_map(|row| {
        (0..row.count()).filter_map(move |nth| Some((row.slot(nth)?, (row.first + u16::from(nth), row.sub))))
    });
    let slots: Vec<_> = slots.collect();
    let (slot, _) = slots.iter().find(|(_, place)| *place == first).unwrap();
    slots.iter().filter(|(other, _)| other / 14 == slot / 14).map(|(_, place)| *place).collect()
}

/// A save and a restore take the place of what is lost as well, also after a restart. So do a save of values that are
/// the defaults, and one of another group.
#[test]
fn a_save_or_a_restore_ends_it() {
    for (index, sub, signature) in
        [(0x1010, 1, b"save"), (0x1010, 2, b"save"), (0x1011, 1, b"load"), (0x1011, 4, b"load")]
    {
        let (mut rig, _) = lost_current();
        rig.sign(index, sub, signature).unwrap();
        rig.wait(2);
        rig.word(FAULT_RESET);
        assert_eq!((rig.drive_state(), rig.read(0x1001, 0)), (SWITCH_ON_DISABLED, 0), "{index:04X}h:{sub}");
        rig.wait(100);
        rig.power_cycle();
        rig.wait(3);
        assert_eq!((rig.drive_state(), rig.read(0x603F, 0)), (SWITCH_ON_DISABLED, 0), "{index:04X}h:{sub}");
        assert_eq!((rig.read(0x2003, 0), rig.report.valid), (128, 18));
    }
}

/// A file of before, in which each page was written by itself and only those that had changed, is read as it was: the
/// first save writes all pages, twice.
#[test]
fn an_older_file() {
    let contents = include_bytes!("older.bin");
    let mut eeprom = vec![0xFF; 16_384];
    eeprom[SETTINGS..].copy_from_slice(contents);
    let mut rig = Rig::with_eeprom(&eeprom, 1);
    rig.wait(3);
    assert!(rig.report.valid < 18 && rig.report.lost == 0 && !rig.report.worn, "{:?}", rig.report);
    assert_eq!((rig.drive_state(), rig.read(0x603F, 0)), (SWITCH_ON_DISABLED, 0));
    let older = values(&mut rig);
    let expected: Vec<u32> = SAVED.map(|(_, _, value)| value).to_vec();
    assert_eq!(older, expected);
    rig.set(0x2003, 0, 41);
    rig.sign(0x1010, 4, b"save").unwrap();
    rig.wait(100);
    rig.power_cycle();
    assert_eq!((rig.read(0x2003, 0), rig.report.valid), (41, 18));
    assert_eq!(values(&mut rig)[..6], expected[..6]);
}

/// A second copy that cannot be written is told, and what was saved is saved.
#[test]
fn a_second_copy_that_cannot_be_written() {
    let mut rig = Rig::with_eeprom(&saved(), 1);
    rig.set(0x2003, 0, 41);
    rig.sign(0x1010, 1, b"save").unwrap();
    rig.frames();
    rig.control("fault eeprom on");
    rig.wait(30);
    let told = told(&mut rig);
    assert!(told.len() == 1 && told[0][..5] == WORN, "{told:02X?}");
    rig.control("fault eeprom off");
    rig.power_cycle();
    assert_eq!((rig.read(0x2003, 0), rig.drive_state()), (41, SWITCH_ON_DISABLED));
}
