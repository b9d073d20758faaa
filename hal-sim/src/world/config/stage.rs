//! Table `[stage]` of a world file: where switches and hard ends are, and which arrangements of them there cannot be.
//! Positions are in 1/256 full steps on the rotor's scale.

use super::wrong::{FARTHEST, Wrong, within};
use crate::world::pin::Pin;
use serde::Deserialize;

/// Table `[stage]`. A switch or end that is left out does not exist.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StageConfig {
    /// The position at which the left stop switch closes on the way down; without a width it is closed everywhere
    /// below.
    pub left: Option<i64>,
    /// Number of positions that keep the left switch closed, 1 or more: from `left - left_width + 1` to `left`, both
    /// included.
    pub left_width: Option<i64>,
    /// The position at which the right stop switch closes on the way up; without a width it is closed everywhere above.
    pub right: Option<i64>,
    /// Number of positions that keep the right switch closed, 1 or more: from `right` to `right + right_width - 1`,
    /// both included.
    pub right_width: Option<i64>,
    /// Whether the motor is built in the other way round. The left switch is then where positions are high and is
    /// closed at its position and above. The right one is where they are low and is closed at its position and below.
    pub reversed: bool,
    /// The home switch is closed from the first to the second position, both included.
    pub home: Option<[i64; 2]>,
    /// The switches that are normally closed: their pins are low while they are pressed, and high otherwise.
    pub normally_closed: Vec<Pin>,
    /// How far beyond the position at which a switch closes it opens again, on both sides; 0 by default.
    pub hysteresis: i64,
    /// Length of the circle of a rotary stage: each switch repeats after so many units, in both directions. Then every
    /// switch needs a width, and there are no hard ends.
    pub circle: Option<i64>,
    /// The lowest position that the stage can reach, at which it is blocked.
    pub hard_left: Option<i64>,
    /// The highest position that the stage can reach, at which it is blocked.
    pub hard_right: Option<i64>,
}

/// Positions that close a switch, on the rotor's scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Zone {
    /// The switch.
    pub pin: Pin,
    /// The lowest position that closes it; `None` if all below close it, too.
    pub from: Option<i64>,
    /// The highest position that closes it; `None` if all above close it, too.
    pub to: Option<i64>,
}

/// An end switch: the positions that close it, as far as they have an end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EndSwitch {
    pub(crate) pin: Pin,
    /// The position at which the switch closes for a motor that comes from the middle of the stage.
    pub(crate) at: i64,
    /// Number of positions that keep it closed, from `at` outward; all if it has no width.
    pub(crate) width: Option<i64>,
}

impl EndSwitch {
    /// Tells what is wrong with its position.
    fn wrong(&self, why: String) -> Wrong {
        Wrong::new(if self.pin == Pin::Left { &["stage.left"] } else { &["stage.right"] }, why)
    }
}

impl StageConfig {
    /// The end switch where positions are low, and the one where they are high.
    pub(crate) fn ends(&self) -> (Option<EndSwitch>, Option<EndSwitch>) {
        let left = self.left.map(|at| EndSwitch { pin: Pin::Left, at, width: self.left_width });
        let right = self.right.map(|at| EndSwitch { pin: Pin::Right, at, width: self.right_width });
        if self.reversed { (right, left) } else { (left, right) }
    }

    /// Where the switches are closed by the stage: the lower end switch first, then the upper one and the home switch.
    pub fn zones(&self) -> Vec<Zone> {
        let (low, high) = self.ends();
        let low =
            low.map(|EndSwitch { pin, at, width }| Zone { pin, from: width.map(|width| at - width + 1), to: Some(at) });
        let high = high.map(|EndSwitch { pin, at, width }| Zone {
            pin,
            from: Some(at),
            to: width.map(|width| at + width - 1),
        });
        let home = self.home.map(|[from, to]| Zone { pin: Pin::Home, from: Some(from), to: Some(to) });
        [low, high, home].into_iter().flatten().collect()
    }

    pub(super) fn check(&self) -> Result<(), Wrong> {
        let [home_from, home_to] = self.home.map_or([None; 2], |home| home.map(Some));
        let positions: [(&'static [&'static str; 1], Option<i64>); 6] = [
            (&["stage.left"], self.left),
            (&["stage.right"], self.right),
            (&["stage.home"], home_from),
            (&["stage.home"], home_to),
            (&["stage.hard_left"], self.hard_left),
            (&["stage.hard_right"], self.hard_right),
        ];
        for (name, position) in positions {
            within(name, position.unwrap_or_default(), -FARTHEST, FARTHEST)?;
        }
        if let Some([from, to]) = self.home.filter(|[from, to]| from > to) {
            return Err(Wrong::new(&["stage.home"], format!("{from} is above {to}; give the lower position first")));
        }
        within(&["stage.hysteresis"], self.hysteresis, 0, FARTHEST)?;
        check_width("stage.left", &["stage.left_width"], self.left, self.left_width)?;
        check_width("stage.right", &["stage.right_width"], self.right, self.right_width)?;
        match self.circle {
            Some(circle) => self.check_circle(circle),
            None => self.check_way(),
        }
    }

    /// Checks a stage that goes to and fro between its ends.
    fn check_way(&self) -> Result<(), Wrong> {
        // Without a hard end the stage goes on beyond all switches.
        let lowest = self.hard_left.unwrap_or(-4 * FARTHEST);
        let highest = self.hard_right.unwrap_or(4 * FARTHEST);
        if lowest >= highest {
            let why = format!("{lowest} is not below stage.hard_right ({highest})");
            return Err(Wrong::new(&["stage.hard_left"], why));
        }
        let ends = self.ends();
        if let (Some(low), Some(high)) = ends {
            self.check_order(low, high)?;
        }
        for (end, hard, other, sign) in [(ends.0, lowest, highest, 1), (ends.1, -highest, -lowest, -1)] {
            // With the sign of the upper end turned it is as the lower one.
            let Some(end) = end else { continue };
            let at = sign * end.at;
            let [beyond, against] = if sign > 0 {
                ["stage.hard_left", "stage.hard_right"]
            } else {
                ["stage.hard_right", "stage.hard_left"]
            };
            if at < hard {
                let why = format!("{} is behind the hard end {beyond} ({}): nothing can press it", end.at, sign * hard);
                return Err(end.wrong(why));
            }
            if at + self.hysteresis >= other {
                let why =
                    format!("{} is at the wrong hard end, {against} ({}): it is always pressed", end.at, sign * other);
                return Err(end.wrong(why));
            }
        }
        self.check_home(lowest, highest)
    }

    /// The end switches have to leave a way between them.
    fn check_order(&self, low: EndSwitch, high: EndSwitch) -> Result<(), Wrong> {
        if low.at >= high.at {
            let is = if self.reversed { "above" } else { "below" };
            let [left, right] = [self.left, self.right].map(Option::unwrap_or_default);
            let turned = if self.reversed {
                "; stage.reversed says that the motor is built in the other way round"
            } else {
                "; if the motor is built in the other way round, stage.reversed = true says so"
            };
            let why = format!("{left} is not {is} stage.right ({right}){turned}");
            return Err(Wrong::new(&["stage.left"], why));
        }
        if high.at - low.at <= self.hysteresis + 1 {
            let why = format!(
                "with {} the switches at {} and {} leave no way between them on which both are open",
                self.hysteresis, low.at, high.at
            );
            return Err(Wrong::new(&["stage.hysteresis", "stage.left"], why));
        }
        Ok(())
    }

    /// The home switch has to be where the stage gets, and to leave it something. One that goes on behind a hard end is
    /// possible: then it has a single edge.
    fn check_home(&self, lowest: i64, highest: i64) -> Result<(), Wrong> {
        let Some([from, to]) = self.home else { return Ok(()) };
        let behind = |name: &str, end: i64| {
            let why = format!("{from} to {to} is behind the hard end {name} ({end}): no search ever finds it");
            Err(Wrong::new(&["stage.home"], why))
        };
        if to < lowest {
            return behind("stage.hard_left", lowest);
        }
        if from > highest {
            return behind("stage.hard_right", highest);
        }
        if from - self.hysteresis <= lowest && to + self.hysteresis >= highest {
            let why = format!("{from} to {to}: once pressed, it is pressed all the way between the hard ends");
            return Err(Wrong::new(&["stage.home"], why));
        }
        Ok(())
    }

    /// Checks a rotary stage.
    fn check_circle(&self, circle: i64) -> Result<(), Wrong> {
        within(&["stage.circle"], circle, 2, FARTHEST)?;
        if self.hard_left.or(self.hard_right).is_some() {
            let why =
                "a rotary stage has no hard ends; leave out stage.hard_left and stage.hard_right, or stage.circle";
            return Err(Wrong::new(&["stage.circle"], why.into()));
        }
        let home = self.home.map(|[from, to]| to - from + 1);
        let widths: [(&'static [&'static str; 1], Option<i64>, Option<i64>); 3] = [
            (&["stage.left"], self.left, self.left_width),
            (&["stage.right"], self.right, self.right_width),
            (&["stage.home"], home, home),
        ];
        for (name, at, width) in widths {
            if at.is_some() && width.is_none() {
                let why = format!("on a rotary stage (stage.circle) it needs {}_width", name[0]);
                return Err(Wrong::new(name, why));
            }
            let width = width.unwrap_or(1) + 2 * self.hysteresis;
            if at.is_some() && width >= circle {
                let why = format!("with the hysteresis it takes {width} of the {circle} units of a circle");
                return Err(Wrong::new(name, why));
            }
        }
        let (Some(low), Some(high)) = self.ends() else { return Ok(()) };
        // The lower switch is closed up to its position, the upper one from its position on, until they open again.
        let low_length = low.width.unwrap_or(1) + 2 * self.hysteresis;
        let high_length = high.width.unwrap_or(1) + 2 * self.hysteresis;
        let low_begins = low.at + self.hysteresis + 1 - low_length;
        let apart = (high.at - self.hysteresis - low_begins).rem_euclid(circle);
        if apart <= low_length && apart + high_length >= circle {
            let why = "stage.left and stage.right leave nothing of the circle on which both are open";
            return Err(Wrong::new(&["stage.circle"], why.into()));
        }
        Ok(())
    }
}

/// Checks the width of an end switch.
fn check_width(
    switch: &str,
    name: &'static [&'static str; 1],
    at: Option<i64>,
    width: Option<i64>,
) -> Result<(), Wrong> {
    within(name, width.unwrap_or(1), 1, FARTHEST)?;
    if width.is_some() && at.is_none() {
        return Err(Wrong::new(name, format!("there is no {switch}")));
    }
    Ok(())
}
