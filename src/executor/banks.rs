//! Global parameters: banks 0, 2 and 3, and storing them (manual chapter 5).

use super::commands::slots;
use super::{Commands, Outcome, Product};
use crate::device::Circuit;
use crate::param::{GlobalParameter as G, Interrupt, Parameter, Row, STORED_USER_VARIABLES, Storage};
use crate::tmcl::Status;

/// The tick timer and random numbers have 31 bits (manual section 5.1, parameters 132 and 133).
const BITS_31: u32 = 0x7FFF_FFFF;

/// The number that, written to parameter 73, locks the EEPROM.
const LOCK: i32 = 1234;

/// The parameter that a number and a bank stand for.
enum Global {
    Bank0(&'static Parameter<G>),
    Variable(u8),
    /// The setting, in bank 3, of the interrupt that has the same number.
    Interrupt(u8, &'static Row),
}

fn check(row: &Row, value: i32) -> Result<(), Status> {
    if !row.writable() {
        Err(Status::WrongType)
    } else if !row.accepts(value) {
        Err(Status::InvalidValue)
    } else {
        Ok(())
    }
}

impl<T: Circuit<Product: Product>, const AXES: usize> Commands<'_, T, AXES> {
    /// GGP.
    pub(crate) fn get_global(&mut self, number: u8, bank: u8) -> Result<i32, Status> {
        Ok(match find::<T::Product>(number, bank)? {
            Global::Bank0(parameter) => match parameter.function {
                G::TickTimer => self.tick_timer().cast_signed(),
                G::RandomNumber => self.random().cast_signed(),
                G::ApplicationStatus => self.machine.state() as i32,
                G::DownloadMode => self.device.store().downloading().is_some().into(),
                G::ProgramCounter => self.machine.counter().into(),
                setting => self.executor.globals.get(setting),
            },
            Global::Variable(number) => self.executor.variables.get(usize::from(number)).copied().unwrap_or_default(),
            Global::Interrupt(number, _) => self.machine.interrupts.setting(number),
        })
    }

    /// SGP, AGP. `echo` is the reply's value.
    pub(super) fn set_global(&mut self, number: u8, bank: u8, value: i32, echo: i32) -> Result<Outcome, Status> {
        match find::<T::Product>(number, bank)? {
            Global::Bank0(Parameter { function, row }) => {
                check(row, value)?;
                if let Storage::Automatic(slot) = row.storage {
                    slots::<T::Product>()?;
                    if *function == G::EepromLock {
                        return self.lock(slot, value, echo);
                    }
                    self.may_store()?;
                }
                match *function {
                    G::CodeProtection if self.executor.globals.uncover(value) => {
                        return self.erase_program(value, echo);
                    }
                    G::TickTimer => {
                        self.executor.tick_offset = (self.now.millis() as u32).wrapping_sub(value.cast_unsigned());
                    }
                    G::RandomNumber => self.executor.random = value.cast_unsigned(),
                    polarity @ (G::EndSwitchPolarity | G::ReverseShaft) => self.set_interface(polarity, value)?,
                    setting => self.executor.globals.set(setting, value),
                }
                if let Storage::Automatic(slot) = row.storage {
                    self.keep(Some(slot.into()), value)?;
                    return Ok(Outcome::stored(echo));
                }
            }
            Global::Variable(number) => {
                if let Some(cell) = self.executor.variables.get_mut(usize::from(number)) {
                    *cell = value;
                }
            }
            Global::Interrupt(number, row) => {
                check(row, value)?;
                self.machine.interrupts.set(number, value);
            }
        }
        Ok(Outcome::Value(echo))
    }

    /// Locks the EEPROM or unlocks it (73), which is stored itself, locked or not.
    fn lock(&mut self, slot: u8, value: i32, echo: i32) -> Result<Outcome, Status> {
        let locks = matches!(value, 1 | LOCK).into();
        self.put(Some(slot.into()), locks)?;
        self.executor.globals.set(G::EepromLock, locks);
        Ok(Outcome::stored(echo))
    }

    /// Takes the read protection (81) off, by which the program is erased; not while a link downloads one. The
    /// protection ends only when the program is gone, so that a power cut never shows it.
    fn erase_program(&mut self, protection: i32, echo: i32) -> Result<Outcome, Status> {
        if self.device.store().downloading().is_some() {
            return Err(Status::NotAvailable);
        }
        self.machine.stop();
        if let Some(protection) = self.device.store_mut().erase(protection) {
            self.executor.globals.set(G::CodeProtection, protection);
        }
        Ok(Outcome::written(echo))
    }

    /// STGP: user variables only; of bank 0 SGP itself stores what can be stored.
    pub(super) fn store_global(&mut self, number: u8, bank: u8, echo: i32) -> Result<Outcome, Status> {
        let slot = stored_variable::<T::Product>(number, bank)?;
        let value = self.executor.variables.get(usize::from(number)).copied().unwrap_or_default();
        self.keep(Some(slot), value)?;
        Ok(Outcome::stored(echo))
    }

    /// RSGP.
    pub(super) fn restore_global(&mut self, number: u8, bank: u8, echo: i32) -> Result<Outcome, Status> {
        let slot = stored_variable::<T::Product>(number, bank)?;
        let value = self.recall(Some(slot))?;
        if let Some(cell) = self.executor.variables.get_mut(usize::from(number)) {
            *cell = value;
        }
        Ok(Outcome::Value(echo))
    }

    /// Changes switch polarity (79) or shaft direction (90). If the motion controller does not take the datagram, the
    /// parameter and the shadow registers of the chip driver go back to the value before.
    fn set_interface(&mut self, parameter: G, value: i32) -> Result<(), Status> {
        let globals = &mut self.executor.globals;
        let before = globals.get(parameter);
        globals.set(parameter, value);
        self.device.invert(globals.inversion()).map_err(|error| {
            globals.set(parameter, before);
            let _ = self.device.invert(globals.inversion());
            error.into()
        })
    }

    /// The milliseconds that the tick timer has counted.
    fn tick_timer(&self) -> u32 {
        (self.now.millis() as u32).wrapping_sub(self.executor.tick_offset) & BITS_31
    }

    /// The next random number, 31 bits: xorshift32 (Marsaglia, "Xorshift RNGs", 2003), which never leaves
    /// zero by itself.
    fn random(&mut self) -> u32 {
        let mut x = if self.executor.random == 0 { BITS_31 } else { self.executor.random };
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        self.executor.random = x;
        x & BITS_31
    }
}

/// Finds the parameter with a number in a bank.
#[inline(always)]
fn find<P: Product>(number: u8, bank: u8) -> Result<Global, Status> {
    let spec = P::SPEC;
    match bank {
        0 => spec.global.find(number).map(Global::Bank0).ok_or(Status::WrongType),
        2 => Ok(Global::Variable(number)),
        3 => {
            let found = Interrupt::find(number, spec.axes, spec.inputs);
            let row = found.and_then(|(numbered, _)| numbered.row.as_ref());
            row.map(|row| Global::Interrupt(number, row)).ok_or(Status::WrongType)
        }
        _ => Err(Status::InvalidValue),
    }
}

/// The slot of a user variable. What has none can be neither stored nor restored.
fn stored_variable<P: Product>(number: u8, bank: u8) -> Result<usize, Status> {
    match find::<P>(number, bank)? {
        Global::Variable(number) if usize::from(number) < STORED_USER_VARIABLES => {
            slots::<P>()?.variable(number).ok_or(Status::WrongType)
        }
        Global::Variable(_) | Global::Bank0(_) | Global::Interrupt(..) => Err(Status::WrongType),
    }
}
