//! Values with their units, as a user writes them: `60 rpm`, `1000 int`, `0.5 s`.

use tmcm::module::Spec;
use tmcm_sim::suggest::suggestion;

use super::exact::Exact;
use super::scale::{MotionUnit, Quantity};
use super::{current, time};

/// Other ways to write a unit, without spaces.
const ALIASES: [(&str, &str); 12] = [
    ("microsteps/s", "pps"),
    ("usteps/s", "pps"),
    ("microsteps/s2", "pps2"),
    ("usteps/s2", "pps2"),
    ("pps/s", "pps2"),
    ("fs/s", "fullsteps/s"),
    ("fs/s2", "fullsteps/s2"),
    ("turns/s", "rps"),
    ("turns/s2", "rps/s"),
    ("rps2", "rps/s"),
    ("turns/min", "rpm"),
    ("sec", "s"),
];

/// A meaning that a number with its unit can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// A speed, or an acceleration, in this unit.
    Motion(Quantity, MotionUnit),
    /// A time, of which one unit is so many seconds.
    Time(Exact),
    /// A current, of which one unit is so many amperes.
    Current(Exact),
}

/// A value that is to be converted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Value {
    /// The value as it is repeated to the user.
    pub(super) text: String,
    /// The number before the unit.
    pub(super) number: Exact,
    /// The unit as it is shown.
    pub(super) unit: String,
    /// The meanings that it can have, at least one.
    pub(super) meanings: Vec<Meaning>,
}

/// Reads values, one after the other. A word that begins as a number does begins a value; those behind it are its unit.
///
/// # Errors
/// A message about what is no value, with an example or a suggestion.
pub(super) fn read(spec: &Spec, words: &[String]) -> Result<Vec<Value>, String> {
    let mut parts: Vec<(String, String)> = Vec::new();
    for word in words.iter().flat_map(|word| word.split([' ', ','])).filter(|word| !word.is_empty()) {
        let digits = word.bytes().take_while(|byte| byte.is_ascii_digit() || b"+-.".contains(byte)).count();
        let (number, unit) = word.split_at(digits);
        if !number.is_empty() {
            parts.push((number.into(), unit.into()));
        } else if let Some((_, last)) = parts.last_mut() {
            let space = if last.is_empty() { "" } else { " " };
            last.push_str(space);
            last.push_str(unit);
        } else {
            return Err(format!("'{word}' is no number. Write a number and its unit, for example '60 rpm'"));
        }
    }
    parts.into_iter().map(|(number, unit)| value(spec, &number, &unit)).collect()
}

/// Reads one value.
fn value(spec: &Spec, number: &str, unit: &str) -> Result<Value, String> {
    let exact = Exact::parse(number).ok_or_else(|| {
        format!("'{number}' is no number that can be converted. Write it with at most 15 digits, such as 51200 or -0.5")
    })?;
    let known = known(spec);
    let names = || known.iter().map(|(name, _)| name.as_str());
    if unit.is_empty() {
        let mut names: Vec<&str> = names().collect();
        names.dedup();
        let names = names.join(", ");
        return Err(format!("'{number}' has no unit. Write one behind it: {names}"));
    }
    let meant = plain(unit);
    let meant = ALIASES.iter().find(|(alias, _)| *alias == meant).map_or(meant.as_str(), |(_, name)| name);
    let found = known.iter().filter(|(name, _)| plain(name) == meant);
    let (names_found, meanings): (Vec<_>, Vec<_>) = found.cloned().unzip();
    match names_found.into_iter().next() {
        Some(unit) => Ok(Value { text: format!("{number} {unit}"), number: exact, unit, meanings }),
        None => {
            let mut all: Vec<&str> = names().collect();
            all.dedup();
            let suggestion = suggestion(unit, all.iter().copied());
            Err(format!("'{unit}' is none of the units {}{suggestion}", all.join(", ")))
        }
    }
}

/// A unit's name as names are compared.
fn plain(name: &str) -> String {
    name.to_lowercase().replace("^2", "2").replace('²', "2").replace('µ', "u").split_whitespace().collect()
}

/// The units that can be written, and what each means; one that means several things is there as often, one after the
/// other.
fn known(spec: &Spec) -> Vec<(String, Meaning)> {
    let motion = MotionUnit::ALL.into_iter().flat_map(|unit| {
        Quantity::ALL.map(|quantity| (unit.name(quantity).to_owned(), Meaning::Motion(quantity, unit)))
    });
    let times = time::units(spec).map(|(name, seconds)| (name.to_owned(), Meaning::Time(seconds)));
    let currents = current::units().map(|(name, amperes)| (name.to_owned(), Meaning::Current(amperes)));
    motion.chain(times).chain(currents).collect()
}
