//! Currents: in amperes, and in the numbers that a product's parameters have them in.
//!
//! The driver has 32 steps of current (manual chapter 4, parameter 6). A number of 8n to 8n + 7 gives the coils n + 1
//! of 32 parts of the module's full current.

use tmcm::param::Unit;

use super::exact::Exact;
use super::table::{self, Line};
use crate::product::Product;

/// Units of current, each in milliamperes.
const UNITS: [(&str, i128); 2] = [("A", 1_000), ("mA", 1)];
/// The steps of the driver, and the numbers of a parameter that give the same step.
pub(super) const STEPS: i128 = 32;
pub(super) const EACH: i128 = 8;
/// The number of the full current.
pub(super) const FULL: i128 = 255;

/// The current that a module makes of a wanted one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Made {
    /// The number that is next to the current, as a fraction.
    wanted: Exact,
    /// The number that is written.
    pub(super) number: i128,
    /// The current that the coils get, in amperes RMS.
    amperes: Exact,
}

/// The units that can be written, each in amperes.
pub(super) fn units() -> impl Iterator<Item = (&'static str, Exact)> {
    UNITS.into_iter().map(|(name, milliamperes)| (name, Exact::ratio(milliamperes, 1_000)))
}

/// Finds what a module whose full current is so many mA makes of a current in amperes.
pub(super) fn make(full: u32, wanted: Exact) -> Made {
    let full = Exact::ratio(full.into(), 1_000);
    let share = wanted * full.inverse();
    let step = (share * Exact::whole(STEPS)).rounded().clamp(1, STEPS);
    let number = share * Exact::whole(FULL);
    Made {
        wanted: number,
        number: number.rounded().clamp(EACH * (step - 1), EACH * step - 1),
        amperes: full * Exact::ratio(step, STEPS),
    }
}

/// Fails for a current that the product does not have.
pub(super) fn possible(product: Product, text: &str, wanted: Exact) -> Result<(), String> {
    let (spec, most) = (product.spec(), Exact::ratio(product.kind().full_current.into(), 1_000));
    if wanted.is_negative() {
        return Err(format!("{text}: a current is not negative"));
    }
    if wanted.approximate() > most.approximate() {
        return Err(format!("{text}: a current of a {} is at most {} A", spec.usb, most.shown()));
    }
    Ok(())
}

/// Tells what a current of so many amperes RMS is, which the user has written as `text`.
///
/// # Errors
/// The product has no such current.
pub(super) fn text(product: Product, text: &str, wanted: Exact) -> Result<String, String> {
    let (spec, full) = (product.spec(), product.kind().full_current);
    let most = Exact::ratio(full.into(), 1_000);
    possible(product, text, wanted)?;
    let made = make(full, wanted);
    let takes = spec.axis.rows.iter().map(|parameter| &parameter.row);
    let takes = takes.filter(|row| row.unit == Unit::Current && row.writable()).map(|row| format!("AP {}", row.number));
    let peak = |amperes: Exact| format!("{:.4}", amperes.approximate() * std::f64::consts::SQRT_2);
    let line =
        |unit: &str, numbers: [String; 2], remark: String| Line { unit: unit.into(), numbers: numbers.into(), remark };
    let lines = [
        line("A RMS", [wanted.shown(), made.amperes.shown()], String::new()),
        line("A peak", [peak(wanted), peak(made.amperes)], String::new()),
        line(
            Unit::Current.symbol(),
            [made.wanted.shown(), made.number.to_string()],
            takes.collect::<Vec<_>>().join(", "),
        ),
    ];
    let head = format!("{text} as a current of a {}, whose full current is {} A RMS\n", spec.usb, most.shown());
    Ok(head + &table::text(&["wanted", "gets"], &lines))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 2 A one of 32 steps is 62.5 mA: 1.2 A are 19.2 of them, so 19, 1.1875 A, which 144 to 151 give; 1.2 A are 153
    /// of
    /// 255. The lowest step is that of 0 to 7, and 255 is the full current.
    #[test]
    fn steps_of_current() {
        let made = |amperes: &str| {
            let made = make(2_000, Exact::parse(amperes).expect("a number"));
            (made.wanted.shown(), made.number, made.amperes.shown())
        };
        assert_eq!(made("1.2"), ("153".into(), 151, "1.1875".into()));
        assert_eq!(made("0"), ("0".into(), 0, "0.0625".into()));
        assert_eq!(made("2"), ("255".into(), 255, "2".into()));
        assert_eq!(made("0.0625"), ("7.96875".into(), 7, "0.0625".into()));
        // Half of 1.1 A of a TMCM-6110: 16 steps, 120 to 127.
        assert_eq!(make(1_100, Exact::ratio(55, 100)).number, 127);
    }
}
