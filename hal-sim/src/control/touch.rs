//! Objects in the world of a board that can be touched, each with the lines of the control port that do it. They are
//! for somebody who has hands, or a page with buttons.

use super::{Control, HIGHEST_INPUT};
use crate::board::BoardKind;
use crate::fault::Fault;
use crate::world::ANALOG_MAX;

/// Something that can be touched.
#[derive(Clone, Debug, PartialEq)]
pub struct Touchable {
    /// The axis whose it is; none for what is of the whole board.
    pub axis: Option<usize>,
    /// The name of the object.
    pub name: String,
    /// How it is touched.
    pub how: Touch,
    /// The value that shows how it is, as conditions name it; none for what the state does not tell.
    pub shown: Option<String>,
}

/// How something is touched: by which lines.
#[derive(Clone, Debug, PartialEq)]
pub enum Touch {
    /// The object is on or off.
    Switch {
        /// Switches it on.
        on: String,
        /// Switches it off.
        off: String,
    },
    /// The object has a number, which stands in the line between `before` and `behind`.
    Number {
        /// The line before the number.
        before: String,
        /// The line behind it.
        behind: String,
        /// The least number.
        least: f64,
        /// The greatest number.
        greatest: f64,
        /// Numbers are multiples of it.
        step: f64,
        /// The unit of the number; empty if it has none.
        unit: &'static str,
        /// A blow: the number is no state, but something that happens.
        once: bool,
    },
    /// The object is in one of several states: the name of each, and the line for it, in the order of their numbers
    /// from 0 on.
    Choice(Vec<(&'static str, String)>),
}

impl Touch {
    fn switch(on: impl Into<String>, off: impl Into<String>) -> Self {
        Touch::Switch { on: on.into(), off: off.into() }
    }
}

/// All that there is to be touched of a board of this kind: that of its axes first, axis by axis.
pub fn touchables(kind: &BoardKind) -> Vec<Touchable> {
    let of_axes = (0..kind.axes()).flat_map(|axis| of_axis(kind, axis));
    of_axes.chain(of_board(kind)).collect()
}

fn of_axis(kind: &BoardKind, axis: usize) -> impl Iterator<Item = Touchable> {
    let switches = ["left", "right", "home"].map(|name| Touchable {
        axis: Some(axis),
        name: format!("{name} switch"),
        how: Touch::switch(format!("press {name} {axis}"), format!("release {name} {axis}")),
        shown: Some(format!("switches.{name} {axis}")),
    });
    let number = |word: &str, [least, greatest, step]: [f64; 3], unit, once| Touch::Number {
        before: format!("{word} "),
        behind: format!(" {axis}"),
        least,
        greatest,
        step,
        unit,
        once,
    };
    let load = Touchable {
        axis: Some(axis),
        name: "load".into(),
        how: number("load", [0.0, 1.0, 0.05], "of the torque at full current", false),
        shown: Some(format!("load {axis}")),
    };
    let slip = Touchable {
        axis: Some(axis),
        name: "slip".into(),
        how: number("slip", [-200.0, 200.0, 1.0], "full steps", true),
        shown: None,
    };
    let faults = faults(kind, Some(axis));
    switches.into_iter().chain([load, slip]).chain(faults)
}

fn of_board(kind: &BoardKind) -> impl Iterator<Item = Touchable> {
    let inputs = (0..=HIGHEST_INPUT).filter(|number| kind.has_input(*number)).map(|number| Touchable {
        axis: None,
        name: if kind.enable_input == Some(number) { "ENABLE".into() } else { format!("IN{number}") },
        how: Touch::switch(format!("input {number} 1"), format!("input {number} 0")),
        shown: Some(if kind.enable_input == Some(number) { "enable".into() } else { format!("inputs.{number}") }),
    });
    let analog = kind.analog().enumerate().map(|(place, number)| Touchable {
        axis: None,
        name: format!("IN{number}, analog"),
        how: whole_board(&format!("analog {number}"), [0.0, f64::from(ANALOG_MAX), 1.0], ""),
        shown: Some(format!("analogs.{place}")),
    });
    let one = |name: &str, how, shown: Option<&str>| Touchable {
        axis: None,
        name: name.into(),
        how,
        shown: shown.map(Into::into),
    };
    // In the order of the numbers that the state gives them.
    let can = ["off", "passive", "on"].map(|state| (state, format!("can {state}")));
    let rest = [
        one("supply", whole_board("supply", [0.0, 60.0, 0.1], "V"), Some("supply")),
        one("temperature", whole_board("temperature", [-55.0, 200.0, 1.0], "degC"), Some("temperature")),
        one("power", Touch::switch("power on", "power off"), Some("power")),
        one("USB cable", Touch::switch("usb on", "usb off"), None),
        one("CAN controller", Touch::Choice(can.into()), Some("can")),
    ];
    inputs.chain(analog).chain(rest).chain(faults(kind, None))
}

fn whole_board(word: &str, [least, greatest, step]: [f64; 3], unit: &'static str) -> Touch {
    Touch::Number { before: format!("{word} "), behind: String::new(), least, greatest, step, unit, once: false }
}

/// The faults of an axis, or of the whole board, that a board of this kind can have.
fn faults(kind: &BoardKind, axis: Option<usize>) -> impl Iterator<Item = Touchable> {
    let there = Fault::ALL.into_iter().filter(move |fault| {
        let control = Control::Fault { axis: axis.unwrap_or_default(), fault: *fault, on: true };
        fault.is_of_an_axis() == axis.is_some() && control.check(kind).is_ok()
    });
    let behind = axis.map_or_else(String::new, |axis| format!(" {axis}"));
    there.map(move |fault| {
        let name = fault.name();
        Touchable {
            axis,
            name: format!("fault {name}"),
            how: Touch::switch(format!("fault {name} on{behind}"), format!("fault {name} off{behind}")),
            shown: None,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{TMCM_1110, TMCM_1140, TMCM_3110, TMCM_3212, TMCM_6110};
    use crate::control::Line;

    fn lines(touch: &Touch) -> Vec<String> {
        match touch {
            Touch::Switch { on, off } => vec![on.clone(), off.clone()],
            Touch::Number { before, behind, least, greatest, .. } => {
                [least, greatest].map(|number| format!("{before}{number}{behind}")).into()
            }
            Touch::Choice(states) => states.iter().map(|(_, line)| line.clone()).collect(),
        }
    }

    /// Each line is one that the board takes, ends of ranges included, and nothing is offered twice.
    #[test]
    fn a_board_takes_all_that_is_offered() {
        for kind in [&TMCM_1140, &TMCM_1110, &TMCM_3110, &TMCM_3212, &TMCM_6110] {
            let all = touchables(kind);
            for touchable in &all {
                for line in lines(&touchable.how) {
                    let parsed = Line::parse(&line).unwrap_or_else(|error| panic!("{line}: {error}"));
                    parsed.control.check(kind).unwrap_or_else(|error| panic!("{line}: {error}"));
                }
            }
            let mut names: Vec<_> = all.iter().map(|touchable| (touchable.axis, &touchable.name)).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), all.len());
            let of_axes = all.iter().filter_map(|touchable| touchable.axis).max();
            assert_eq!(of_axes, Some(kind.axes() - 1));
        }
    }
}
