//! The text of an EDS, or of the DCF of one node (CiA 306).

use std::collections::BTreeMap;
use std::fmt::{Display, Write};

use tmcm::canopen::{Entry, Kind, Mapping, Object};

use super::object::{Described, shown};

/// The name of the EDS in `docs`.
const NAME: &str = "tmcm1140-canopen.eds";
/// Version of the file, which tools compare: it becomes another whenever the objects do.
const VERSION: u8 = 1;
/// When this version was made. The text does not depend on the day on which it is written.
const DATE: &str = "11-22-2026";
const TIME: &str = "12:00AM";

/// The bit rates that an EDS has a key for, in kbit/s. There is none for 100.
const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

const COMMENTS: [&str; 4] = [
    "Made by tmcl eds from the object table of the firmware.",
    "The inhibit times of the TPDOs (1800h to 1803h, sub-index 3) are in milliseconds.",
    "The node also works at 100 kbit/s (2704h), which an EDS has no key for.",
    "Velocities and accelerations are in the units that 208Ch and 208Eh tell.",
];

/// Objects that every node has.
const MANDATORY: [u16; 3] = [0x1000, 0x1001, 0x1018];
/// Indices of the manufacturer's objects.
const MANUFACTURER: std::ops::Range<u16> = 0x2000..0x6000;

/// The objects of each index, in the order of their sub-indices.
type Indices = BTreeMap<u16, Vec<Described>>;

/// The EDS, or the DCF of a node.
pub fn text(node: Option<u8>) -> String {
    let mut indices = Indices::new();
    for described in Described::all() {
        indices.entry(described.index()).or_default().push(described);
    }
    let mut file = File(String::new());
    file.about_itself(node);
    file.about_the_device(&indices);
    if let Some(node) = node {
        file.section("DeviceComissioning");
        file.key("NodeID", node);
        file.key("NodeName", "TMCM-1140");
        file.key("Baudrate", number(Object::BitRate));
        file.key("NetNumber", 0);
        file.key("CANopenManager", 0);
    }
    file.section("DummyUsage");
    for number in 1..=7 {
        file.key(&format!("Dummy{number:04}"), 0);
    }
    file.section("Comments");
    file.key("Lines", COMMENTS.len());
    for (number, line) in (1..).zip(COMMENTS) {
        file.key(&format!("Line{number}"), line);
    }
    let mandatory = |index: u16| MANDATORY.contains(&index);
    let manufacturer = |index: u16| MANUFACTURER.contains(&index);
    file.objects("MandatoryObjects", &indices, node, mandatory);
    file.objects("OptionalObjects", &indices, node, |index| !mandatory(index) && !manufacturer(index));
    file.objects("ManufacturerObjects", &indices, node, manufacturer);
    file.0
}

/// The default of an object that is a number.
fn number(object: Object) -> u32 {
    Entry::of(object).row().default_number(0, 0)
}

/// The text as far as it is written. Writing to a string cannot fail.
struct File(String);

impl File {
    fn section(&mut self, name: &str) {
        self.commented(None, name);
    }

    /// A section with a comment, which stands above it: not all readers of EDS files take one within.
    fn commented(&mut self, comment: Option<&str>, name: &str) {
        if !self.0.is_empty() {
            self.0.push('\n');
        }
        if let Some(comment) = comment {
            let _ = writeln!(self.0, "; {comment}");
        }
        let _ = writeln!(self.0, "[{name}]");
    }

    fn key(&mut self, key: &str, value: impl Display) {
        let _ = writeln!(self.0, "{key}={value}");
    }

    fn about_itself(&mut self, node: Option<u8>) {
        self.section("FileInfo");
        self.key("FileName", node.map_or(NAME.into(), |node| format!("tmcm1140-canopen-{node}.dcf")));
        self.key("FileVersion", VERSION);
        self.key("FileRevision", 0);
        if node.is_some() {
            self.key("LastEDS", NAME);
        }
        self.key("EDSVersion", "4.0");
        self.key("Description", "TMCM-1140 with the CANopen firmware");
        for event in ["Creation", "Modification"] {
            self.key(&format!("{event}Time"), TIME);
            self.key(&format!("{event}Date"), DATE);
        }
        self.key("CreatedBy", "tmcl eds");
        self.key("ModifiedBy", "tmcl eds");
    }

    fn about_the_device(&mut self, indices: &Indices) {
        self.section("DeviceInfo");
        self.key("VendorName", "TRINAMIC");
        self.key("VendorNumber", shown(number(Object::VendorId).into()));
        self.key("ProductName", "TMCM-1140");
        self.key("ProductNumber", shown(number(Object::ProductCode).into()));
        self.key("RevisionNumber", shown(number(Object::RevisionNumber).into()));
        self.key("OrderCode", "TMCM-1140-CANopen");
        let works = Entry::of(Object::BitRate).row();
        for rate in BIT_RATES {
            self.key(&format!("BaudRate_{rate}"), u8::from(works.accepts(rate.into())));
        }
        self.key("SimpleBootUpMaster", 0);
        self.key("SimpleBootUpSlave", 1);
        // PDOs carry whole bytes.
        self.key("Granularity", 8);
        self.key("DynamicChannelsSupported", 0);
        self.key("GroupMessaging", 0);
        self.key("NrOfRXPDO", indices.range(0x1400..0x1600).count());
        self.key("NrOfTXPDO", indices.range(0x1800..0x1A00).count());
        self.key("LSS_Supported", 0);
    }

    /// A list of indices, and the objects at them.
    fn objects(&mut self, list: &str, indices: &Indices, node: Option<u8>, belongs: impl Fn(u16) -> bool) {
        let found: Vec<_> = indices.iter().filter(|(index, _)| belongs(**index)).collect();
        self.section(list);
        self.key("SupportedObjects", found.len());
        for (number, (index, _)) in (1..).zip(&found) {
            self.key(&number.to_string(), format_args!("0x{index:04X}"));
        }
        for (index, objects) in found {
            self.index(*index, objects, node);
        }
    }

    /// An index, and its sub-indices if it has any.
    fn index(&mut self, index: u16, objects: &[Described], node: Option<u8>) {
        let Some(head) = objects.first() else { return };
        let section = format!("{index:04X}");
        let kind = match head.row.kind {
            Kind::Var => return self.value(&section, head, node),
            Kind::Array => "0x8",
            Kind::Record => "0x9",
        };
        self.section(&section);
        self.key("ParameterName", head.whole());
        self.key("ObjectType", kind);
        self.key("SubNumber", objects.len());
        for object in objects {
            self.value(&format!("{section}sub{:X}", object.row.sub), object, node);
        }
    }

    /// An object that has a value.
    fn value(&mut self, section: &str, object: &Described, node: Option<u8>) {
        let row = object.row;
        let unit = (!row.unit.is_empty()).then(|| format!("unit: {}", row.unit));
        self.commented(unit.as_deref(), section);
        self.key("ParameterName", object.name());
        self.key("ObjectType", "0x7");
        self.key("DataType", format_args!("0x{:04X}", row.data.number()));
        self.key("AccessType", object.access());
        if let Some((low, high)) = object.limits() {
            self.key("LowLimit", shown(low));
            self.key("HighLimit", shown(high));
        }
        if let Some(default) = object.default(node) {
            self.key("DefaultValue", default);
        }
        self.key("PDOMapping", u8::from(row.mapping != Mapping::No));
        if object.is_command() {
            // Tools that bring all values to a node are to leave this one out.
            self.key("ObjFlags", 1);
        }
    }
}
