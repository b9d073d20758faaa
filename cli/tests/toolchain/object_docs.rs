//! `docs/tmcm1140-canopen.eds` and `docs/objects.md` are made from the object table.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use tmcl_tools::eds;
use tmcm::canopen::{Access, Initial, Kind, Mapping, Object, ROWS, Row, Storage, Type, When};

use crate::object_notes::note;
use common::pages::compare;

const HEAD: &str = "\
# Objects

Generated from the table in `src/canopen/object.rs` - do not edit. After a change there:

    UPDATE_DOCS=1 cargo test -p tmcl-cli --test toolchain object_docs

These are the objects of the CANopen firmware; `tmcm1140-canopen.eds` beside this file has them for masters, and
[canopen.md](canopen.md) tells how they work together. *Number*: index and sub-index. *Access*: ro is only read, rw is
also written. *PDO*: an object that can be mapped to a PDO that the node sends (*sent*) or receives (*received*).
*Saved*: the groups of 1010h that save the value and of 1011h that restore it; nothing: it has its default after each
start, or is found by the firmware. *Written*: the state of the drive in which it can be written, where that is not each.
A value above the range is refused with 06090031h, one below it with 06090032h, one in a gap of it or against the rule in
the note with 06090030h, and nothing changes.
";

/// The parts of the page.
const PARTS: [(&str, RangeInclusive<u16>); 3] = [
    ("Communication", 0x1000..=0x1FFF),
    ("Settings of the manufacturer", 0x2000..=0x5FFF),
    ("Drive (CiA 402)", 0x6000..=0xFFFF),
];

/// Number of cells of a line.
const CELLS: usize = 11;

/// A number: what is as large as a code is one, in hexadecimal.
fn number(value: i64) -> String {
    match value {
        0xFFFF_FFFF | 0x1_0000.. if value != i64::from(i32::MAX) => format!("{value:08X}h"),
        _ => value.to_string(),
    }
}

/// True if a rule, and no range, says which numbers the object takes.
fn has_rule(object: Object) -> bool {
    let ruled = matches!(
        object,
        Object::SyncCobId
            | Object::EmergencyCobId
            | Object::ConsumerHeartbeatTime
            | Object::ReceiveCobId
            | Object::ReceiveEntry1
            | Object::ReceiveEntry2
            | Object::ReceiveEntry3
            | Object::TransmitCobId
            | Object::TransmitEntry1
            | Object::TransmitEntry2
            | Object::TransmitEntry3
    );
    ruled || eds::is_command(object)
}

fn range(object: Object, row: &Row) -> String {
    let one = |&(low, high): &(i64, i64)| match high - low {
        0 => number(low),
        1 => format!("{}, {}", number(low), number(high)),
        _ => format!("{}..{}", number(low), number(high)),
    };
    match row.ranges {
        _ if has_rule(object) => "see note".into(),
        [] if row.access == Access::Rw => "any".into(),
        // What sub-index 0 says stands in the column of defaults.
        _ if row.access == Access::Ro && row.kind != Kind::Var && row.sub == 0 => String::new(),
        ranges => ranges.iter().map(one).collect::<Vec<_>>().join(", "),
    }
}

fn default(row: &Row) -> String {
    match row.default {
        Initial::Varies => String::new(),
        Initial::Text(text) => text.into(),
        Initial::Number(value) => number(value),
        Initial::Each(values) => values.map(number).join(", "),
        Initial::PlusNode(base) if row.count() > 1 => format!("{base:X}h + node ID, each 100h more"),
        Initial::PlusNode(base) => format!("{base:X}h + node ID"),
    }
}

fn data_type(row: &Row) -> &'static str {
    match row.data {
        Type::U8 => "U8",
        Type::U16 => "U16",
        Type::U32 => "U32",
        Type::U64 => "U64",
        Type::I8 => "I8",
        Type::I16 => "I16",
        Type::I32 => "I32",
        Type::Text => "text",
        Type::Octets => "7 bytes",
    }
}

fn line(object: Object, row: &Row) -> String {
    let place = match (row.count(), row.kind) {
        (1, Kind::Var) => format!("{:04X}h", row.first),
        (1, _) => format!("{:04X}h.{}", row.first, row.sub),
        _ => format!("{:04X}h..{:04X}h.{}", row.first, row.last, row.sub),
    };
    let name = row.name.replace('#', "1..4");
    let access = if row.access == Access::Ro { "ro" } else { "rw" };
    let mapping = match row.mapping {
        Mapping::No => "",
        Mapping::Tx => "sent",
        Mapping::RxTx => "sent, received",
    };
    let saved = match row.storage {
        Storage::Computed | Storage::Volatile => "",
        Storage::All(_) => "all",
        Storage::Motor(_) => "motor, all",
        Storage::Communication(_) => "communication, all",
    };
    let written = if row.when == When::Disabled { "SWITCH ON DISABLED" } else { "" };
    let cells: [&str; CELLS] = [
        &place,
        &name,
        data_type(row),
        access,
        mapping,
        &range(object, row),
        &default(row),
        row.unit,
        saved,
        written,
        note(object),
    ];
    cells.map(|cell| if cell.is_empty() { "| ".into() } else { format!("| {cell} ") }).concat() + "|\n"
}

fn render() -> String {
    let mut text = String::from(HEAD);
    for (title, indices) in PARTS {
        text += &format!("\n## {title}\n\n");
        text += "| number | name | type | access | PDO | range | default | unit | saved | written | note |\n";
        text += "|---|---|---|---|---|---|---|---|---|---|---|\n";
        let rows = Object::ALL.iter().zip(&ROWS).filter(|(_, row)| indices.contains(&row.first));
        text.extend(rows.map(|(object, row)| line(*object, row)));
    }
    text
}

#[test]
fn the_page_of_the_objects_is_what_the_table_says() {
    compare("objects.md", "-p tmcl-cli --test toolchain object_docs", &render());
}

#[test]
fn the_eds_is_what_the_table_says() {
    compare("tmcm1140-canopen.eds", "-p tmcl-cli --test toolchain object_docs", &eds::text(None));
}

/// A pipe or a line break in a note would break the table.
#[test]
fn every_object_has_a_line_with_all_cells() {
    let text = render();
    let rows: Vec<_> = text.lines().filter(|line| line.starts_with('|')).collect();
    assert_eq!(rows.len(), ROWS.len() + 2 * PARTS.len());
    for row in rows {
        assert_eq!(row.matches('|').count(), CELLS + 1, "{row}");
    }
}

/// The keys of each section.
fn sections(text: &str) -> BTreeMap<&str, BTreeMap<&str, &str>> {
    let mut sections = BTreeMap::<_, BTreeMap<_, _>>::new();
    let mut section = "";
    for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with(';')) {
        if let Some(name) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            section = name;
            assert!(sections.insert(name, BTreeMap::new()).is_none(), "[{name}] is there twice");
        } else {
            let (key, value) = line.split_once('=').unwrap_or_else(|| panic!("{line}"));
            let before = sections.get_mut(section).unwrap().insert(key, value);
            assert!(before.is_none(), "[{section}] has {key} twice");
        }
    }
    sections
}

/// The entries of some objects in the EDS, one of each kind.
#[test]
fn an_object_in_the_eds_has_its_properties() {
    let text = eds::text(None);
    let sections = sections(&text);
    let keys = |section: &str, expected: &[(&str, &str)]| {
        let found = &sections[section];
        for (key, value) in expected {
            assert_eq!(found.get(key), Some(value), "[{section}] {key}");
        }
        found.len()
    };
    keys("1000", &[("AccessType", "const"), ("DefaultValue", "0x00040192"), ("PDOMapping", "0")]);
    keys("1001", &[("AccessType", "ro")]);
    let cob_id = [("ParameterName", "RPDO4 COB-ID"), ("AccessType", "rw"), ("DefaultValue", "$NODEID+0x40000500")];
    keys("1403sub1", &cob_id);
    assert_eq!(keys("1403", &[("ParameterName", "RPDO4 communication"), ("ObjectType", "0x9"), ("SubNumber", "3")]), 3);
    keys("1403sub0", &[("ParameterName", "Largest sub-index"), ("AccessType", "const"), ("DefaultValue", "2")]);
    keys("1603sub2", &[("DefaultValue", "0x60FF0020")]);
    keys("1010", &[("ObjectType", "0x8"), ("SubNumber", "4")]);
    keys("1010sub4", &[("AccessType", "rw"), ("ObjFlags", "1")]);
    keys("2097", &[("LowLimit", "0"), ("HighLimit", "15")]);
    keys("209E", &[("DataType", "0x0002"), ("LowLimit", "-63"), ("HighLimit", "63")]);
    keys("210Bsub3", &[("DataType", "0x001B")]);
    keys("6040", &[("AccessType", "rww"), ("PDOMapping", "1"), ("DataType", "0x0006")]);
    keys("6041", &[("AccessType", "ro"), ("PDOMapping", "1")]);
    assert!(!sections["6041"].contains_key("DefaultValue") && !sections["6041"].contains_key("LowLimit"));
    keys("607Dsub1", &[("DefaultValue", "-2147483648"), ("LowLimit", "-2147483648"), ("HighLimit", "2147483647")]);
    keys("DeviceInfo", &[("BaudRate_10", "0"), ("BaudRate_20", "1"), ("NrOfTXPDO", "4"), ("LSS_Supported", "0")]);
    keys("MandatoryObjects", &[("SupportedObjects", "3"), ("3", "0x1018")]);
    assert!(!sections.contains_key("DeviceComissioning"));
    let listed: usize = ["MandatoryObjects", "OptionalObjects", "ManufacturerObjects"]
        .map(|list| sections[list]["SupportedObjects"].parse::<usize>().unwrap())
        .iter()
        .sum();
    let indices = sections.keys().filter(|name| name.len() == 4).count();
    assert_eq!(listed, indices);
}

/// The file of one node has its ID in place of the variable.
#[test]
fn the_file_of_a_node_has_its_node_id() {
    let text = eds::text(Some(5));
    assert!(!text.contains("NODEID"));
    let sections = sections(&text);
    assert_eq!(sections["DeviceComissioning"]["NodeID"], "5");
    assert_eq!(sections["1403sub1"]["DefaultValue"], "0x40000505");
    assert_eq!(sections["1014"]["DefaultValue"], "133");
    assert_eq!(sections["FileInfo"]["LastEDS"], "tmcm1140-canopen.eds");
}
