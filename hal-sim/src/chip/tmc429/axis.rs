//! An axis, of which the chip has three: its state and registers. How it moves is in [`motion`].

mod motion;

use super::ramp::{FRACTION_BITS, Proportion};
use super::registers::{axis as reg, interrupt, ref_conf};
use crate::chip::bits::sign_extend;

/// "Never" as a tick.
pub(super) const NEVER: u64 = u64::MAX;

/// The pulse generator makes a step whenever its accumulator passes this (datasheet 8.1.13.1).
const PHASE_PERIOD: u32 = 2048;

/// The four modes of motion (8.1.11.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RampMode {
    Ramp,
    Soft,
    Velocity,
    Hold,
}

/// An axis. Its motion is evaluated only when necessary: `velocity` and `phase` are those of tick `synced`, and until
/// tick `next` they follow from the number of ticks that have passed.
#[derive(Debug)]
pub(super) struct Axis {
    x_target: i32,
    x_actual: i32,
    v_min: u32,
    v_max: u32,
    v_target: i32,
    a_max: u32,
    current_scale: u32,
    proportion: Proportion,
    mode: RampMode,
    ref_conf: u32,
    latch_armed: bool,
    interrupt_mask: u32,
    interrupt_flags: u32,
    pulse_div: u32,
    ramp_div: u32,
    usrs: u32,
    tolerance: u32,
    x_latched: i32,
    microstep: u8,
    /// 12.8 bits, sign and magnitude: "the most significant 11 bits and the sign" go to the pulse generator
    /// (8.1.10.2), so the fraction is cut towards zero.
    velocity: i32,
    /// The value to which the ramp generator drives `velocity`.
    goal: i32,
    /// Pulse accumulator, below [`PHASE_PERIOD`].
    phase: u32,
    /// The rate for which `period`, the pulse ticks of a step rounded up, was calculated: remembering it saves a
    /// division.
    period_rate: u32,
    period: u32,
    /// Number of steps that can be made before anything but the counters changes.
    free_steps: u32,
    synced: u64,
    next: u64,
    /// The next tick at which the switch inputs are sampled.
    sample_at: u64,
    /// The switches as last sampled, true is active.
    left: bool,
    right: bool,
    /// A soft stop is under way and has been reported.
    soft_stopping: bool,
    /// The last step counted up.
    up: bool,
    /// PULSE_DIV was changed in a mode where that forces a microstep.
    stray_step: bool,
    /// The conditions behind the interrupts for position and reference switch, as last seen.
    conditions: u32,
}

impl Axis {
    /// Power-on state: all bits 0 (14, 7.3) but the fixed one of PMUL.
    pub(super) fn new() -> Self {
        Self {
            x_target: 0,
            x_actual: 0,
            v_min: 0,
            v_max: 0,
            v_target: 0,
            a_max: 0,
            current_scale: 0,
            proportion: Proportion { pmul: reg::PMUL_FIXED >> reg::PMUL_SHIFT, pdiv: 0 },
            mode: RampMode::Ramp,
            ref_conf: 0,
            latch_armed: false,
            interrupt_mask: 0,
            interrupt_flags: 0,
            pulse_div: 0,
            ramp_div: 0,
            usrs: 0,
            tolerance: 0,
            x_latched: 0,
            microstep: 0,
            velocity: 0,
            goal: 0,
            phase: 0,
            period_rate: 0,
            period: 0,
            free_steps: 0,
            synced: 0,
            next: NEVER,
            sample_at: NEVER,
            left: false,
            right: false,
            soft_stopping: false,
            up: true,
            stray_step: false,
            conditions: interrupt::POS_END | interrupt::REF_MISS,
        }
    }

    /// The next tick that must not be skipped.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// X_ACTUAL, sign-extended, in microsteps.
    pub(super) fn position(&self) -> i32 {
        self.x_actual
    }

    /// V_ACTUAL, sign-extended (8.1.6).
    pub(super) fn velocity(&self) -> i32 {
        let whole = self.rate().cast_signed();
        if self.velocity < 0 { -whole } else { whole }
    }

    /// The status bit xEQt (6.2.2.2).
    pub(super) fn at_target(&self) -> bool {
        self.x_actual == self.x_target
    }

    /// True if any interrupt flag is set.
    pub(super) fn interrupt(&self) -> bool {
        self.interrupt_flags != 0
    }

    /// Reads a register of this axis, `index` being IDX (7.3). Unused bits read 0.
    pub(super) fn read(&self, index: u8) -> u32 {
        match index {
            reg::X_TARGET => self.x_target.cast_unsigned() & reg::POSITION_MASK,
            reg::X_ACTUAL => self.x_actual.cast_unsigned() & reg::POSITION_MASK,
            reg::V_MIN => self.v_min,
            reg::V_MAX => self.v_max,
            reg::V_TARGET => self.v_target.cast_unsigned() & reg::SIGNED_VELOCITY_MASK,
            reg::V_ACTUAL => self.velocity().cast_unsigned() & reg::SIGNED_VELOCITY_MASK,
            reg::A_MAX => self.a_max,
            reg::A_ACTUAL => self.limit(self.goal - self.velocity).cast_unsigned() & reg::SIGNED_VELOCITY_MASK,
            reg::CURRENT_SCALE => self.current_scale,
            reg::PMUL_PDIV => self.proportion.pmul << reg::PMUL_SHIFT | self.proportion.pdiv,
            reg::REF_CONF_MODE => {
                let mode = match self.mode {
                    RampMode::Ramp => 0,
                    RampMode::Soft => 1,
                    RampMode::Velocity => 2,
                    RampMode::Hold => 3,
                };
                u32::from(self.latch_armed) << reg::LP_SHIFT | self.ref_conf | mode
            }
            reg::INTERRUPTS => self.interrupt_mask << reg::INTERRUPT_MASK_SHIFT | self.interrupt_flags,
            reg::DIVIDERS => self.pulse_div << reg::PULSE_DIV_SHIFT | self.ramp_div << reg::RAMP_DIV_SHIFT | self.usrs,
            reg::DX_REF_TOLERANCE => self.tolerance,
            reg::X_LATCHED => self.x_latched.cast_unsigned() & reg::POSITION_MASK,
            reg::USTEP_COUNT => u32::from(self.microstep),
            _ => 0,
        }
    }

    /// Writes a register of this axis at tick `tick`; it acts from the next tick on.
    pub(super) fn write(&mut self, index: u8, data: u32, tick: u64) {
        self.sync(tick);
        match index {
            reg::X_TARGET => self.x_target = sign_extend(data, reg::POSITION_BITS),
            reg::X_ACTUAL => self.x_actual = sign_extend(data, reg::POSITION_BITS),
            reg::V_MIN => self.v_min = data & reg::UNSIGNED_MASK,
            reg::V_MAX => self.v_max = data & reg::UNSIGNED_MASK,
            reg::V_TARGET => self.v_target = sign_extend(data, reg::SIGNED_VELOCITY_BITS),
            // Outside hold_mode the register is called read-only (8.1), yet 12.2 writes it in ramp_mode to
            // start with a velocity, so every mode takes it. The hidden bits become 0 (8.1.6).
            reg::V_ACTUAL => self.velocity = sign_extend(data, reg::SIGNED_VELOCITY_BITS) << FRACTION_BITS,
            reg::A_MAX => self.a_max = data & reg::UNSIGNED_MASK,
            reg::CURRENT_SCALE => self.current_scale = data & reg::CURRENT_SCALE_MASK,
            reg::PMUL_PDIV => {
                let pmul = (data | reg::PMUL_FIXED) >> reg::PMUL_SHIFT & reg::PMUL_MASK;
                self.proportion = Proportion { pmul, pdiv: data & reg::PDIV_MASK };
            }
            reg::REF_CONF_MODE => {
                self.ref_conf = data & ref_conf::MASK;
                self.mode = match data & reg::MODE_MASK {
                    0 => RampMode::Ramp,
                    1 => RampMode::Soft,
                    2 => RampMode::Velocity,
                    _ => RampMode::Hold,
                };
            }
            reg::INTERRUPTS => {
                // "Write 1 at the position of the bit to clear the flag", and a flag without its mask is
                // forced to 0 (8.1.12).
                self.interrupt_mask = data >> reg::INTERRUPT_MASK_SHIFT & interrupt::ALL;
                self.interrupt_flags &= !data & self.interrupt_mask;
            }
            reg::DIVIDERS => self.set_dividers(data),
            reg::DX_REF_TOLERANCE => self.tolerance = data & reg::TOLERANCE_MASK,
            reg::X_LATCHED => self.latch_armed = true,
            reg::USTEP_COUNT => self.microstep = (data & reg::USTEP_MASK) as u8,
            // A_ACTUAL is read-only.
            _ => {}
        }
        self.set_goal();
        self.settle();
    }

    fn set_dividers(&mut self, data: u32) {
        let pulse_div = data >> reg::PULSE_DIV_SHIFT & reg::DIVIDER_MASK;
        // "Changing PULSE_DIV in velocity_mode or in hold_mode might force an internal microstep depending on
        // the actual microstep position" (8.1.13.2): the half accumulated step comes out.
        let sensitive = matches!(self.mode, RampMode::Velocity | RampMode::Hold);
        if sensitive && pulse_div != self.pulse_div && self.phase >= PHASE_PERIOD / 2 {
            self.stray_step = true;
            self.sample_at = self.sample_at.min(self.synced + 1);
        }
        self.pulse_div = pulse_div;
        self.ramp_div = data >> reg::RAMP_DIV_SHIFT & reg::DIVIDER_MASK;
        self.usrs = data & reg::USRS_MASK;
    }

    /// The pulse generator's input: the velocity without sign and fraction.
    fn rate(&self) -> u32 {
        self.velocity.unsigned_abs() >> FRACTION_BITS
    }
}

/// A position in the range of the 24 bit counter.
fn wrap(position: i32) -> i32 {
    sign_extend(position.cast_unsigned(), reg::POSITION_BITS)
}
