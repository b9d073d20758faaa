//! PDO records: the manual's procedure for a change, changes in any order in the mode of 2701h, and what is refused.

use crate::rig::Rig;
use common::random::Random;

const ACCESS: u32 = 0x0601_0000;
const NOT_MAPPABLE: u32 = 0x0604_0041;
const TOO_LONG: u32 = 0x0604_0042;
const VALUE: u32 = 0x0609_0030;

/// Index of the communication record and of the mapping record, and the bits of an identifier, of the first PDO that is
/// received and of the third that is sent.
const RECORDS: [(u16, u16, u32); 2] = [(0x1400, 0x1600, 0x201), (0x1802, 0x1A02, 0x381)];

/// A mapping entry.
const TARGET: u32 = 0x607A_0020;
const MODE: u32 = 0x6060_0008;
const CONTROL: u32 = 0x6040_0010;

#[test]
fn the_procedure_of_the_manual() {
    for (communication, mapping, id) in RECORDS {
        let mut rig = Rig::operational();
        rig.set(communication, 1, 0xC000_0000 | id);
        rig.set(mapping, 0, 0);
        for (sub, entry) in [(1, MODE), (2, TARGET), (3, CONTROL)] {
            rig.set(mapping, sub, entry);
        }
        rig.set(mapping, 0, 3);
        rig.set(communication, 1, 0x4000_0000 | id);
        let read: Vec<_> = (0..4).map(|sub| rig.read(mapping, sub)).collect();
        assert_eq!(read, [3, MODE, TARGET, CONTROL]);
        assert_eq!(rig.read(communication, 1), 0x4000_0000 | id);
        rig.set(0x6060, 0, 3);
        rig.set(0x607A, 0, 0x0102_0304);
        rig.frames();
        rig.send(0x80, &[]);
        if mapping == 0x1600 {
            rig.send(0x201, &[6, 9, 8, 7, 6, 0x55, 1]);
            assert_eq!([0x6060, 0x607A, 0x6040].map(|index| rig.read(index, 0)), [6, 0x0607_0809, 0x155]);
        } else {
            assert_eq!(rig.of(0x381), [[3, 4, 3, 2, 1, 0, 0]]);
        }
    }
}

/// The values that dcfgen of Lely writes: bit 30 is clear, and reads 1 afterwards.
#[test]
fn bit_30_may_be_written_either_way() {
    for (communication, mapping, id) in RECORDS {
        let mut rig = Rig::new();
        for off in [0x8000_0000, 0xC000_0000] {
            for on in [0, 0x4000_0000] {
                assert_eq!(rig.write(communication, 1, off | id), Ok(()));
                assert_eq!(rig.read(communication, 1), 0xC000_0000 | id);
                assert_eq!(rig.write(communication, 2, 1), Ok(()));
                assert_eq!(rig.write(mapping, 0, 0), Ok(()));
                assert_eq!(rig.write(mapping, 1, CONTROL), Ok(()));
                assert_eq!(rig.write(mapping, 0, 1), Ok(()));
                assert_eq!(rig.write(communication, 1, on | id), Ok(()));
                assert_eq!(rig.read(communication, 1), 0x4000_0000 | id);
            }
        }
    }
}

#[test]
fn valid_pdos_are_not_changed() {
    for (communication, mapping, id) in RECORDS {
        let mut rig = Rig::new();
        let record = |rig: &mut Rig| {
            let communication: Vec<_> = (0..3).map(|sub| rig.read(communication, sub)).collect();
            let mapping: Vec<_> = (0..4).map(|sub| rig.read(mapping, sub)).collect();
            [communication, mapping].concat()
        };
        let before = record(&mut rig);
        assert_eq!(rig.write(communication, 1, id + 1), Err(ACCESS));
        for count in [0, 1, 3] {
            assert_eq!(rig.write(mapping, 0, count), Err(ACCESS), "{mapping:04X}h");
        }
        for sub in 1..4 {
            assert_eq!(rig.write(mapping, sub, TARGET), Err(ACCESS), "{mapping:04X}h");
        }
        assert_eq!(record(&mut rig), before);
        // The same identifier, or another one in the moment in which the PDO is switched off, may be written.
        assert_eq!(rig.write(communication, 1, id), Ok(()));
        assert_eq!(rig.write(communication, 1, 0x8000_0000 | (id + 1)), Ok(()));
        assert_eq!(rig.read(communication, 1), 0xC000_0000 | (id + 1));
        // The mapping has entries, which do not change while they count.
        assert_eq!(rig.write(mapping, 1, TARGET), Err(ACCESS));
        assert_eq!(rig.write(mapping, 0, 0), Ok(()));
        assert_eq!(rig.write(mapping, 1, TARGET), Ok(()));
    }
}

#[test]
fn what_cannot_be_mapped() {
    for (communication, mapping, id) in RECORDS {
        let receive = mapping == 0x1600;
        let mut rig = Rig::new();
        rig.set(communication, 1, 0x8000_0000 | id);
        rig.set(mapping, 0, 0);
        let sent_only = [0x6041_0010, 0x6064_0020, 0x2702_0020, 0x270E_0120, 0x6061_0008];
        let never = [
            0x1000_0020,
            0x6081_0020,
            0x6040_0008,
            0x6040_0020,
            0x6040_0110,
            0x5FFF_0010,
            0x607A_0021,
            0x607D_0120,
            0x0005_0008,
            0x1008_0048,
            1,
            0xFFFF_FFFF,
            0x210B_0340,
            0x2703_0008,
        ];
        for entry in never.into_iter().chain(sent_only.into_iter().filter(|_| receive)) {
            assert_eq!(rig.write(mapping, 1, entry), Err(NOT_MAPPABLE), "{entry:08X}h");
        }
        assert_eq!(rig.read(mapping, 1), if receive { CONTROL } else { 0x6041_0010 });
        for entry in [CONTROL, MODE, TARGET, 0x60FF_0020, 0x2703_0120, 0x2703_0220, 0x6042_0010] {
            assert_eq!(rig.write(mapping, 1, entry), Ok(()), "{entry:08X}h");
        }
        for entry in sent_only.into_iter().filter(|_| !receive) {
            assert_eq!(rig.write(mapping, 1, entry), Ok(()), "{entry:08X}h");
        }
        // Too long together, too many, and an entry that maps nothing.
        for (entries, count, result) in [
            ([TARGET, 0x60FF_0020, MODE], 3, Err(TOO_LONG)),
            ([TARGET, 0x60FF_0020, MODE], 2, Ok(())),
            ([TARGET, TARGET, TARGET], 3, Err(TOO_LONG)),
            ([CONTROL, MODE, TARGET], 4, Err(TOO_LONG)),
            ([CONTROL, MODE, TARGET], 255, Err(TOO_LONG)),
            ([CONTROL, 0, TARGET], 2, Err(NOT_MAPPABLE)),
            ([CONTROL, 0, TARGET], 1, Ok(())),
        ] {
            rig.set(mapping, 0, 0);
            for (sub, entry) in (1..).zip(entries) {
                rig.set(mapping, sub, entry);
            }
            assert_eq!(rig.write(mapping, 0, count), result, "{entries:08X?} {count}");
            assert_eq!(rig.read(mapping, 0), if result.is_ok() { count } else { 0 });
        }
    }
}

/// Identifiers that CiA 301 keeps for other services, and bits that are not there.
#[test]
fn cob_ids_that_are_refused() {
    let restricted = [0, 1, 0x7F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF, 0x701, 0x7FF];
    let allowed = [0x80, 0x81, 0x100, 0x181, 0x580, 0x600, 0x680, 0x6DF, 0x700];
    let mut rig = Rig::new();
    for index in [0x1400, 0x1803] {
        rig.set(index, 1, 0x8000_0201);
        for id in restricted {
            assert_eq!(rig.write(index, 1, id), Err(VALUE), "{id:03X}h");
            // A PDO that is off has no use for its identifier.
            assert_eq!(rig.write(index, 1, 0x8000_0000 | id), Ok(()), "{id:03X}h");
        }
        for id in allowed {
            assert_eq!(rig.write(index, 1, 0x8000_0000 | id), Ok(()));
            assert_eq!(rig.write(index, 1, id), Ok(()), "{id:03X}h");
        }
        for bit in 11..30 {
            assert_eq!(rig.write(index, 1, 0x8000_0201 | 1 << bit), Err(VALUE), "bit {bit}");
        }
    }
    for id in restricted {
        assert_eq!(rig.write(0x1005, 0, id), Err(VALUE), "{id:03X}h");
    }
    for id in allowed {
        assert_eq!(rig.write(0x1005, 0, id), Ok(()), "{id:03X}h");
    }
    for bit in 11..31 {
        assert_eq!(rig.write(0x1005, 0, 0x80 | 1 << bit), Err(VALUE), "bit {bit}");
    }
    // Bit 31 of 1005h says nothing (CiA 301), and is not kept.
    rig.set(0x1005, 0, 0x8000_0085);
    assert_eq!((rig.read(0x1005, 0), rig.write(0x1005, 0, 0xC000_0085)), (0x85, Err(VALUE)));
    // The identifier of emergencies changes while they are off.
    assert_eq!(rig.write(0x1014, 0, 0x82), Err(0x0800_0022));
    assert_eq!(rig.write(0x1014, 0, 0x8000_0082), Err(0x0800_0022));
    assert_eq!((rig.write(0x1014, 0, 0x8000_0081), rig.write(0x1014, 0, 0x82)), (Ok(()), Ok(())));
    assert_eq!((rig.write(0x1014, 0, 0x8000_0082), rig.write(0x1014, 0, 0x701)), (Ok(()), Err(VALUE)));
    for bit in 11..31 {
        assert_eq!(rig.write(0x1014, 0, 0x8000_0082 | 1 << bit), Err(VALUE), "bit {bit}");
    }
}

/// In the mode of 2701h a valid PDO changes its identifier and its mapping, also in operation.
#[test]
fn the_manufacturer_specific_mode_changes_valid_pdos() {
    let mut rig = Rig::operational();
    assert_eq!(rig.download(0x2701, 0, b"make"), Ok(()));
    rig.set(0x1600, 1, MODE);
    rig.send(0x201, &[1]);
    assert_eq!(rig.read(0x6060, 0), 1);
    rig.set(0x1600, 2, TARGET);
    rig.set(0x1600, 0, 2);
    rig.set(0x1400, 1, 0x222);
    rig.send(0x201, &[2, 0, 0, 0, 0]);
    assert_eq!(rig.read(0x6060, 0), 1);
    rig.send(0x222, &[2, 9, 0, 0, 0]);
    assert_eq!((rig.read(0x6060, 0), rig.read(0x607A, 0)), (2, 9));
    // Entries that count map something, and have room.
    rig.set(0x1600, 1, TARGET);
    assert_eq!(rig.write(0x1600, 1, 0), Err(NOT_MAPPABLE));
    rig.set(0x1600, 3, MODE);
    assert_eq!(rig.write(0x1600, 0, 3), Err(TOO_LONG));
    assert_eq!((rig.read(0x1600, 0), rig.read(0x1600, 1)), (2, TARGET));
    // One entry less, then the next PDO that is sent has less in it.
    rig.set(0x1A02, 0, 1);
    rig.frames();
    rig.send(0x80, &[]);
    assert_eq!(rig.of(0x381), [[0x50, 2]]);
    assert_eq!(rig.download(0x2701, 0, b"kill"), Ok(()));
    assert_eq!(rig.write(0x1600, 0, 1), Err(ACCESS));
}

/// Changes in every order: the record is always one that can be, and reads back what was taken.
#[test]
fn records_are_always_possible() {
    let mut random = Random(0x7AB1E);
    let mut rig = Rig::operational();
    let entries = [0, CONTROL, MODE, TARGET, 0x60FF_0020, 0x6041_0010, 0x6064_0020, 0x1000_0020, 0x2703_0120];
    let mut taken = 0;
    for _ in 0..20_000 {
        let (communication, mapping, id) = random.pick(&RECORDS);
        let (index, sub, value) = match random.below(6) {
            0 => (communication, 1, id | 0x8000_0000),
            1 => (communication, 1, id + random.below(2) as u32),
            2 | 3 => (mapping, 0, random.below(5) as u32),
            _ => (mapping, 1 + random.below(3) as u8, random.pick(&entries)),
        };
        if random.one_in(200) {
            let mode: &[u8; 4] = random.pick(&[b"make", b"kill"]);
            rig.download(0x2701, 0, mode).unwrap();
        }
        let before = rig.read(index, sub);
        let result = rig.write(index, sub, value);
        let after = rig.read(index, sub);
        let written = if index == communication { value | 0x4000_0000 } else { value };
        assert_eq!(after, if result.is_ok() { written } else { before });
        taken += u32::from(result.is_ok() && before != after);
        let count = rig.read(mapping, 0) as u8;
        let mapped: Vec<_> = (1..=count).map(|sub| rig.read(mapping, sub)).collect();
        let bits: u32 = mapped.iter().map(|entry| entry & 0xFF).sum();
        assert!(count <= 3 && bits <= 64 && !mapped.contains(&0), "{mapped:08X?}");
        if mapping == 0x1600 {
            assert!(!mapped.contains(&0x6041_0010) && !mapped.contains(&0x6064_0020));
        }
    }
    assert!(taken > 1_000, "{taken}");
}
