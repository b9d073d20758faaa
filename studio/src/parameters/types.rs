//! Types of what is asked about parameters, and of what is told.

use serde::{Deserialize, Serialize};
use tmcl_tools::params::{INTERRUPTS, Setting, VARIABLES};

/// A bank of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ParameterBank {
    /// Parameters of an axis.
    Axis,
    /// Global parameters, of bank 0.
    Global,
    /// User variables, of bank 2.
    Variable,
    /// Parameters of interrupts, of bank 3.
    Interrupt,
    /// Coordinates of an axis.
    Coordinate,
}

/// Where a parameter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterPlace {
    /// The bank of the parameter.
    pub bank: ParameterBank,
    /// The number of the parameter.
    pub number: u8,
    /// The axis of the parameter; 0 for one that has none.
    pub axis: u8,
}

impl ParameterPlace {
    /// Where a setting is; `None` for a bank that has no name here.
    pub fn of(setting: Setting) -> Option<Self> {
        let (bank, number, axis) = match setting {
            Setting::Axis { number, axis, .. } => (ParameterBank::Axis, number, axis),
            Setting::Coordinate { number, axis, .. } => (ParameterBank::Coordinate, number, axis),
            Setting::Global { number, bank: 0, .. } => (ParameterBank::Global, number, 0),
            Setting::Global { number, bank: VARIABLES, .. } => (ParameterBank::Variable, number, 0),
            Setting::Global { number, bank: INTERRUPTS, .. } => (ParameterBank::Interrupt, number, 0),
            Setting::Global { .. } => return None,
        };
        Some(ParameterPlace { bank, number, axis })
    }

    /// The setting, with a value.
    pub fn with(self, value: i32) -> Setting {
        let ParameterPlace { bank, number, axis } = self;
        match bank {
            ParameterBank::Axis => Setting::Axis { number, axis, value },
            ParameterBank::Coordinate => Setting::Coordinate { number, axis, value },
            ParameterBank::Global => Setting::Global { number, bank: 0, value },
            ParameterBank::Variable => Setting::Global { number, bank: VARIABLES, value },
            ParameterBank::Interrupt => Setting::Global { number, bank: INTERRUPTS, value },
        }
    }
}

/// A parameter and a value for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterSetting {
    /// Where it is.
    pub place: ParameterPlace,
    /// The value.
    pub value: i32,
}

impl ParameterSetting {
    /// The setting.
    pub fn setting(&self) -> Setting {
        self.place.with(self.value)
    }
}

/// The tables of a product are wanted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersOf {
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
}

/// Values that a parameter takes: from the first to the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterRange {
    /// The least.
    pub low: i32,
    /// The greatest.
    pub high: i32,
}

/// When a parameter is stored in the EEPROM.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ParameterStored {
    /// Never.
    No,
    /// On command.
    Command,
    /// By the module itself, whenever it is written.
    Automatic,
}

/// The row of a parameter in the table of a product; one of an axis stands for those of all axes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterRow {
    /// The bank of the parameter.
    pub bank: ParameterBank,
    /// The number of the parameter.
    pub number: u8,
    /// The name of the parameter.
    pub name: String,
    /// The module's unit of its value; empty where a number speaks for itself.
    pub unit: String,
    /// The values that it takes.
    pub ranges: Vec<ParameterRange>,
    /// The same in words.
    pub takes: String,
    /// The value of the parameter in a new module.
    pub default: i32,
    /// Whether it can be written.
    pub writable: bool,
    /// When it is stored.
    pub stored: ParameterStored,
    /// Whether it is as it was written, and no live value.
    pub kept: bool,
    /// Whether reading clears it.
    pub clears: bool,
    /// A remark; it may be empty.
    pub note: String,
}

/// The tables of a product.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterTables {
    /// Number of axes; of a product that is not known the most that a known one has.
    pub axes: u8,
    /// The parameters: of an axis, global, of interrupts.
    pub rows: Vec<ParameterRow>,
}

/// Parameters that are meant.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersMeant {
    /// Where they are.
    pub of: Vec<ParameterPlace>,
}

/// The outcome for a parameter.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterTold {
    /// Where it is.
    pub place: ParameterPlace,
    /// The value that the module has; null if it was not asked for, or is refused.
    pub value: Option<i32>,
    /// The refusal of the module in words; empty if all was done.
    pub why: String,
}

/// The outcomes for parameters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersTold {
    /// The outcomes, one for each parameter that was meant, in their order.
    pub told: Vec<ParameterTold>,
}

/// Values that are to be written one after the other.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersWrite {
    /// The values.
    pub to: Vec<ParameterSetting>,
    /// Whether they are stored in the EEPROM, too.
    pub store: bool,
}

/// Lines of a file that are to be written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersRestore {
    /// The name of the file.
    pub name: String,
    /// The number of the product in its title; null if it has none.
    pub from: Option<u16>,
    /// The lines.
    pub to: Vec<ParameterSetting>,
    /// Whether they are stored in the EEPROM, too.
    pub store: bool,
}

/// The parameters that are to be stored.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersStore {
    /// The product; null for one that is not known.
    pub product: Option<String>,
    /// Number of axes.
    pub axes: u8,
    /// Where they are; null for all that the tables have.
    pub of: Option<Vec<ParameterPlace>>,
}

/// The writes that storing parameters takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterWrites {
    /// The parameters that are stored on command.
    pub of: Vec<ParameterPlace>,
    /// Number of writes to the EEPROM.
    pub writes: usize,
    /// Sentences that have to be known before; if nothing can be stored, they say why.
    pub lines: Vec<String>,
}

/// Values that are to be written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersToWrite {
    /// The product; null for one that is not known.
    pub product: Option<String>,
    /// The values.
    pub to: Vec<ParameterSetting>,
}

/// A line of direct mode that is to be sent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TypedLine {
    /// The line.
    pub line: String,
    /// The product; null for one that is not known.
    pub product: Option<String>,
}

/// Sentences that have to be known before values are written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterWords {
    /// Sentences; none if there is nothing.
    pub lines: Vec<String>,
}

/// A file of `tmcl params`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParametersFile {
    /// The name of the file.
    pub name: String,
    /// The contents of the file.
    pub text: String,
    /// The product for which it is read; null for one that is not known.
    pub product: Option<String>,
}

/// A line of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterLine {
    /// Where the parameter is.
    pub place: ParameterPlace,
    /// The value in the file.
    pub value: i32,
    /// The parameter in words.
    pub name: String,
    /// Whether two modules at a bus must not have the same: it is not ticked by itself.
    pub interface: bool,
    /// Why the module will not take it; empty if it should.
    pub why: String,
}

/// The contents of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterLines {
    /// The number of the product in its title; null if it has none.
    pub from: Option<u16>,
    /// The lines of the file. Of several about the same parameter it has the last one.
    pub lines: Vec<ParameterLine>,
}

#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use serde_json::json;
    let place = ParameterPlace { bank: ParameterBank::Axis, number: 4, axis: 0 };
    let setting = ParameterSetting { place, value: 1000 };
    let told = ParameterTold { place, value: None, why: "no".into() };
    let row = ParameterRow {
        bank: ParameterBank::Axis,
        number: 4,
        name: "maximum positioning speed".into(),
        unit: "int".into(),
        ranges: vec![ParameterRange { low: 1, high: 2047 }],
        takes: "1..2047".into(),
        default: 1000,
        writable: true,
        stored: ParameterStored::Command,
        kept: true,
        clears: false,
        note: String::new(),
    };
    let line = ParameterLine { place, value: 1, name: "name".into(), interface: false, why: String::new() };
    let mut examples = vec![
        ("ParameterPlace", json!(place)),
        ("ParameterSetting", json!(setting)),
        ("ParametersMeant", json!(ParametersMeant { of: vec![place] })),
        ("ParameterTold", json!(told)),
        ("ParameterTold", json!(ParameterTold { value: Some(1), why: String::new(), ..told.clone() })),
        ("ParametersTold", json!(ParametersTold { told: vec![told] })),
        ("ParameterRange", json!(ParameterRange { low: 1, high: 2 })),
        ("ParameterTables", json!(ParameterTables { axes: 1, rows: vec![row.clone()] })),
        ("ParametersWrite", json!(ParametersWrite { to: vec![setting], store: true })),
        ("ParameterWrites", json!(ParameterWrites { of: vec![place], writes: 1, lines: vec!["one".into()] })),
        ("ParameterWords", json!(ParameterWords { lines: vec!["one".into()] })),
        ("ParameterLine", json!(line)),
    ];
    for bank in [
        ParameterBank::Axis,
        ParameterBank::Global,
        ParameterBank::Variable,
        ParameterBank::Interrupt,
        ParameterBank::Coordinate,
    ] {
        examples.push(("ParameterBank", json!(bank)));
    }
    for stored in [ParameterStored::No, ParameterStored::Command, ParameterStored::Automatic] {
        examples.push(("ParameterStored", json!(stored)));
        examples.push(("ParameterRow", json!(ParameterRow { stored, ..row.clone() })));
    }
    for product in [Some(String::from("1140")), None] {
        let (text, to) = (String::new(), vec![setting]);
        let of = product.as_ref().map(|_| vec![place]);
        let from = product.as_ref().map(|_| 1140);
        let name = String::from("a.tmcl");
        examples.extend([
            ("TypedLine", json!(TypedLine { line: "STAP 4, 0".into(), product: product.clone() })),
            ("ParametersOf", json!(ParametersOf { product: product.clone() })),
            ("ParametersStore", json!(ParametersStore { product: product.clone(), axes: 1, of })),
            ("ParametersToWrite", json!(ParametersToWrite { product: product.clone(), to: to.clone() })),
            ("ParametersRestore", json!(ParametersRestore { name: name.clone(), from, to, store: true })),
            ("ParameterLines", json!(ParameterLines { from, lines: vec![line.clone()] })),
            ("ParametersFile", json!(ParametersFile { name, text, product })),
        ]);
    }
    examples
}
