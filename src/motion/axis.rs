//! The state of one axis: the values of its parameters, the motion it was told, and the events it has noticed. The
//! functions that need the chips belong to [`Joined`](super::Joined), an axis with its motion controller.

use super::current::{Excitation, MotionState};
use super::driving::Driving;
use super::encoders::Encoders;
use super::hardware::{Followed, Hardware, Shape};
use super::hold::Hold;
use super::orders::{Orders, Untold};
use super::pace::Pace;
use super::profile::Profile;
use super::search::Search;
use super::sensors::Sensors;
use super::slope::Slopes;
use super::stall::Measured;
use super::switch::{Side, Stops};
use super::values::Values;
use crate::param::{AxisParameter as P, Parameter, Table};
use crate::units::Micros;

/// The events of an axis since the poll before. Each event is returned by one poll only.
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
    /// Whether a stop switch holds the motor.
    pub(super) hold: Hold,
    /// The reference search that is under way.
    pub(super) search: Option<Search>,
    /// The state that a command changes besides, apart from the goal of the hardware.
    pub(super) orders: Orders<H::Shape>,
    /// Orders that the chips have not taken yet; each poll tells them again.
    pub(super) untold: Untold,
    /// Whether the motor stands where it is to stand, by the last poll and by what it was told since. With it goes the
    /// number of the reading that the last poll has left to be taken.
    pub(super) followed: Followed,
    /// Events that the next poll returns.
    pub(super) events: Events,
    /// Whether stallGuard2 has measured the load of the moving motor yet.
    pub(super) measured: Measured,
    /// The excitation that the driver was told last.
    pub(super) driving: Driving,
    /// The level at the right stop switch's input while that switch is closed, on an axis that watches it itself;
    /// `None` where the ramp generator does.
    pub(super) watched: Option<bool>,
    pub(super) sensors: Sensors,
    pub(super) encoders: Encoders,
}

impl<H: Hardware> Axis<H> {
    /// An axis on its hardware with the factory defaults of its parameters. The chips are not told anything yet.
    pub fn new(hardware: H, table: &'static Table<P>) -> Self {
        Axis {
            hardware,
            table,
            values: Values::of(table),
            hold: Hold::default(),
            search: None,
            orders: Orders::default(),
            untold: Untold::Nothing,
            followed: Followed::default(),
            events: Events::default(),
            measured: Measured::default(),
            driving: Driving::default(),
            watched: None,
            sensors: Sensors::default(),
            encoders: Encoders::default(),
        }
    }

    /// Sets a parameter to its stored value without telling the chips; [`Joined::start`](super::Joined::start) does
    /// that later. A value out of range, or of a parameter that cannot be stored, is ignored.
    pub fn preset(&mut self, parameter: &Parameter<P>, value: i32) {
        if parameter.row.stored() && parameter.row.accepts(value) {
            self.values.set(parameter.function, value);
        }
    }

    /// Sets a setting without telling the chips, as [`preset`](Self::preset) does, but whatever the product's table
    /// says of it. This is for a firmware that has ranges of its own, and for a setting that the table does not have.
    pub fn preset_setting(&mut self, setting: P, value: i32) {
        self.values.set(setting, value);
    }

    /// Reverses the counting direction of the encoders, because the motor's shaft is reversed (global parameter 90).
    /// The direction outputs, which the axes of a motion controller have in common, are switched by
    /// [`MotionController::invert`](super::MotionController::invert).
    pub fn set_reverse(&mut self, reverse: bool) {
        self.encoders.reverse = reverse;
    }

    /// Has the axis watch the right stop switch itself, at its input, once in each poll. It does so because the ramp
    /// generator has one polarity for all switches and that of this one is another. `closed` is the level of the input
    /// while the switch is closed; with `None` the ramp generator watches this switch again, from the next motion
    /// command on.
    pub fn watch_right_switch(&mut self, closed: Option<bool>) {
        self.watched = closed;
    }

    /// Tells the axis how many microsteps a turn of the motor has. Then the position of the built-in encoder follows
    /// from that, and no longer from the prescaler of parameter 210.
    pub fn set_turn(&mut self, turn: i32) {
        self.encoders.turn = Some(turn);
    }

    /// Whether the right stop switch is closed, on an axis that watches it itself.
    pub(super) fn watched_right(&self) -> Option<bool> {
        self.watched.map(|closed| self.sensors.right == closed)
    }

    /// The effect of closed stop switches on the motor now, whoever watches them.
    pub(super) fn stops(&self) -> Stops {
        profile(&self.values, self.search.as_ref(), &self.orders.pace).stops
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
        let [left, right] = self.hardware.readings(controller).switches;
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
        H::Shape::of(&self.values)
    }

    /// The slopes that the motor has for an acceleration of `wanted` on its way to a position. The ramps are of this
    /// shape, and the speed is up to that of parameter 4.
    pub fn slopes(&self, shape: &H::Shape, wanted: i32) -> Slopes {
        shape.slopes(&self.values, wanted, self.values.get(P::MaximumSpeed))
    }

    /// The difference of speed by which the motor makes up for a lag, as in [`Shape::correction`].
    pub fn correction(&self, way: i32) -> i32 {
        H::Shape::correction(&self.values, way)
    }

    /// True while a reference search is under way.
    pub const fn searches(&self) -> bool {
        self.search.is_some()
    }

    /// True if the last poll has found that the motor stands and is to stand, and nothing has been told it since.
    pub const fn rests(&self) -> bool {
        self.followed.rests
    }

    /// True if the last poll has left a reading to be taken by [`Joined::refresh`](super::Joined::refresh).
    pub(crate) const fn has_reading(&self) -> bool {
        self.followed.left.is_some()
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
        profile(&self.values, self.search.as_ref(), &self.orders.pace).speed
    }
}

/// The motion profile as the parameters and the pace of the last motion command make it, or as a reference search says.
/// In a search the stop switches act as the leg under way needs them, and near position zero as anywhere else
/// (tolerance 0).
pub(super) fn profile<'a, S>(values: &'a Values, search: Option<&Search>, pace: &Pace<S>) -> Profile<'a> {
    let acceleration = pace.acceleration.unwrap_or(values.get(P::MaximumAcceleration));
    match search {
        Some(search) => {
            Profile { values, speed: search.slow_speed(), acceleration, tolerance: 0, stops: search.stops() }
        }
        None => Profile {
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
