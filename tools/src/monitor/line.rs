//! Samples as lines for people.

use tmcm::param::AxisParameter;

use super::column::{Column, Usual};
use crate::product::{Product, numbers, speed_unit, symbol};
use crate::status::{DRIVER_FLAGS, EXTENDED_FLAGS, STANDSTILL};

/// The text for axes that are left out.
const DOTS: &str = "...";

/// The values that are shown of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    /// The number of the axis.
    pub axis: u8,
    /// The present values of the axis.
    pub sample: Usual,
    /// The extended error flags of all samples so far.
    pub seen: i32,
}

/// How speeds of a module are shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Speeds {
    /// Width in characters of the longest number.
    width: usize,
    /// The unit behind the number, with a space before it.
    unit: String,
}

impl Speeds {
    /// The speeds of a product; `in_chip` if its unit mode says that they are in units of the chip.
    pub fn of(product: Option<Product>, in_chip: bool) -> Self {
        let ranges = numbers(product).axis.row(AxisParameter::ActualSpeed).map_or(&[][..], |row| row.ranges);
        let width = ranges.first().map_or(1, |(low, _)| low.to_string().len());
        let unit = product.map(|product| symbol(speed_unit(product), in_chip));
        Speeds { width, unit: unit.map_or_else(String::new, |unit| format!(" {unit}")) }
    }
}

/// A sample as a line.
pub fn line(Shown { sample, seen, .. }: &Shown, Speeds { width, unit }: &Speeds) -> String {
    let [position, speed, load, driver, _, left, right, home] = *sample;
    let pressed = [(left, "left"), (right, "right"), (home, "home")];
    let pressed: Vec<&str> = pressed.into_iter().filter(|(value, _)| *value == Some(1)).map(|(_, name)| name).collect();
    format!(
        "position {:>11}  speed {:>width$}{unit}  load {:>4}  switches {}  driver {}  errors {}",
        number(position),
        number(speed),
        number(load),
        listed(&pressed),
        listed(&flags(driver.unwrap_or_default(), &DRIVER_FLAGS)),
        listed(&flags(*seen, &EXTENDED_FLAGS)),
    )
}

/// A sample as a line of a terminal with so many columns. The line is in words if there is room, else with `lrh` for
/// closed switches and with the errors of driver and axis together. If that is too long as well, it is as one of
/// several axes.
pub fn short(shown: &Shown, speeds: &Speeds, columns: usize) -> String {
    let all = line(shown, speeds);
    if all.len() <= columns {
        return all;
    }
    let [position, speed, load, driver, _, left, right, home] = shown.sample;
    let mark = |level: Option<i32>, mark| if level == Some(1) { mark } else { '-' };
    let [left, right, home] = [mark(left, 'l'), mark(right, 'r'), mark(home, 'h')];
    let mut errors = flags(shown.seen, &EXTENDED_FLAGS);
    errors.extend(flags(driver.unwrap_or_default() & !STANDSTILL, &DRIVER_FLAGS));
    let (width, unit) = (speeds.width, &speeds.unit);
    let head = format!(
        "position {:>11}  speed {:>width$}{unit}  load {:>4}  {left}{right}{home}  errors ",
        number(position),
        number(speed),
        number(load)
    );
    let mut names = listed(&errors);
    while head.len() + names.len() > columns {
        // Some of the names are better than none.
        if errors.pop().is_none() || errors.is_empty() {
            return status(&[*shown], speeds, columns);
        }
        names = format!("{} {DOTS}", errors.join(" "));
    }
    head + &names
}

/// The values of columns of one's own choice as a line, each behind its name.
pub fn named(columns: &[Column], values: &[Option<i32>]) -> String {
    let all = columns.iter().zip(values).map(|(Column { name, .. }, value)| format!("{name} {}", number(*value)));
    all.collect::<Vec<_>>().join("  ")
}

/// All axes in one line of a terminal with so many columns, with as much of each as there is room for. That is position
/// and speed with `lrh` for closed switches and `!` for errors, or the position alone, with `!` in place of the colon.
/// Axes for which there is no room at all are three dots.
pub fn status(all: &[Shown], Speeds { width, .. }: &Speeds, columns: usize) -> String {
    let roomy = |shown: &Shown| {
        let [position, speed, _, _, _, left, right, home] = shown.sample;
        let mark = |on: bool, mark| if on { mark } else { '-' };
        let [left, right, home] =
            [(left, 'l'), (right, 'r'), (home, 'h')].map(|(level, name)| mark(level == Some(1), name));
        let error = mark(has_error(shown), '!');
        format!("{} {:>11} {:>width$} {left}{right}{home}{error}", shown.axis, number(position), number(speed))
    };
    let tight = |shown: &Shown| {
        let colon = if has_error(shown) { '!' } else { ':' };
        format!("{}{colon}{:>10}", shown.axis, number(shown.sample[0]))
    };
    let line = all.iter().map(roomy).collect::<Vec<_>>().join("  ");
    if line.len() <= columns {
        return line;
    }
    let mut axes: Vec<String> = all.iter().map(tight).collect();
    let length = |axes: &[String]| axes.iter().map(|axis| axis.len() + 1).sum::<usize>();
    if length(&axes) > columns + 1 {
        while !axes.is_empty() && length(&axes) + DOTS.len() > columns {
            axes.pop();
        }
        axes.push(DOTS.into());
    }
    axes.join(" ")
}

fn has_error(shown: &Shown) -> bool {
    shown.seen != 0 || shown.sample[3].is_some_and(|flags| flags & !STANDSTILL != 0)
}

fn number(value: Option<i32>) -> String {
    value.map_or_else(|| "-".into(), |value| value.to_string())
}

/// The names of the bits that are set.
fn flags(bits: i32, names: &[&'static str]) -> Vec<&'static str> {
    (0..).zip(names).filter(|(bit, _)| bits & (1 << bit) != 0).map(|(_, name)| *name).collect()
}

fn listed(names: &[&str]) -> String {
    if names.is_empty() { "-".into() } else { names.join(" ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUSY: Usual = [Some(-51_200), Some(1000), None, Some(0b1000_0001), Some(0), Some(1), Some(0), Some(1)];
    const QUIET: Usual = [Some(7), Some(0), Some(0), Some(128), Some(0), Some(0), Some(0), Some(0)];

    fn internal() -> Speeds {
        Speeds::of(Some(Product::Tmcm1140), false)
    }

    fn shown(axis: u8, sample: Usual, seen: i32) -> Shown {
        Shown { axis, sample, seen }
    }

    #[test]
    fn a_sample_in_words() {
        assert_eq!(
            line(&shown(0, BUSY, 1), &internal()),
            "position      -51200  speed  1000 int  load    -  switches left home  driver SG STST  errors stall"
        );
        assert!(line(&shown(0, Usual::default(), 0), &internal()).ends_with("switches -  driver -  errors -"));
        let unknown = line(&shown(0, QUIET, 0), &Speeds::of(None, false));
        assert_eq!(unknown, "position           7  speed     0  load    0  switches -  driver STST  errors -");
    }

    /// Whatever the width of the terminal: what is seen tells of errors.
    #[test]
    fn errors_are_seen_on_narrow_terminals() {
        let of = |columns| short(&shown(0, BUSY, 1), &internal(), columns);
        assert!(of(120).ends_with("driver SG STST  errors stall"));
        assert_eq!(of(79), "position      -51200  speed  1000 int  load    -  l-h  errors stall SG");
        let all = short(&shown(0, [Some(7); 8], 3), &internal(), 79);
        assert!(all.ends_with("  ---  errors stall ..."), "{all}");
        assert_eq!(of(39), "0      -51200  1000 l-h!");
        assert_eq!(of(20), "0!    -51200");
        assert_eq!(
            short(&shown(0, QUIET, 0), &internal(), 79),
            "position           7  speed     0 int  load    0  ---  errors -"
        );
        assert_eq!(short(&shown(0, QUIET, 0), &internal(), 39), "0           7     0 ----");
    }

    /// The TMCM-3212 has speeds in pps, or in units of its chip, and short circuits to the supply.
    #[test]
    fn speeds_have_the_unit_of_the_product() {
        let fast = [Some(0), Some(-7_999_774), Some(7), Some(0b11 << 8), Some(0), Some(0), Some(0), Some(0)];
        let shown = |in_chip| line(&shown(0, fast, 0), &Speeds::of(Some(Product::Tmcm3212), in_chip));
        assert_eq!(
            shown(false),
            "position           0  speed -7999774 pps  load    7  switches -  driver S2VSA S2VSB  errors -"
        );
        assert!(shown(true).contains("speed -7999774 chip  load"));
    }

    #[test]
    fn several_axes_fit_into_a_line() {
        let two = [shown(0, BUSY, 0), shown(2, QUIET, 0)];
        assert_eq!(status(&two, &internal(), 79), "0      -51200  1000 l-h!  2           7     0 ----");
        assert_eq!(status(&two, &internal(), 49), "0!    -51200 2:         7");
        assert_eq!(status(&[shown(5, QUIET, 2)], &internal(), 20), "5!         7");
        assert_eq!(status(&[shown(5, Usual::default(), 0)], &internal(), 20), "5:         -");
        let long = [Some(-123_456_789), Some(-2047), Some(0), Some(128), Some(0), Some(1), Some(1), Some(1)];
        let of = |axes: u8| status(&(0..axes).map(|axis| shown(axis, long, 1)).collect::<Vec<_>>(), &internal(), 79);
        assert!((1..=6).all(|axes| of(axes).len() <= 79));
        assert!(of(3).contains("lrh!") && of(6).ends_with("5!-123456789"));
        // Where there is no room for an axis, nobody takes half of it for the whole.
        assert_eq!(status(&two, &internal(), 25), "0!    -51200 2:         7");
        assert_eq!(status(&two, &internal(), 24), "0!    -51200 ...");
        assert_eq!(
            (status(&two, &internal(), 16).as_str(), status(&two, &internal(), 15).as_str()),
            ("0!    -51200 ...", "...")
        );
    }
}
