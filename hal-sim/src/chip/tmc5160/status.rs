//! The state that the chip tells: status bits, flags and the registers that it writes itself.

use super::Tmc5160;
use super::gstat;
use super::registers::{OTP, address::*};
use super::sine;
use super::switches::Pair;

/// The version in IOIN (6.1).
const VERSION: u32 = 0x30;

/// Bits of RAMP_STAT (6.3.2.2).
mod ramp_stat {
    pub(super) const LATCH_L: u32 = 2;
    pub(super) const LATCH_R: u32 = 3;
    pub(super) const STOP_SG: u32 = 6;
    pub(super) const POS_REACHED: u32 = 7;
    pub(super) const SECOND_MOVE: u32 = 12;
}

/// A word of flags, the first of them bit 0.
fn flags<const N: usize>(flags: [bool; N]) -> u32 {
    flags.iter().rev().fold(0, |word, &flag| word << 1 | u32::from(flag))
}

impl Tmc5160 {
    /// The interrupt output DIAG0: true while it signals an interrupt (16.2).
    pub fn interrupt_pin(&self) -> bool {
        let stopping = self.switches.stopping();
        let [null_event, deviation] = self.encoder.flags();
        self.ramp.reached() || self.stalled || stopping.left || stopping.right || null_event || deviation
    }

    /// The position compare output DIAG1 (16.2).
    pub fn position_compare_pin(&self) -> bool {
        self.ramp.position() == self.registers.get(X_COMPARE).cast_signed()
    }

    /// SPI_STATUS (4.1.2).
    pub(super) fn status(&self) -> u8 {
        let (state, active) = (self.state(self.present()), self.switches.active(&self.registers));
        flags([
            self.gstat & gstat::RESET != 0,
            self.gstat & gstat::DRV_ERR != 0,
            self.driver.stall(state),
            self.driver.stands_still(state),
            self.ramp.at_speed(),
            self.ramp.at_target(),
            active.left,
            active.right,
        ]) as u8
    }

    /// Gives what a read access to an address returns.
    pub(super) fn read(&mut self, address: u8) -> u32 {
        let clock = self.present();
        match address {
            GSTAT => self.gstat,
            IOIN => self.inputs(),
            OTP_READ => OTP,
            TSTEP => self.driver.step_time(self.state(clock)),
            XACTUAL => self.ramp.position().cast_unsigned(),
            VACTUAL => self.ramp.velocity().cast_unsigned() & 0xFF_FFFF,
            RAMP_STAT => self.ramp_stat(),
            XLATCH => self.xlatch.cast_unsigned(),
            X_ENC => self.encoder.position().cast_unsigned(),
            ENC_STATUS => flags(self.encoder.flags()),
            ENC_LATCH => self.encoder.latch().cast_unsigned(),
            MSCNT => self.driver.microstep(),
            MSCURACT => {
                let coil =
                    |offset| sine::current(self.driver.field() + offset, &self.registers).cast_unsigned() & 0x1FF;
                coil(0) | coil(256) << 16
            }
            DRV_STATUS => self.drv_status(),
            PWM_SCALE => {
                let speed = self.ramp.velocity().unsigned_abs();
                let driven = self.bridges_on();
                self.driver.pwm_scale(super::State { registers: &self.registers, clock, speed, driven })
            }
            PWM_AUTO => self.driver.pwm_auto(),
            // IFCNT counts UART accesses only, OFFSET_READ is that of ideal amplifiers, and LOST_STEPS belongs to
            // step/direction mode: they read 0 like what cannot be read.
            _ => self.registers.read(address),
        }
    }

    /// Clears flags of RAMP_STAT.
    pub(super) fn clear_ramp_stat(&mut self, word: u32) {
        let bit = |bit: u32| word >> bit & 1 != 0;
        self.switches.clear_latched(Pair { left: bit(ramp_stat::LATCH_L), right: bit(ramp_stat::LATCH_R) });
        self.stalled &= !bit(ramp_stat::STOP_SG);
        self.ramp.clear(bit(ramp_stat::POS_REACHED), bit(ramp_stat::SECOND_MOVE));
    }

    fn inputs(&self) -> u32 {
        let (levels, tracks) = (self.switches.levels(), self.encoder.tracks());
        // SD_MODE is tied low; nothing is connected to the comparator of SWN and SWP.
        let pins = [levels.left, levels.right, tracks.b, tracks.a, self.bridges.disable_pin(), tracks.n];
        VERSION << 24 | flags(pins)
    }

    fn ramp_stat(&self) -> u32 {
        let clock = self.present();
        let (active, latched, stopping) =
            (self.switches.active(&self.registers), self.switches.latched(), self.switches.stopping());
        flags([
            active.left,
            active.right,
            latched.left,
            latched.right,
            stopping.left,
            stopping.right,
            self.stalled,
            self.ramp.reached(),
            self.ramp.at_speed(),
            self.ramp.at_target(),
            self.ramp.velocity() == 0,
            self.ramp.waits(clock),
            self.ramp.second_move(),
            self.driver.stalled(self.state(clock)),
        ])
    }

    fn drv_status(&self) -> u32 {
        let state = self.state(self.present());
        let stealth = self.driver.stealth(state);
        // "It is not applicable in stealthChop mode" (6.5.5).
        let load = if stealth { 0 } else { u32::from(self.driver.stall_guard()) };
        load | u32::from(stealth) << 14
            | u32::from(self.driver.full_steps(state)) << 15
            | self.driver.scale(state) << 16
            | u32::from(self.driver.stall(state)) << 24
            | self.bridges.flags()
            | u32::from(self.driver.stands_still(state)) << 31
    }
}
