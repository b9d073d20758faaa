//! The state of one axis: the values of its parameters, the motion it was told, and the events it has noticed. The
//! functions that need the chips belong to [`Joined`], an axis with its motion controller; they stand in the other
//! files here.

use core::ops::{Deref, DerefMut};

use super::current::{Excitation, MotionState};
use super::encoders::Encoders;
use super::hardware::{Course, Hardware};
use super::orders::{Orders, Untold};
use super::pace::Pace;
use super::search::Search;
use super::sensors::Sensors;
use super::slope::Slopes;
use super::stall::Measured;
use super::switch::{Side, Stops};
use super::values::Values;
use crate::param::{AxisParameter as P, Parameter, Table};
use crate::units::Micros;

/// What has happened to an axis since the poll before. Each event is returned by one poll only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Events {
    /// The target of a positioning move was reached, or a reference search has made its zero point.
    pub reached: bool,
    /// Parameter 8 (position reached) has become 1. That is an event also in a move that no host has asked for, as in a
    /// reference search.
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
    /// A motor that is to turn at a speed stands before its closed stop switch, or brakes there.
    pub at_switch: bool,
    /// The closed stop switch before which a reference search has given up.
    pub limit: Option<Side>,
}

/// The state of one axis on the hardware `H`. The functions that exchange datagrams with a chip need the motion
/// controller as well: [`Axis::on`] joins the two.
#[derive(Debug)]
pub struct Axis<H: Hardware> {
    pub(super) hardware: H,
    /// The axis parameters of the product.
    pub(super) table: &'static Table<P>,
    pub(super) values: Values,
    /// Number of polls, one in a millisecond, for which a stop switch has held the motor; 255 stands for any more.
    pub(super) held: u8,
    /// The reference search that is under way.
    pub(super) search: Option<Search>,
    /// What a command changes besides, apart from the goal of the hardware.
    pub(super) orders: Orders<H::Shape>,
    /// What the chips have not taken yet; each poll tells it again.
    pub(super) untold: Untold,
    /// The motor is on a straight line or rotates, and was last seen turn so fast that it is somewhere else in each poll.
    pub(super) brisk: bool,
    /// The last poll has found the motor standing where it is to stand.
    pub(super) rests: bool,
    /// The number of the reading that the last poll has left to be taken.
    pub(super) later: Option<u8>,
    /// Events that the next poll returns.
    pub(super) events: Events,
    /// Whether stallGuard2 has measured the load of the moving motor yet.
    pub(super) measured: Measured,
    /// The current that the driver was told last; `None` if it is to be told anew in any case.
    pub(super) excitation: Option<Excitation>,
    /// The level at the right stop switch's input while that switch is closed, on an axis that watches it itself; `None`
    /// where the ramp generator does.
    watched: Option<bool>,
    pub(super) sensors: Sensors,
    pub(super) encoders: Encoders,
}

/// An axis together with its motion controller, and so with the way to its chips.
#[derive(Debug)]
pub struct Joined<'a, H: Hardware> {
    axis: &'a mut Axis<H>,
    controller: &'a mut H::Controller,
}

impl<H: Hardware> Deref for Joined<'_, H> {
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
    /// The hardware of the axis, and the motion controller that each function of the hardware needs.
    pub(super) fn reach(&mut self) -> (&mut H, &mut H::Controller) {
        (&mut self.axis.hardware, self.controller)
    }

    /// Calls a function of the hardware with the motion controller and with the course that the motor is to take.
    pub(super) fn on_course<R>(&mut self, act: impl FnOnce(&mut H, &mut H::Controller, &Course<'_>) -> R) -> R {
        let Axis { hardware, values, search, orders, watched, .. } = &mut *self.axis;
        let mut course = course(values, search.as_ref(), &orders.pace);
        course.stops.right &= watched.is_none();
        act(hardware, self.controller, &course)
    }

    /// True if the hardware has lost its registers, as in [`Hardware::is_lost`].
    pub fn is_lost(&self) -> bool {
        self.hardware.is_lost(self.controller)
    }

    /// The motion controller of the axis, with its last readings.
    pub(super) fn controller(&self) -> &H::Controller {
        self.controller
    }
}

impl<H: Hardware> Axis<H> {
    /// An axis on its hardware with the factory defaults of its parameters. The chips are not told anything yet.
    pub fn new(hardware: H, table: &'static Table<P>) -> Self {
        Axis {
            hardware,
            table,
            values: Values::of(table),
            held: 0,
            search: None,
            orders: Orders::default(),
            untold: Untold::Nothing,
            brisk: false,
            rests: false,
            later: None,
            events: Events::default(),
            measured: Measured::default(),
            excitation: None,
            watched: None,
            sensors: Sensors::default(),
            encoders: Encoders::default(),
        }
    }

    /// Joins the axis with its motion controller.
    pub fn on<'a>(&'a mut self, controller: &'a mut H::Controller) -> Joined<'a, H> {
        Joined { axis: self, controller }
    }

    /// Sets a parameter to its stored value without telling the chips; [`Joined::start`] does that later. A value out
    /// of range, or of a parameter that cannot be stored, is ignored.
    pub fn preset(&mut self, parameter: &Parameter<P>, value: i32) {
        if parameter.row.stored() && parameter.row.accepts(value) {
            self.values.set(parameter.function, value);
        }
    }

    /// Sets a setting without telling the chips, as [`preset`](Self::preset) does, but whatever the product's table says of
    /// it: for a firmware that has ranges of its own, and for a setting that the table does not have.
    pub fn preset_setting(&mut self, setting: P, value: i32) {
        self.values.set(setting, value);
    }

    /// Reverses the counting direction of the encoders, because the motor's shaft is reversed (global parameter 90).
    /// The direction outputs, which the axes of a motion controller have in common, are switched by
    /// [`Hardware::invert`].
    pub fn set_reverse(&mut self, reverse: bool) {
        self.encoders.reverse = reverse;
    }

    /// Has the axis watch the right stop switch itself, at its input, once in each poll, because the ramp generator has
    /// one polarity for all switches and that of this one is another. `closed` is the level of the input while the switch
    /// is closed; with `None` the ramp generator watches this switch again, from the next motion command on.
    pub fn watch_right_switch(&mut self, closed: Option<bool>) {
        self.watched = closed;
    }

    /// Tells the axis how many microsteps a turn of the motor has. Then the position of the built-in encoder follows from
    /// that, and no longer from the prescaler of parameter 210.
    pub fn set_turn(&mut self, turn: i32) {
        self.encoders.turn = Some(turn);
    }

    /// Whether the right stop switch is closed, on an axis that watches it itself.
    pub(super) fn watched_right(&self) -> Option<bool> {
        self.watched.map(|closed| self.sensors.right == closed)
    }

    /// What closed stop switches do to the motor now, whoever watches them.
    pub(super) fn stops(&self) -> Stops {
        course(&self.values, self.search.as_ref(), &self.orders.pace).stops
    }

    /// True when writing parameter 2 (target speed) rotates the motor, as ROR does: in velocity mode, and in a
    /// reference search, which the rotation ends. In the two positioning modes the ramp generator works out its target
    /// speed itself.
    pub fn takes_speed(&self) -> bool {
        self.search.is_some() || !self.hardware.known().mode.positions()
    }

    /// True when the actual position is the target position (parameter 8), by the last reading.
    pub fn at_target(&self) -> bool {
        let known = self.hardware.known();
        known.position == known.target
    }

    /// The actual position in microsteps, as last read.
    pub fn last_position(&self) -> i32 {
        self.hardware.known().position
    }

    /// The actual speed, as last read, in the unit of parameter 3.
    pub fn last_speed(&self) -> i32 {
        self.hardware.known().speed
    }

    /// The target position in microsteps; `None` in velocity mode, in which the motor goes to no position.
    pub fn target_position(&self) -> Option<i32> {
        let known = self.hardware.known();
        known.mode.positions().then_some(known.target)
    }

    /// The home switch as sampled in the last poll, true while its input is high, whatever parameter 193 says of its
    /// polarity.
    pub const fn home_switch(&self) -> bool {
        self.sensors.home
    }

    /// The left and the right stop switch as read last: true is closed, after the polarity of global parameter 79.
    pub fn stop_switches(&self, controller: &H::Controller) -> [bool; 2] {
        let [left, right] = self.hardware.last_switches(controller);
        [left, self.watched_right().unwrap_or(right)]
    }

    /// True while a positioning move is under way.
    pub const fn travelling(&self) -> bool {
        self.orders.travelling
    }

    /// True while a positioning move is under way whose pace has a speed of its own.
    pub const fn limited(&self) -> bool {
        self.orders.travelling && self.orders.pace.speed.is_some()
    }

    /// The pace of the last motion command.
    pub const fn pace(&self) -> Pace<H::Shape> {
        self.orders.pace
    }

    /// The way to the target, to either side, in microsteps, by the last reading of the position.
    pub fn left(&self) -> u32 {
        let known = self.hardware.known();
        known.target.wrapping_sub(known.position).unsigned_abs()
    }

    /// The value of a setting; 0 for a parameter that is not a setting.
    pub fn setting(&self, parameter: P) -> i32 {
        self.values.get(parameter)
    }

    /// The shape that the parameters give the ramps.
    pub fn shape(&self) -> H::Shape {
        H::shape(&self.values)
    }

    /// The slopes that the motor has for an acceleration of `wanted` on its way to a position, with ramps of a shape, at a
    /// speed of up to that of parameter 4.
    pub fn slopes(&self, shape: &H::Shape, wanted: i32) -> Slopes {
        H::slopes(&self.values, shape, wanted, self.values.get(P::MaximumSpeed))
    }

    /// The difference of speed by which the motor makes up for a lag, as in [`Hardware::correction`].
    pub fn correction(&self, way: i32) -> i32 {
        H::correction(&self.values, way)
    }

    /// True while a reference search is under way.
    pub const fn searches(&self) -> bool {
        self.search.is_some()
    }

    /// True if the last poll has found that the motor stands and is to stand, and nothing has been told it since.
    pub const fn rests(&self) -> bool {
        self.rests
    }

    /// True if the last poll has left a reading to be taken by [`Joined::refresh`].
    pub(crate) const fn has_reading(&self) -> bool {
        self.later.is_some()
    }

    /// The value of RFS STATUS: 0 without a reference search, else the number of the leg under way, counted from 1.
    pub fn search_status(&self) -> i32 {
        self.search.as_ref().map_or(0, Search::number)
    }

    /// Lets the next N event zero the external encoder, if parameter 217 asks for it.
    pub(super) fn arm_null(&mut self) {
        self.encoders.arm_null(&self.values);
    }

    /// Takes in the counts of the encoders that this poll has sampled.
    pub(super) fn count(&mut self) {
        self.encoders.count(self.sensors, &self.values);
    }

    /// The current that the motor is to have in this state of motion.
    pub(super) fn select_excitation(&mut self, now: Micros, state: MotionState) -> Excitation {
        self.orders.current.select(now, state, self.hardware.known().speed, &self.values)
    }

    /// The speed at which the motor goes to a position, in the unit of parameter 4.
    pub fn positioning_speed(&self) -> i32 {
        course(&self.values, self.search.as_ref(), &self.orders.pace).speed
    }
}

/// How the motor is to move: as the parameters and the pace of the last motion command say, or as a reference search
/// says. In a search the stop switches act as the leg under way needs them, and near position zero as anywhere else
/// (tolerance 0).
fn course<'a, S>(values: &'a Values, search: Option<&Search>, pace: &Pace<S>) -> Course<'a> {
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
                latch: None,
            },
        },
    }
}
