//! The object table against a copy of the list of objects, `objects.csv`: types, access, defaults, ranges, storage, and
//! what is not there.

use std::collections::{BTreeMap, BTreeSet};

use crate::rig::Rig;
use tmcm::canopen::{Access, Entry, Initial, Kind, Mapping, Object, ROWS, Storage, When};

/// A row of the list.
pub(crate) struct Listed {
    pub(crate) index: u16,
    pub(crate) sub: u8,
    pub(crate) kind: String,
    pub(crate) data: String,
    pub(crate) access: String,
    pub(crate) pdo: String,
    /// Ranges of accepted values; empty for all of the type.
    pub(crate) ranges: Vec<(i64, i64)>,
    pub(crate) default: String,
    pub(crate) unit: String,
    pub(crate) stored: String,
    pub(crate) when: String,
    pub(crate) name: String,
}

impl Listed {
    /// Number of bytes of a number; 0 for strings.
    pub(crate) fn size(&self) -> usize {
        match self.data.as_str() {
            "U8" | "I8" => 1,
            "U16" | "I16" => 2,
            "U32" | "I32" => 4,
            "U64" => 8,
            _ => 0,
        }
    }

    /// The default as a number, on a node with this ID; `None` for texts, and where the list has none.
    pub(crate) fn number(&self, node: u8) -> Option<i64> {
        let (number, plus) = match self.default.split_once('+') {
            Some((number, "$NODEID")) => (number, node),
            _ => (self.default.as_str(), 0),
        };
        let parsed = match number.strip_prefix("0x") {
            Some(hex) => i64::from_str_radix(hex, 16),
            None => number.parse(),
        };
        parsed.ok().filter(|_| self.data != "Text").map(|number| number + i64::from(plus))
    }

    /// True for what a host writes a signature to.
    pub(crate) fn is_signature(&self) -> bool {
        matches!((self.index, self.sub), (0x1010 | 0x1011 | 0x2706, 1..) | (0x2700 | 0x2701, _))
    }
}

/// The fields of a line; a field in quotes may have commas.
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut quoted) = (vec![String::new()], false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            c => fields.last_mut().unwrap().push(c),
        }
    }
    fields
}

/// The list.
pub(crate) fn list() -> Vec<Listed> {
    let lines = include_str!("objects.csv").lines().skip(1);
    let list: Vec<_> = lines
        .map(|line| {
            let [index, sub, kind, data, access, pdo, ranges, default, unit, stored, when, name] =
                fields(line).try_into().unwrap();
            let range = |text: &str| {
                let (low, high) = text.split_once("..").unwrap_or((text, text));
                (low.parse().unwrap(), high.parse().unwrap())
            };
            let ranges = ranges.split_whitespace().map(range).collect();
            let (index, sub) = (u16::from_str_radix(&index, 16).unwrap(), sub.parse().unwrap());
            Listed { index, sub, kind, data, access, pdo, ranges, default, unit, stored, when, name }
        })
        .collect();
    assert_eq!(list.len(), 211);
    list
}

#[test]
fn the_table_is_the_list() {
    let list = list();
    for listed in &list {
        let place = format!("{:04X}h:{}", listed.index, listed.sub);
        let entry = Entry::find(listed.index, listed.sub).unwrap_or_else(|abort| panic!("{place}: {abort:?}"));
        let row = entry.row();
        assert!((row.first..=row.last).contains(&listed.index) && row.sub == listed.sub, "{place}");
        assert_eq!(u16::from(entry.nth), listed.index - row.first, "{place}");
        let kind = match row.kind {
            Kind::Var => "VAR",
            Kind::Array => "ARRAY",
            Kind::Record => "RECORD",
        };
        assert_eq!(kind, listed.kind, "{place}");
        assert_eq!(format!("{:?}", row.data), listed.data, "{place}");
        assert_eq!(if row.access == Access::Ro { "ro" } else { "rw" }, listed.access, "{place}");
        let pdo = match row.mapping {
            Mapping::No => "",
            Mapping::Tx => "tx",
            Mapping::RxTx => "rx tx",
        };
        assert_eq!(pdo, listed.pdo, "{place}");
        assert_eq!(row.ranges, listed.ranges, "{place}");
        assert_eq!(row.unit, listed.unit, "{place}");
        assert_eq!(row.name.replace('#', &(entry.nth + 1).to_string()), listed.name, "{place}");
        let stored = match row.storage {
            Storage::Computed | Storage::Volatile => "",
            Storage::All(_) => "all",
            Storage::Motor(_) => "motor",
            Storage::Communication(_) => "communication",
        };
        assert_eq!(stored, listed.stored, "{place}");
        assert_eq!(if row.when == When::Disabled { "off" } else { "" }, listed.when, "{place}");
        for node in [1, 127] {
            let default = row.data.value(row.default_number(entry.nth, node));
            match row.default {
                Initial::Text(text) => assert_eq!(text, listed.default, "{place}"),
                Initial::Varies => assert!(listed.number(node).is_none(), "{place}"),
                _ => assert_eq!(Some(default), listed.number(node), "{place}"),
            }
        }
    }
    let rows: usize = ROWS.iter().map(|row| usize::from(row.count())).sum();
    assert_eq!(rows, list.len());
    assert_eq!(ROWS.len(), Object::ALL.len());
}

/// Values lie in the EEPROM by slot number, so an object that changed its slot would be misread on every module in the
/// field.
#[test]
fn storage_slots_are_frozen() {
    let slot = |index, sub| Entry::find(index, sub).map(|entry| entry.row().slot(entry.nth)).unwrap();
    let mut slots = BTreeSet::new();
    for listed in list() {
        let found = slot(listed.index, listed.sub);
        assert_eq!(found.is_some(), !listed.stored.is_empty());
        slots.extend(found);
    }
    assert!(slots.into_iter().eq(3..123));
    let some = [(0x2704, 0), (0x2705, 0), (0x1005, 0), (0x1400, 1), (0x1403, 2), (0x1A03, 3), (0x2000, 0), (0x609A, 0)];
    assert_eq!(some.map(|(index, sub)| slot(index, sub).unwrap()), [3, 4, 5, 14, 21, 69, 70, 122]);
}

/// Each object of a fresh node has its default, in the length of its type.
#[test]
fn each_object_reads_its_default() {
    let mut rig = Rig::new();
    let mut read = BTreeMap::new();
    for listed in list() {
        let place = format!("{:04X}h:{}", listed.index, listed.sub);
        let data = rig.upload(listed.index, listed.sub).unwrap_or_else(|code| panic!("{place}: {code:08X}h"));
        match listed.data.as_str() {
            "Text" => assert_eq!(data, listed.default.as_bytes(), "{place}"),
            "Octets" => assert_eq!(data, [0; 7], "{place}"),
            _ => {
                assert_eq!(data.len(), listed.size(), "{place}");
                if let Some(number) = listed.number(1) {
                    assert_eq!(data, number.to_le_bytes()[..data.len()], "{place}");
                } else {
                    read.insert((listed.index, listed.sub), data);
                }
            }
        }
    }
    // What the list leaves open.
    let expected: [(_, &[u8]); 9] = [
        ((0x2707, 0), &[0xE8, 3]),
        ((0x2708, 0), &[1]),
        ((0x270E, 1), &[0; 4]),
        ((0x6041, 0), &[0x50, 0]),
        ((0x6062, 0), &[0; 4]),
        ((0x6063, 0), &[0; 4]),
        ((0x6064, 0), &[0; 4]),
        ((0x606C, 0), &[0; 4]),
        ((0x60F4, 0), &[0; 4]),
    ];
    for (place, data) in expected {
        assert_eq!(read.remove(&place).as_deref(), Some(data), "{place:04X?}");
    }
    assert!(read.is_empty(), "{read:04X?}");
}

/// The neighbours of each object, and of each index, are not there.
#[test]
fn what_is_not_listed_is_not_there() {
    let mut rig = Rig::new();
    let list = list();
    let places: BTreeSet<_> = list.iter().map(|listed| (listed.index, listed.sub)).collect();
    let indices: BTreeSet<_> = list.iter().map(|listed| listed.index).collect();
    let mut checked = 0;
    for &index in &indices {
        for neighbour in [index - 1, index + 1] {
            if !indices.contains(&neighbour) {
                assert_eq!(rig.upload(neighbour, 0), Err(0x0602_0000), "{neighbour:04X}h");
                assert_eq!(rig.download(neighbour, 0, &[0]), Err(0x0602_0000), "{neighbour:04X}h");
                checked += 1;
            }
        }
        for sub in (0..=8).chain([0x7F, 0x80, 0xFF]).filter(|sub| !places.contains(&(index, *sub))) {
            assert_eq!(rig.upload(index, sub), Err(0x0609_0011), "{index:04X}h:{sub}");
            assert_eq!(rig.download(index, sub, &[0; 4]), Err(0x0609_0011), "{index:04X}h:{sub}");
            checked += 1;
        }
    }
    for index in [0, 1, 0x0FFF, 0x1003, 0x1020, 0x1F51, 0x1F80, 0x7FFF, 0xFFFF] {
        assert_eq!(rig.upload(index, 0), Err(0x0602_0000), "{index:04X}h");
    }
    assert!(checked > 1000, "{checked}");
}

/// Read-only objects refuse to be written, in the length of their type as in any other.
#[test]
fn read_only_objects_are_not_written() {
    let mut rig = Rig::new();
    for listed in list().into_iter().filter(|listed| listed.access == "ro") {
        let before = rig.upload(listed.index, listed.sub);
        for data in [&[1][..], &[1, 0], &[1, 0, 0, 0]] {
            let refused = rig.download(listed.index, listed.sub, data);
            // 2706h:0 takes the signature, and with four bytes nothing else.
            let expected = if (listed.index, data.len()) == (0x2706, 4) { 0x0800_0020 } else { 0x0601_0002 };
            assert_eq!(refused, Err(expected), "{:04X}h:{}", listed.index, listed.sub);
        }
        assert_eq!(rig.upload(listed.index, listed.sub), before);
    }
}

/// Each writable number takes the ends of its ranges and refuses what lies beyond them, which changes nothing.
#[test]
fn ranges_are_kept() {
    let mut checked = 0;
    for listed in
        list().into_iter().filter(|listed| listed.access == "rw" && listed.size() > 0 && !listed.is_signature())
    {
        let (index, sub) = (listed.index, listed.sub);
        // COB-IDs, mappings and largest values have rules of their own.
        if matches!(index, 0x1005 | 0x1014 | 0x1016 | 0x1400..=0x1A03 | 0x2087 | 0x2088) {
            continue;
        }
        let mut rig = Rig::new();
        let place = format!("{index:04X}h:{sub}");
        let bits = listed.size() * 8;
        let whole = if listed.data.starts_with('I') {
            (-1 << (bits - 1), (1 << (bits - 1)) - 1)
        } else {
            (0, (1_i64 << bits) - 1)
        };
        let ranges = match (index, listed.ranges.is_empty()) {
            // In internal units.
            (0x6042, _) => vec![(-2047, 2047)],
            (_, true) => vec![whole],
            (_, false) => listed.ranges.clone(),
        };
        let accepts = |value: i64| ranges.iter().any(|(low, high)| (*low..=*high).contains(&value));
        let inside = ranges.iter().flat_map(|(low, high)| [*low, *high]).collect::<Vec<_>>();
        let edges = ranges.iter().flat_map(|(low, high)| [low - 1, high + 1]).chain([whole.0, whole.1]);
        for value in inside {
            rig.set(index, sub, value as u32);
            let read = i64::from(rig.read(index, sub)) & ((1 << bits) - 1);
            assert_eq!(read, value & ((1 << bits) - 1), "{place}");
        }
        let kept = rig.read(index, sub);
        for value in edges.filter(|value| !accepts(*value) && (whole.0..=whole.1).contains(value)) {
            let code = match ranges[..] {
                [(low, high)] if low < high => {
                    if value < low {
                        0x0609_0032
                    } else {
                        0x0609_0031
                    }
                }
                _ => 0x0609_0030,
            };
            assert_eq!(rig.write(index, sub, value as u32), Err(code), "{place} = {value}");
            assert_eq!(rig.read(index, sub), kept, "{place} = {value}");
            checked += 1;
        }
    }
    assert!(checked > 60, "{checked}");
}
