//! Times: in seconds, and in the units in which parameters and commands of a product have them.

use tmcm::module::Spec;
use tmcm::param::{Row, Unit};

use super::exact::Exact;
use super::scale::CLOCK;

/// Units of time that are no product's own, in microseconds.
const COMMON: [(&str, i128); 4] = [("us", 1), ("ms", 1_000), ("s", 1_000_000), ("min", 60_000_000)];

/// A unit in which a product has times.
pub(super) struct Tick {
    /// The unit as the product's tables have it.
    pub(super) name: &'static str,
    /// The length of the unit in seconds.
    pub(super) seconds: Exact,
    /// The number of units nearest to the time, unless that is 0 in place of a time.
    pub(super) number: Option<i32>,
    /// The parameters and commands that take this number.
    pub(super) takers: Vec<String>,
}

/// The length of a unit in seconds, if it is one of time, and what has times in it besides parameters of a table. The
/// times of WAIT are in 10 ms (manual section 3.7.22), the periods of the timers in ms (section 5.4).
fn time(unit: Unit) -> Option<(Exact, &'static [&'static str])> {
    match unit {
        Unit::Milliseconds => Some((Exact::ratio(1, 1_000), &["timers (bank 3)"])),
        Unit::TenMilliseconds => Some((Exact::ratio(1, 100), &["WAIT"])),
        Unit::Clocks512 => Some((Exact::ratio(512, CLOCK), &[])),
        Unit::Clocks2To18 => Some((Exact::ratio(1 << 18, CLOCK), &[])),
        _ => None,
    }
}

/// The units of time that can be written for a product, with their lengths in seconds.
pub(super) fn units(spec: &Spec) -> impl Iterator<Item = (&'static str, Exact)> {
    let common = COMMON.map(|(name, microseconds)| (name, Exact::ratio(microseconds, 1_000_000)));
    let own = own(spec).into_iter().filter_map(|unit| Some((unit.symbol(), time(unit)?.0)));
    common.into_iter().chain(own.filter(move |(name, _)| common.iter().all(|(other, _)| other != name)))
}

/// The units in which a time of so many seconds can be told to a product.
pub(super) fn ticks(spec: &Spec, wanted: Exact) -> Vec<Tick> {
    let tick = |unit: Unit| {
        let (seconds, others) = time(unit)?;
        let number = (wanted * seconds.inverse()).rounded();
        let number = i32::try_from(number).ok().filter(|number| *number != 0 || wanted.is_zero());
        let takes = |row: &Row| row.unit == unit && row.writable() && number.is_some_and(|number| row.accepts(number));
        let takers = rows(spec).filter(|(_, row)| takes(row)).map(|(kind, row)| format!("{kind} {}", row.number));
        let others = others.iter().filter(|_| number.is_some()).map(|other| (*other).into());
        let takers = takers.chain(others).collect();
        Some(Tick { name: unit.symbol(), seconds, number, takers })
    };
    own(spec).into_iter().filter_map(tick).collect()
}

/// The units in which parameters of a product have times, each once.
fn own(spec: &Spec) -> Vec<Unit> {
    let mut units = Vec::new();
    for (_, row) in rows(spec) {
        if time(row.unit).is_some() && !units.contains(&row.unit) {
            units.push(row.unit);
        }
    }
    units
}

/// All parameters of a product, each with the kind of it.
fn rows(spec: &Spec) -> impl Iterator<Item = (&'static str, &'static Row)> {
    let axis = spec.axis.rows.iter().map(|parameter| ("AP", &parameter.row));
    axis.chain(spec.global.rows.iter().map(|parameter| ("GP", &parameter.row)))
}

#[cfg(test)]
mod tests {
    use tmcm::product::TMCM_3212;

    use super::*;

    /// 512 clocks of 16 MHz are 32 us, and 31250 of them are a second; 2^18 clocks are 16.384 ms (TMC5160 datasheet,
    /// sections 6.3.1 and 6.2).
    #[test]
    fn the_clocks_of_a_chip() {
        let ticks = ticks(&TMCM_3212, Exact::whole(1));
        let found =
            |name: &str| ticks.iter().find(|tick| tick.name == name).map(|tick| (tick.number, &tick.takers[..]));
        assert_eq!(found("x32 us"), Some((Some(31_250), &["AP 21".to_owned()][..])));
        // 1 / 0.016384 = 61.04, which is more than the 15 that parameter 31 takes.
        assert_eq!(found("x16.384 ms"), Some((Some(61), &[][..])));
        // Parameter 214 ends at 417.
        assert_eq!(found("x10 ms"), Some((Some(100), &["AP 214".to_owned(), "WAIT".to_owned()][..])));
    }
}
