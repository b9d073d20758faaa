//! Global parameters: banks 0, 2 and 3, and storing them (manual chapter 5).

use super::outcome::Outcome;
use super::{Module, Platform, Spec};
use crate::device::Inversion;
use crate::motion;
use crate::param::{COORDINATES, GlobalParameter as G, Interrupt, Parameter, Row, Storage};
use crate::store::{Memory, Store};
use crate::tmcl::Status;
use crate::units::Micros;

/// The tick timer and random numbers have 31 bits (manual section 5.1, parameters 132 and 133).
const BITS_31: u32 = 0x7FFF_FFFF;

/// The parameter that a number and a bank stand for.
enum Global {
    Bank0(&'static Parameter<G>),
    Variable(u8),
    /// The setting, in bank 3, of the interrupt that has the same number.
    Interrupt(u8, &'static Row),
}

/// The value that the store has for a slot; `None` without a slot.
fn stored<M: Memory>(store: &Store<M>, slot: Option<usize>) -> Option<i32> {
    store.get(slot?)
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

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Finds the parameter with a number in a bank. Inlined, because the way to a reply is then so many lines of flash memory
    /// shorter that GGP takes 34 cycles less, and waits for the flash 73 cycles less.
    #[inline(always)]
    fn find_global(&self, number: u8, bank: u8) -> Result<Global, Status> {
        let spec = self.spec();
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

    /// The value of a parameter of bank 0, as it was set last.
    pub(super) fn global(&self, parameter: G) -> i32 {
        self.globals.get(parameter.index()).copied().unwrap_or_default()
    }

    pub(super) fn set_global_value(&mut self, parameter: G, value: i32) {
        if let Some(cell) = self.globals.get_mut(parameter.index()) {
            *cell = value;
            self.link_settings_stale = true;
        }
    }

    /// GGP.
    pub(super) fn get_global(&mut self, now: Micros, number: u8, bank: u8) -> Result<i32, Status> {
        Ok(match self.find_global(number, bank)? {
            Global::Bank0(parameter) => match parameter.function {
                G::TickTimer => self.tick_timer(now).cast_signed(),
                G::RandomNumber => self.random().cast_signed(),
                G::ApplicationStatus => self.machine.state() as i32,
                G::DownloadMode => self.device.store().downloading().is_some().into(),
                G::ProgramCounter => self.machine.counter().into(),
                setting => self.global(setting),
            },
            Global::Variable(number) => self.variables.get(usize::from(number)).copied().unwrap_or_default(),
            Global::Interrupt(number, _) => self.machine.interrupts.setting(number),
        })
    }

    /// SGP, AGP. `echo` is the reply's value.
    pub(super) fn set_global(
        &mut self,
        now: Micros,
        number: u8,
        bank: u8,
        value: i32,
        echo: i32,
    ) -> Result<Outcome, Status> {
        match self.find_global(number, bank)? {
            Global::Bank0(Parameter { function, row }) => {
                check(row, value)?;
                if self.spec().guest && matches!(row.storage, Storage::Automatic(_)) {
                    return Err(Status::EepromLocked);
                }
                match *function {
                    // Taking the read protection off erases the program; not while a link downloads one.
                    G::CodeProtection if self.uncovers(value) && self.device.store().downloading().is_some() => {
                        return Err(Status::NotAvailable);
                    }
                    G::CodeProtection if self.uncovers(value) => {
                        // The protection ends only when the program is erased, so that a power cut never shows it.
                        self.machine.stop();
                        if let Some(protection) = self.device.store_mut().erase(value) {
                            self.set_global_value(G::CodeProtection, protection);
                        }
                        return Ok(Outcome::written(echo));
                    }
                    G::TickTimer => self.tick_offset = (now.millis() as u32).wrapping_sub(value.cast_unsigned()),
                    G::RandomNumber => self.random = value.cast_unsigned(),
                    polarity @ (G::EndSwitchPolarity | G::ReverseShaft) => self.set_interface(polarity, value)?,
                    setting => {
                        self.set_global_value(setting, value);
                        self.supervision.limit(now, setting);
                    }
                }
                if let Storage::Automatic(slot) = row.storage {
                    self.keep(Some(slot.into()), value)?;
                    return Ok(Outcome::stored(echo));
                }
            }
            Global::Variable(number) => {
                if let Some(cell) = self.variables.get_mut(usize::from(number)) {
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

    /// STGP: user variables only; of bank 0 SGP itself stores what can be stored.
    pub(super) fn store_global(&mut self, number: u8, bank: u8, echo: i32) -> Result<Outcome, Status> {
        let slot = self.stored_variable(number, bank)?;
        let value = self.variables.get(usize::from(number)).copied().unwrap_or_default();
        self.keep(Some(slot), value)?;
        Ok(Outcome::stored(echo))
    }

    /// RSGP.
    pub(super) fn restore_global(&mut self, number: u8, bank: u8, echo: i32) -> Result<Outcome, Status> {
        let slot = self.stored_variable(number, bank)?;
        let value = self.recall(Some(slot))?;
        if let Some(cell) = self.variables.get_mut(usize::from(number)) {
            *cell = value;
        }
        Ok(Outcome::Value(echo))
    }

    /// Refuses what would be stored in an EEPROM that is another firmware's, with status 5.
    pub(super) fn may_store(&self) -> Result<(), Status> {
        if self.spec().guest { Err(Status::EepromLocked) } else { Ok(()) }
    }

    /// Has the store write a value to a slot of the EEPROM; without a slot the command is refused with status 3.
    pub(super) fn keep(&mut self, slot: Option<usize>, value: i32) -> Result<(), Status> {
        self.may_store()?;
        if slot.is_some_and(|slot| self.device.store_mut().set(slot, value)) { Ok(()) } else { Err(Status::WrongType) }
    }

    /// The value that the EEPROM holds in a slot. An EEPROM that does not answer gives status 5, no slot status 3.
    pub(super) fn recall(&self, slot: Option<usize>) -> Result<i32, Status> {
        self.may_store()?;
        if self.device.store().is_unreachable() {
            return Err(Status::EepromLocked);
        }
        slot.and_then(|slot| self.device.store().get(slot)).ok_or(Status::WrongType)
    }

    fn stored_variable(&self, number: u8, bank: u8) -> Result<usize, Status> {
        match self.find_global(number, bank)? {
            Global::Variable(number) => self.spec().slots.variable(number).ok_or(Status::WrongType),
            Global::Bank0(_) | Global::Interrupt(..) => Err(Status::WrongType),
        }
    }

    /// Changes switch polarity (79) or shaft direction (90). If the motion controller does not take the datagram, the
    /// parameter and the shadow registers of the chip driver go back to the value before.
    fn set_interface(&mut self, parameter: G, value: i32) -> Result<(), Status> {
        let before = self.global(parameter);
        self.set_global_value(parameter, value);
        self.apply_polarity_and_direction().map_err(|error| {
            self.set_global_value(parameter, before);
            let _ = self.apply_polarity_and_direction();
            error.into()
        })
    }

    /// Writes switch polarity (79) and shaft direction (90) to the motion controllers.
    pub(super) fn apply_polarity_and_direction(&mut self) -> Result<(), motion::Error> {
        self.device.invert(self.inversion())
    }

    /// Switch polarity (79) and shaft direction (90): bit n of each parameter is for motion controller n.
    pub(super) fn inversion(&self) -> Inversion {
        Inversion { switches: self.global(G::EndSwitchPolarity) as u8, shafts: self.global(G::ReverseShaft) as u8 }
    }

    /// At the start: takes from the store everything that is to be restored.
    pub(super) fn restore(&mut self) {
        self.reload_globals();
        let Spec { axis: table, slots, .. } = self.spec();
        if self.global(G::DoNotRestoreVariables) == 0 {
            for (number, variable) in (0..=u8::MAX).zip(&mut self.variables) {
                *variable = stored(self.device.store(), slots.variable(number)).unwrap_or_default();
            }
        }
        let coordinates = self.global(G::CoordinateStorage) != 0;
        for (axis, cells) in (0..=u8::MAX).zip(&mut self.coordinates) {
            for parameter in table.rows {
                let slot = parameter.row.slot().and_then(|slot| slots.axis(axis, slot));
                if let Some(value) = stored(self.device.store(), slot) {
                    self.device.preset(axis.into(), parameter, value);
                }
            }
            if coordinates {
                for (number, cell) in (0..COORDINATES as u8).zip(cells) {
                    *cell = stored(self.device.store(), slots.coordinate(axis, number)).unwrap_or_default();
                }
            }
        }
    }

    /// Takes the stored parameters of bank 0 from the store.
    pub(super) fn reload_globals(&mut self) {
        for Parameter { function, row } in self.spec().global.rows {
            let value = row.slot().and_then(|slot| self.device.store().get(slot.into()));
            if let Some(value) = value.filter(|value| row.accepts(*value)) {
                self.set_global_value(*function, value);
            }
        }
    }

    fn tick_timer(&self, now: Micros) -> u32 {
        (now.millis() as u32).wrapping_sub(self.tick_offset) & BITS_31
    }

    /// The next random number, 31 bits: xorshift32 (Marsaglia, "Xorshift RNGs", 2003), which never leaves
    /// zero by itself.
    fn random(&mut self) -> u32 {
        let mut x = if self.random == 0 { BITS_31 } else { self.random };
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        self.random = x;
        x & BITS_31
    }
}
