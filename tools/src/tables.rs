//! The tables of the products as JSON, for programs of others: what a parameter or an object is called, which numbers
//! it takes, whether it is stored.

use serde::Serialize;
use tmcm::canopen::Mapping;
use tmcm::param::Storage;

use crate::eds::Described;
use crate::params::Entry;
use crate::product::Product;

/// All parameters of a product.
#[derive(Debug, Serialize)]
struct Parameters {
    product: &'static str,
    axes: u8,
    /// Of each axis: GAP, SAP, STAP, RSAP.
    axis: Vec<Parameter>,
    /// Of bank 0: GGP, SGP, STGP, RSGP.
    global: Vec<Parameter>,
    /// Of bank 3, those of interrupts.
    interrupts: Vec<Parameter>,
}

#[derive(Debug, Serialize)]
struct Parameter {
    number: u8,
    name: String,
    /// Inclusive ranges, in ascending order; empty for one that can only be read. A timer of 32 bits without a sign is
    /// -2147483648 and above as well.
    ranges: &'static [(i32, i32)],
    /// As it is written behind a value; null for a plain number.
    unit: Option<&'static str>,
    /// "R", or "RW".
    access: &'static str,
    /// "on command" by STAP or STGP, "at once" by the command that sets it, or null: lost with the power.
    stored: Option<&'static str>,
    /// After a factory reset; null for one that can only be read.
    default: Option<i32>,
    note: &'static str,
}

impl Parameter {
    fn of(Entry { setting, row, name }: Entry) -> Self {
        let (writable, unit) = (row.writable(), row.unit.symbol());
        Self {
            number: setting.read().kind,
            name,
            ranges: if writable { row.ranges } else { &[] },
            unit: (!unit.is_empty()).then_some(unit),
            access: if writable { "RW" } else { "R" },
            stored: match row.storage {
                Storage::Volatile => None,
                Storage::OnCommand(_) => Some("on command"),
                Storage::Automatic(_) => Some("at once"),
            },
            default: writable.then_some(row.default),
            note: row.note,
        }
    }
}

/// The objects of the CANopen firmware.
#[derive(Debug, Serialize)]
struct Objects {
    product: &'static str,
    objects: Vec<Value>,
}

/// An object that has a value.
#[derive(Debug, Serialize)]
struct Value {
    index: u16,
    sub_index: u8,
    /// Of the index, where that has sub-indices.
    whole: Option<String>,
    name: String,
    /// The number of the data type, as CiA 301 has it.
    data_type: u8,
    /// As in an EDS: "const", "ro", "rw", "rwr" or "rww".
    access: &'static str,
    /// The smallest and the largest number that it takes; null for what is not written, and for texts.
    limits: Option<(i64, i64)>,
    /// As in an EDS; null if it cannot be said beforehand.
    default: Option<String>,
    unit: Option<&'static str>,
    /// Whether a PDO can carry it.
    pdo_mapping: bool,
    /// Writing it makes the module do something, so that a value read from it must not be written back.
    is_command: bool,
}

impl Value {
    fn of(described: &Described) -> Self {
        let (row, name) = (described.row, described.name());
        let whole = described.whole();
        Self {
            index: described.index(),
            sub_index: row.sub,
            whole: (whole != name).then_some(whole),
            name,
            data_type: row.data.number(),
            access: described.access(),
            limits: described.limits(),
            default: described.default(None),
            unit: (!row.unit.is_empty()).then_some(row.unit),
            pdo_mapping: row.mapping != Mapping::No,
            is_command: described.is_command(),
        }
    }
}

/// All parameters of a product: their numbers, names, ranges, units, defaults, and whether they are stored.
pub fn parameters(product: Product) -> String {
    let of = Some(product);
    text(&Parameters {
        product: product.name(),
        axes: product.spec().axes,
        axis: Entry::of_axis(of, 0).map(Parameter::of).collect(),
        global: Entry::globals(of).map(Parameter::of).collect(),
        interrupts: Entry::interrupts(of).map(Parameter::of).collect(),
    })
}

/// The object dictionary of the TMCM-1140 with the CANopen firmware.
pub fn objects() -> String {
    text(&Objects { product: Product::Tmcm1140.name(), objects: Described::all().iter().map(Value::of).collect() })
}

/// Nothing of these tables is anything that JSON does not have.
fn text(table: &impl Serialize) -> String {
    serde_json::to_string_pretty(table).unwrap_or_default() + "\n"
}
