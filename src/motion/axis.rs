//! One axis: a ramp generator of the TMC429 and a TMC262 driver, with the moves and the turn of each millisecond.

use embedded_hal::spi::SpiDevice;

use super::Error;
use super::current::{Current, Excitation, MotionState};
use super::position::Position;
use super::ramp::{self, braking};
use super::search::Search;
use super::stall::Measured;
use super::switch::{SETTLED, stops};
use crate::chip::encoder::{Counter, TURN};
use crate::chip::tmc262::{Configuration, Tmc262};
use crate::chip::tmc429::{RampGenerator, RampMode, Register, Tmc429, reference, signed};
use crate::param::{AxisParameter as P, Table};
use crate::units::{INTERNAL_MAX, Internal, Micros};

/// Inputs of an axis besides its chips, sampled once per poll.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sensors {
    /// SG_TST output of the driver: high while the load value is zero, so that the motor stalls.
    pub stall: bool,
    /// Home switch as it is: true is closed.
    pub home: bool,
    /// Angle of the built-in encoder, 0..=1023 in a turn.
    pub encoder: u16,
    /// Counter of the external ABN encoder, wrapping.
    pub external: u16,
    /// Counts of the external encoder at which its N track last became low, and high, since the poll before.
    pub null: [Option<u16>; 2],
}

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

/// Bits of parameter 210 that are functions, not prescaler. The manual reserves the lowest four bits (section 6.2.1),
/// but only [`CLEAR`] has a function (section 6.2.2), and in the manual's own table 20 the prescaler of two microsteps,
/// 200, has bit 3 set.
const ENCODER_FUNCTIONS: i32 = CLEAR;
/// Bits of parameter 217 that are functions, not prescaler (manual section 6.3).
const EXTERNAL_FUNCTIONS: i32 = 0x1C;
/// Parameters 210 and 217: clear the counter at the absolute zero point, or at an N event.
const CLEAR: i32 = 4;
/// Parameter 217: at every N event, not only at the next.
const CLEAR_ALWAYS: i32 = 8;
/// Parameter 217: the N event is the track becoming high, not low.
const NULL_HIGH: i32 = 16;

/// Polls in which each reading of the chips has had its turn: the speed in every second poll, driver and right switch
/// in every fourth, and once in place of the switch the version of the motion controller, which shows that it is there.
const SLOTS: u8 = 64;

/// Modulus of the ABN counter.
const ABN_COUNTS: u32 = 1 << 16;

/// One axis.
#[derive(Debug)]
pub struct Axis<D> {
    pub(super) generator: RampGenerator,
    pub(super) driver: Tmc262<D>,
    table: &'static Table<P>,
    values: [i32; P::SETTINGS],
    pub(super) position: Position,
    pub(super) mode: RampMode,
    /// Commanded speed in velocity mode, in internal units; positive is to the right.
    pub(super) target_speed: Internal,
    pub(super) reverse: bool,
    pub(super) speed: Internal,
    right: bool,
    /// For how many polls, of a millisecond each, a stop switch has held the motor.
    held: u8,
    /// A positioning move is under way, whose end will be an event.
    pub(super) travelling: bool,
    /// The position was the target at the last poll, and no other target has been given since.
    at_target: bool,
    pub(super) search: Option<Search>,
    pub(super) errors: i32,
    /// Driver faults since the last motion command, as bits of parameter 208.
    pub(super) alarms: u8,
    /// The motor has been stopped because an encoder deviates, and has not been sent anywhere since.
    pub(super) deviating: bool,
    /// A hard stop did not get through to the chip, and is tried again with every poll.
    pub(super) stopping: bool,
    /// Events that the next poll returns.
    pub(super) events: Events,
    /// The external encoder is to be zeroed at its next N event.
    pub(super) null_armed: bool,
    braking_memo: ramp::BrakingMemo,
    pub(super) measured: Measured,
    current: Current,
    pub(super) excitation: Option<Excitation>,
    pub(super) sensors: Sensors,
    pub(super) encoder: Counter<{ TURN as u32 }>,
    pub(super) external: Counter<ABN_COUNTS>,
    /// Number of the next poll in the rotation of readings: less than [`SLOTS`].
    slot: u8,
}

impl<D: SpiDevice> Axis<D> {
    /// The axis on ramp generator `generator`, with the factory defaults of its parameters; nothing is written yet.
    pub fn new(generator: RampGenerator, driver: D, table: &'static Table<P>) -> Self {
        Axis {
            generator,
            driver: Tmc262::new(driver),
            table,
            values: table.defaults(),
            position: Position::default(),
            mode: RampMode::Ramp,
            target_speed: 0,
            reverse: false,
            speed: 0,
            right: false,
            held: 0,
            travelling: false,
            at_target: true,
            search: None,
            errors: 0,
            alarms: 0,
            deviating: false,
            stopping: false,
            events: Events::default(),
            null_armed: false,
            braking_memo: ramp::BrakingMemo::default(),
            measured: Measured::default(),
            current: Current::default(),
            excitation: None,
            sensors: Sensors::default(),
            encoder: Counter::new(),
            external: Counter::new(),
            slot: 0,
        }
    }

    /// Brings both chips to the parameters' values after power-on or a restart: position zero, no motion.
    /// The TMC429 has been halted before.
    pub fn start<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>) -> Result<(), Error> {
        self.write_position(chip, 0)?;
        self.arm_null(true);
        self.refresh_excitation(now, MotionState::Standing)?;
        let (ramp_div, pulse_div) = self.divisors();
        if braking(INTERNAL_MAX, ramp_div, pulse_div, INTERNAL_MAX).is_none() {
            // Each divisor was accepted once, but not with the other one it was stored with.
            for divisor in [P::RampDivisor, P::PulseDivisor] {
                self.set_value(divisor, self.table.row(divisor).map_or(0, |row| row.default));
            }
        }
        self.mode = RampMode::Ramp;
        self.configure(chip)
    }

    /// True when parameter 2 is the speed to rotate at, as in ROR: in velocity mode, and in a reference search, which
    /// it ends. In the positioning modes the ramp generator works out its target speed itself.
    pub const fn takes_speed(&self) -> bool {
        self.search.is_some() || matches!(self.mode, RampMode::Velocity | RampMode::Hold)
    }

    /// Rotates at `speed` in velocity mode, right if positive (ROR, ROL, SAP 2); 0 stops along the ramp
    /// (MST).
    pub fn rotate<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>, speed: Internal) -> Result<(), Error> {
        self.begin(speed != 0);
        self.search = None;
        self.travelling = false;
        self.run_at(now, chip, speed)
    }

    /// Moves to `target` (MVP, SAP 0). In soft mode it stays in soft mode.
    pub fn move_to<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>, target: i32) -> Result<(), Error> {
        self.begin(true);
        self.search = None;
        self.travel_to(now, chip, target)?;
        self.travelling = true;
        Ok(())
    }

    /// Rotates, for a command or a reference search.
    pub(super) fn run_at<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        speed: Internal,
    ) -> Result<(), Error> {
        if speed != 0 {
            self.wake(now)?;
        }
        self.set_mode(chip, RampMode::Velocity)?;
        chip.write(self.generator, Register::VTarget, speed as u32)?;
        self.target_speed = speed;
        // The speed limit comes last: in ramp mode it would have acted at once.
        self.configure(chip)
    }

    /// Positions, for a command or a reference search.
    pub(super) fn travel_to<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        target: i32,
    ) -> Result<(), Error> {
        self.wake(now)?;
        self.aim(target);
        let mode = if self.mode == RampMode::Soft { RampMode::Soft } else { RampMode::Ramp };
        self.resume(chip, mode)
    }

    fn aim(&mut self, target: i32) {
        self.position.aim(target);
        self.at_target &= self.at_target();
    }

    /// True when the position is the target, as parameter 8 tells; as of the last datagram.
    pub const fn at_target(&self) -> bool {
        self.position.actual == self.position.target
    }

    /// The actual position in microsteps, as of the last datagram.
    pub const fn last_position(&self) -> i32 {
        self.position.actual
    }

    /// The target position in microsteps, in the two ramp modes that go to one.
    pub const fn target_position(&self) -> Option<i32> {
        match self.mode {
            RampMode::Ramp | RampMode::Soft => Some(self.position.target),
            RampMode::Velocity | RampMode::Hold => None,
        }
    }

    /// Home switch as of the last poll, as it is.
    pub const fn home_switch(&self) -> bool {
        self.sensors.home
    }

    /// Left and right stop switch, polarity applied: the left one as of the last datagram, the right one at most
    /// eight polls old.
    pub fn stop_switches<M: SpiDevice>(&self, chip: &Tmc429<M>) -> [bool; 2] {
        [chip.left_switch(self.generator), self.right]
    }

    /// True while a positioning move is under way.
    pub const fn travelling(&self) -> bool {
        self.travelling
    }

    /// The actual position in microsteps, asked of the chip by one datagram.
    pub fn actual_position<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>) -> Result<i32, Error> {
        let counter = chip.read(self.generator, Register::XActual)?;
        self.position.track(counter);
        Ok(self.position.actual)
    }

    /// Changes the ramp mode (parameter 138). Into velocity mode the motor keeps the speed it was heading
    /// for; out of it, it goes to the last target. A reference search ends, as if the motor had been stopped before.
    pub(super) fn change_mode<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        mode: RampMode,
    ) -> Result<(), Error> {
        if self.search.is_some() {
            self.rotate(now, chip, 0)?;
        }
        match (self.mode, mode) {
            (RampMode::Velocity, RampMode::Velocity) => Ok(()),
            (_, RampMode::Velocity) => {
                let heading = self.target_speed(chip)?;
                self.rotate(now, chip, heading)
            }
            (RampMode::Velocity, _) => {
                self.begin(true);
                self.wake(now)?;
                self.aim(self.position.target);
                self.travelling = true;
                self.resume(chip, mode)
            }
            (_, _) => self.set_mode(chip, mode),
        }
    }

    /// Overwrites the position counter (parameter 1). Target and position become equal, so that nothing
    /// moves; a motor that was positioning, or searching, is stopped along the ramp. The chip wants velocity mode for
    /// this (datasheet section 8.1.2).
    pub(super) fn set_position<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        value: i32,
    ) -> Result<(), Error> {
        let mode = self.mode;
        let standing = self.position.actual == self.position.target && self.speed == 0;
        if mode != RampMode::Velocity || self.search.is_some() {
            self.search = None;
            self.travelling = false;
            self.run_at(now, chip, 0)?;
        }
        self.write_position(chip, value)?;
        if mode != RampMode::Velocity && standing { self.resume(chip, mode) } else { Ok(()) }
    }

    /// Makes target and position `value`, in a mode in which the chip takes it.
    fn write_position<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>, value: i32) -> Result<(), Error> {
        chip.write(self.generator, Register::XActual, value as u32)?;
        chip.write(self.generator, Register::XTarget, value as u32)?;
        self.position.set(value);
        self.measured = Measured::default();
        Ok(())
    }

    /// The speed the motor is heading for: the commanded one, or the ramp generator's own.
    pub(super) fn target_speed<M: SpiDevice>(&self, chip: &mut Tmc429<M>) -> Result<Internal, Error> {
        Ok(match self.mode {
            RampMode::Velocity | RampMode::Hold => self.target_speed,
            RampMode::Ramp | RampMode::Soft => signed(chip.read(self.generator, Register::VTarget)?, 12),
        })
    }

    /// The speed right now: one datagram.
    pub(super) fn actual_speed<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>) -> Result<Internal, Error> {
        self.speed = signed(chip.read(self.generator, Register::VActual)?, 12);
        Ok(self.speed)
    }

    /// The magnitude of the chip's smoothed acceleration.
    pub(super) fn actual_acceleration<M: SpiDevice>(&self, chip: &mut Tmc429<M>) -> Result<Internal, Error> {
        Ok(signed(chip.read(self.generator, Register::AActual)?, 12).abs())
    }

    /// Left and right stop switch, polarity applied: one datagram.
    pub(super) fn switches<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>) -> Result<(bool, bool), Error> {
        let bits = chip.reference_switches()? >> (2 * self.generator as u32);
        self.right = bits & 1 != 0;
        Ok((bits & 2 != 0, self.right))
    }

    /// Reverses the shaft (global parameter 90). The direction output is common to the chip's motors and is
    /// switched elsewhere; here the encoders follow.
    pub fn set_reverse(&mut self, reverse: bool) {
        self.reverse = reverse;
    }

    /// Writes all settings of the ramp generator; values that the chip has already take no datagram.
    pub(super) fn configure<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>) -> Result<(), Error> {
        let m = self.generator;
        let (ramp_div, pulse_div) = self.divisors();
        chip.write(m, Register::VMin, self.value(P::MinimumSpeed) as u32)?;
        self.write_divisors(chip, u32::from(pulse_div) << 12 | u32::from(ramp_div) << 8)?;
        chip.write(m, Register::DxRefTolerance, self.tolerance() as u32)?;
        let limit = self.positioning_speed();
        let wanted = self.value(P::MaximumAcceleration);
        if self.mode == RampMode::Velocity {
            // Velocity mode goes up to the full range and takes the acceleration as it is.
            chip.write(m, Register::AMax, wanted as u32)?;
            chip.write(m, Register::VMax, INTERNAL_MAX as u32)?;
        } else {
            let b = self.braking_memo.braking(wanted, ramp_div, pulse_div, limit).ok_or(Error::OutOfRange)?;
            chip.write(m, Register::AMax, b.acceleration as u32)?;
            chip.write(m, Register::PMulPDiv, u32::from(b.pmul) << 8 | u32::from(b.pdiv))?;
            chip.write(m, Register::VMax, limit as u32)?;
        }
        // A new mode comes last, when all that it needs is in place.
        self.write_reference(chip)
    }

    /// RAMP_DIV and PULSE_DIV.
    pub(super) fn divisors(&self) -> (u8, u8) {
        (self.value(P::RampDivisor) as u8, self.value(P::PulseDivisor) as u8)
    }

    /// Writes parameters and excitation to the driver.
    pub(super) fn write_driver(&mut self) -> Result<(), Error> {
        if let Some(excitation) = self.excitation {
            let configuration = self.configuration(excitation);
            self.driver.apply(&configuration)?;
        }
        Ok(())
    }

    /// A parameter's value as set.
    pub(super) fn value(&self, parameter: P) -> i32 {
        self.values.get(parameter.index()).copied().unwrap_or_default()
    }

    pub(super) fn set_value(&mut self, parameter: P, value: i32) {
        if let Some(place) = self.values.get_mut(parameter.index()) {
            *place = value;
        }
    }

    /// Takes the axis on by one poll of the 1 kHz. That takes two datagrams to the TMC429, or one to it and one to the
    /// driver; a few more where a switch holds the motor, in a reference search, or where the motor is stopped.
    pub fn poll<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>, sensors: Sensors) -> Events {
        self.sensors = sensors;
        self.count_encoders();
        // A datagram that did not get through to a chip is tried again with the next poll.
        let _ = self.turn(now, chip);
        core::mem::take(&mut self.events)
    }

    fn turn<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>) -> Result<(), Error> {
        if self.stopping {
            self.hard_stop(now, chip)?;
        }
        self.actual_position(chip)?;
        let slot = self.slot;
        self.slot = (slot + 1) % SLOTS;
        match slot % 4 {
            0 | 2 => drop(self.actual_speed(chip)?),
            1 => self.driver.refresh()?,
            _ if slot == SLOTS - 1 => chip.confirm()?,
            _ => drop(self.switches(chip)?),
        }

        let waypoint = self.position.waypoint;
        if self.mode != RampMode::Velocity && self.position.advance() {
            // A waypoint that did not get through to the chip is given to it again with the next poll.
            self.write_waypoint(chip).inspect_err(|_| self.position.waypoint = waypoint)?;
        }
        self.guard(now, chip)?;
        if let Some(search) = self.search {
            self.poll_search(now, chip, search)?;
        }
        self.held = if self.is_held(chip)? { self.held.saturating_add(1) } else { 0 };
        let reached = self.at_target();
        self.events.at_target |= reached && !core::mem::replace(&mut self.at_target, reached);
        if self.travelling {
            let cut_short = self.held >= SETTLED && !reached;
            self.events.reached |= reached;
            self.events.cut_short |= cut_short;
            self.travelling = !(reached || cut_short);
        }
        self.refresh_excitation(now, self.motion_state())
    }

    fn count_encoders(&mut self) {
        let Sensors { encoder, external, null, .. } = self.sensors;
        let setting = self.value(P::EncoderPrescaler);
        let prescaler = setting & !ENCODER_FUNCTIONS;
        if self.encoder.update(encoder.into(), prescaler, self.reverse) && setting & CLEAR != 0 {
            self.encoder.zero_at(0, prescaler, self.reverse);
        }
        let setting = self.value(P::ExternalEncoderPrescaler);
        let prescaler = setting & !EXTERNAL_FUNCTIONS;
        self.external.update(external.into(), prescaler, self.reverse);
        let [low, high] = null;
        let event = if setting & NULL_HIGH != 0 { high } else { low };
        if let Some(count) = event.filter(|_| self.null_armed) {
            self.external.zero_at(count.into(), prescaler, self.reverse);
            self.arm_null(setting & CLEAR_ALWAYS != 0);
        }
    }

    /// Lets the next N event zero the external encoder, if parameter 217 asks for it at all and `again`.
    pub(super) fn arm_null(&mut self, again: bool) {
        self.null_armed = again && self.value(P::ExternalEncoderPrescaler) & CLEAR != 0;
    }

    /// True while a stop switch holds the motor against its command. The last readings of switches and speed may be
    /// some polls old; so they are read again before the motor counts as held.
    fn is_held<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>) -> Result<bool, Error> {
        let ahead = match self.mode {
            RampMode::Velocity | RampMode::Hold => self.target_speed,
            RampMode::Ramp | RampMode::Soft => self.position.target.wrapping_sub(self.position.actual),
        };
        // Near the counter's origin the chip lets the motor pass (datasheet section 8.1.14).
        let tolerance = self.tolerance().unsigned_abs();
        let near = tolerance != 0 && signed(self.position.actual as u32, 24).unsigned_abs() <= tolerance;
        let bits = self.reference();
        if near || self.speed != 0 || !stops(bits, ahead, chip.left_switch(self.generator), self.right) {
            return Ok(false);
        }
        let (left, right) = self.switches(chip)?;
        Ok(stops(bits, ahead, left, right) && self.actual_speed(chip)? == 0)
    }

    /// DX_REF_TOLERANCE: a search wants to be stopped wherever its switch is.
    fn tolerance(&self) -> i32 {
        if self.search.is_some() { 0 } else { self.value(P::ReferenceTolerance) }
    }

    /// The speed at which the axis goes to a position.
    fn positioning_speed(&self) -> Internal {
        self.search.map_or_else(|| self.value(P::MaximumSpeed), |search| search.switch_speed())
    }

    fn motion_state(&self) -> MotionState {
        let held = self.held > 0;
        let (ahead, cruises) = match self.mode {
            RampMode::Velocity | RampMode::Hold => (self.target_speed != 0, self.speed == self.target_speed),
            RampMode::Ramp | RampMode::Soft => {
                (self.position.actual != self.position.target, self.speed.abs() == self.positioning_speed())
            }
        };
        let moving = ahead || self.speed != 0;
        if !moving || (held && self.value(P::EndSwitchPowerDown) != 0) {
            MotionState::Standing
        } else if held {
            MotionState::Held
        } else if cruises {
            MotionState::Cruising
        } else {
            MotionState::Changing
        }
    }

    /// A motion command begins: error flags are cleared, and if the command moves the motor, a deviation may stop it
    /// again.
    pub(super) fn begin(&mut self, moves: bool) {
        self.errors = 0;
        self.deviating &= !moves;
    }

    /// Before a motion: the driver gets the current of a motor whose speed changes, so that it is there with the first
    /// step.
    fn wake(&mut self, now: Micros) -> Result<(), Error> {
        self.release_driver()?;
        self.refresh_excitation(now, MotionState::Changing)
    }

    fn refresh_excitation(&mut self, now: Micros, state: MotionState) -> Result<(), Error> {
        let values = &self.values;
        let value = |p: P| values.get(p.index()).copied().unwrap_or_default();
        let excitation = self.current.select(now, state, self.speed, value);
        if self.excitation != Some(excitation) {
            self.excitation = Some(excitation);
            self.write_driver()?;
        }
        Ok(())
    }

    /// Goes into a positioning mode: target and ramp settings first, the mode last.
    fn resume<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>, mode: RampMode) -> Result<(), Error> {
        self.mode = mode;
        self.write_waypoint(chip)?;
        self.configure(chip)
    }

    fn write_waypoint<M: SpiDevice>(&self, chip: &mut Tmc429<M>) -> Result<(), Error> {
        Ok(chip.write(self.generator, Register::XTarget, self.position.waypoint as u32)?)
    }

    pub(super) fn set_mode<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>, mode: RampMode) -> Result<(), Error> {
        self.mode = mode;
        self.write_reference(chip)
    }

    /// Reference switch bits as the parameters, or a search, want them.
    fn reference(&self) -> u32 {
        let bit = |parameter: P, bit: u32| if self.value(parameter) != 0 { bit } else { 0 };
        match &self.search {
            Some(search) => search.reference(),
            None => {
                bit(P::LeftSwitchDisable, reference::DISABLE_STOP_L)
                    | bit(P::RightSwitchDisable, reference::DISABLE_STOP_R)
                    | bit(P::SoftStop, reference::SOFT_STOP)
            }
        }
    }

    fn write_reference<M: SpiDevice>(&self, chip: &mut Tmc429<M>) -> Result<(), Error> {
        Ok(chip.write(self.generator, Register::RefConfMode, self.reference() | self.mode as u32)?)
    }

    fn configuration(&self, excitation: Excitation) -> Configuration {
        let byte = |parameter: P| self.value(parameter) as u8;
        let flag = |parameter: P| self.value(parameter) != 0;
        Configuration {
            microsteps: byte(P::MicrostepResolution),
            interpolation: flag(P::StepInterpolation),
            double_edge: flag(P::DoubleStep),
            blank_time: byte(P::ChopperBlankTime),
            constant_toff: flag(P::ConstantToffMode),
            no_fast_decay_comparator: flag(P::DisableFastDecayComparator),
            hysteresis_end: byte(P::ChopperHysteresisEnd),
            hysteresis_start: byte(P::ChopperHysteresisStart),
            off_time: if excitation.free { 0 } else { byte(P::ChopperOffTime) },
            random_off_time: flag(P::RandomToffMode),
            current_minimum: byte(P::SmartEnergyCurrentMinimum),
            down_step: byte(P::SmartEnergyDownStep),
            hysteresis: byte(P::SmartEnergyHysteresis),
            up_step: byte(P::SmartEnergyUpStep),
            cool_step: if excitation.cool_step { byte(P::SmartEnergyHysteresisStart) } else { 0 },
            filter: flag(P::StallGuardFilter),
            threshold: self.value(P::StallGuardThreshold) as i8,
            current: excitation.scale,
            slope_high: byte(P::SlopeHighSide),
            slope_low: byte(P::SlopeLowSide),
            no_short_protection: flag(P::ShortProtectionDisable),
            short_timer: byte(P::ShortDetectionTimer),
            vsense: flag(P::Vsense),
        }
    }

    /// PULSE_DIV may make a stray step when changed outside ramp mode while the motor stands (datasheet
    /// section 8.1.13): for the moment of the change the chip is in ramp mode with its target where it is.
    fn write_divisors<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>, word: u32) -> Result<(), Error> {
        let standing = self.mode == RampMode::Velocity && self.target_speed == 0 && self.speed == 0;
        if !standing || chip.holds(self.generator, Register::Divisors, word) {
            return Ok(chip.write(self.generator, Register::Divisors, word)?);
        }
        let here = self.actual_position(chip)?;
        chip.write(self.generator, Register::XTarget, here as u32)?;
        self.set_mode(chip, RampMode::Ramp)?;
        chip.write(self.generator, Register::Divisors, word)?;
        self.set_mode(chip, RampMode::Velocity)?;
        // In ramp mode the ramp generator has written V_TARGET itself.
        Ok(chip.write(self.generator, Register::VTarget, self.target_speed as u32)?)
    }
}
