//! The executor at work: all that a command can reach. What the commands do stands by subject in files of their own.

use super::{Executor, Product, Slots, Spec};
use crate::device::{Circuit, Device};
use crate::motion::Joined;
use crate::param::GlobalParameter as G;
use crate::tmcl::Status;
use crate::units::Micros;
use crate::vm::Machine;

/// An executor together with the device and the interpreter that its commands act on.
pub(crate) struct Commands<'a, T: Circuit, const AXES: usize> {
    /// The time.
    pub(super) now: Micros,
    /// Whoever owns the executor forbids that a motor is started.
    pub(super) barred: bool,
    pub(super) executor: &'a mut Executor<AXES>,
    pub(super) machine: &'a mut Machine,
    pub(super) device: &'a mut Device<T, AXES>,
}

impl<T: Circuit<Product: Product>, const AXES: usize> Commands<'_, T, AXES> {
    /// The specification of the product.
    pub(super) const SPEC: &'static Spec = T::Product::SPEC;

    /// An axis of the device.
    pub(super) fn axis(&mut self, number: u8) -> Result<Joined<'_, T::Hardware>, Status> {
        self.device.axis(number.into()).ok_or(Status::InvalidValue)
    }

    /// Refuses motion commands while no motor may move: the supply is too low, a motion controller is silent, or the
    /// owner of the executor forbids it.
    pub(super) const fn unlocked(&self) -> Result<(), Status> {
        if self.device.is_locked() || self.barred { Err(Status::NotAvailable) } else { Ok(()) }
    }

    /// Refuses to store anything, with status 5, while parameter 73 locks the EEPROM.
    pub(super) fn may_store(&self) -> Result<(), Status> {
        if self.executor.globals.get(G::EepromLock) != 0 { Err(Status::EepromLocked) } else { Ok(()) }
    }

    /// Has the store write a value to a slot of the EEPROM. Without a slot the command is refused with status 3, with a
    /// locked EEPROM with status 5.
    pub(super) fn keep(&mut self, slot: Option<usize>, value: i32) -> Result<(), Status> {
        self.may_store()?;
        self.put(slot, value)
    }

    /// As [`keep`](Self::keep), with a locked EEPROM as well.
    pub(super) fn put(&mut self, slot: Option<usize>, value: i32) -> Result<(), Status> {
        if slot.is_some_and(|slot| self.device.store_mut().set(slot, value)) { Ok(()) } else { Err(Status::WrongType) }
    }

    /// The value that the EEPROM holds in a slot. An EEPROM that does not answer gives status 5, no slot status 3.
    pub(super) fn recall(&self, slot: Option<usize>) -> Result<i32, Status> {
        if self.device.store().is_unreachable() {
            return Err(Status::EepromLocked);
        }
        slot.and_then(|slot| self.device.store().get(slot)).ok_or(Status::WrongType)
    }
}

/// The slots of the settings; status 5 where the EEPROM is another firmware's.
pub(super) const fn slots<P: Product>() -> Result<&'static Slots, Status> {
    match &P::SPEC.slots {
        Some(slots) => Ok(slots),
        None => Err(Status::EepromLocked),
    }
}
