//! The interrupts of TMCL programs and the global parameters of bank 3, which configure them. The parameter of an
//! interrupt has the number of the interrupt (manual sections 3.6.6.1 and 5.4).

use super::{ANY, Access, Row, Storage, Unit};

/// Range of the parameter that chooses the edges of a signal: two bits.
const EDGES: &[(i32, i32)] = &[(0, 3)];

/// Interrupt number that stands for all interrupts in EI and DI.
pub const ALL_INTERRUPTS: u8 = 255;
/// Number of timers; their interrupts are numbered from 0.
pub const TIMERS: u8 = 3;

/// The parts of a module each of which has an interrupt of a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Per {
    /// An interrupt for each timer.
    Timer,
    /// An interrupt for each axis.
    Axis,
    /// An interrupt for each digital input.
    Input,
}

/// A kind of interrupts, by the event that raises them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interrupt {
    /// The period of a timer is over.
    Timer,
    /// An axis has reached its target position.
    PositionReached,
    /// stallGuard2 has stopped the motor.
    Stall,
    /// Deviation supervision has stopped the motor.
    Deviation,
    /// The level of a left stop switch has changed.
    StopLeft,
    /// The level of a right stop switch has changed.
    StopRight,
    /// The level of a digital input has changed.
    Input,
}

/// The interrupts of one kind: `first`, `first + step` and so on, one per timer, axis or input.
#[derive(Debug)]
pub struct Numbered {
    /// The event that raises them.
    pub interrupt: Interrupt,
    /// Name of the event, for people: as in a [`Row`] an image has none.
    #[cfg(not(target_os = "none"))]
    pub name: &'static str,
    /// The parts of a module each of which has an interrupt of this kind.
    pub per: Per,
    /// Interrupt number of the first timer, axis or input.
    pub first: u8,
    /// Difference between the interrupt numbers of neighbours.
    pub step: u8,
    /// The parameter in bank 3, under the number of the first interrupt; `None` if interrupts of this kind have none.
    pub row: Option<Row>,
}

/// All kinds of interrupts, in the order of their numbers.
pub static INTERRUPTS: [Numbered; 7] = [
    numbered(Interrupt::Timer, "timer", Per::Timer, 1, Some(PERIOD)),
    numbered(Interrupt::PositionReached, "position reached", Per::Axis, 1, None),
    numbered(Interrupt::Stall, "stallGuard", Per::Axis, 1, None),
    numbered(Interrupt::Deviation, "deviation", Per::Axis, 1, None),
    numbered(Interrupt::StopLeft, "stop left", Per::Axis, 2, Some(TRANSITION)),
    numbered(Interrupt::StopRight, "stop right", Per::Axis, 2, Some(TRANSITION)),
    numbered(Interrupt::Input, "input", Per::Input, 1, Some(TRANSITION)),
];

const fn numbered(
    interrupt: Interrupt,
    #[cfg_attr(target_os = "none", expect(unused_variables))] name: &'static str,
    per: Per,
    step: u8,
    row: Option<Row>,
) -> Numbered {
    let first = interrupt.first();
    let row = match row {
        Some(row) => Some(Row { number: first, ..row }),
        None => None,
    };
    Numbered {
        interrupt,
        #[cfg(not(target_os = "none"))]
        name,
        per,
        first,
        step,
        row,
    }
}

const PERIOD: Row = Row {
    number: 0,
    #[cfg(not(target_os = "none"))]
    name: "period",
    unit: Unit::Milliseconds,
    ranges: ANY,
    access: Access::ReadWrite,
    storage: Storage::Volatile,
    default: 0,
    #[cfg(not(target_os = "none"))]
    note: "unsigned 32 bits",
};

const TRANSITION: Row = Row {
    number: 0,
    #[cfg(not(target_os = "none"))]
    name: "transition",
    unit: Unit::Choice,
    ranges: EDGES,
    access: Access::ReadWrite,
    storage: Storage::Volatile,
    default: 0,
    #[cfg(not(target_os = "none"))]
    note: "0 off, 1 low-high, 2 high-low, 3 both",
};

impl Interrupt {
    /// Interrupt number of the first timer, axis or input.
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

    /// The kind of the interrupt with this number, and the index of its timer, axis or input, on a module with `axes`
    /// axes and `inputs` digital inputs; `None` if the module has no such interrupt.
    pub fn find(number: u8, axes: u8, inputs: u8) -> Option<(&'static Numbered, u8)> {
        INTERRUPTS.iter().find_map(|numbered| {
            let (offset, step) = (number.checked_sub(numbered.first)?, numbered.step.max(1));
            let index = offset / step;
            (offset % step == 0 && index < numbered.per.count(axes, inputs)).then_some((numbered, index))
        })
    }
}

impl Per {
    /// Number of timers, axes or inputs on a module with `axes` axes and `inputs` digital inputs.
    pub const fn count(self, axes: u8, inputs: u8) -> u8 {
        match self {
            Per::Timer => TIMERS,
            Per::Axis => axes,
            Per::Input => inputs,
        }
    }
}

impl Numbered {
    /// Interrupt number of the timer, axis or input with this index.
    pub const fn number(&self, index: u8) -> u8 {
        self.first.saturating_add(self.step.saturating_mul(index))
    }

    /// Name of the parameter of the timer, axis or input with this index, such as `stop left 0 transition`; `None` if
    /// interrupts of this kind have no parameter.
    #[cfg(not(target_os = "none"))]
    pub fn parameter_name(&'static self, index: u8) -> Option<impl core::fmt::Display + use<>> {
        let (name, row) = (self.name, self.row.as_ref()?);
        Some(core::fmt::from_fn(move |f| write!(f, "{name} {index} {}", row.name)))
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
        let all = INTERRUPTS.iter().flat_map(|numbered| (0..numbered.per.count(6, 8)).map(|i| numbered.number(i)));
        let mut all: Vec<u8> = all.collect();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!((all.len(), count), (3 + 5 * 6 + 8, count));
    }
}
