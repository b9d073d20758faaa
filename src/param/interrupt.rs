//! Interrupts and their parameters in bank 3, which have the same numbers (manual sections 3.6.6.1 and 5.4).

use core::fmt;

use super::{ANY, Access, Row, Storage, Unit};

/// Which edges of a signal count.
const EDGES: &[(i32, i32)] = &[(0, 3)];

/// The number that means all interrupts.
pub const ALL_INTERRUPTS: u8 = 255;
/// Timers, numbered from 0.
pub const TIMERS: u8 = 3;

/// Of what there is an interrupt each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Each {
    /// Of the timers.
    Timer,
    /// Of the axes.
    Axis,
    /// Of the digital inputs.
    Input,
}

/// What raises interrupts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interrupt {
    /// A timer.
    Timer,
    /// The target position is reached.
    PositionReached,
    /// stallGuard2 has stopped the motor.
    Stall,
    /// Deviation supervision has stopped the motor.
    Deviation,
    /// The left stop switch.
    StopLeft,
    /// The right stop switch.
    StopRight,
    /// A digital input.
    Input,
}

/// The numbers of interrupts of one kind.
#[derive(Debug)]
pub struct Numbered {
    /// What raises them.
    pub interrupt: Interrupt,
    /// That in words.
    pub name: &'static str,
    /// Of what there is one each.
    pub each: Each,
    /// The number of the first.
    pub first: u8,
    /// From one to the next.
    pub step: u8,
    /// The parameter in bank 3, if there is one; its number is that of the first.
    pub row: Option<Row>,
}

/// All interrupts there are.
pub static INTERRUPTS: [Numbered; 7] = [
    numbered(Interrupt::Timer, "timer", Each::Timer, 1, Some(PERIOD)),
    numbered(Interrupt::PositionReached, "position reached", Each::Axis, 1, None),
    numbered(Interrupt::Stall, "stallGuard", Each::Axis, 1, None),
    numbered(Interrupt::Deviation, "deviation", Each::Axis, 1, None),
    numbered(Interrupt::StopLeft, "stop left", Each::Axis, 2, Some(TRANSITION)),
    numbered(Interrupt::StopRight, "stop right", Each::Axis, 2, Some(TRANSITION)),
    numbered(Interrupt::Input, "input", Each::Input, 1, Some(TRANSITION)),
];

const fn numbered(interrupt: Interrupt, name: &'static str, each: Each, step: u8, row: Option<Row>) -> Numbered {
    let first = interrupt.first();
    let row = match row {
        Some(row) => Some(Row { number: first, ..row }),
        None => None,
    };
    Numbered { interrupt, name, each, first, step, row }
}

const PERIOD: Row = Row {
    number: 0,
    name: "period",
    unit: Unit::Milliseconds,
    ranges: ANY,
    access: Access::ReadWrite,
    storage: Storage::Volatile,
    default: 0,
    note: "unsigned 32 bits",
};

const TRANSITION: Row = Row {
    number: 0,
    name: "transition",
    unit: Unit::Choice,
    ranges: EDGES,
    access: Access::ReadWrite,
    storage: Storage::Volatile,
    default: 0,
    note: "0 off, 1 low-high, 2 high-low, 3 both",
};

impl Interrupt {
    /// The number of the first.
    pub const fn first(self) -> u8 {
        match self {
            Interrupt::Timer => 0,
            Interrupt::PositionReached => 3,
            Interrupt::Stall => 15,
            Interrupt::Deviation => 21,
            Interrupt::StopLeft => 27,
            Interrupt::StopRight => 28,
            Interrupt::Input => 39,
        }
    }

    /// The interrupt with a number, and of which timer, axis or input it is, on a module with so many axes and inputs.
    pub fn find(number: u8, axes: u8, inputs: u8) -> Option<(&'static Numbered, u8)> {
        INTERRUPTS.iter().find_map(|numbered| {
            let (offset, step) = (number.checked_sub(numbered.first)?, numbered.step.max(1));
            let index = offset / step;
            (offset % step == 0 && index < numbered.each.count(axes, inputs)).then_some((numbered, index))
        })
    }
}

impl Each {
    /// How many there are on a module with so many axes and inputs.
    pub const fn count(self, axes: u8, inputs: u8) -> u8 {
        match self {
            Each::Timer => TIMERS,
            Each::Axis => axes,
            Each::Input => inputs,
        }
    }
}

impl Numbered {
    /// The number of the one of a timer, axis or input.
    pub const fn number(&self, index: u8) -> u8 {
        self.first.saturating_add(self.step.saturating_mul(index))
    }

    /// The name of its parameter, if it has one: `stop left 0 transition`.
    pub fn parameter_name(&'static self, index: u8) -> Option<impl fmt::Display + use<>> {
        let (name, row) = (self.name, self.row.as_ref()?);
        Some(fmt::from_fn(move |f| write!(f, "{name} {index} {}", row.name)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manuals_numbers_exist_and_no_others() {
        let of = |axes, inputs| (0..=255).filter(|n| Interrupt::find(*n, axes, inputs).is_some()).collect::<Vec<u8>>();
        assert_eq!(of(1, 4), [0, 1, 2, 3, 15, 21, 27, 28, 39, 40, 41, 42]);
        let six: Vec<u8> = (0..9).chain(15..47).collect();
        assert_eq!(of(6, 8), six);
    }

    /// Stop switches alternate: left and right of the first axis, then of the second one.
    #[test]
    fn a_number_tells_which_switch_of_which_axis() {
        let names = [27, 28, 29, 38].map(|number| {
            let (numbered, index) = Interrupt::find(number, 6, 8).unwrap();
            assert_eq!(numbered.number(index), number);
            numbered.parameter_name(index).unwrap().to_string()
        });
        let expected = ["left 0", "right 0", "left 1", "right 5"].map(|name| format!("stop {name} transition"));
        assert_eq!(names, expected);
    }

    #[test]
    fn no_two_interrupts_share_a_number() {
        let all = INTERRUPTS.iter().flat_map(|numbered| (0..numbered.each.count(6, 8)).map(|i| numbered.number(i)));
        let mut all: Vec<u8> = all.collect();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!((all.len(), count), (3 + 5 * 6 + 8, count));
    }
}
