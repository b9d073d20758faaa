//! The table of a module's parameters: numbers, values, ranges, defaults.

use tmcm::param::Row;

use super::entry::Entry;
use super::place::{INTERRUPTS, Where};
use crate::conversation::Conversation;
use crate::failure::Failure;
use crate::product::symbol;
use crate::stop::Stop;

/// The values that a parameter takes, in words.
pub fn range(row: &Row) -> String {
    let one = |&(low, high): &(i32, i32)| match (low, high) {
        (i32::MIN, i32::MAX) => "any".into(),
        (low, high) if low == high => low.to_string(),
        (low, high) => format!("{low}..{high}"),
    };
    if row.writable() { row.ranges.iter().map(one).collect::<Vec<_>>().join(", ") } else { "read only".into() }
}

/// Reads the tables of a module's parameters, each of an axis or a bank, in words. If `at` names an axis or a bank,
/// there is only the table of that one. The tables have only parameters whose names contain all of `words`. `tell`
/// takes each table as soon as it has been read, and ends the list by false.
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
    let axes = module.axes()?;
    if let Some(bank) = at.bank.filter(|bank| ![0, INTERRUPTS].contains(bank)) {
        return Err(Failure::Failed(format!(
            "--bank {bank}: only banks 0 and 3 have names and ranges; a variable is read by get --bank 2 NUMBER"
        )));
    }
    let mut found = false;
    let wanted = |name: &str| words.iter().all(|word| name.to_lowercase().contains(&word.to_lowercase()));
    for axis in (0..axes).filter(|axis| at.bank.is_none() && at.axis.is_none_or(|only| only == *axis)) {
        let in_chip = module.is_in_chip_units(axis)?;
        let entries = Entry::of_axis(product, axis).filter(|entry| wanted(&entry.name)).collect();
        if let Some(table) = table(module, &format!("Axis {axis}"), entries, in_chip, stop)? {
            found = true;
            if !tell(&table) {
                return Ok(());
            }
        }
    }
    let has_bank = |bank| at.axis.is_none() && at.bank.is_none_or(|only| only == bank);
    if has_bank(0) {
        let entries = Entry::globals(product).filter(|entry| wanted(&entry.name)).collect();
        if let Some(table) = table(module, "Global parameters, bank 0", entries, false, stop)? {
            found = true;
            if !tell(&table) {
                return Ok(());
            }
        }
    }
    if has_bank(INTERRUPTS) {
        let entries = Entry::interrupts(product).filter(|entry| wanted(&entry.name)).collect();
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
    for entry in entries {
        let clears = entry.clears(product);
        let Entry { setting, row, name } = entry;
        if stop.happened() {
            return Err(stop.interrupted(""));
        }
        let value = match setting.read() {
            _ if clears => "-".into(),
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
