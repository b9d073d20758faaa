//! 1010h, 1011h and 2706h: what is saved, what is restored and when, and an EEPROM that does not work.

use crate::number::usb;
use crate::rig::{Rig, checked, expedited};
use crate::table::list;

const SIGNATURE: u32 = 0x0800_0020;
const HARDWARE: u32 = 0x0606_0000;

/// Values other than the defaults for some objects of each group, and what comes with them.
const CHANGED: [(u16, u8, u32, &str); 11] = [
    (0x1005, 0, 0x95, "all"),
    (0x1017, 0, 7000, "all"),
    (0x1029, 1, 1, "all"),
    (0x1802, 2, 10, "all"),
    (0x1803, 1, 0x4000_0222, "all"),
    (0x2710, 0, 1, "all"),
    (0x2003, 0, 99, "motor"),
    (0x2095, 0, 0xFD, "motor"),
    (0x607D, 1, 0xFFFF_FF00, "motor"),
    (0x2704, 0, 250, "communication"),
    (0x2705, 0, 9, "communication"),
];

fn change(rig: &mut Rig) {
    rig.set(0x1803, 1, 0x8000_0222);
    for (index, sub, value, _) in CHANGED {
        rig.set(index, sub, value);
    }
}

fn read(rig: &mut Rig) -> Vec<u32> {
    CHANGED.iter().map(|(index, sub, ..)| rig.read(*index, *sub)).collect()
}

/// The values that are expected where these groups have been saved.
fn expected(groups: &[&str], defaults: &[u32]) -> Vec<u32> {
    let values = CHANGED.iter().zip(defaults);
    values.map(|((_, _, value, group), default)| if groups.contains(group) { *value } else { *default }).collect()
}

#[test]
fn each_group_saves_and_restores_its_own() {
    let groups: [(u16, u8, &[&str]); 4] = [
        (0x1010, 1, &["all", "motor", "communication"]),
        (0x1010, 4, &["motor"]),
        (0x1010, 2, &["communication"]),
        (0x2706, 1, &["communication"]),
    ];
    let defaults = read(&mut Rig::new());
    for (index, sub, saved) in groups {
        let mut rig = Rig::new();
        change(&mut rig);
        assert_eq!(rig.sign(index, sub, b"save"), Ok(()));
        let in_force = read(&mut rig);
        assert_eq!(in_force, expected(&["all", "motor", "communication"], &defaults));
        rig.power_cycle();
        assert_eq!(read(&mut rig), renumbered(expected(saved, &defaults), rig.node.node_id()), "{index:04X}h:{sub}");
    }
    for (sub, restored) in [(1, &["all", "motor", "communication"][..]), (4, &["motor"]), (2, &["communication"])] {
        let mut rig = Rig::new();
        change(&mut rig);
        assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
        assert_eq!(rig.sign(0x1011, sub, b"load"), Ok(()));
        // In force after the next reset.
        assert_eq!(read(&mut rig), expected(&["all", "motor", "communication"], &defaults));
        rig.command(0x81);
        rig.wait(20);
        let left: Vec<_> = ["all", "motor", "communication"]
            .into_iter()
            .filter(|group| sub != 1 && !restored.contains(group))
            .collect();
        assert_eq!(read(&mut rig), renumbered(expected(&left, &defaults), rig.node.node_id()), "1011h:{sub}");
        // A save before the reset stores over it.
        let mut rig = Rig::new();
        change(&mut rig);
        assert_eq!(rig.sign(0x1011, sub, b"load"), Ok(()));
        assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
        rig.power_cycle();
        assert_eq!(read(&mut rig), expected(&["all", "motor", "communication"], &defaults));
    }
}

/// The default of 1803h:1 has the node ID in it.
fn renumbered(mut values: Vec<u32>, node: u8) -> Vec<u32> {
    for (value, (index, ..)) in values.iter_mut().zip(CHANGED) {
        if index == 0x1803 && *value == 0x4000_0481 {
            *value = 0x4000_0480 + u32::from(node);
        }
    }
    values
}

/// Every object of the list with a storage column survives, and no other.
#[test]
fn all_that_is_listed_as_stored_is_stored() {
    let mut rig = Rig::new();
    // PDOs off and empty, so that their records take other values; and another dimension for the largest values.
    for index in (0x1400..0x1404).chain(0x1800..0x1804) {
        rig.set(index, 1, 0x8000_0000);
        rig.set(index + 0x200, 0, 0);
    }
    rig.set(0x208C, 0, 181);
    let other = |listed: &crate::table::Listed, now: u32| match (listed.index, listed.sub) {
        (0x1005, _) => 0x91,
        (0x1014, _) => 0x8000_0081,
        (0x1016, _) => 0x0007_0100,
        (0x1400..=0x1403 | 0x1800..=0x1803, 1) => 0xC000_0333,
        (0x1600..=0x1603 | 0x1A00..=0x1A03, 0) => 0,
        (0x1600..=0x1603 | 0x1A00..=0x1A03, _) => 0x2703_0120,
        (0x208C, _) => 181,
        _ => match listed.ranges[..] {
            [] => now ^ 1,
            [(low, _), ..] if i64::from(now) != low & ((1 << (listed.size() * 8)) - 1) => low as u32,
            [.., (_, high)] => high as u32,
        },
    };
    let mut written = Vec::new();
    for listed in list().iter().filter(|listed| listed.access == "rw" && listed.size() > 0 && !listed.is_signature()) {
        if matches!(listed.index, 0x2087 | 0x2088) {
            rig.set(listed.index, 0, 1234);
        } else if !matches!(listed.index, 0x605B..=0x605E) {
            let now = rig.read(listed.index, listed.sub);
            rig.set(listed.index, listed.sub, other(listed, now));
        }
        let value = rig.read(listed.index, listed.sub);
        written.push((listed.index, listed.sub, value, !listed.stored.is_empty()));
    }
    rig.set(0x2705, 0, 1);
    assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
    rig.power_cycle();
    let mut fresh = Rig::new();
    for (index, sub, value, stored) in written {
        let (read, default) = (rig.read(index, sub), fresh.read(index, sub));
        let value = if index == 0x2705 { 1 } else { value };
        assert_eq!(read, if stored { value } else { default }, "{index:04X}h:{sub}");
        assert!(value != default || matches!(index, 0x2705 | 0x605B..=0x605E), "{index:04X}h:{sub} has no other value");
    }
}

#[test]
fn wrong_signatures_do_nothing() {
    let mut rig = Rig::new();
    let before = rig.eeprom();
    rig.set(0x2003, 0, 5);
    for (index, sub) in [(0x1010, 1), (0x1010, 2), (0x1010, 4), (0x1011, 1), (0x1011, 2), (0x1011, 4), (0x2706, 1)] {
        let wrong = if index == 0x1011 { b"save" } else { b"load" };
        for signature in [wrong, b"evas", b"\0\0\0\0", b"SAVE"] {
            assert_eq!(rig.sign(index, sub, signature), Err(SIGNATURE), "{index:04X}h:{sub}");
        }
    }
    rig.wait(200);
    assert!(rig.eeprom() == before);
}

/// The manual's table has the object at sub-index 0.
#[test]
fn node_id_and_bit_rate_by_sub_index_0() {
    let mut rig = Rig::new();
    rig.set(0x2705, 0, 42);
    assert_eq!(rig.sign(0x2706, 0, b"save"), Ok(()));
    rig.power_cycle();
    assert_eq!(rig.node.node_id(), 42);
}

/// Node ID and bit rate are in force after the next start of the firmware, and COB-IDs follow the node ID.
#[test]
fn node_id_and_bit_rate() {
    let mut rig = Rig::new();
    rig.set(0x2705, 0, 42);
    rig.set(0x2704, 0, 125);
    assert_eq!(rig.sign(0x2706, 1, b"save"), Ok(()));
    rig.command(0x82);
    rig.wait(2);
    assert_eq!((rig.node.node_id(), rig.node.bit_rate()), (1, 1000));
    assert_eq!((rig.read(0x2708, 0), rig.read(0x2707, 0), rig.read(0x2705, 0)), (1, 1000, 42));
    rig.set(0x1400, 1, 0x8000_0201);
    rig.set(0x1400, 1, 0x234);
    assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
    rig.frames();
    rig.command(0x81);
    rig.wait(20);
    assert_eq!(rig.frames(), [(0x72A, vec![0])]);
    assert_eq!((rig.node.node_id(), rig.node.bit_rate()), (42, 125));
    assert_eq!((rig.read(0x2708, 0), rig.read(0x2707, 0)), (42, 125));
    let cob_ids = [(0x1014, 0), (0x1400, 1), (0x1401, 1), (0x1800, 1), (0x1803, 1)];
    let read = cob_ids.map(|(index, sub)| rig.read(index, sub));
    assert_eq!(read, [0xAA, 0x4000_0234, 0x4000_032A, 0x4000_01AA, 0x4000_04AA]);
    rig.command(1);
    assert_eq!(rig.frames().iter().map(|(id, _)| *id).collect::<Vec<_>>(), [0x1AA, 0x2AA]);
    rig.send(0, &[2, 1]);
    assert_eq!(rig.read(0x1000, 0), 0x0004_0192);
}

/// The confirmation comes when all is durable; meanwhile other requests are refused, and an abort forgets the reply.
#[test]
fn a_request_while_something_is_saved() {
    let mut rig = Rig::new();
    rig.set(0x2003, 0, 5);
    rig.frames();
    let save = expedited(0x1010, 1, b"save");
    rig.send(0x601, &save);
    assert!(rig.frames().is_empty());
    rig.send(0x601, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(rig.of(0x581), [[0x80, 0x00, 0x10, 0, 0x22, 0, 0, 8]]);
    // Ten pages of 5 ms, on a fresh EEPROM.
    rig.wait(40);
    assert!(rig.of(0x581).is_empty());
    rig.wait(40);
    assert_eq!(rig.of(0x581), [[0x60, 0x10, 0x10, 1, 0, 0, 0, 0]]);
    rig.set(0x2003, 0, 6);
    rig.send(0x601, &save);
    rig.send(0x601, &[0x80, 0x10, 0x10, 1, 0, 0, 4, 5]);
    assert_eq!(rig.read(0x2003, 0), 6);
    // What is under way without anybody who waits for it is not to be mixed with what is saved now.
    rig.wait(10);
    assert_eq!(rig.sign(0x1010, 1, b"save"), Err(0x0800_0022));
    assert_eq!(rig.sign(0x1011, 4, b"load"), Err(0x0800_0022));
    rig.wait(60);
    assert!(rig.of(0x581).is_empty());
    rig.power_cycle();
    assert_eq!(rig.read(0x2003, 0), 6);
    // What is durable already is confirmed at once.
    rig.send(0x601, &save);
    assert_eq!(rig.of(0x581).len(), 1);
}

/// In segments, too.
#[test]
fn saving_in_segments() {
    let mut rig = Rig::new();
    rig.set(0x2003, 0, 5);
    rig.request([0x21, 0x10, 0x10, 1, 4, 0, 0, 0]);
    let reply = rig.request([0x07, b's', b'a', b'v', b'e', 0, 0, 0]);
    assert_eq!(reply, [0x20, 0, 0, 0, 0, 0, 0, 0]);
    rig.power_cycle();
    assert_eq!(rig.read(0x2003, 0), 5);
}

#[test]
fn an_eeprom_that_fails() {
    let mut rig = Rig::new();
    rig.set(0x2003, 0, 5);
    rig.control("fault eeprom on");
    let before = rig.eeprom();
    for (index, sub, signature) in [(0x1010, 1, b"save"), (0x1010, 4, b"save"), (0x1010, 1, b"save")] {
        assert_eq!(rig.sign(index, sub, signature), Err(HARDWARE));
        assert_eq!(rig.read(0x2003, 0), 5);
    }
    rig.set(0x2705, 0, 8);
    assert_eq!(rig.sign(0x2706, 1, b"save"), Err(HARDWARE));
    rig.control("fault eeprom off");
    assert!(rig.eeprom() == before);
    assert_eq!(rig.sign(0x1010, 4, b"save"), Ok(()));
    rig.power_cycle();
    assert_eq!((rig.read(0x2003, 0), rig.node.node_id()), (5, 1));
    // Restoring fails as well, and what was saved stays.
    rig.control("fault eeprom on");
    assert_eq!(rig.sign(0x1011, 1, b"load"), Err(HARDWARE));
    rig.control("fault eeprom off");
    rig.power_cycle();
    assert_eq!(rig.read(0x2003, 0), 5);
}

/// An EEPROM that does not answer at the start, and a node that was told to be node 1 all the same. The node has the
/// defaults, nothing can be saved, and 1010h says so.
#[test]
fn an_eeprom_that_is_not_there() {
    let mut rig = Rig::new();
    rig.set(0x2003, 0, 5);
    assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
    assert_eq!((rig.read(0x1010, 1), rig.read(0x1011, 4)), (1, 1));
    rig.control("fault eeprom on");
    rig.power_cycle();
    assert!(rig.report.unreachable);
    usb(&mut rig, 137, 1234);
    assert_eq!(rig.read(0x2003, 0), 128);
    for sub in [1, 2, 4] {
        assert_eq!((rig.read(0x1010, sub), rig.read(0x1011, sub)), (0, 0));
        assert_eq!(rig.sign(0x1010, sub, b"save"), Err(HARDWARE));
        assert_eq!(rig.sign(0x1011, sub, b"load"), Err(HARDWARE));
    }
    rig.control("fault eeprom off");
    rig.power_cycle();
    assert_eq!(rig.read(0x2003, 0), 5);
}

/// A reset waits for what is being saved, and its confirmation leaves before.
#[test]
fn a_reset_while_something_is_saved() {
    let mut rig = Rig::new();
    rig.set(0x2003, 0, 5);
    rig.set(0x1017, 0, 0);
    rig.wait(2);
    rig.frames();
    rig.send(0x601, &expedited(0x1010, 1, b"save"));
    rig.command(0x81);
    rig.wait(100);
    let frames = rig.frames();
    assert_eq!(frames.iter().map(|(id, _)| *id).collect::<Vec<_>>(), [0x581, 0x701]);
    assert_eq!(checked(frames[0].1[..].try_into().unwrap()), Ok(()));
    assert_eq!(rig.read(0x2003, 0), 5);
}
