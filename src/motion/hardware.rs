//! What an axis runs on: a ramp generator, which makes the steps, and a driver, which makes currents of them. They may
//! be two chips or one.
//!
//! All that an axis does it does by [`Hardware`]: so it knows no chip, and what a chip demands - how wide its positions
//! are, in which order its registers are written - is known in one file for each kind of hardware.

use super::Error;
use super::current::Excitation;
use super::switch::Stops;
use super::values::Values;

/// The ramp mode of an axis, by the numbers of parameter 138.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// It goes to a position, with a trapezoidal ramp.
    #[default]
    Ramp = 0,
    /// It goes to a position, with an exponential approach.
    Soft = 1,
    /// It turns at a speed.
    Velocity = 2,
    /// It is being stopped at once: so only until its hardware has heard all of that.
    Hold = 3,
}

impl Mode {
    /// True in the modes that go to a position.
    pub const fn positions(self) -> bool {
        matches!(self, Mode::Ramp | Mode::Soft)
    }
}

/// Where a motor is to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// It shall turn at this speed, right if positive.
    Speed(i32),
    /// It shall go to this position, in microsteps.
    Position {
        /// The position. The motor goes there the shorter way round the 32 bits.
        target: i32,
        /// With an exponential approach, where the ramp generator has one.
        soft: bool,
    },
}

/// How a motor is to move: what parameters and a reference search make of it together. Speeds and accelerations are in
/// the units of the product's table, which are those of its ramp generator.
#[derive(Clone, Copy, Debug)]
pub struct Course<'a> {
    /// The parameters: those that only one kind of hardware has it takes from here itself, for example divisors.
    pub values: &'a Values,
    /// The speed at which it goes to a position.
    pub speed: i32,
    /// How fast it comes to its speed, and to a stand.
    pub acceleration: i32,
    /// How far from position zero the stop switches do not stop it, in microsteps; 0 stops it everywhere.
    pub tolerance: i32,
    /// What the stop switches do.
    pub stops: Stops,
}

/// What is known of a ramp generator without asking it: what it was told last, and the last readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Known {
    /// What it does.
    pub mode: Mode,
    /// The speed that it was told to turn at last, right if positive.
    pub target_speed: i32,
    /// The position that it was sent to last, in microsteps.
    pub target: i32,
    /// Where the motor is, in microsteps.
    pub position: i32,
    /// How fast it turns, right if positive.
    pub speed: i32,
}

impl Known {
    /// The direction in which the motor is to turn, as a sign.
    pub const fn ahead(&self) -> i32 {
        if self.mode.positions() { self.target.wrapping_sub(self.position) } else { self.target_speed }
    }
}

/// What an axis runs on. A value of it is what one axis has to itself; what several have in common is the
/// [`Controller`](Self::Controller).
///
/// A function fails where a chip does not take a datagram, or does not answer. What was told is done then in part, or
/// not at all; telling it once more is right in any case.
pub trait Hardware {
    /// What the axes of one motion controller share: the bus to it, and what is known of its registers.
    type Controller;

    /// How many axes one controller has: axis n of a module is on controller n / `AXES`.
    const AXES: usize;

    /// Those of the driver's [flags](Self::flags) which mean that it has switched the motor off.
    const SHUT_DOWN: u8;

    /// Sets a controller up, with its motors at a stand. Its axes are [placed](Self::place) and given a
    /// [goal](Self::head) then.
    ///
    /// # Errors
    /// It does not answer as one of its kind does.
    fn start(controller: &mut Self::Controller) -> Result<(), Error>;

    /// Stops all motors of a controller at once, whatever they were doing: it may be running since before the firmware
    /// started. Its axes do not know: each is [placed](Self::place) or [stopped](Self::stop) before it moves again.
    ///
    /// # Errors
    /// Some of it was not heard; the rest was told all the same.
    fn halt(controller: &mut Self::Controller) -> Result<(), Error>;

    /// Whether a controller answers; one that has not is asked again.
    fn answers(controller: &mut Self::Controller) -> bool;

    /// Inverts the inputs of the stop switches, and the direction of the motors, of all axes of a controller.
    fn invert(controller: &mut Self::Controller, switches: bool, direction: bool) -> Result<(), Error>;

    /// Whether the ramp generator can go to a position with these parameters.
    fn accepts(values: &Values) -> bool;

    /// Sends the motor somewhere, whatever it was doing; also while it moves.
    fn head(&mut self, controller: &mut Self::Controller, goal: Goal, course: &Course<'_>) -> Result<(), Error>;

    /// The motor goes on to where it was sent, on another course.
    fn adjust(&mut self, controller: &mut Self::Controller, course: &Course<'_>) -> Result<(), Error>;

    /// Stops the motor at once, without a ramp. From then on it turns at speed 0.
    fn stop(&mut self, controller: &mut Self::Controller, course: &Course<'_>) -> Result<(), Error>;

    /// Makes `position` the motor's position and its target, in microsteps. The motor stands, or turns at a speed.
    fn place(&mut self, controller: &mut Self::Controller, position: i32) -> Result<(), Error>;

    /// Takes the readings of this millisecond: the position of a motor that does not stand, and one of the others. These rotate, and the axes of a
    /// controller take turns in that: `reading` is the number of the reading, wrapping at 256, or `None` where it is the
    /// turn of another axis.
    fn refresh(&mut self, controller: &mut Self::Controller, reading: Option<u8>) -> Result<(), Error>;

    /// What is known without asking.
    fn known(&self) -> &Known;

    /// The position right now, in microsteps.
    fn position(&mut self, controller: &mut Self::Controller) -> Result<i32, Error>;

    /// The speed right now.
    fn speed(&mut self, controller: &mut Self::Controller) -> Result<i32, Error>;

    /// The speed that the motor is heading for right now: on its way to a position the ramp generator's own.
    fn target_speed(&mut self, controller: &mut Self::Controller) -> Result<i32, Error>;

    /// The magnitude of the acceleration right now.
    fn acceleration(&mut self, controller: &mut Self::Controller) -> Result<i32, Error>;

    /// The stop switches right now, left and right: true is closed.
    fn switches(&mut self, controller: &mut Self::Controller) -> Result<[bool; 2], Error>;

    /// The stop switches as they were read last, left and right.
    fn last_switches(&self, controller: &Self::Controller) -> [bool; 2];

    /// True while a stop switch holds the motor against its goal. By the last reading of its speed it stands.
    fn is_held(&mut self, controller: &mut Self::Controller, course: &Course<'_>) -> Result<bool, Error>;

    /// The position shall be kept at which the stop switch opens that [`Stops::latch`] tells; it is closed now.
    fn latch(&mut self, controller: &mut Self::Controller) -> Result<(), Error>;

    /// The position that has been kept since, if one has.
    fn latched(&mut self, controller: &mut Self::Controller) -> Result<Option<i32>, Error>;

    /// Brings the driver to its parameters and this excitation.
    fn drive(
        &mut self,
        controller: &mut Self::Controller,
        values: &Values,
        excitation: Excitation,
    ) -> Result<(), Error>;

    /// The driver may have lost what it was told: next time it is told everything.
    fn forget(&mut self, controller: &mut Self::Controller);

    /// The motor's load as read last, 0..=1023: 0 is the largest.
    fn load(&self, controller: &Self::Controller) -> u16;

    /// The current that coolStep gives the motor, as read last, 0..=31.
    fn current(&self, controller: &Self::Controller) -> u8;

    /// The driver's flags as read last, by the bits of parameter 208.
    fn flags(&self, controller: &Self::Controller) -> u8;

    /// Whether the motor stalls, by the driver's last measurement. `pin` is the level of the driver's output for that,
    /// where it has one.
    fn stalled(&self, controller: &Self::Controller, pin: bool) -> bool;
}
