//! Instructions for what is around the program: special registers, masks, sleep.

use rsemu::cpu::arm::v7m::isa::HintOp;
use rsemu::cpu::arm::v7m::sys::{Exception, control, fsr};
use rsemu::cpu::arm::v7m::xpsr;

use super::bus::Bus;
use super::core::Core;
use super::registers::PC;

/// Numbers of the special registers (DDI 0403 B5.1.1). The first four are APSR and its combinations; in those with an
/// odd number, and in the two after, is the exception.
const MSP: u8 = 8;
const PSP: u8 = 9;
const PRIMASK: u8 = 16;
const BASEPRI: u8 = 17;
const BASEPRI_MAX: u8 = 18;
const FAULTMASK: u8 = 19;
const CONTROL: u8 = 20;

impl Core {
    /// Reads a special register.
    pub(super) fn read_special(&mut self, register: u8) -> u32 {
        let privileged = self.registers.privileged();
        let shown = |value: u32| if privileged { value } else { 0 };
        let flags = xpsr::FLAGS | xpsr::GE;
        match register {
            0 | 2 => self.registers.xpsr() & flags,
            1 | 3 => self.registers.xpsr() & (flags | xpsr::EXCEPTION),
            5 | 7 => self.registers.exception().into(),
            MSP => *self.registers.stack(false),
            PSP => *self.registers.stack(true),
            PRIMASK => shown(self.registers.primask.into()),
            BASEPRI | BASEPRI_MAX => shown(self.registers.basepri.into()),
            FAULTMASK => shown(self.registers.faultmask.into()),
            CONTROL => self.registers.control,
            _ => 0,
        }
    }

    /// Writes a special register. A program without privilege writes the flags only.
    pub(super) fn write_special(&mut self, register: u8, mask: u8, value: u32) {
        self.attention = true;
        let registers = &mut self.registers;
        match register {
            0..=3 => {
                let parts = [(0b10, xpsr::FLAGS), (0b01, xpsr::GE)];
                for (_, bits) in parts.into_iter().filter(|(part, _)| mask & part != 0) {
                    registers.put(bits, value);
                }
            }
            _ if !registers.privileged() => {}
            MSP | PSP => *registers.stack(register == PSP) = value & !3,
            PRIMASK => registers.primask = value & 1 != 0,
            BASEPRI => registers.basepri = value as u8,
            BASEPRI_MAX => {
                let raises = registers.basepri == 0 || (value as u8) < registers.basepri;
                if value as u8 != 0 && raises {
                    registers.basepri = value as u8;
                }
            }
            FAULTMASK => self.mask_faults(value & 1 != 0),
            CONTROL => {
                let writable = control::NPRIV | if registers.in_handler() { 0 } else { control::SPSEL };
                registers.control = registers.control & !writable | value & writable;
                registers.choose_stack();
            }
            _ => {}
        }
    }

    /// Lets interrupts, or interrupts and faults, in or keeps them out.
    pub(super) fn change_masks(&mut self, enable: bool, interrupts: bool, faults: bool) {
        self.attention = true;
        if !self.registers.privileged() {
            return;
        }
        if interrupts {
            self.registers.primask = !enable;
        }
        if faults {
            self.mask_faults(!enable);
        }
    }

    /// Faults can be masked where none is handled only.
    fn mask_faults(&mut self, masked: bool) {
        if !masked || self.registers.priority(&self.sys) > -1 {
            self.registers.faultmask = masked;
        }
    }

    /// Sleeps, wakes others, or does nothing.
    pub(super) fn hint(&mut self, hint: HintOp) {
        match hint {
            HintOp::Wfi => self.fall_asleep(),
            HintOp::Wfe if self.event => self.event = false,
            HintOp::Wfe => self.fall_asleep(),
            HintOp::Sev => self.event = true,
            _ => {}
        }
    }

    fn fall_asleep(&mut self) {
        self.asleep = true;
        self.attention = true;
    }

    /// Enters the handler that the program calls; from where that cannot be entered, it is a fault.
    pub(super) fn call_supervisor<B: Bus>(&mut self, bus: &mut B) {
        if self.sys.priority_of(Exception::SVCALL) >= self.registers.priority(&self.sys) {
            self.fault_for_good(bus, fsr::HF_FORCED);
        } else {
            self.enter_exception(bus, Exception::SVCALL, self.registers.get(PC).wrapping_sub(2));
        }
    }

    /// No debugger is connected: it is a fault.
    pub(super) fn break_point<B: Bus>(&mut self, bus: &mut B) {
        self.fault_for_good(bus, fsr::HF_DEBUGEVT);
    }

    fn fault_for_good<B: Bus>(&mut self, bus: &mut B, why: u32) {
        self.sys.hfsr |= why;
        self.enter_exception(bus, Exception::HARD_FAULT, self.registers.get(PC).wrapping_sub(2));
    }
}
