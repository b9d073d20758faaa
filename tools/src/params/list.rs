//! The table of a module's parameters: numbers, values, ranges, defaults.

use tmcm::param::{AxisParameter, INTERRUPTS, Row};
use tmcm::tmcl::{Command, Opcode};

use super::file::Setting;
use super::place::Where;
use crate::conversation::Conversation;
use crate::failure::Failure;
use crate::product::{Product, axis_number, numbers, symbol};
use crate::stop::Stop;

/// Bank of the parameters of interrupts.
const BANK_OF_INTERRUPTS: u8 = 3;

/// What a parameter takes, in words.
pub(super) fn range(row: &Row) -> String {
    let one = |&(low, high): &(i32, i32)| match (low, high) {
        (i32::MIN, i32::MAX) => "any".into(),
        (low, high) if low == high => low.to_string(),
        (low, high) => format!("{low}..{high}"),
    };
    if row.writable() { row.ranges.iter().map(one).collect::<Vec<_>>().join(", ") } else { "read only".into() }
}

/// A parameter of the table: where it is, its row, its name.
struct Entry {
    setting: Setting,
    row: &'static Row,
    name: String,
}

/// The tables of a module's parameters, each of an axis or a bank, in words; of this axis or this bank only if there is one, and
/// only parameters whose names contain all of `words`. `tell` takes each as soon as it has been read, and ends it by false.
///
/// # Errors
/// There are no such parameters, the link fails, or it is to end.
pub fn list(
    module: &mut Conversation,
    words: &[String],
    at: Where,
    stop: &dyn Stop,
    tell: &mut dyn FnMut(&str) -> bool,
) -> Result<(), Failure> {
    let product = module.product()?;
    let spec = numbers(product);
    let axes = module.axes()?;
    if let Some(bank) = at.bank.filter(|bank| ![0, BANK_OF_INTERRUPTS].contains(bank)) {
        return Err(Failure::Failed(format!(
            "--bank {bank}: only banks 0 and 3 have names and ranges; a variable is read by get --bank 2 NUMBER"
        )));
    }
    let mut found = false;
    let wanted = |name: &str| words.iter().all(|word| name.to_lowercase().contains(&word.to_lowercase()));
    for axis in (0..axes).filter(|axis| at.bank.is_none() && at.axis.is_none_or(|only| only == *axis)) {
        let entries = spec.axis.rows.iter().map(|found| Entry {
            setting: Setting::Axis { number: found.row.number, axis, value: 0 },
            row: &found.row,
            name: found.row.name.into(),
        });
        let in_chip = module.is_in_chip_units(axis)?;
        let entries = entries.filter(|entry| wanted(&entry.name)).collect();
        if let Some(table) = table(module, &format!("Axis {axis}"), entries, in_chip, stop)? {
            found = true;
            if !tell(&table) {
                return Ok(());
            }
        }
    }
    let has_bank = |bank| at.axis.is_none() && at.bank.is_none_or(|only| only == bank);
    if has_bank(0) {
        let entries = spec.global.rows.iter().map(|found| Entry {
            setting: Setting::Global { number: found.row.number, bank: 0, value: 0 },
            row: &found.row,
            name: found.row.name.into(),
        });
        let entries = entries.filter(|entry| wanted(&entry.name)).collect();
        if let Some(table) = table(module, "Global parameters, bank 0", entries, false, stop)? {
            found = true;
            if !tell(&table) {
                return Ok(());
            }
        }
    }
    if has_bank(BANK_OF_INTERRUPTS) {
        let entries = INTERRUPTS.iter().flat_map(|kind| {
            (0..kind.per.count(spec.axes, spec.inputs)).filter_map(|index| {
                let number = kind.number(index);
                let setting = Setting::Global { number, bank: BANK_OF_INTERRUPTS, value: 0 };
                Some(Entry { setting, row: kind.row.as_ref()?, name: kind.parameter_name(index)?.to_string() })
            })
        });
        let entries = entries.filter(|entry| wanted(&entry.name)).collect();
        if let Some(table) = table(module, "Interrupts, bank 3", entries, false, stop)? {
            found = true;
            if !tell(&table) {
                return Ok(());
            }
        }
    }
    match found {
        false => Err(Failure::Failed("no parameter has all these words in its name".into())),
        true => Ok(()),
    }
}

/// True for a command that takes away what it reads: the extended error flags are cleared by that.
fn clears(command: Command, product: Option<Product>) -> bool {
    command.opcode == Opcode::Gap as u8 && axis_number(product, AxisParameter::ExtendedErrorFlags) == Some(command.kind)
}

/// The parameters below a heading; `None` if there are none. A star stands behind a value that is not the
/// default. Parameters that the module refuses to read are left out.
fn table(
    module: &mut Conversation,
    heading: &str,
    entries: Vec<Entry>,
    in_chip: bool,
    stop: &dyn Stop,
) -> Result<Option<String>, Failure> {
    let product = module.product()?;
    let mut rows = Vec::new();
    for Entry { setting, row, name } in entries {
        if stop.happened() {
            return Err(stop.interrupted(""));
        }
        let value = match setting.read() {
            command if clears(command, product) => "-".into(),
            command => match module.value(command) {
                Ok(value) if row.writable() && row.stored() && value != row.default => format!("{value}*"),
                Ok(value) => value.to_string(),
                Err(error) if error.is_refusal() => continue,
                Err(error) => return Err(error.into()),
            },
        };
        let number = setting.read().kind.to_string();
        let unit = symbol(row.unit, in_chip).to_owned();
        rows.push([number, value, unit, range(row), row.default.to_string(), name]);
    }
    if rows.is_empty() {
        return Ok(None);
    }
    let head = ["", "value", "unit", "takes", "default", "name"].map(String::from);
    let width = |column: usize| {
        let cells = rows.iter().chain([&head]).filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or_default()
    };
    let [first, second, third, fourth, fifth] = [0, 1, 2, 3, 4].map(width);
    let mut text = format!("{heading}\n");
    for [number, value, unit, takes, default, name] in [&head].into_iter().chain(&rows) {
        text += &format!(
            "  {number:>first$}  {value:>second$}  {unit:third$}  {takes:fourth$}  {default:>fifth$}  {name}\n"
        );
    }
    Ok(Some(text))
}
