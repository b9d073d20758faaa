//! The ramp generator of the TMC429 that moves an axis: what is read of it, in which rotation, and in which order its
//! registers are written.

use embedded_hal::spi::SpiDevice;

use super::settings::{Basis, Settings};
use super::shape::Trapezoid;
use super::{Bound, Rest, position};
use crate::chip::tmc262::Tmc262;
use crate::chip::tmc429::{self, Register, reference, signed};
use crate::motion::Error;
use crate::motion::hardware::{Followed, Goal, Known, RampGenerator, RampMode};
use crate::motion::profile::Profile;
use crate::motion::switch::{Side, Stops};
use crate::motion::values::Values;
use crate::param::AxisParameter as P;

/// Length of the rotation of readings. Each second reading is the speed, each fourth the driver's, and each fourth the
/// switches. The last one is, in place of the switches, the version of the TMC429, which shows that the chip is there.
pub(super) const READINGS: u8 = 64;
/// Number of the reading that asks the TMC429 for its version.
pub(super) const CONFIRMATION: u8 = READINGS - 1;

impl<M: SpiDevice, D: SpiDevice> RampGenerator for Bound<'_, M, D> {
    type Shape = Trapezoid;

    fn go(&mut self, goal: Goal, profile: &Profile<'_>) -> Result<(), Error> {
        self.axis.rest = Rest::Moves;
        match goal {
            Goal::Speed(speed) => {
                self.set_mode(RampMode::Velocity, profile.stops)?;
                self.chip.write(self.axis.generator, Register::VTarget, speed as u32)?;
                self.axis.known.target_speed = speed;
            }
            // For a position the target and the ramp settings are written first and the mode last.
            Goal::Position { target, soft } => {
                self.axis.known.mode = if soft { RampMode::Soft } else { RampMode::Ramp };
                self.axis.known.target = target;
                self.axis.waypoint = position::first(self.axis.known.position, target);
                self.write_waypoint()?;
            }
        }
        // For a speed the speed limit is written after velocity mode: in ramp mode the new limit would act at once.
        self.retune(profile)
    }

    /// In velocity mode the target does not act yet: the datagram that sets the motor going is the mode. In the
    /// positioning modes it is the target.
    fn prepare(&mut self, target: i32, profile: &Profile<'_>) -> Result<(), Error> {
        self.axis.settled = None;
        if !self.axis.known.mode.positions() {
            let waypoint = position::first(self.axis.known.position, target);
            self.chip.write(self.axis.generator, Register::XTarget, waypoint as u32)?;
        }
        self.write_ramp(&Settings::of(RampMode::Ramp, profile), None)
    }

    fn ease(&mut self, profile: &Profile<'_>) -> Result<bool, Error> {
        let Some(settled) = self.axis.settled.take() else { return self.retune(profile).map(|()| true) };
        let Settings { speed, acceleration, .. } = Settings::of(settled.mode, profile);
        let words = self.ramp_words(settled.basis, speed, acceleration)?;
        let differing =
            || words.iter().filter(|(register, word)| !self.chip.holds(self.axis.generator, *register, *word));
        let (next, left) = (differing().next().copied(), differing().count());
        if let Some((register, word)) = next {
            self.chip.write(self.axis.generator, register, word)?;
        }
        // No profile has the speed -1, so one that is not the chip's yet never counts as settled.
        let speed = if left > 1 { -1 } else { speed };
        self.axis.settled = Some(Settings { speed, acceleration, ..settled });
        Ok(next.is_some())
    }

    fn retune(&mut self, profile: &Profile<'_>) -> Result<(), Error> {
        let settings = Settings::of(self.axis.known.mode, profile);
        if self.axis.settled != Some(settings) {
            let known = self.axis.settled.take().map(|settings| settings.basis);
            self.write_settings(&settings, known)?;
            self.axis.settled = Some(settings);
        }
        Ok(())
    }

    fn reshape(&mut self, _: Option<Trapezoid>) {}

    /// V_ACTUAL may be written in hold mode only (datasheet section 8.1.6). Writing zero also clears the hidden
    /// fraction of the velocity.
    fn stop(&mut self, profile: &Profile<'_>) -> Result<(), Error> {
        self.set_mode(RampMode::Hold, profile.stops)?;
        self.chip.write(self.axis.generator, Register::VActual, 0)?;
        self.chip.write(self.axis.generator, Register::VTarget, 0)?;
        self.axis.known.speed = 0;
        self.go(Goal::Speed(0), profile)
    }

    /// X_ACTUAL is written in velocity mode (datasheet section 8.1.2), or in hold mode, in which `halt` leaves the
    /// chip.
    fn set_position(&mut self, position: i32, standing: bool) -> Result<(), Error> {
        if standing {
            self.chip.place_standing(self.axis.generator, position as u32)?;
        } else {
            self.chip.write(self.axis.generator, Register::XActual, position as u32)?;
        }
        self.chip.write(self.axis.generator, Register::XTarget, position as u32)?;
        self.axis.known.position = position;
        self.axis.known.target = position;
        self.axis.waypoint = position;
        // The chip may have been halted and set up anew before, so none of its settings is taken for known.
        self.axis.settled = None;
        Ok(())
    }

    fn follow(&mut self, reading: Option<u8>) -> Result<Followed, Error> {
        if self.axis.rest == Rest::Rests {
            return Ok(Followed { rests: true, left: reading });
        }
        self.position()?;
        if self.axis.rest == Rest::Stands {
            self.axis.rest = Rest::Rests;
        }
        Ok(Followed { rests: false, left: reading })
    }

    /// Takes one datagram, to the TMC429 or to the driver. A waypoint is moved on in place of a reading.
    fn refresh(&mut self, reading: u8) -> Result<(), Error> {
        let Known { mode, position, target, .. } = self.axis.known;
        if let Some(next) = position::next(position, target, self.axis.waypoint).filter(|_| mode.positions()) {
            let before = core::mem::replace(&mut self.axis.waypoint, next);
            // A waypoint that did not get through to the chip is written again with the axis' next reading.
            return self.write_waypoint().inspect_err(|_| self.axis.waypoint = before);
        }
        match reading % READINGS {
            CONFIRMATION => self.chip.confirm()?,
            reading => match reading % 4 {
                1 => self.tell_driver(Tmc262::refresh),
                3 => drop(self.read_switches()?),
                _ => drop(self.speed()?),
            },
        }
        Ok(())
    }

    fn position(&mut self) -> Result<i32, Error> {
        let counter = self.chip.read(self.axis.generator, Register::XActual)?;
        self.axis.known.position = position::extend(self.axis.known.position, counter);
        Ok(self.axis.known.position)
    }

    fn speed(&mut self) -> Result<i32, Error> {
        self.axis.known.speed = signed(self.chip.read(self.axis.generator, Register::VActual)?, 12);
        self.axis.rest = match self.axis.rest {
            // A motor with a way ahead may be about to start, or be held by a switch.
            _ if self.axis.known.speed != 0 || self.axis.known.ahead() != 0 => Rest::Moves,
            Rest::Moves => Rest::Stands,
            rest => rest,
        };
        Ok(self.axis.known.speed)
    }

    fn target_speed(&mut self) -> Result<i32, Error> {
        if self.axis.known.mode.positions() {
            Ok(signed(self.chip.read(self.axis.generator, Register::VTarget)?, 12))
        } else {
            Ok(self.axis.known.target_speed)
        }
    }

    /// A_ACTUAL is smoothed by the chip.
    fn reading(&mut self, _: &Values, parameter: P) -> Result<i32, Error> {
        match parameter {
            P::ActualAcceleration => Ok(signed(self.chip.read(self.axis.generator, Register::AActual)?, 12).abs()),
            _ => Err(Error::NotNow),
        }
    }
}

impl<M: SpiDevice, D: SpiDevice> Bound<'_, M, D> {
    /// Reads the stop switches.
    pub(super) fn read_switches(&mut self) -> Result<[bool; 2], Error> {
        let bits = self.chip.reference_switches()?;
        Ok(self.own_switches(bits))
    }

    /// The switches of this motor, left and right, of those of the chip.
    pub(super) fn own_switches(&mut self, bits: u32) -> [bool; 2] {
        let bits = bits >> (2 * self.axis.generator as u32);
        self.axis.right = bits & 1 != 0;
        [bits & 2 != 0, self.axis.right]
    }

    fn write_waypoint(&mut self) -> Result<(), Error> {
        Ok(self.chip.write(self.axis.generator, Register::XTarget, self.axis.waypoint as u32)?)
    }

    /// Writes settings to the chip, without those in `known`, which the chip is known to have.
    fn write_settings(&mut self, settings: &Settings, known: Option<Basis>) -> Result<(), Error> {
        self.write_ramp(settings, known)?;
        // A new mode is written last, when the settings that it needs are in place.
        self.set_mode(settings.mode, settings.stops)
    }

    /// Writes settings to the chip but for the mode, and without those in `known`.
    fn write_ramp(&mut self, settings: &Settings, known: Option<Basis>) -> Result<(), Error> {
        let m = self.axis.generator;
        let Settings { basis, mode, stops, speed, acceleration } = *settings;
        let Basis { minimum_speed, ramp_div, pulse_div, tolerance } = basis;
        if known != Some(basis) {
            self.chip.write(m, Register::VMin, minimum_speed as u32)?;
            self.write_divisors(u32::from(pulse_div) << 12 | u32::from(ramp_div) << 8, stops)?;
            self.chip.write(m, Register::DxRefTolerance, tolerance as u32)?;
        }
        if mode == RampMode::Velocity {
            // In velocity mode the chip takes any acceleration.
            self.chip.write(m, Register::AMax, acceleration as u32)?;
            return Ok(self.chip.write(m, Register::VMax, speed as u32)?);
        }
        for (register, word) in self.ramp_words(basis, speed, acceleration)? {
            self.chip.write(m, register, word)?;
        }
        Ok(())
    }

    /// The registers that make the ramps of positioning, in the order in which they are written.
    fn ramp_words(&mut self, basis: Basis, speed: i32, acceleration: i32) -> Result<[(Register, u32); 3], Error> {
        let Basis { ramp_div, pulse_div, .. } = basis;
        let b = self.axis.braking.braking(acceleration, ramp_div, pulse_div, speed).ok_or(Error::OutOfRange)?;
        Ok([
            (Register::AMax, b.acceleration as u32),
            (Register::PMulPDiv, u32::from(b.pmul) << 8 | u32::from(b.pdiv)),
            (Register::VMax, speed as u32),
        ])
    }

    /// Writes the ramp mode, together with what the stop switches do, which is in the same register.
    fn set_mode(&mut self, mode: RampMode, stops: Stops) -> Result<(), Error> {
        self.axis.known.mode = mode;
        if self.axis.settled.is_some_and(|settings| settings.mode == mode && settings.stops == stops) {
            return Ok(());
        }
        self.axis.settled = None;
        let mode = match mode {
            RampMode::Ramp => tmc429::RampMode::Ramp,
            RampMode::Soft => tmc429::RampMode::Soft,
            RampMode::Velocity => tmc429::RampMode::Velocity,
            RampMode::Hold => tmc429::RampMode::Hold,
        };
        let bit = |set: bool, bit: u32| if set { bit } else { 0 };
        let reference = bit(!stops.left, reference::DISABLE_STOP_L)
            | bit(!stops.right, reference::DISABLE_STOP_R)
            | bit(stops.soft, reference::SOFT_STOP)
            | bit(stops.latch == Some(Side::Right), reference::REF_RNL);
        Ok(self.chip.write(self.axis.generator, Register::RefConfMode, reference | mode as u32)?)
    }

    /// Writes RAMP_DIV and PULSE_DIV. Changing PULSE_DIV outside ramp mode may make a stray step while the motor stands
    /// (datasheet section 8.1.13). So for the moment of the change the chip is in ramp mode, with its target where the
    /// motor is.
    fn write_divisors(&mut self, word: u32, stops: Stops) -> Result<(), Error> {
        let Known { mode, target_speed, speed, .. } = self.axis.known;
        let standing = mode == RampMode::Velocity && target_speed == 0 && speed == 0;
        if !standing || self.chip.holds(self.axis.generator, Register::Divisors, word) {
            return Ok(self.chip.write(self.axis.generator, Register::Divisors, word)?);
        }
        let here = self.position()?;
        self.chip.write(self.axis.generator, Register::XTarget, here as u32)?;
        self.set_mode(RampMode::Ramp, stops)?;
        self.chip.write(self.axis.generator, Register::Divisors, word)?;
        self.set_mode(RampMode::Velocity, stops)?;
        // In ramp mode the ramp generator has changed V_TARGET itself.
        Ok(self.chip.write(self.axis.generator, Register::VTarget, target_speed as u32)?)
    }
}
