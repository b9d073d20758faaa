//! The hardware of an axis: a ramp generator, which makes step pulses, and a driver, which makes coil currents of them.
//! The two may be two chips or one.
//!
//! An axis reaches its chips by [`Hardware`] alone and so knows none of them. What a chip demands - how wide its
//! positions are, in which order its registers are written - is known in one file for each kind of hardware.

use core::fmt;

use super::Error;
use super::current::Excitation;
use super::ratio::Ratio;
use super::slope::Slopes;
use super::switch::Stops;
use super::values::Values;
use crate::param::AxisParameter;

/// The ramp mode of an axis, by the numbers of parameter 138.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// The motor goes to a position, with a trapezoidal ramp.
    #[default]
    Ramp = 0,
    /// The motor goes to a position, with an exponential approach.
    Soft = 1,
    /// The motor turns at a speed.
    Velocity = 2,
    /// The motor is being stopped at once. The mode lasts until the hardware has taken the whole stop; then the motor
    /// is in velocity mode at speed 0.
    Hold = 3,
}

impl Mode {
    /// True in the two modes in which the motor goes to a position.
    pub const fn positions(self) -> bool {
        matches!(self, Mode::Ramp | Mode::Soft)
    }
}

/// What a motor is to do: turn at a speed, or go to a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// The motor shall turn at this speed, in the unit of the course; right if positive.
    Speed(i32),
    /// The motor shall go to a position.
    Position {
        /// The position in microsteps. The motor goes there the shorter way round the 32 bits.
        target: i32,
        /// With an exponential approach, where the ramp generator has one; else with a trapezoidal ramp.
        soft: bool,
    },
}

/// How a motor is to move: what its parameters and a reference search make of it together. Speeds and accelerations are
/// in the units of the product's parameter table, which are those of its ramp generator: for a TMC429 internal units,
/// 0..=2047.
#[derive(Clone, Copy, Debug)]
pub struct Course<'a> {
    /// All parameters of the axis. The hardware takes those from here that only its kind has, for example divisors.
    pub values: &'a Values,
    /// The speed at which the motor goes to a position.
    pub speed: i32,
    /// The acceleration of the motor's ramps, up and down.
    pub acceleration: i32,
    /// How far from position zero, in microsteps, the motor runs over the stop switches: with 0 they act everywhere.
    pub tolerance: i32,
    /// What the stop switches do.
    pub stops: Stops,
}

/// What the ramps of a ramp generator have besides a top speed and one acceleration. Axes on a straight line have the same in
/// the ratio of their ways.
pub trait Shape: Copy + fmt::Debug {
    /// Reduces what is so much that an axis with the `ratio` of the way does not exceed its `own`.
    fn limit(&mut self, ratio: Ratio, own: &Self);

    /// The same in the ratio of the ways, rounded up, and at most its `own`.
    fn scaled(&self, ratio: Ratio, own: &Self) -> Self;
}

/// A ramp generator that has nothing besides.
impl Shape for () {
    fn limit(&mut self, _: Ratio, (): &()) {}

    fn scaled(&self, _: Ratio, (): &()) {}
}

/// What is known of a ramp generator without a datagram: what it was told last, and what was read last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Known {
    /// The mode that the ramp generator was told last.
    pub mode: Mode,
    /// The speed at which the motor was last told to turn, right if positive.
    pub target_speed: i32,
    /// The position to which the motor was last sent, in microsteps.
    pub target: i32,
    /// The actual position as read last, in microsteps.
    pub position: i32,
    /// The actual speed as read last, right if positive.
    pub speed: i32,
}

impl Known {
    /// The direction in which the motor is to turn: only the sign counts, right is positive, and 0 is nowhere.
    pub const fn ahead(&self) -> i32 {
        if self.mode.positions() { self.target.wrapping_sub(self.position) } else { self.target_speed }
    }

    /// The number of microsteps that the motor makes before it is at a position, if it turns on as it was seen last; the
    /// positions wrap at 32 bits. `None` while it stands, or turns away from its goal.
    pub fn steps_before(&self, position: i32) -> Option<u32> {
        let on_its_way = self.speed.signum() == self.ahead().signum() && self.speed != 0;
        let way = position.wrapping_sub(self.position);
        let ahead = if self.speed > 0 { way } else { way.wrapping_neg() };
        on_its_way.then_some(ahead.cast_unsigned().wrapping_sub(1))
    }
}

/// What [`Hardware::follow`] has found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// The motor stands where it is to stand.
    pub rests: bool,
    /// The reading that was wanted, where it has not been taken yet.
    pub left: Option<u8>,
}

/// What an axis runs on. A value of this type is what one axis has to itself; what several axes have in common is the
/// [`Controller`](Self::Controller). Positions are in microsteps, speeds and accelerations in the units of [`Course`].
///
/// # Errors
/// A function fails where a chip does not take a datagram or does not answer one. Then what it was to do is done in
/// part or not at all, and calling it once more is right in any case.
pub trait Hardware {
    /// What the axes of one motion controller have in common: the bus to it, and what is known of its registers.
    type Controller;

    /// What the ramps have besides a top speed and an acceleration.
    type Shape: Shape;

    /// How many axes one motion controller moves: axis n of a module belongs to controller n / `AXES`.
    const AXES: usize;

    /// The parameters that determine the units of speeds and accelerations.
    const UNITS: &'static [AxisParameter];

    /// The parameters of positioning ramps, in those units.
    const RAMPS: &'static [AxisParameter];

    /// Of the parameters on which the excitation of the motor depends those that [`drive`](Self::drive) also takes from the
    /// values themselves: so it is called when they are written.
    const DRIVEN: &'static [AxisParameter];

    /// Number of readings in a rotation, in which each comes at least once. The next rotation has the same datagrams.
    const ROTATION: u8;

    /// Number of readings after which nothing that is known of a motor that turns is older than they are.
    const FRESH: u8;

    /// The driver's [flags](Self::flags) that mean that the driver has switched the motor off.
    const SHUT_DOWN: u32;

    /// Sets a motion controller up, with its motors at a stand. Afterwards each of its axes is [placed](Self::place)
    /// and given a [goal](Self::head).
    ///
    /// # Errors
    /// The controller does not answer as one of its kind does.
    fn start(controller: &mut Self::Controller) -> Result<(), Error>;

    /// Stops all motors of a motion controller at once, whatever they were doing: the controller may be running since
    /// before the firmware started. Its axes are not told: each is [placed](Self::place) or [stopped](Self::stop)
    /// before it moves again.
    ///
    /// # Errors
    /// Some datagrams did not get through; the others were sent all the same.
    fn halt(controller: &mut Self::Controller) -> Result<(), Error>;

    /// True if the motion controller answers. A controller that has not answered before is asked again by this.
    fn answers(controller: &mut Self::Controller) -> bool;

    /// Inverts the inputs of the stop switches, and the direction outputs of the motors, of all axes of a motion
    /// controller; each where its argument is true.
    fn invert(controller: &mut Self::Controller, switches: bool, direction: bool) -> Result<(), Error>;

    /// True if the ramp generator can go to a position with these parameters.
    fn accepts(values: &Values) -> bool;

    /// Gives the motor a new goal, whatever it was doing; also while it moves.
    fn head(&mut self, controller: &mut Self::Controller, goal: Goal, course: &Course<'_>) -> Result<(), Error>;

    /// Makes all ready for a positioning move but the datagram that sets the motor going, which [`head`](Self::head) to
    /// the same goal on the same course sends then; so several motors can be started at once. A motor that moves may go on
    /// on the new course.
    fn ready(&mut self, controller: &mut Self::Controller, target: i32, course: &Course<'_>) -> Result<(), Error>;

    /// The motor goes on to its present goal, a position, on a course of another speed or acceleration. Only so many datagrams
    /// are sent as one piece of a turn has time for. True if there were any: then this is to be called again.
    fn approach(&mut self, controller: &mut Self::Controller, course: &Course<'_>) -> Result<bool, Error>;

    /// The shape that the parameters of an axis give its ramps.
    fn shape(values: &Values) -> Self::Shape;

    /// Gives the ramps of the motor, from its next goal on, another shape than that of its parameters; `None` gives them that
    /// again.
    fn reshape(&mut self, shape: Option<Self::Shape>);

    /// The slopes that the motor really has for an acceleration of `wanted` on its way to a position, with ramps of a shape,
    /// at a speed of up to `speed`.
    fn slopes(values: &Values, shape: &Self::Shape, wanted: i32, speed: i32) -> Slopes;

    /// By how much, in 1/256 microstep, two motors seem to lag because their positions are not read at the same time, at a
    /// speed.
    fn skew(speed: i32) -> i32;

    /// The difference of speed, in 1/256 of the unit of [`Course`], by which a motor makes up for a lag of `way`, in 1/256
    /// microstep, within some 16 ms. `way` is at most 2^16 to either side.
    fn correction(values: &Values, way: i32) -> i32;

    /// The motor goes on to its present goal on another course.
    fn adjust(&mut self, controller: &mut Self::Controller, course: &Course<'_>) -> Result<(), Error>;

    /// Stops the motor at once, without a ramp. Its goal is then to turn at speed 0.
    fn stop(&mut self, controller: &mut Self::Controller, course: &Course<'_>) -> Result<(), Error>;

    /// Makes `position` both the actual position and the target. Before this call the motor is `standing`, or turns at a
    /// speed. While it turns, the position of the chip may be this one or the former one if the function fails.
    fn place(&mut self, controller: &mut Self::Controller, position: i32, standing: bool) -> Result<(), Error>;

    /// Follows the motor: reads the actual position of one that does not stand. `reading` is the number of the reading that
    /// is wanted as well, if there is one. This comes once in a millisecond.
    fn follow(&mut self, controller: &mut Self::Controller, reading: Option<u8>) -> Result<Followed, Error>;

    /// Takes one of the other readings, in rotation; `reading` is its number, wrapping at 256. This comes once in a
    /// millisecond, where [`follow`](Self::follow) has left it; the axes of a motion controller take turns in it.
    fn refresh(&mut self, controller: &mut Self::Controller, reading: u8) -> Result<(), Error>;

    /// The number of microsteps that a motor which turns on may still make, from its last known position, before
    /// [`follow`](Self::follow) and [`refresh`](Self::refresh) do more than to read, or the axis acts upon its position; 0 for
    /// a motor that rests. `None` if they may do more than to read now.
    fn room(&self, controller: &Self::Controller) -> Option<u32>;

    /// What is known without a datagram.
    fn known(&self) -> &Known;

    /// The same, for the goal in it to be put back after a command that was refused. The chips are told so by
    /// [`head`](Self::head).
    fn known_mut(&mut self) -> &mut Known;

    /// Reads the actual position.
    fn position(&mut self, controller: &mut Self::Controller) -> Result<i32, Error>;

    /// Reads the actual speed, right if positive.
    fn speed(&mut self, controller: &mut Self::Controller) -> Result<i32, Error>;

    /// Reads the speed to which the motor is accelerating or braking: the commanded one, or, on the way to a position,
    /// the ramp generator's own.
    fn target_speed(&mut self, controller: &mut Self::Controller) -> Result<i32, Error>;

    /// A turn begins, the millisecond in which each axis is polled once.
    fn begin_turn(controller: &mut Self::Controller);

    /// The stop switches in this turn, left and right: true is closed, after inversion. The hardware may read them for all
    /// axes of the controller when the first one asks.
    fn turn_switches(&mut self, controller: &mut Self::Controller) -> Result<[bool; 2], Error>;

    /// True if the reading of this number is one of speed or switches.
    fn is_of_motion(reading: u8) -> bool;

    /// Reads the stop switches, left and right: true is closed, after inversion.
    fn switches(&mut self, controller: &mut Self::Controller) -> Result<[bool; 2], Error>;

    /// The stop switches as read last, left and right: true is closed, after inversion.
    fn last_switches(&self, controller: &Self::Controller) -> [bool; 2];

    /// True while a closed stop switch acts on a motor that is to turn in the direction `ahead`, of which only the sign counts,
    /// by the last readings.
    fn meets_switch(&self, controller: &Self::Controller, course: &Course<'_>, ahead: i32) -> bool;

    /// True while a stop switch keeps the motor from turning in the direction `ahead`. To be called while the last reading of
    /// the speed is 0, or the position `stays` although the motor was fast: then the last reading of the switches may be older.
    fn is_held(
        &mut self,
        controller: &mut Self::Controller,
        course: &Course<'_>,
        ahead: i32,
        stays: bool,
    ) -> Result<bool, Error>;

    /// Arms the latch: the position is to be kept at which the stop switch of [`Stops::latch`] opens, which is closed
    /// now.
    fn latch(&mut self, controller: &mut Self::Controller) -> Result<(), Error>;

    /// The position that the latch has kept since it was armed; `None` if the switch has not opened since.
    fn latched(&mut self, controller: &mut Self::Controller) -> Result<Option<i32>, Error>;

    /// Brings the driver's registers to the parameters and this excitation.
    fn drive(
        &mut self,
        controller: &mut Self::Controller,
        values: &Values,
        excitation: Excitation,
    ) -> Result<(), Error>;

    /// True if [`drive`](Self::drive) is to be called once more, because the motor stands now.
    fn waits_to_be_driven(&self) -> bool {
        false
    }

    /// Notes that the driver may have lost its registers: the next [`drive`](Self::drive) writes all of them.
    fn forget(&mut self, controller: &mut Self::Controller);

    /// Reads a parameter that is known to this kind of hardware alone, in its unit in the product's table. Hardware that
    /// has no such parameters leaves this function as it is.
    ///
    /// # Errors
    /// [`Error::NotNow`] if this kind of hardware does not have the parameter.
    fn reading(
        &mut self,
        controller: &mut Self::Controller,
        values: &Values,
        parameter: AxisParameter,
    ) -> Result<i32, Error> {
        let _ = (controller, values, parameter);
        Err(Error::NotNow)
    }

    /// Makes `position` that of an encoder whose counter is in the hardware, in the unit of parameter 209; without such a
    /// counter this does nothing.
    fn place_encoder(&mut self, controller: &mut Self::Controller, position: i32) -> Result<(), Error> {
        let _ = (controller, position);
        Ok(())
    }

    /// The load value of the motor as read last, 0..=1023 (parameter 206): 0 is the largest load.
    fn load(&self, controller: &Self::Controller) -> u16;

    /// The current that coolStep gives the motor, as read last, 0..=31 (parameter 180).
    fn current(&self, controller: &Self::Controller) -> u8;

    /// The driver's flags as read last, as the bits of parameter 208.
    fn flags(&self, controller: &Self::Controller) -> u32;

    /// True if the motor stalls, by the driver's last measurement of its load. `pin` is the level of the driver's
    /// output for this, on a driver that has such an output.
    fn stalled(&self, controller: &Self::Controller, pin: bool) -> bool;

    /// Has the hardware stop the motor at once when it stalls, where it can do so itself, or no longer do so. True if it has
    /// stopped the motor, which then stands until it is told to [stop](Self::stop).
    fn watch_stall(&mut self, controller: &mut Self::Controller, armed: bool) -> Result<bool, Error> {
        let _ = (controller, armed);
        Ok(false)
    }

    /// True if an encoder whose counter is in the hardware deviates from the position further than it may, by the last
    /// reading.
    fn deviates(&self) -> bool {
        false
    }

    /// True if the hardware has lost its registers, because of its supply. Then the motor stands, and is to be told to
    /// [stop](Self::stop), which sets the hardware up again.
    fn is_lost(&self, controller: &Self::Controller) -> bool {
        let _ = controller;
        false
    }
}
