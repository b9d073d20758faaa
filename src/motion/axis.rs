//! One axis: what it is to do, what it has noticed, and the values of its parameters.

use core::ops::{Deref, DerefMut};

use super::current::{Current, Excitation, MotionState};
use super::encoders::Encoders;
use super::hardware::{Course, Hardware};
use super::search::Search;
use super::sensors::Sensors;
use super::stall::Measured;
use super::switch::{Side, Stops};
use super::values::Values;
use crate::param::{AxisParameter as P, Parameter, Table};
use crate::units::Micros;

/// Events of an axis since the last poll; each is told once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Events {
    /// The target of a positioning move was reached, or a reference search has found its place.
    pub reached: bool,
    /// Parameter 8 (position reached) has become 1, also in a move that no host has asked for, as in a reference
    /// search.
    pub at_target: bool,
    /// stallGuard2 has stopped the motor.
    pub stall: bool,
    /// A positioning move ended before its target, by a stop switch, a stall, an encoder deviation or a driver alarm;
    /// or a reference search has given up.
    pub cut_short: bool,
    /// An encoder has begun to deviate too far from the position.
    pub deviation: bool,
    /// The driver has shut down: over-temperature or short to ground.
    pub alarm: bool,
}

/// Speed and acceleration of one motion, in the units of parameters 4 and 5 and in their place where they are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pace {
    /// The speed at which the motor goes to a position.
    pub speed: Option<i32>,
    /// How fast it comes to its speed, and to a stand.
    pub acceleration: Option<i32>,
}

/// One axis. What needs its controller, as every motion does, is to be had by [`Axis::on`].
#[derive(Debug)]
pub struct Axis<H> {
    pub(super) hardware: H,
    pub(super) table: &'static Table<P>,
    pub(super) values: Values,
    /// For how many polls, of a millisecond each, a stop switch has held the motor.
    pub(super) held: u8,
    /// A positioning move is under way, whose end will be an event.
    pub(super) travelling: bool,
    /// The position was the target at the last poll, and no other target has been given since.
    pub(super) was_at_target: bool,
    pub(super) search: Option<Search>,
    /// The pace of the last motion command.
    pub(super) pace: Pace,
    pub(super) errors: i32,
    /// Driver faults since the last motion command, as bits of parameter 208.
    pub(super) alarms: u8,
    /// The motor has been stopped because an encoder deviates, and has not been sent anywhere since.
    pub(super) deviating: bool,
    /// A hard stop did not get through to the chip, and is tried again with every poll.
    pub(super) stopping: bool,
    /// Events that the next poll returns.
    pub(super) events: Events,
    pub(super) measured: Measured,
    pub(super) current: Current,
    /// The bridges are switched off, whatever the motor is told to do.
    pub(super) bridges_off: bool,
    pub(super) excitation: Option<Excitation>,
    pub(super) sensors: Sensors,
    pub(super) encoders: Encoders,
}

/// An axis together with its controller: so it can reach its chips.
#[derive(Debug)]
pub struct Joined<'a, H: Hardware> {
    axis: &'a mut Axis<H>,
    controller: &'a mut H::Controller,
}

impl<H> Deref for Joined<'_, H>
where
    H: Hardware,
{
    type Target = Axis<H>;

    fn deref(&self) -> &Axis<H> {
        self.axis
    }
}

impl<H: Hardware> DerefMut for Joined<'_, H> {
    fn deref_mut(&mut self) -> &mut Axis<H> {
        self.axis
    }
}

impl<'a, H: Hardware> Joined<'a, H> {
    /// The hardware, and the controller that it works with.
    pub(super) fn reach(&mut self) -> (&mut H, &mut H::Controller) {
        (&mut self.axis.hardware, self.controller)
    }

    /// The same with the course that the motor is to take.
    pub(super) fn on_course<R>(&mut self, act: impl FnOnce(&mut H, &mut H::Controller, &Course<'_>) -> R) -> R {
        let Axis { hardware, values, search, pace, .. } = &mut *self.axis;
        act(hardware, self.controller, &course(values, search.as_ref(), *pace))
    }

    /// The controller.
    pub(super) fn controller(&self) -> &H::Controller {
        self.controller
    }
}

impl<H: Hardware> Axis<H> {
    /// An axis on its hardware, with the factory defaults of its parameters; nothing is written yet.
    pub fn new(hardware: H, table: &'static Table<P>) -> Self {
        Axis {
            hardware,
            table,
            values: Values::of(table),
            held: 0,
            travelling: false,
            was_at_target: true,
            search: None,
            pace: Pace::default(),
            errors: 0,
            alarms: 0,
            deviating: false,
            stopping: false,
            events: Events::default(),
            measured: Measured::default(),
            current: Current::default(),
            bridges_off: false,
            excitation: None,
            sensors: Sensors::default(),
            encoders: Encoders::default(),
        }
    }

    /// The axis joined with its controller.
    pub fn on<'a>(&'a mut self, controller: &'a mut H::Controller) -> Joined<'a, H> {
        Joined { axis: self, controller }
    }

    /// Takes a stored value without telling the chips, before [`Joined::start`] does.
    pub fn preset(&mut self, parameter: &Parameter<P>, value: i32) {
        if parameter.row.stored() && parameter.row.accepts(value) {
            self.values.set(parameter.function, value);
        }
    }

    /// Reverses the shaft (global parameter 90). The direction output is common to the controller's motors and is
    /// switched elsewhere; here the encoders follow.
    pub fn set_reverse(&mut self, reverse: bool) {
        self.encoders.reverse = reverse;
    }

    /// True when parameter 2 is the speed to rotate at, as in ROR: in velocity mode, and in a reference search, which
    /// it ends. In the positioning modes the ramp generator works out its target speed itself.
    pub fn takes_speed(&self) -> bool {
        self.search.is_some() || !self.hardware.known().mode.positions()
    }

    /// True when the position is the target, as parameter 8 tells; as last read.
    pub fn at_target(&self) -> bool {
        let known = self.hardware.known();
        known.position == known.target
    }

    /// The actual position in microsteps, as last read.
    pub fn last_position(&self) -> i32 {
        self.hardware.known().position
    }

    /// The target position in microsteps, in the two ramp modes that go to one.
    pub fn target_position(&self) -> Option<i32> {
        let known = self.hardware.known();
        known.mode.positions().then_some(known.target)
    }

    /// Home switch as of the last poll, as it is.
    pub const fn home_switch(&self) -> bool {
        self.sensors.home
    }

    /// Left and right stop switch, polarity applied, as last read.
    pub fn stop_switches(&self, controller: &H::Controller) -> [bool; 2] {
        self.hardware.last_switches(controller)
    }

    /// True while a positioning move is under way.
    pub const fn travelling(&self) -> bool {
        self.travelling
    }

    /// True while a reference search is under way.
    pub const fn searches(&self) -> bool {
        self.search.is_some()
    }

    /// RFS STATUS: 0, or the number of the leg under way.
    pub fn search_status(&self) -> i32 {
        self.search.as_ref().map_or(0, Search::number)
    }

    /// Lets the next N event zero the external encoder, if parameter 217 asks for it.
    pub(super) fn arm_null(&mut self) {
        self.encoders.arm_null(&self.values);
    }

    /// Takes the encoders on by one poll.
    pub(super) fn count(&mut self) {
        self.encoders.count(self.sensors, &self.values);
    }

    /// The current for a state of motion.
    pub(super) fn select_excitation(&mut self, now: Micros, state: MotionState) -> Excitation {
        let excitation = self.current.select(now, state, self.hardware.known().speed, &self.values);
        Excitation { free: excitation.free || self.bridges_off, ..excitation }
    }

    /// The speed at which the axis goes to a position.
    pub(super) fn positioning_speed(&self) -> i32 {
        course(&self.values, self.search.as_ref(), self.pace).speed
    }
}

/// How the motor is to move by its parameters, by the pace of its command, or in a reference search. A search wants to
/// be stopped wherever its switch is, and by the switches that it says itself.
fn course<'a>(values: &'a Values, search: Option<&Search>, pace: Pace) -> Course<'a> {
    let acceleration = pace.acceleration.unwrap_or(values.get(P::MaximumAcceleration));
    match search {
        Some(search) => {
            Course { values, speed: search.slow_speed(), acceleration, tolerance: 0, stops: search.stops() }
        }
        None => Course {
            values,
            speed: pace.speed.unwrap_or(values.get(P::MaximumSpeed)),
            acceleration,
            tolerance: values.get(P::ReferenceTolerance),
            stops: Stops {
                left: !values.is_on(P::LeftSwitchDisable),
                right: !values.is_on(P::RightSwitchDisable),
                soft: values.is_on(P::SoftStop),
                latch: Side::Left,
            },
        },
    }
}
