//! The hardware of an axis that runs on a TMC5160, which is ramp generator, driver and encoder counter in one: each axis is
//! on a motion controller of its own.
//!
//! Here is all that this chip demands: its unit of time (`unit.rs`), ramps of six points (`ramp.rs`, `settings.rs`), the
//! driver's many settings (`configuration.rs`), and a way to stop at once although its speed cannot be written. Most of
//! what is known of the motor comes with two datagrams in each millisecond (`readings.rs`): the actual position and, in
//! rotation, one of the other readings; the stop switches are in the status byte of each datagram. By its supply the chip
//! can be reset: then it has lost all registers, and the motor stands.

mod configuration;
mod ramp;
mod readings;
mod settings;
#[cfg(test)]
mod tests;
mod unit;

use core::marker::PhantomData;

use embedded_hal::spi::SpiDevice;

use super::Error;
use super::current::Excitation;
use super::hardware::{Course, Followed, Goal, Hardware, Known, Mode};
use super::slope::Slopes;
use super::values::Values;
use crate::chip::tmc5160::{RampMode, Register, Tmc5160, Turn, drv_status, gstat, ramp_stat};
use crate::param::AxisParameter as P;
pub use ramp::Shape;
use unit::{Unit, signed_speed};

/// Number of turns, one in a millisecond, after which a reading of the speed is younger than the last goal: it is asked for
/// in one of two turns, and comes in the next one.
const SETTLING: u8 = 4;
/// Number of turns for which the switches stay as they stop the motor at once, so that the ramp generator has seen them.
const HALTING: u8 = 2;
/// Number of turns after which a reading of the driver's flags is younger than its last release: they are asked for in
/// one of four turns, and come in the next one.
const RELEASING: u8 = 6;

/// What one axis has of its TMC5160. `D` is the SPI device of the chip.
#[derive(Debug)]
pub struct Tmc5160Axis<D> {
    known: Known,
    /// The shape of the ramps, where it is not that of the parameters.
    shape: Option<Shape>,
    /// The number of the next reading in the rotation, wrapping at 256.
    rotation: u8,
    /// For how many turns a reading of the speed may still be older than the goal.
    settling: u8,
    /// For how many turns the switches still stop the motor at once, whatever they are.
    halting: u8,
    /// For how many turns the driver's flags may still be those of a shut-down that has been ended.
    releasing: u8,
    /// SW_MODE as the course of the motor has it, but for sg_stop.
    switches: u32,
    /// The stop switches as read last, left and right.
    closed: [bool; 2],
    /// A stall stops the motor.
    armed: bool,
    /// A stall has stopped the motor.
    stalled: bool,
    /// The encoder deviates.
    deviates: bool,
    /// stealthChop is switched on.
    pwm: bool,
    /// stealthChop is to be switched on, when the motor stands.
    waits: bool,
    /// DRV_STATUS as read last.
    driver: u32,
    /// The unit of speeds.
    unit: Unit,
    /// The top speed of the course, in that unit.
    top_speed: i32,
    device: PhantomData<D>,
}

impl<D: SpiDevice> Tmc5160Axis<D> {
    /// The hardware of the axes of a module. The chips are not told anything yet.
    pub fn axes<const N: usize>() -> [Self; N] {
        [(); N].map(|()| Tmc5160Axis {
            known: Known::default(),
            shape: None,
            rotation: 0,
            settling: 0,
            halting: 0,
            releasing: 0,
            switches: 0,
            closed: [false; 2],
            armed: false,
            stalled: false,
            deviates: false,
            pwm: false,
            waits: false,
            driver: 0,
            unit: Unit::Pps,
            top_speed: 0,
            device: PhantomData,
        })
    }
}

impl<D: SpiDevice> Hardware for Tmc5160Axis<D> {
    type Controller = Tmc5160<D>;

    type Shape = Shape;

    const AXES: usize = 1;

    const UNITS: &'static [P] = &[P::UnitMode];

    const RAMPS: &'static [P] = &[
        P::MaximumSpeed,
        P::MaximumAcceleration,
        P::StartVelocity,
        P::FirstAcceleration,
        P::FirstVelocity,
        P::MaximumDeceleration,
        P::LastDeceleration,
        P::StopVelocity,
    ];

    const DRIVEN: &'static [P] =
        &[P::MaximumCurrent, P::StandbyCurrent, P::PowerDownDelay, P::StopOnStall, P::SmartEnergyThresholdSpeed];

    const ROTATION: u8 = readings::ROTATION;

    /// Each reading but the version comes once in eight turns, and is answered in the next one.
    const FRESH: u8 = 10;

    const SHUT_DOWN: u32 = flags::OVERTEMPERATURE | flags::SHORTS_TO_GROUND | flags::SHORTS_TO_SUPPLY;

    fn start(chip: &mut Tmc5160<D>) -> Result<(), Error> {
        chip.initialise()?;
        Ok(chip.halt()?)
    }

    fn halt(chip: &mut Tmc5160<D>) -> Result<(), Error> {
        chip.forget();
        Ok(chip.halt()?)
    }

    fn answers(chip: &mut Tmc5160<D>) -> bool {
        chip.answers() || chip.confirm().is_ok()
    }

    /// Each chip inverts its switches and its motor by parameters of its axis (24, 25 and 251), so there is nothing that its
    /// axes have in common.
    fn invert(_: &mut Tmc5160<D>, _: bool, _: bool) -> Result<(), Error> {
        Ok(())
    }

    /// The chip takes all values that the ranges of the parameters allow.
    fn accepts(_: &Values) -> bool {
        true
    }

    fn head(&mut self, chip: &mut Tmc5160<D>, goal: Goal, course: &Course<'_>) -> Result<(), Error> {
        self.settling = SETTLING;
        match goal {
            Goal::Speed(speed) => {
                self.known.mode = Mode::Velocity;
                self.known.target_speed = speed;
                self.adjust(chip, course)?;
                let mode = if speed < 0 { RampMode::Negative } else { RampMode::Positive };
                Ok(chip.write(Register::RampMode, mode as u32)?)
            }
            Goal::Position { target, .. } => {
                self.ready(chip, target, course)?;
                self.known.mode = Mode::Ramp;
                self.known.target = target;
                if !chip.holds(Register::RampMode, RampMode::Positioning as u32) {
                    return Ok(chip.write(Register::RampMode, RampMode::Positioning as u32)?);
                }
                Ok(chip.write(Register::XTarget, target as u32)?)
            }
        }
    }

    /// In velocity mode the top speed would set the motor going: so the chip is in hold mode, in which the motor keeps the
    /// speed that it has, until positioning begins. In positioning mode the motor goes when it gets its target.
    fn ready(&mut self, chip: &mut Tmc5160<D>, target: i32, course: &Course<'_>) -> Result<(), Error> {
        self.write_switches(chip, course)?;
        let positions = chip.holds(Register::RampMode, RampMode::Positioning as u32);
        if !positions {
            chip.write(Register::RampMode, RampMode::Hold as u32)?;
        }
        self.write_ramp(chip, course)?;
        if !positions {
            chip.write(Register::XTarget, target as u32)?;
        }
        Ok(())
    }

    /// A datagram takes 8 us, so all are sent at once.
    fn approach(&mut self, chip: &mut Tmc5160<D>, course: &Course<'_>) -> Result<bool, Error> {
        self.write_ramp(chip, course)
    }

    fn shape(values: &Values) -> Shape {
        Shape::of(values).in_two_parts(values)
    }

    fn reshape(&mut self, shape: Option<Shape>) {
        self.shape = shape;
    }

    fn slopes(values: &Values, shape: &Shape, wanted: i32, _: i32) -> Slopes {
        shape.slopes(Unit::of(values), wanted)
    }

    /// The positions of two chips are read within some 60 us: at 1 pps the motor makes 1/65 of 1/256 microstep meanwhile.
    fn skew(speed: i32) -> i32 {
        speed >> 6
    }

    /// A lag of a microstep is made up for in 16.4 ms by 61 pps.
    fn correction(_: &Values, way: i32) -> i32 {
        way.saturating_mul(61)
    }

    fn adjust(&mut self, chip: &mut Tmc5160<D>, course: &Course<'_>) -> Result<(), Error> {
        self.write_switches(chip, course)?;
        if self.known.mode.positions() {
            return self.write_ramp(chip, course).map(drop);
        }
        let unit = Unit::of(course.values);
        chip.write(Register::AMax, unit.acceleration(course.acceleration))?;
        chip.write(Register::TZeroWait, course.values.get(P::RampWaitTime) as u32)?;
        Ok(chip.write(Register::VMax, unit.speed(self.known.target_speed).min(unit::TOP_SPEED))?)
    }

    /// A chip that has been reset is set up with the motor where it was last known to be. What its driver has lost is written
    /// by [`drive`](Self::drive).
    fn stop(&mut self, chip: &mut Tmc5160<D>, course: &Course<'_>) -> Result<(), Error> {
        self.known.mode = Mode::Hold;
        if chip.is_lost() {
            Self::start(chip)?;
            chip.place_standing(Register::XActual, self.known.position)?;
        } else {
            chip.halt()?;
            chip.write(Register::RampStat, ramp_stat::EVENT_STOP_SG)?;
        }
        self.halting = HALTING;
        (self.armed, self.stalled) = (false, false);
        self.known.speed = 0;
        self.head(chip, Goal::Speed(0), course)
    }

    fn place(&mut self, chip: &mut Tmc5160<D>, position: i32, standing: bool) -> Result<(), Error> {
        if standing {
            chip.place_standing(Register::XActual, position)?;
        } else {
            chip.write(Register::XActual, position as u32)?;
        }
        chip.write(Register::XTarget, position as u32)?;
        self.known.position = position;
        self.known.target = position;
        Ok(())
    }

    /// Also takes one of the other readings, whatever is asked for: two datagrams bring two.
    fn follow(&mut self, chip: &mut Tmc5160<D>, _: Option<u8>) -> Result<Followed, Error> {
        self.settling = self.settling.saturating_sub(1);
        self.releasing = self.releasing.saturating_sub(1);
        if let Some(turns) = self.halting.checked_sub(1) {
            self.halting = turns;
            if turns == 0 {
                self.show_switches(chip)?;
            }
        }
        let Turn { position, reading } = chip.turn(self.next_reading(chip))?;
        self.take_position(chip, position)?;
        if self.halting == 0 {
            self.closed = chip.switches();
        }
        if let Some((register, word)) = reading {
            self.take(chip, register, word)?;
        }
        Ok(Followed { rests: self.rests(), left: None })
    }

    /// All readings come with [`follow`](Self::follow).
    fn refresh(&mut self, _: &mut Tmc5160<D>, _: u8) -> Result<(), Error> {
        Ok(())
    }

    fn room(&self, chip: &Tmc5160<D>) -> Option<u32> {
        let settled = self.settling == 0 && self.halting == 0 && self.releasing == 0;
        if !settled || self.armed || self.stalled || !chip.answers() {
            return None;
        }
        if self.rests() {
            return Some(0);
        }
        let room = self.known.steps_before(self.known.target)?.min(self.known.steps_before(0)?);
        Some(room.min(readings::LEAP / 2))
    }

    fn known(&self) -> &Known {
        &self.known
    }

    fn known_mut(&mut self) -> &mut Known {
        &mut self.known
    }

    fn position(&mut self, chip: &mut Tmc5160<D>) -> Result<i32, Error> {
        let position = chip.read(Register::XActual)? as i32;
        self.take_position(chip, position)?;
        Ok(self.known.position)
    }

    fn speed(&mut self, chip: &mut Tmc5160<D>) -> Result<i32, Error> {
        let speed = signed_speed(chip.read(Register::VActual)?);
        self.known.speed = self.unit.of_register(speed);
        Ok(self.known.speed)
    }

    /// On the way to a position the chip does not tell to what speed it is accelerating or braking: it is the top speed until
    /// the motor is there.
    fn target_speed(&mut self, chip: &mut Tmc5160<D>) -> Result<i32, Error> {
        if !self.known.mode.positions() {
            return Ok(self.known.target_speed);
        }
        self.position(chip)?;
        Ok(self.top_speed.saturating_mul(self.known.ahead().signum()))
    }

    /// Stop switches come with each datagram.
    fn begin_turn(_: &mut Tmc5160<D>) {}

    fn turn_switches(&mut self, _: &mut Tmc5160<D>) -> Result<[bool; 2], Error> {
        Ok(self.closed)
    }

    /// No reading but those of [`follow`](Self::follow) is ever asked for.
    fn is_of_motion(_: u8) -> bool {
        false
    }

    /// While their polarities are such that both stop the motor, the chip does not know their states.
    fn switches(&mut self, chip: &mut Tmc5160<D>) -> Result<[bool; 2], Error> {
        if self.halting == 0 {
            let word = chip.read(Register::RampStat)?;
            self.closed = [word & ramp_stat::STOP_L != 0, word & ramp_stat::STOP_R != 0];
        }
        Ok(self.closed)
    }

    fn last_switches(&self, _: &Tmc5160<D>) -> [bool; 2] {
        self.closed
    }

    fn meets_switch(&self, _: &Tmc5160<D>, course: &Course<'_>, ahead: i32) -> bool {
        course.stops.hold(ahead, self.closed)
    }

    /// A last reading of 0 may be older than the goal.
    fn is_held(&mut self, chip: &mut Tmc5160<D>, course: &Course<'_>, ahead: i32, _: bool) -> Result<bool, Error> {
        let stood = self.settling == 0 && self.known.speed == 0;
        Ok(self.meets_switch(chip, course, ahead) && (stood || self.speed(chip)? == 0))
    }

    fn latch(&mut self, chip: &mut Tmc5160<D>) -> Result<(), Error> {
        Ok(chip.write(Register::RampStat, ramp_stat::LATCHES)?)
    }

    fn latched(&mut self, chip: &mut Tmc5160<D>) -> Result<Option<i32>, Error> {
        if chip.read(Register::RampStat)? & ramp_stat::LATCHES == 0 {
            return Ok(None);
        }
        Ok(Some(chip.read(Register::XLatch)? as i32))
    }

    /// The chip itself goes over to the standby current, so the state of motion decides only whether the bridges are on and
    /// coolStep works.
    fn drive(&mut self, chip: &mut Tmc5160<D>, values: &Values, excitation: Excitation) -> Result<(), Error> {
        if excitation.free {
            chip.write(Register::Gstat, gstat::DRV_ERR)?;
            self.releasing = RELEASING;
        }
        let wanted = configuration::pwm_wanted(values);
        self.pwm = wanted && (self.pwm || self.rests());
        self.waits = wanted && !self.pwm;
        let mut supervises_anew = false;
        for (register, word) in configuration::words(values, excitation, self.pwm) {
            supervises_anew |= register == Register::EncDeviation && !chip.holds(register, word);
            chip.write(register, word)?;
        }
        if supervises_anew { self.forget_deviation(chip) } else { Ok(()) }
    }

    fn waits_to_be_driven(&self) -> bool {
        self.waits && self.rests()
    }

    fn forget(&mut self, chip: &mut Tmc5160<D>) {
        chip.forget();
    }

    fn reading(&mut self, chip: &mut Tmc5160<D>, values: &Values, parameter: P) -> Result<i32, Error> {
        Ok(match parameter {
            P::MeasuredSpeed => {
                let period = chip.read(Register::TStep)?;
                let speed = Unit::of(values).of_period(period, values.get(P::MicrostepResolution));
                speed.saturating_mul(self.known.speed.signum())
            }
            P::PwmScale => (chip.read(Register::PwmScale)? & 0xFF) as i32,
            P::PwmMode => i32::from(chip.read(Register::DrvStatus)? & drv_status::STEALTH != 0),
            P::LatchedPosition => chip.read(Register::XLatch)? as i32,
            P::LatchedEncoderPosition => chip.read(Register::EncLatch)? as i32,
            P::ChipEncoderPosition => chip.read(Register::XEnc)? as i32,
            _ => return Err(Error::NotNow),
        })
    }

    fn place_encoder(&mut self, chip: &mut Tmc5160<D>, position: i32) -> Result<(), Error> {
        if self.rests() {
            chip.place_standing(Register::XEnc, position)?;
        } else {
            chip.write(Register::XEnc, position as u32)?;
        }
        self.forget_deviation(chip)
    }

    fn load(&self, _: &Tmc5160<D>) -> u16 {
        (self.driver & drv_status::SG_RESULT) as u16
    }

    fn current(&self, _: &Tmc5160<D>) -> u8 {
        (self.driver >> drv_status::CS_ACTUAL_BIT & 0x1F) as u8
    }

    fn flags(&self, _: &Tmc5160<D>) -> u32 {
        let flags = self.driver >> drv_status::FLAGS_BIT | (self.driver >> drv_status::S2VSA_BIT & 0b11) << 8;
        if self.releasing > 0 { flags & !Self::SHUT_DOWN } else { flags }
    }

    /// The chip stops the motor itself, see [`watch_stall`](Self::watch_stall).
    fn stalled(&self, _: &Tmc5160<D>, _: bool) -> bool {
        false
    }

    /// A motor that a stall has stopped would be let go if the stop were switched off, so it is asked before.
    fn watch_stall(&mut self, chip: &mut Tmc5160<D>, armed: bool) -> Result<bool, Error> {
        if self.armed && !armed {
            self.stalled = chip.read(Register::RampStat)? & ramp_stat::EVENT_STOP_SG != 0;
        }
        if self.armed != armed && !self.stalled {
            self.armed = armed;
            self.show_switches(chip)?;
        }
        Ok(self.stalled)
    }

    fn deviates(&self) -> bool {
        self.deviates
    }

    fn is_lost(&self, chip: &Tmc5160<D>) -> bool {
        chip.is_lost()
    }
}

/// The flags of the driver as parameter 208 shows them: bits 0 to 7 are those of DRV_STATUS from StallGuard to stst, as on a
/// TMC262, and bits 8 and 9 the shorts to the supply.
mod flags {
    /// ot: over-temperature.
    pub(super) const OVERTEMPERATURE: u32 = 1 << 1;
    /// s2ga and s2gb: a short to ground.
    pub(super) const SHORTS_TO_GROUND: u32 = 0b11 << 3;
    /// s2vsa and s2vsb: a short to the supply.
    pub(super) const SHORTS_TO_SUPPLY: u32 = 0b11 << 8;
}
