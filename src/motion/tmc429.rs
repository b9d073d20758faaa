//! The hardware of an axis that runs on a ramp generator of the TMC429 and on a TMC262 driver of its own.
//!
//! Here is all that these two chips demand: the TMC429's positions have 24 bits (`position.rs`), its braking ramps need
//! a parameter that is worked out for them ([`ramp`]), in velocity mode its speed limit is not that of positioning, and
//! registers are written in such an order that none of them acts before the others are right. A register that already
//! has its value costs no datagram: the drivers in [`crate::chip`] see to that.

mod configuration;
mod position;
pub mod ramp;
mod settings;

use core::marker::PhantomData;

use embedded_hal::spi::{ErrorType, SpiDevice};

use super::Error;
use super::current::Excitation;
use super::hardware::{Course, Followed, Goal, Hardware, Known, Mode};
use super::slope::{Slope, Slopes};
use super::switch::{Side, Stops};
use super::values::Values;
use crate::chip::error;
use crate::chip::tmc262::{Tmc262, flags};
use crate::chip::tmc429::{RampGenerator, RampMode, Register, Tmc429, reference, signed};
use crate::param::AxisParameter as P;
use crate::units::INTERNAL_MAX;
use configuration::configuration;
use settings::{Basis, Settings, divisors};

/// Length of the rotation of readings. Each second reading is the speed, each fourth the driver's, and each fourth the
/// switches; the last one is, in place of the switches, the version of the TMC429, which shows that the chip is there.
const READINGS: u8 = 64;
/// Number of the reading that asks the TMC429 for its version.
const CONFIRMATION: u8 = READINGS - 1;

/// Whether the position of a motor has to be read. Its known speed may be some milliseconds old; since then the motor may
/// have been set going and told to stop again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rest {
    /// The motor may move.
    Moves,
    /// Its speed has been read as zero after it was sent to where it is, so its position is read once more.
    Stands,
    /// The known position is that at which the motor stands.
    Rests,
}

/// A function of the driver that exchanges datagrams.
type TellDriver<D> = fn(&mut Tmc262<D>) -> Result<(), error::Error<<D as ErrorType>::Error>>;

/// What one axis has of the two chips. `M` is the SPI device of the TMC429, `D` that of the TMC262.
#[derive(Debug)]
pub struct Tmc429Tmc262<M, D> {
    generator: RampGenerator,
    driver: Tmc262<D>,
    known: Known,
    /// The target that the chip was given, in microsteps: a waypoint on the way to the motor's target, or that target
    /// itself.
    waypoint: i32,
    /// The right stop switch as read last; the left one comes in the status byte of each datagram.
    right: bool,
    rest: Rest,
    /// The settings that the chip has; `None` if not all datagrams of the last settings have got through.
    settled: Option<Settings>,
    braking: ramp::BrakingMemo,
    controller: PhantomData<M>,
}

impl<M, D: SpiDevice> Tmc429Tmc262<M, D> {
    /// The hardware of the axes of a module, in the order of their drivers; each TMC429 moves three of them. The chips
    /// are not told anything yet.
    pub fn axes<const N: usize>(drivers: [D; N]) -> [Self; N] {
        let mut generators = RampGenerator::ALL.into_iter().cycle();
        drivers.map(|driver| Tmc429Tmc262 {
            generator: generators.next().unwrap_or(RampGenerator::First),
            driver: Tmc262::new(driver),
            known: Known::default(),
            waypoint: 0,
            right: false,
            rest: Rest::Moves,
            settled: None,
            braking: ramp::BrakingMemo::default(),
            controller: PhantomData,
        })
    }
}

impl<M: SpiDevice, D: SpiDevice> Hardware for Tmc429Tmc262<M, D> {
    type Controller = Tmc429<M>;

    type Shape = ();

    const AXES: usize = RampGenerator::ALL.len();

    const UNITS: &'static [P] = &[P::RampDivisor, P::PulseDivisor];

    const RAMPS: &'static [P] = &[P::MaximumSpeed, P::MaximumAcceleration];

    const DRIVEN: &'static [P] = &[];

    const ROTATION: u8 = READINGS;

    /// Load and current are each read once in four readings of the driver.
    const FRESH: u8 = 16;

    const SHUT_DOWN: u32 = (flags::OVERTEMPERATURE | flags::SHORT_A | flags::SHORT_B) as u32;

    fn start(chip: &mut Tmc429<M>) -> Result<(), Error> {
        chip.confirm()?;
        chip.halt()?;
        Ok(chip.initialise()?)
    }

    fn halt(chip: &mut Tmc429<M>) -> Result<(), Error> {
        Ok(chip.halt()?)
    }

    fn answers(chip: &mut Tmc429<M>) -> bool {
        chip.answers() || chip.confirm().is_ok()
    }

    fn invert(chip: &mut Tmc429<M>, switches: bool, direction: bool) -> Result<(), Error> {
        Ok(chip.write_interface(switches, direction)?)
    }

    /// False for the pairs of RAMP_DIV and PULSE_DIV that admit no positioning ramp, whatever its acceleration.
    fn accepts(values: &Values) -> bool {
        let (ramp_div, pulse_div) = divisors(values);
        ramp::braking(INTERNAL_MAX, ramp_div, pulse_div, INTERNAL_MAX).is_some()
    }

    fn head(&mut self, chip: &mut Tmc429<M>, goal: Goal, course: &Course<'_>) -> Result<(), Error> {
        self.rest = Rest::Moves;
        match goal {
            Goal::Speed(speed) => {
                self.set_mode(chip, Mode::Velocity, course.stops)?;
                chip.write(self.generator, Register::VTarget, speed as u32)?;
                self.known.target_speed = speed;
            }
            // For a position the target and the ramp settings are written first and the mode last.
            Goal::Position { target, soft } => {
                self.known.mode = if soft { Mode::Soft } else { Mode::Ramp };
                self.known.target = target;
                self.waypoint = position::first(self.known.position, target);
                self.write_waypoint(chip)?;
            }
        }
        // For a speed the speed limit is written after velocity mode: in ramp mode the new limit would act at once.
        self.adjust(chip, course)
    }

    /// In velocity mode the target does not act yet: the datagram that sets the motor going is the mode. In the positioning
    /// modes it is the target.
    fn ready(&mut self, chip: &mut Tmc429<M>, target: i32, course: &Course<'_>) -> Result<(), Error> {
        self.settled = None;
        if !self.known.mode.positions() {
            let waypoint = position::first(self.known.position, target);
            chip.write(self.generator, Register::XTarget, waypoint as u32)?;
        }
        self.write_ramp(chip, &Settings::of(Mode::Ramp, course), None)
    }

    fn approach(&mut self, chip: &mut Tmc429<M>, course: &Course<'_>) -> Result<bool, Error> {
        let Some(settled) = self.settled.take() else { return self.adjust(chip, course).map(|()| true) };
        let Settings { speed, acceleration, .. } = Settings::of(settled.mode, course);
        let words = self.ramp_words(settled.basis, speed, acceleration)?;
        let differing = || words.iter().filter(|(register, word)| !chip.holds(self.generator, *register, *word));
        let (next, left) = (differing().next().copied(), differing().count());
        if let Some((register, word)) = next {
            chip.write(self.generator, register, word)?;
        }
        // No course has the speed -1, so one that is not the chip's yet never counts as settled.
        let speed = if left > 1 { -1 } else { speed };
        self.settled = Some(Settings { speed, acceleration, ..settled });
        Ok(next.is_some())
    }

    fn shape(_: &Values) {}

    fn reshape(&mut self, _: Option<()>) {}

    /// From rest, or to it, with an acceleration of A, the square of the speed is 2048 p = 16 A 2^(PULSE_DIV - RAMP_DIV) for
    /// each microstep (datasheet section 8.1.10). Of p the chip has PMUL / 2^(3 + PDIV).
    fn slopes(values: &Values, (): &(), wanted: i32, speed: i32) -> Slopes {
        let (ramp_div, pulse_div) = divisors(values);
        let (acceleration, square) = match ramp::braking(wanted, ramp_div, pulse_div, speed) {
            Some(b) => (b.acceleration, u32::from(b.pmul) << 16 >> b.pdiv),
            None => (wanted, 0),
        };
        Slopes { acceleration, up: Slope::straight(square), down: Slope::straight(square) }
    }

    /// Its motors are so slow that they make less than a microstep in that time.
    fn skew(_: i32) -> i32 {
        0
    }

    /// The unit of speed is 16 MHz / (2^PULSE_DIV * 2048 * 32): 4 / 2^PULSE_DIV of it are a microstep in 16.4 ms.
    fn correction(values: &Values, way: i32) -> i32 {
        way << divisors(values).1 >> 2
    }

    fn adjust(&mut self, chip: &mut Tmc429<M>, course: &Course<'_>) -> Result<(), Error> {
        let settings = Settings::of(self.known.mode, course);
        if self.settled != Some(settings) {
            let known = self.settled.take().map(|settings| settings.basis);
            self.write_settings(chip, &settings, known)?;
            self.settled = Some(settings);
        }
        Ok(())
    }

    /// V_ACTUAL may be written in hold mode only (datasheet section 8.1.6). Writing zero also clears the hidden
    /// fraction of the velocity.
    fn stop(&mut self, chip: &mut Tmc429<M>, course: &Course<'_>) -> Result<(), Error> {
        self.set_mode(chip, Mode::Hold, course.stops)?;
        chip.write(self.generator, Register::VActual, 0)?;
        chip.write(self.generator, Register::VTarget, 0)?;
        self.known.speed = 0;
        self.head(chip, Goal::Speed(0), course)
    }

    /// X_ACTUAL is written in velocity mode (datasheet section 8.1.2), or in hold mode, in which `halt` leaves the
    /// chip.
    fn place(&mut self, chip: &mut Tmc429<M>, position: i32, standing: bool) -> Result<(), Error> {
        if standing {
            chip.place_standing(self.generator, position as u32)?;
        } else {
            chip.write(self.generator, Register::XActual, position as u32)?;
        }
        chip.write(self.generator, Register::XTarget, position as u32)?;
        self.known.position = position;
        self.known.target = position;
        self.waypoint = position;
        // The chip may have been halted and set up anew before, so none of its settings is taken for known.
        self.settled = None;
        Ok(())
    }

    fn follow(&mut self, chip: &mut Tmc429<M>, reading: Option<u8>) -> Result<Followed, Error> {
        if self.rest == Rest::Rests {
            return Ok(Followed { rests: true, left: reading });
        }
        self.position(chip)?;
        if self.rest == Rest::Stands {
            self.rest = Rest::Rests;
        }
        Ok(Followed { rests: false, left: reading })
    }

    /// Takes one datagram, to the TMC429 or to the driver. A waypoint is moved on in place of a reading.
    fn refresh(&mut self, chip: &mut Tmc429<M>, reading: u8) -> Result<(), Error> {
        let Known { mode, position, target, .. } = self.known;
        if let Some(next) = position::next(position, target, self.waypoint).filter(|_| mode.positions()) {
            let before = core::mem::replace(&mut self.waypoint, next);
            // A waypoint that did not get through to the chip is written again with the axis' next reading.
            return self.write_waypoint(chip).inspect_err(|_| self.waypoint = before);
        }
        match reading % READINGS {
            CONFIRMATION => chip.confirm()?,
            reading => match reading % 4 {
                1 => self.tell_driver(chip, Tmc262::refresh),
                3 => drop(self.switches(chip)?),
                _ => drop(self.speed(chip)?),
            },
        }
        Ok(())
    }

    /// An axis notes that it is at its target whatever its mode.
    fn room(&self, chip: &Tmc429<M>) -> Option<u32> {
        if !chip.answers() {
            return None;
        }
        if self.rest == Rest::Rests {
            return Some(0);
        }
        let room = self.known.steps_before(self.known.target)?;
        if self.known.mode.positions() && self.waypoint != self.known.target {
            return Some(position::room(self.known.steps_before(self.waypoint)?));
        }
        Some(room.min(position::EXTENDED))
    }

    fn known(&self) -> &Known {
        &self.known
    }

    fn known_mut(&mut self) -> &mut Known {
        &mut self.known
    }

    fn position(&mut self, chip: &mut Tmc429<M>) -> Result<i32, Error> {
        let counter = chip.read(self.generator, Register::XActual)?;
        self.known.position = position::extend(self.known.position, counter);
        Ok(self.known.position)
    }

    fn speed(&mut self, chip: &mut Tmc429<M>) -> Result<i32, Error> {
        self.known.speed = signed(chip.read(self.generator, Register::VActual)?, 12);
        self.rest = match self.rest {
            // A motor with a way ahead may be about to start, or be held by a switch.
            _ if self.known.speed != 0 || self.known.ahead() != 0 => Rest::Moves,
            Rest::Moves => Rest::Stands,
            rest => rest,
        };
        Ok(self.known.speed)
    }

    fn target_speed(&mut self, chip: &mut Tmc429<M>) -> Result<i32, Error> {
        if self.known.mode.positions() {
            Ok(signed(chip.read(self.generator, Register::VTarget)?, 12))
        } else {
            Ok(self.known.target_speed)
        }
    }

    /// A_ACTUAL is smoothed by the chip.
    fn reading(&mut self, chip: &mut Tmc429<M>, _: &Values, parameter: P) -> Result<i32, Error> {
        match parameter {
            P::ActualAcceleration => Ok(signed(chip.read(self.generator, Register::AActual)?, 12).abs()),
            _ => Err(Error::NotNow),
        }
    }

    fn begin_turn(chip: &mut Tmc429<M>) {
        chip.forget_switches();
    }

    /// All switches of the chip are in one register.
    fn turn_switches(&mut self, chip: &mut Tmc429<M>) -> Result<[bool; 2], Error> {
        let bits = chip.switches_once()?;
        Ok(self.own_switches(bits))
    }

    fn is_of_motion(reading: u8) -> bool {
        let reading = reading % READINGS;
        reading != CONFIRMATION && reading % 4 != 1
    }

    fn switches(&mut self, chip: &mut Tmc429<M>) -> Result<[bool; 2], Error> {
        let bits = chip.reference_switches()?;
        Ok(self.own_switches(bits))
    }

    /// The left switch is as old as the last datagram, the right one at most eight turns of readings of this axis.
    fn last_switches(&self, chip: &Tmc429<M>) -> [bool; 2] {
        [chip.left_switch(self.generator), self.right]
    }

    /// Near the position that the chip counts as zero, within the tolerance of parameter 141, the chip lets the motor pass the
    /// stop switches (datasheet section 8.1.14).
    fn meets_switch(&self, chip: &Tmc429<M>, course: &Course<'_>, ahead: i32) -> bool {
        let tolerance = course.tolerance.unsigned_abs();
        let near = tolerance != 0 && signed(self.known.position as u32, 24).unsigned_abs() <= tolerance;
        !near && course.stops.hold(ahead, self.last_switches(chip))
    }

    /// The readings of switches and speed may be some milliseconds old, so they are taken again before the motor counts
    /// as held.
    fn is_held(&mut self, chip: &mut Tmc429<M>, course: &Course<'_>, ahead: i32, stays: bool) -> Result<bool, Error> {
        if !stays && !self.meets_switch(chip, course, ahead) {
            return Ok(false);
        }
        self.switches(chip)?;
        Ok(self.meets_switch(chip, course, ahead) && self.speed(chip)? == 0)
    }

    fn latch(&mut self, chip: &mut Tmc429<M>) -> Result<(), Error> {
        Ok(chip.write(self.generator, Register::XLatched, 0)?)
    }

    /// The chip latches the position only while the motor moves (datasheet section 8.1.15).
    fn latched(&mut self, chip: &mut Tmc429<M>) -> Result<Option<i32>, Error> {
        if chip.read(self.generator, Register::RefConfMode)? & reference::LATCH_PENDING != 0 {
            return Ok(None);
        }
        let counter = chip.read(self.generator, Register::XLatched)?;
        Ok(Some(position::extend(self.known.position, counter)))
    }

    fn drive(&mut self, chip: &mut Tmc429<M>, values: &Values, excitation: Excitation) -> Result<(), Error> {
        self.driver.configure(&configuration(values, excitation));
        self.tell_driver(chip, Tmc262::update);
        Ok(())
    }

    fn forget(&mut self, _: &mut Tmc429<M>) {
        self.driver.forget();
    }

    fn load(&self, _: &Tmc429<M>) -> u16 {
        self.driver.load()
    }

    fn current(&self, _: &Tmc429<M>) -> u8 {
        self.driver.current()
    }

    fn flags(&self, _: &Tmc429<M>) -> u32 {
        self.driver.flags().into()
    }

    /// `pin` is the level of SG_TST, which is high while the load value is zero.
    fn stalled(&self, _: &Tmc429<M>, pin: bool) -> bool {
        pin
    }
}

impl<M: SpiDevice, D: SpiDevice> Tmc429Tmc262<M, D> {
    /// The switches of this motor, left and right, of those of the chip.
    fn own_switches(&mut self, bits: u32) -> [bool; 2] {
        let bits = bits >> (2 * self.generator as u32);
        self.right = bits & 1 != 0;
        [bits & 2 != 0, self.right]
    }

    /// Exchanges datagrams with the driver, again if an answer is lost. A driver that does not answer then, while the TMC429 on
    /// the same bus does, counts as shut down. What has not reached it comes with its next readings, in whose rotation all its
    /// registers are written. Never inlined, for the size of it.
    #[inline(never)]
    fn tell_driver(&mut self, chip: &mut Tmc429<M>, tell: TellDriver<D>) {
        let is_silent = tell(&mut self.driver).is_err() && tell(&mut self.driver).is_err();
        if is_silent && chip.confirm().is_ok() && tell(&mut self.driver).is_err() {
            self.driver.note_silence();
        }
    }

    fn write_waypoint(&self, chip: &mut Tmc429<M>) -> Result<(), Error> {
        Ok(chip.write(self.generator, Register::XTarget, self.waypoint as u32)?)
    }

    /// Writes settings to the chip, without those in `known`, which the chip is known to have.
    fn write_settings(&mut self, chip: &mut Tmc429<M>, settings: &Settings, known: Option<Basis>) -> Result<(), Error> {
        self.write_ramp(chip, settings, known)?;
        // A new mode is written last, when the settings that it needs are in place.
        self.set_mode(chip, settings.mode, settings.stops)
    }

    /// Writes settings to the chip but for the mode, and without those in `known`.
    fn write_ramp(&mut self, chip: &mut Tmc429<M>, settings: &Settings, known: Option<Basis>) -> Result<(), Error> {
        let m = self.generator;
        let Settings { basis, mode, stops, speed, acceleration } = *settings;
        let Basis { minimum_speed, ramp_div, pulse_div, tolerance } = basis;
        if known != Some(basis) {
            chip.write(m, Register::VMin, minimum_speed as u32)?;
            self.write_divisors(chip, u32::from(pulse_div) << 12 | u32::from(ramp_div) << 8, stops)?;
            chip.write(m, Register::DxRefTolerance, tolerance as u32)?;
        }
        if mode == Mode::Velocity {
            // In velocity mode the chip takes any acceleration.
            chip.write(m, Register::AMax, acceleration as u32)?;
            return Ok(chip.write(m, Register::VMax, speed as u32)?);
        }
        for (register, word) in self.ramp_words(basis, speed, acceleration)? {
            chip.write(m, register, word)?;
        }
        Ok(())
    }

    /// The registers that make the ramps of positioning, in the order in which they are written.
    fn ramp_words(&mut self, basis: Basis, speed: i32, acceleration: i32) -> Result<[(Register, u32); 3], Error> {
        let Basis { ramp_div, pulse_div, .. } = basis;
        let b = self.braking.braking(acceleration, ramp_div, pulse_div, speed).ok_or(Error::OutOfRange)?;
        Ok([
            (Register::AMax, b.acceleration as u32),
            (Register::PMulPDiv, u32::from(b.pmul) << 8 | u32::from(b.pdiv)),
            (Register::VMax, speed as u32),
        ])
    }

    /// Writes the ramp mode, together with what the stop switches do, which is in the same register.
    fn set_mode(&mut self, chip: &mut Tmc429<M>, mode: Mode, stops: Stops) -> Result<(), Error> {
        self.known.mode = mode;
        if self.settled.is_some_and(|settings| settings.mode == mode && settings.stops == stops) {
            return Ok(());
        }
        self.settled = None;
        let mode = match mode {
            Mode::Ramp => RampMode::Ramp,
            Mode::Soft => RampMode::Soft,
            Mode::Velocity => RampMode::Velocity,
            Mode::Hold => RampMode::Hold,
        };
        let bit = |set: bool, bit: u32| if set { bit } else { 0 };
        let reference = bit(!stops.left, reference::DISABLE_STOP_L)
            | bit(!stops.right, reference::DISABLE_STOP_R)
            | bit(stops.soft, reference::SOFT_STOP)
            | bit(stops.latch == Some(Side::Right), reference::REF_RNL);
        Ok(chip.write(self.generator, Register::RefConfMode, reference | mode as u32)?)
    }

    /// Writes RAMP_DIV and PULSE_DIV. Changing PULSE_DIV outside ramp mode may make a stray step while the motor stands
    /// (datasheet section 8.1.13): so for the moment of the change the chip is in ramp mode, with its target where the
    /// motor is.
    fn write_divisors(&mut self, chip: &mut Tmc429<M>, word: u32, stops: Stops) -> Result<(), Error> {
        let Known { mode, target_speed, speed, .. } = self.known;
        let standing = mode == Mode::Velocity && target_speed == 0 && speed == 0;
        if !standing || chip.holds(self.generator, Register::Divisors, word) {
            return Ok(chip.write(self.generator, Register::Divisors, word)?);
        }
        let here = self.position(chip)?;
        chip.write(self.generator, Register::XTarget, here as u32)?;
        self.set_mode(chip, Mode::Ramp, stops)?;
        chip.write(self.generator, Register::Divisors, word)?;
        self.set_mode(chip, Mode::Velocity, stops)?;
        // In ramp mode the ramp generator has changed V_TARGET itself.
        Ok(chip.write(self.generator, Register::VTarget, target_speed as u32)?)
    }
}
