//! An axis in words.

use tmcm::device::{LOCK, RELEASE};
use tmcm::motion::Side;
use tmcm::param::{AxisParameter as P, Unit};

use super::driver;
use super::line::{Line, Severity};
use super::quantity::{Quantity, all};
use super::scale::volts;
use crate::product::{Product, numbers, speed_unit, symbol, with_unit};

/// The ramp mode (parameter 138) in which a motor goes to no position.
const VELOCITY: i32 = 2;
/// The highest current scale of a driver, with which the motor has its full current.
const FULL_SCALE: i32 = 31;

/// A current that is less than this, in 1/255, is the driver's least: it has 32 steps.
const STEP: i32 = 8;

/// Tells what there is to say of an axis. `values` are those of [`requests`](super::requests), in their order; `None`
/// for one that was not answered, of which nothing is said.
pub fn words(product: Option<Product>, axis: u8, values: &[Option<i32>]) -> Vec<Line> {
    let read = all(product, axis).zip(values).filter_map(|((quantity, _), value)| Some((quantity, (*value)?)));
    let readings = Readings { product, read: read.collect() };
    let mut lines = Vec::new();
    lines.extend(readings.supply());
    lines.extend(readings.motion());
    lines.extend(readings.switches());
    lines.extend(readings.driver());
    lines.extend(readings.current());
    lines.extend(readings.encoders());
    lines.extend(readings.stall());
    if lines.is_empty() {
        lines.push(Line::note("nothing of this axis has been read"));
    }
    lines
}

/// A position with its unit.
fn steps(position: i32) -> String {
    with_unit(position, Unit::Microsteps.symbol())
}

/// The values that were read of an axis.
struct Readings {
    product: Option<Product>,
    read: Vec<(Quantity, i32)>,
}

impl Readings {
    fn value(&self, quantity: Quantity) -> Option<i32> {
        self.read.iter().find(|(read, _)| *read == quantity).map(|(_, value)| *value)
    }

    fn of(&self, parameter: P) -> Option<i32> {
        self.value(Quantity::Parameter(parameter))
    }

    /// The number of a parameter on this product, for words.
    fn number(&self, parameter: P) -> u8 {
        numbers(self.product).axis.row(parameter).map_or(0, |row| row.number)
    }

    /// A speed with its unit.
    fn speed(&self, speed: i32) -> String {
        let in_chip = self.of(P::UnitMode) == Some(0);
        with_unit(speed, self.product.map_or("", |product| symbol(speed_unit(product), in_chip)))
    }

    fn stands(&self) -> bool {
        self.of(P::ActualSpeed) == Some(0)
    }

    fn searches(&self) -> bool {
        self.value(Quantity::Search).is_some_and(|state| state != 0)
    }

    /// A supply that is too low locks the motors.
    fn supply(&self) -> Option<Line> {
        let supply = self.value(Quantity::Supply)?;
        let [lock, release] = [LOCK, RELEASE].map(i32::from);
        let [now, low, high] = [supply, lock, release].map(volts);
        if supply < lock {
            Some(Line::error(format!(
                "locked: the supply is {now}; no motor moves below {low}, and then not until it is above {high}"
            )))
        } else if supply <= release {
            Some(Line::warning(format!(
                "the supply is {now}: if it has been below {low}, no motor moves until it is above {high}"
            )))
        } else {
            None
        }
    }

    fn motion(&self) -> Vec<Line> {
        let mut lines = Vec::new();
        match self.value(Quantity::Search) {
            Some(0) | None => {}
            Some(state) => lines.push(Line::note(format!("homing: a reference search is under way, in state {state}"))),
        }
        let (Some(position), Some(speed)) = (self.of(P::ActualPosition), self.of(P::ActualSpeed)) else { return lines };
        // Without a ramp mode to be read nobody can tell whether the motor is on its way to its target, or past it.
        let goes_to_a_position = self.of(P::RampMode).map(|mode| mode != VELOCITY);
        let target = self.of(P::TargetPosition).filter(|_| goes_to_a_position.unwrap_or(false) && !self.searches());
        let is_there = self.of(P::PositionReached) == Some(1);
        lines.push(match (speed, target) {
            (0, _) if is_there && goes_to_a_position != Some(false) => {
                Line::fine(format!("at position: it stands at its target, {}", steps(position)))
            }
            (0, Some(target)) => Line::note(format!("stands at {}, and not at its target, {target}", steps(position))),
            (0, None) => Line::fine(format!("stands at {}", steps(position))),
            _ => {
                let direction = if speed > 0 { "right" } else { "left" };
                let to = target.map_or_else(String::new, |target| format!(" to {target}"));
                Line::fine(format!("moves {direction}{to}, at {}; now at {}", self.speed(speed), steps(position)))
            }
        });
        lines
    }

    fn switches(&self) -> Vec<Line> {
        let mut lines: Vec<Line> = [Side::Left, Side::Right].into_iter().filter_map(|side| self.stop(side)).collect();
        if self.of(P::HomeSwitch).is_some_and(|state| state != 0) {
            lines.push(Line::note("the home switch is closed"));
        }
        let is_known =
            [P::LeftSwitch, P::RightSwitch, P::HomeSwitch].into_iter().any(|switch| self.of(switch).is_some());
        if lines.is_empty() && is_known {
            lines.push(Line::fine("no switch is closed"));
        }
        lines
    }

    /// Tells what a limit switch says that is closed.
    fn stop(&self, side: Side) -> Option<Line> {
        let (name, switch, disable) = match side {
            Side::Left => ("left", P::LeftSwitch, P::LeftSwitchDisable),
            Side::Right => ("right", P::RightSwitch, P::RightSwitchDisable),
        };
        if self.of(switch)? == 0 {
            return None;
        }
        let closed = format!("the {name} limit switch is closed");
        let number = self.number(disable);
        Some(match self.of(disable) {
            // A search goes to the switches, whatever these parameters say.
            _ if self.searches() => Line::note(closed),
            Some(0) => Line::warning(format!("{closed}: the motor does not turn {name} until it opens")),
            Some(_) => Line::note(format!("{closed}, and stops nothing (parameter {number} is 1)")),
            None => Line::note(closed),
        })
    }

    fn driver(&self) -> Vec<Line> {
        self.of(P::DriverErrorFlags).map(|flags| driver::lines(flags, self.stands())).unwrap_or_default()
    }

    fn current(&self) -> Vec<Line> {
        let mut lines = Vec::new();
        if self.of(P::ChopperOffTime) == Some(0) {
            let number = self.number(P::ChopperOffTime);
            lines.push(Line::warning(format!("the driver is off: the motor turns freely (parameter {number} is 0)")));
        }
        if self.of(P::MaximumCurrent).is_some_and(|current| current < STEP) {
            let number = self.number(P::MaximumCurrent);
            lines.push(Line::warning(format!("the motor has the least current that there is (parameter {number})")));
        }
        let set = [("run", P::MaximumCurrent), ("standby", P::StandbyCurrent)];
        let set = set.map(|(name, parameter)| Some(format!("{name} {}/255", self.of(parameter)?)));
        let now = self
            .of(P::SmartEnergyActualCurrent)
            .map(|scale| format!("now {}/{}", scale.saturating_add(1), FULL_SCALE + 1));
        let parts: Vec<String> = set.into_iter().chain([now]).flatten().collect();
        if !parts.is_empty() {
            lines.push(Line::fine(format!("current: {}", parts.join(", "))));
        }
        lines
    }

    /// The encoders that are watched, and how far they are from the position.
    fn encoders(&self) -> Vec<Line> {
        let both = [
            (P::EncoderPosition, P::MaximumEncoderDeviation),
            (P::ExternalEncoderPosition, P::MaximumExternalEncoderDeviation),
        ];
        let of_board = both.into_iter().filter_map(|(counted, limit)| {
            let most = self.of(limit).filter(|most| *most != 0)?;
            let away = self.of(P::ActualPosition)?.wrapping_sub(self.of(counted)?).unsigned_abs();
            let name = numbers(self.product).axis.row(counted)?.name.trim_end_matches(" position");
            let (words, number) = (format!("the {name} is {away} from the position"), self.number(limit));
            let severity = if away > most.unsigned_abs() { Severity::Error } else { Severity::Fine };
            Some(Line { severity, words: format!("{words}; more than {most} stops the motor (parameter {number})") })
        });
        // The counter in the chip has another unit than the position.
        let of_chip = self.of(P::ChipEncoderDeviation).filter(|most| *most != 0).map(|most| {
            let number = self.number(P::ChipEncoderDeviation);
            Line::fine(format!(
                "the encoder is watched: a deviation of more than {most} stops the motor (parameter {number})"
            ))
        });
        of_board.chain(of_chip).collect()
    }

    fn stall(&self) -> Option<Line> {
        let above = self.of(P::StopOnStall).filter(|above| *above != 0)?;
        let number = self.number(P::StopOnStall);
        Some(Line::fine(format!("a stall above {} stops the motor (parameter {number})", self.speed(above))))
    }
}
