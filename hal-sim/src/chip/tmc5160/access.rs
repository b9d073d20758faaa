//! The register file as a host sees it: datagrams, and what writing a register does.

use super::registers::address::*;
use super::{Tmc5160, gstat};
use crate::chip::SpiSlave;
use crate::clock::Nanos;

impl Tmc5160 {
    /// Latches status and data for the next access.
    pub(super) fn latch_answer(&mut self, data: u32) {
        let status = self.status();
        self.port.answer(status, data);
    }

    /// Writes a register, at the present time.
    pub(super) fn write(&mut self, address: u8, data: u32) {
        let clock = self.present();
        self.registers.write(address, data);
        match address {
            GSTAT => self.clear_gstat(data),
            XACTUAL => {
                self.ramp.set_position(data.cast_signed(), clock);
                self.encoder.compare(data.cast_signed(), &self.registers);
            }
            RAMPMODE..=XTARGET => self.ramp.set(&self.registers, matches!(address, RAMPMODE | XTARGET), clock),
            RAMP_STAT => self.clear_ramp_stat(data),
            ENCMODE => {
                let event = self.encoder.mode_written(&mut self.registers);
                self.heed_null(event);
            }
            X_ENC => {
                self.encoder.set_position(data.cast_signed());
                self.encoder.compare(self.ramp.position(), &self.registers);
            }
            ENC_STATUS => {
                self.encoder.clear([data & 1 != 0, data & 2 != 0]);
                self.encoder.compare(self.ramp.position(), &self.registers);
            }
            ENC_DEVIATION => self.encoder.compare(self.ramp.position(), &self.registers),
            PWMCONF => self.driver.tune(&self.registers),
            GCONF | IHOLD_IRUN | CHOPCONF | COOLCONF | DRV_CONF => {
                self.driver.configure(&self.registers);
                self.check_bridges();
            }
            _ => {}
        }
        self.heed_stops(clock);
        self.reschedule();
    }

    fn clear_gstat(&mut self, flags: u32) {
        self.gstat &= !flags;
        // "The flag can only be cleared when the temperature is below the limit again."
        if self.bridges.overheated() {
            self.gstat |= gstat::DRV_ERR;
        }
        self.check_bridges();
    }
}

impl SpiSlave for Tmc5160 {
    fn select(&mut self, now: Nanos) {
        self.port.select(now, self.limits());
    }

    fn byte(&mut self, mosi: u8) -> u8 {
        let miso = self.port.byte(mosi);
        if self.supplied { miso } else { 0 }
    }

    /// CSN rises: a datagram takes effect, and the answer of the next one is latched. That of a read access is the
    /// register, that of a write access mirrors what was written (4.1.1).
    fn deselect(&mut self, now: Nanos) {
        let Some((first, data)) = self.port.deselect(now, self.limits()).filter(|_| self.supplied) else { return };
        if first & WRITE != 0 {
            self.write(first & !WRITE, data);
            self.latch_answer(data);
        } else {
            let data = self.read(first);
            self.latch_answer(data);
        }
    }
}
