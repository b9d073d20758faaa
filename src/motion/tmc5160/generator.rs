//! The ramp generator of a TMC5160.

use embedded_hal::spi::SpiDevice;

use super::Bound;
use super::ramp::Shape;
use super::unit::{self, SpeedUnit, signed_speed};
use crate::chip::tmc5160::{self, Register, Turn, drv_status, ramp_stat};
use crate::motion::Error;
use crate::motion::hardware::{Followed, Goal, MotionController, RampGenerator, RampMode};
use crate::motion::profile::Profile;
use crate::motion::values::Values;
use crate::param::AxisParameter as P;

/// Number of turns, one in a millisecond, after which a reading of the speed is younger than the last goal. It is asked
/// for in one of two turns, and comes in the next one.
const SETTLING: u8 = 4;
/// Number of turns for which the switches stay as they stop the motor at once, so that the ramp generator has seen
/// them.
const HALTING: u8 = 2;

impl<D: SpiDevice> RampGenerator for Bound<'_, D> {
    type Shape = Shape;

    fn go(&mut self, goal: Goal, profile: &Profile<'_>) -> Result<(), Error> {
        self.axis.delays.settling = SETTLING;
        match goal {
            Goal::Speed(speed) => {
                self.axis.known.mode = RampMode::Velocity;
                self.axis.known.target_speed = speed;
                self.retune(profile)?;
                let mode = if speed < 0 { tmc5160::RampMode::Negative } else { tmc5160::RampMode::Positive };
                Ok(self.chip.write(Register::RampMode, mode as u32)?)
            }
            Goal::Position { target, .. } => {
                self.prepare(target, profile)?;
                self.axis.known.mode = RampMode::Ramp;
                self.axis.known.target = target;
                if !self.chip.holds(Register::RampMode, tmc5160::RampMode::Positioning as u32) {
                    return Ok(self.chip.write(Register::RampMode, tmc5160::RampMode::Positioning as u32)?);
                }
                Ok(self.chip.write(Register::XTarget, target as u32)?)
            }
        }
    }

    /// In velocity mode the top speed would set the motor going. So the chip is in hold mode, in which the motor keeps
    /// the speed that it has, until positioning begins. In positioning mode the motor goes when it gets its target.
    fn prepare(&mut self, target: i32, profile: &Profile<'_>) -> Result<(), Error> {
        self.write_switches(profile)?;
        let positions = self.chip.holds(Register::RampMode, tmc5160::RampMode::Positioning as u32);
        if !positions {
            self.chip.write(Register::RampMode, tmc5160::RampMode::Hold as u32)?;
        }
        self.write_ramp(profile)?;
        if !positions {
            self.chip.write(Register::XTarget, target as u32)?;
        }
        Ok(())
    }

    /// A datagram takes 8 us, so all are sent at once.
    fn ease(&mut self, profile: &Profile<'_>) -> Result<bool, Error> {
        self.write_ramp(profile)
    }

    fn retune(&mut self, profile: &Profile<'_>) -> Result<(), Error> {
        self.write_switches(profile)?;
        if self.axis.known.mode.positions() {
            return self.write_ramp(profile).map(drop);
        }
        let unit = SpeedUnit::of(profile.values);
        self.chip.write(Register::AMax, unit.acceleration(profile.acceleration))?;
        self.chip.write(Register::TZeroWait, profile.values.get(P::RampWaitTime) as u32)?;
        Ok(self.chip.write(Register::VMax, unit.speed(self.axis.known.target_speed).min(unit::TOP_SPEED))?)
    }

    fn reshape(&mut self, shape: Option<Shape>) {
        self.axis.shape = shape;
    }

    /// A chip that has been reset is set up with the motor where it was last known to be. What its driver has lost is
    /// written by [`drive`](crate::motion::Driver::drive).
    fn stop(&mut self, profile: &Profile<'_>) -> Result<(), Error> {
        self.axis.known.mode = RampMode::Hold;
        if self.chip.is_lost() {
            self.chip.start()?;
            self.chip.place_standing(Register::XActual, self.axis.known.position)?;
        } else {
            self.chip.halt()?;
            self.chip.write(Register::RampStat, ramp_stat::EVENT_STOP_SG)?;
        }
        self.axis.delays.halting = HALTING;
        (self.axis.stall.armed, self.axis.stall.stopped) = (false, false);
        self.axis.known.speed = 0;
        self.go(Goal::Speed(0), profile)
    }

    fn set_position(&mut self, position: i32, standing: bool) -> Result<(), Error> {
        if standing {
            self.chip.place_standing(Register::XActual, position)?;
        } else {
            self.chip.write(Register::XActual, position as u32)?;
        }
        self.chip.write(Register::XTarget, position as u32)?;
        self.axis.known.position = position;
        self.axis.known.target = position;
        Ok(())
    }

    /// Also takes one of the other readings, whatever is asked for: two datagrams bring two.
    fn follow(&mut self, _: Option<u8>) -> Result<Followed, Error> {
        self.axis.delays.settling = self.axis.delays.settling.saturating_sub(1);
        self.axis.delays.releasing = self.axis.delays.releasing.saturating_sub(1);
        if let Some(turns) = self.axis.delays.halting.checked_sub(1) {
            self.axis.delays.halting = turns;
            if turns == 0 {
                self.show_switches()?;
            }
        }
        let register = self.next_reading();
        let Turn { position, reading } = self.chip.turn(register)?;
        self.take_position(position)?;
        if self.axis.delays.halting == 0 {
            self.axis.closed = self.chip.switches();
        }
        if let Some((register, word)) = reading {
            self.take(register, word)?;
        }
        Ok(Followed { rests: self.axis.rests(), left: None })
    }

    /// All readings come with [`follow`](Self::follow).
    fn refresh(&mut self, _: u8) -> Result<(), Error> {
        Ok(())
    }

    fn position(&mut self) -> Result<i32, Error> {
        let position = self.chip.read(Register::XActual)? as i32;
        self.take_position(position)?;
        Ok(self.axis.known.position)
    }

    fn speed(&mut self) -> Result<i32, Error> {
        let speed = signed_speed(self.chip.read(Register::VActual)?);
        self.axis.known.speed = self.axis.unit.of_register(speed);
        Ok(self.axis.known.speed)
    }

    /// On the way to a position the chip does not tell to what speed it is accelerating or braking: it is the top speed
    /// until the motor is there.
    fn target_speed(&mut self) -> Result<i32, Error> {
        if !self.axis.known.mode.positions() {
            return Ok(self.axis.known.target_speed);
        }
        self.position()?;
        Ok(self.axis.top_speed.saturating_mul(self.axis.known.ahead().signum()))
    }

    fn reading(&mut self, values: &Values, parameter: P) -> Result<i32, Error> {
        Ok(match parameter {
            P::MeasuredSpeed => {
                let period = self.chip.read(Register::TStep)?;
                let speed = SpeedUnit::of(values).of_period(period, values.get(P::MicrostepResolution));
                speed.saturating_mul(self.axis.known.speed.signum())
            }
            P::PwmScale => (self.chip.read(Register::PwmScale)? & 0xFF) as i32,
            P::PwmMode => i32::from(self.chip.read(Register::DrvStatus)? & drv_status::STEALTH != 0),
            P::LatchedPosition => self.chip.read(Register::XLatch)? as i32,
            P::LatchedEncoderPosition => self.chip.read(Register::EncLatch)? as i32,
            P::ChipEncoderPosition => self.chip.read(Register::XEnc)? as i32,
            _ => return Err(Error::NotNow),
        })
    }

    fn set_encoder(&mut self, position: i32) -> Result<(), Error> {
        if self.axis.rests() {
            self.chip.place_standing(Register::XEnc, position)?;
        } else {
            self.chip.write(Register::XEnc, position as u32)?;
        }
        self.forget_deviation()
    }
}
