//! The driver behind the ramp generator: the field that its steps turn, the current, and the measurement of the load.

use super::registers::{Registers, address::*};
use super::thresholds::Thresholds;
use crate::chip::bits::{field, sign_extend};
use crate::chip::load::{CoolStep, LoadRatio, Response, StallGuard, Threshold};
use crate::clock::Nanos;

/// Microsteps in an electrical period: four full steps of 256.
const PERIOD: i64 = 1024;
/// TSTEP where it overflows, and at standstill.
pub(super) const LONGEST_STEP: u32 = (1 << 20) - 1;
/// The unit of TPOWERDOWN and IHOLDDELAY is 2^18 clocks.
const DELAY_BITS: u32 = 18;
/// "The stall detection feature becomes switched off for 2-3 electrical periods whenever passing THIGH threshold"
/// (6.2): three of them, in full steps.
const BLIND: u32 = 12;
/// The lowest VDCMIN that switches dcStep on (6.3.2).
const LOWEST_DC: u32 = 256;

/// Bits of GCONF.
mod gconf {
    pub(super) const FAST_STANDSTILL: u32 = 1;
    pub(super) const EN_PWM_MODE: u32 = 2;
    pub(super) const SHAFT: u32 = 4;
}

/// The driver.
#[derive(Debug)]
pub(super) struct Driver {
    /// Angle of the field in 1/256 full steps; MSCNT are its lowest bits.
    field: i64,
    /// MRES: a step is 2^MRES positions of the table wide.
    resolution: u32,
    /// GCONF.shaft.
    inverted: bool,
    /// The clock of the last step; `None` if there has been none since the reset.
    last_step: Option<u64>,
    /// Clocks between the last two steps.
    interval: u64,
    /// The motor has the current of a motor at rest, or is on the way to it.
    reduced: bool,
    thresholds: Thresholds,
    /// Number of full steps before stalls are seen again.
    blind: u32,
    stall_guard: StallGuard,
    cool_step: CoolStep,
    /// PWM_OFS_AUTO and PWM_GRAD_AUTO.
    pwm_auto: [u32; 2],
    /// PWM_SCALE_SUM at the last moment in stealthChop.
    pwm_scale: u32,
}

/// The state of the rest of the chip, as far as the driver has to know it.
#[derive(Clone, Copy)]
pub(super) struct State<'a> {
    pub(super) registers: &'a Registers,
    pub(super) clock: u64,
    /// VACTUAL without sign.
    pub(super) speed: u32,
    /// The bridges drive the motor.
    pub(super) driven: bool,
}

impl Driver {
    pub(super) fn new(response: Response, seed: u64) -> Self {
        Self {
            field: 0,
            resolution: 0,
            inverted: false,
            last_step: None,
            interval: 0,
            reduced: true,
            thresholds: Thresholds::default(),
            blind: 0,
            stall_guard: StallGuard::new(response, seed),
            cool_step: CoolStep::default(),
            pwm_auto: [0; 2],
            pwm_scale: 0,
        }
    }

    /// Forgets everything; the field jumps to the nearest angle with MSCNT 0.
    pub(super) fn reset(&mut self, registers: &Registers) {
        self.stall_guard.reset();
        self.cool_step.reset();
        self.field = (self.field + PERIOD / 2).div_euclid(PERIOD) * PERIOD;
        (self.last_step, self.interval, self.reduced) = (None, 0, true);
        (self.thresholds, self.blind, self.pwm_scale) = (Thresholds::default(), 0, 0);
        self.configure(registers);
        self.pwm_auto = [registers.field(PWMCONF, 0, 8), registers.field(PWMCONF, 8, 8)];
    }

    /// Takes over registers that have changed.
    pub(super) fn configure(&mut self, registers: &Registers) {
        self.resolution = registers.field(CHOPCONF, 24, 4).min(8);
        self.inverted = registers.bit(GCONF, gconf::SHAFT);
        self.cool_step.limit(registers.get(COOLCONF), registers.field(IHOLD_IRUN, 8, 5));
    }

    /// Takes over PWMCONF: what is not tuned automatically follows PWM_OFS and PWM_GRAD, and keeps that as the initial
    /// value of the tuning (6.5.4). The tuning itself is left out: this motor's values are those that it begins with.
    pub(super) fn tune(&mut self, registers: &Registers) {
        let word = registers.get(PWMCONF);
        let (autoscale, autograd) = (field(word, 18, 1) != 0, field(word, 19, 1) != 0);
        let [offset, gradient] = &mut self.pwm_auto;
        if !autoscale {
            *offset = field(word, 0, 8);
        }
        if !autoscale || !autograd {
            *gradient = field(word, 8, 8);
        }
    }

    /// Takes a step at `clock`. Returns whether the field has passed a full step; if so, the caller calls
    /// [`take_reading`](Self::take_reading).
    ///
    /// With a lower resolution the positions are in the middles of their parts of the table (15.2).
    #[inline]
    pub(super) fn step(&mut self, clock: u64, up: bool) -> bool {
        self.interval = self.last_step.map_or(u64::from(u32::MAX), |last| clock - last);
        self.last_step = Some(clock);
        let (before, resolution) = (self.field, self.resolution);
        let width = 1 << resolution;
        let here = (before >> resolution << resolution) + (width >> 1);
        self.field = if self.turns_up(up) { here + width } else { here - width };
        before >> 8 != self.field >> 8
    }

    /// The number of the first step that passes a full step. It is 1 where all steps are to be made one by one. They
    /// are if the field is not where the present resolution has its positions, or if the current has to rise first.
    #[inline]
    pub(super) fn steps_to_full_step(&self, up: bool) -> u32 {
        let (part, width) = ((self.field & 0xFF) as u32, 1_u32 << self.resolution);
        if self.reduced || part & (width - 1) != width >> 1 {
            return 1;
        }
        (if self.turns_up(up) { 256 - part } else { part + 1 }).div_ceil(width)
    }

    /// The number of steps on so much of the way of the field, in 1/256 full steps, and the one that leaves it.
    #[inline]
    pub(super) fn steps_on(&self, way: i64) -> i64 {
        (way >> self.resolution).saturating_add(1)
    }

    /// How far a step moves the field, in 1/256 full steps.
    pub(super) fn width(&self) -> u64 {
        1 << self.resolution
    }

    /// The direction in which a step turns the field.
    #[inline]
    pub(super) fn turns_up(&self, up: bool) -> bool {
        up != self.inverted
    }

    /// Makes so many steps at once that pass no full step, the last one at `clock`.
    pub(super) fn skip(&mut self, steps: u32, up: bool, clock: u64) {
        let way = i64::from(steps) << self.resolution;
        self.field += if self.turns_up(up) { way } else { -way };
        self.last_step = Some(clock);
    }

    /// Measures stallGuard2 at the end of a full step, at `at`, with `load` on the motor, and lets coolStep react.
    /// Returns whether the motor has stalled where that is to be noticed.
    pub(super) fn take_reading(&mut self, state: State, at: Nanos, load: LoadRatio) -> bool {
        let registers = state.registers;
        let before = self.thresholds;
        self.thresholds = before.with(self.step_time(state), registers);
        self.blind = if before.high != self.thresholds.high { BLIND } else { self.blind.saturating_sub(1) };
        let word = registers.get(COOLCONF);
        let threshold = Threshold { sgt: sign_extend(field(word, 16, 7), 7), filtered: field(word, 24, 1) != 0 };
        let full = registers.field(IHOLD_IRUN, 8, 5);
        let stealth = self.stealth(state);
        if let Some(reading) = self.stall_guard.measure(at, load, threshold, state.driven && !stealth) {
            if self.thresholds.cool && !self.fast(state) && !stealth {
                self.cool_step.adapt(reading, word, full);
            } else {
                self.cool_step.release(full);
            }
        }
        self.stalled(state)
    }

    /// The angle of the field, in 1/256 full steps since the first power-on.
    #[inline]
    pub(super) fn field(&self) -> i64 {
        self.field
    }

    /// MSCNT.
    pub(super) fn microstep(&self) -> u32 {
        (self.field & (PERIOD - 1)) as u32
    }

    /// The value stallGuard2 measured last. At standstill it stays, and does not become the on-time of coil A.
    pub(super) fn stall_guard(&self) -> u16 {
        self.stall_guard.value()
    }

    /// TSTEP: the clocks of 1/256 of a full step, as measured between the last two steps.
    pub(super) fn step_time(&self, state: State) -> u32 {
        if self.stands_still(state) {
            return LONGEST_STEP;
        }
        u32::try_from(self.interval >> self.resolution).map_or(LONGEST_STEP, |clocks| clocks.min(LONGEST_STEP))
    }

    /// The flag stst.
    pub(super) fn stands_still(&self, state: State) -> bool {
        self.last_step.is_none_or(|last| state.clock >= last + Self::standstill(state.registers))
    }

    /// The thresholds that are passed now.
    fn thresholds(&self, state: State) -> Thresholds {
        self.thresholds.with(self.step_time(state), state.registers)
    }

    /// Whether the driver is in stealthChop.
    pub(super) fn stealth(&self, state: State) -> bool {
        let passed = self.thresholds(state);
        state.registers.bit(GCONF, gconf::EN_PWM_MODE) && !passed.pwm && !passed.cool && !passed.high
    }

    /// Whether the motor is faster than THIGH, or than VDCMIN, which "triggers the same actions".
    fn fast(&self, state: State) -> bool {
        let minimum = state.registers.get(VDCMIN);
        self.thresholds(state).high || minimum >= LOWEST_DC && state.speed >= minimum && !self.stealth(state)
    }

    /// The flag fsactive: fast enough, with vhighfs. The field goes on in microsteps: a motor at such a speed does not
    /// tell the difference.
    pub(super) fn full_steps(&self, state: State) -> bool {
        state.registers.bit(CHOPCONF, 18) && self.fast(state)
    }

    /// The flag StallGuard: the load value of a motor that moves is 0. In full steps dcStep has to see the stall, which
    /// DC_SG switches on.
    pub(super) fn stall(&self, state: State) -> bool {
        let measures = !self.full_steps(state) || state.registers.field(DCCTRL, 16, 8) != 0;
        let moves = state.driven && !self.stands_still(state) && !self.stealth(state);
        moves && measures && self.stall_guard.value() == 0
    }

    /// status_sg: the stall as the ramp generator sees it.
    pub(super) fn stalled(&self, state: State) -> bool {
        self.blind == 0 && self.thresholds(state).cool && self.stall(state)
    }

    /// CS_ACTUAL.
    pub(super) fn scale(&self, state: State) -> u32 {
        let word = state.registers.get(IHOLD_IRUN);
        let (hold, delay) = (field(word, 0, 5), u64::from(field(word, 16, 4)) << DELAY_BITS);
        let run = self.cool_step.scale();
        match self.last_step.map(|last| last + Self::power_down(state.registers)) {
            None => hold,
            Some(from) if state.clock < from => run,
            _ if delay == 0 || hold >= run => hold,
            Some(from) => run.saturating_sub(((state.clock - from) / delay).min(31) as u32).max(hold),
        }
    }

    /// The next clock at which, without a step, the flag of standstill or the current changes; `None` if they do not.
    pub(super) fn next_change(&self, state: State) -> Option<u64> {
        let last = self.last_step?;
        let still = last + Self::standstill(state.registers);
        if state.clock < still {
            return Some(still);
        }
        let from = last + Self::power_down(state.registers);
        if state.clock < from {
            return Some(from);
        }
        let word = state.registers.get(IHOLD_IRUN);
        let delay = u64::from(field(word, 16, 4)) << DELAY_BITS;
        (delay != 0 && self.scale(state) > field(word, 0, 5)).then(|| from + ((state.clock - from) / delay + 1) * delay)
    }

    /// The effective motor current in 1/32 of the full scale, 0 with the bridges off or the motor freewheeling.
    pub(super) fn current(&self, state: State) -> u32 {
        let scale = self.scale(state);
        let rests = self.last_step.is_none_or(|last| state.clock >= last + Self::power_down(state.registers));
        let released = scale == 0 && rests && state.registers.field(PWMCONF, 20, 2) != 0 && self.stealth(state);
        if !state.driven || released {
            return 0;
        }
        let global = match state.registers.get(GLOBALSCALER) {
            0 => 256,
            part => part,
        };
        (((scale + 1) * global + 128) / 256).max(1)
    }

    /// Notes that the motor has the current of rest, or not; returns what was noted before.
    #[inline]
    pub(super) fn set_reduced(&mut self, reduced: bool) -> bool {
        std::mem::replace(&mut self.reduced, reduced)
    }

    /// PWM_SCALE: PWM_SCALE_SUM as the formula of the velocity based scaling gives it (6.5.4), of PWM_OFS and PWM_GRAD
    /// or the tuned values; PWM_SCALE_AUTO stays 0, because nothing has to be regulated. Frozen in spreadCycle.
    pub(super) fn pwm_scale(&mut self, state: State) -> u32 {
        if self.stealth(state) {
            let [offset, gradient] = self.pwm_auto;
            let velocity = gradient * 256 / self.step_time(state).max(1);
            self.pwm_scale = (offset * (self.scale(state) + 1) / 32 + velocity).min(255);
        }
        self.pwm_scale
    }

    /// PWM_AUTO.
    pub(super) fn pwm_auto(&self) -> u32 {
        let [offset, gradient] = self.pwm_auto;
        gradient << 16 | offset
    }

    /// Clocks from the last step to standstill.
    fn standstill(registers: &Registers) -> u64 {
        if registers.bit(GCONF, gconf::FAST_STANDSTILL) { 1 << 18 } else { 1 << 20 }
    }

    /// Clocks from the last step to the reduction of the current.
    fn power_down(registers: &Registers) -> u64 {
        Self::standstill(registers) + (u64::from(registers.get(TPOWERDOWN)) << DELAY_BITS)
    }
}
