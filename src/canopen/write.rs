//! The effects of writing an object, and what an SDO and a PDO ask for.

use core::task::Poll;

use super::Node;
use super::cia301::abort::Abort;
use super::cia301::pdo::Carried;
use super::cia301::record::{Direction, Field};
use super::cia301::{Access, Map, cob};
use super::drive::unit::INTERNAL;
use super::drive::{Drive, State, encoder};
use super::entry::Entry;
use super::errors::Emergency;
use super::object::{Object, Row, Special, Writing};
use super::row::When;
use super::store::{Group, load_defaults};
use super::tunnel::COMMAND;
use crate::device::Circuit;
use crate::executor::Product;

/// `save`, written to 1010h and 2706h.
const SAVE: u32 = u32::from_le_bytes(*b"save");
/// `load`, written to 1011h.
const LOAD: u32 = u32::from_le_bytes(*b"load");
/// `make`, written to 2700h and 2701h.
const MAKE: u32 = u32::from_le_bytes(*b"make");
/// `kill`, written to 2701h.
const KILL: u32 = u32::from_le_bytes(*b"kill");

/// The object that an SDO names. The manual's table has 2706h at sub-index 0, its text at sub-index 1: four bytes that
/// are written to the former are for the latter.
#[inline(always)]
pub(super) fn named(index: u16, sub: u8, written: Option<u32>) -> Result<Entry, Abort> {
    let entry = Entry::find(index, sub)?;
    let is_count = entry.object == Object::StoreCount && written == Some(4);
    Ok(if is_count { Entry::of(Object::StoreCommunication) } else { entry })
}

/// Checks a value against the ranges of a row.
fn check(row: &Row, number: i64) -> Result<(), Abort> {
    match row.ranges {
        _ if row.accepts(number) => Ok(()),
        [(low, high)] if low < high => Err(if number < *low { Abort::TooLow } else { Abort::TooHigh }),
        _ => Err(Abort::Value),
    }
}

impl<T: Circuit<Product: Product>> Node<T> {
    /// Writes the bytes of an SDO to an object. Pending while they are being saved.
    ///
    /// # Errors
    /// They are refused, and nothing has changed.
    pub(super) fn download(&mut self, entry: Entry, data: [u8; 8]) -> Result<Poll<()>, Abort> {
        let [a, b, c, d, ..] = data;
        if entry.object == Object::OsCommand {
            let [command @ .., _] = data;
            return self.execute(command).map(Poll::Ready);
        }
        self.write(entry, entry.row().data.extend(u32::from_le_bytes([a, b, c, d])))
    }

    /// Writes the objects of PDOs that were received together, in their order, but the controlword last: it acts upon
    /// the others. Each value is refused for itself.
    pub(super) fn carry_out(&mut self, pdos: &[Carried<Entry>]) {
        if self.tunnel.is_open() {
            return self.raise(Emergency::Refused);
        }
        let mut refused = false;
        for last in [false, true] {
            for (map, data) in pdos {
                for (entry, number) in map.unpacked(*data) {
                    if (entry.object == Object::Controlword) == last {
                        refused |= self.write(entry, entry.row().data.extend(number)).is_err();
                    }
                }
            }
        }
        if refused {
            self.raise(Emergency::Refused);
        }
    }

    /// Writes a number, as [`Type::extend`](super::Type::extend) gives it, to an object. Pending while it is being
    /// saved.
    ///
    /// # Errors
    /// The value is refused, and nothing has changed.
    fn write(&mut self, entry: Entry, value: u32) -> Result<Poll<()>, Abort> {
        let row = entry.row();
        let counts = matches!(row.writing, Writing::Record(_, Field::Count));
        if !counts {
            check(row, row.data.value(value))?;
        }
        if row.access == Access::Ro {
            return Err(Abort::ReadOnly);
        }
        if row.when == When::Disabled && !self.is_disabled() {
            return Err(Abort::State);
        }
        let Node { now, device, settings, services, .. } = self;
        services.pdos.touched = true;
        match row.writing {
            Writing::Plain => settings.values.set(entry, value),
            Writing::Axis(..) => settings.write_parameter(*now, device, entry, value)?,
            Writing::Scaled(_) => {
                let is_disabled = self.is_disabled();
                self.settings.write_scaled(self.now, &mut self.device, is_disabled, entry, value)?;
            }
            Writing::Record(direction, field) => self.write_record(direction, field, entry, value)?,
            Writing::Special(object) => {
                if self.write_special(object, entry, value)? == Poll::Pending {
                    return Ok(Poll::Pending);
                }
            }
        }
        self.lost.written(entry);
        Ok(Poll::Ready(()))
    }

    /// True while settings can be written that change only in SWITCH ON DISABLED: in TMCL mode the motor may move then.
    /// The bridges are off, too, in the FAULT that settings have led to which are lost; there a master writes its list.
    fn is_disabled(&self) -> bool {
        match self.drive.state() {
            State::SwitchOnDisabled => !self.tunnel.is_open(),
            State::Fault => self.errors.tell_of_lost_settings(),
            _ => false,
        }
    }

    /// Writes to a PDO's record. Bit 30 of a COB-ID may be written either way and reads 1.
    fn write_record(&mut self, direction: Direction, field: Field, entry: Entry, value: u32) -> Result<(), Abort> {
        let kept = if field == Field::CobId { value | cob::BIT_30 } else { value };
        let Node { now, settings, services, manufacturer_mode, .. } = self;
        let values = &mut settings.values;
        let (old, before) = (values.get(entry), values.record(direction, entry.nth));
        values.set(entry, kept);
        let after = values.record(direction, entry.nth);
        let map = Map::admitted(direction, field, (&before, &after), value, *manufacturer_mode, Entry::described)
            .inspect_err(|_| values.set(entry, old))?;
        if old != kept || field == Field::Entry {
            self.filters_changed |= services.pdos.change(*now, (direction, entry.nth), field, &after, map);
        }
        Ok(())
    }

    /// Writes an object that does something of its own.
    fn write_special(&mut self, object: Special, entry: Entry, value: u32) -> Result<Poll<()>, Abort> {
        let Node { now, device, settings, services, drive, .. } = self;
        let values = &mut settings.values;
        match object {
            Special::SaveAll => return self.keep(value, SAVE, Group::All),
            Special::SaveMotor => return self.keep(value, SAVE, Group::Motor),
            Special::SaveCommunication | Special::StoreCommunication => {
                return self.keep(value, SAVE, Group::Communication);
            }
            Special::RestoreAll => return self.keep(value, LOAD, Group::All),
            Special::RestoreMotor => return self.keep(value, LOAD, Group::Motor),
            Special::RestoreCommunication => return self.keep(value, LOAD, Group::Communication),
            // Its seven bytes are no number.
            Special::OsCommand => return Err(Abort::State),
            // The bridges would come on, with values that nobody has chosen.
            Special::DirectCommunication if value == MAKE && !self.lost.is_empty() => return Err(Abort::State),
            Special::DirectCommunication if value == MAKE => self.enter_tmcl_mode(),
            Special::DirectCommunication => return Err(Abort::Value),
            Special::ManufacturerMode => {
                self.manufacturer_mode = match value {
                    MAKE => true,
                    KILL => false,
                    _ => return Err(Abort::Value),
                };
            }
            Special::SyncCobId => {
                values.set(entry, cob::sync(value)?);
                self.filters_changed = true;
            }
            Special::EmergencyCobId => {
                cob::emergency(value)?;
                // The identifier changes only while the messages are off.
                let old = values.get(entry);
                if old & cob::OFF == 0 && cob::can_id(old) != cob::can_id(value) {
                    return Err(Abort::State);
                }
                values.set(entry, value);
            }
            Special::ConsumerHeartbeatTime if value >> 24 != 0 => return Err(Abort::Value),
            Special::ConsumerHeartbeatTime => {
                values.set(entry, value);
                services.control.restart_master();
                self.filters_changed = true;
            }
            Special::ProducerHeartbeatTime => {
                values.set(entry, value);
                services.control.restart_heartbeat();
            }
            Special::GuardTime | Special::LifeTimeFactor => {
                values.set(entry, value);
                services.control.restart_guarding();
            }
            Special::MaximumVelocity => {
                settings.write_largest(*now, device, entry, value, settings.scale.largest_velocity())?;
            }
            Special::MaximumAcceleration => {
                settings.write_largest(*now, device, entry, value, settings.scale.largest_acceleration())?;
            }
            Special::VelocityDimension => settings.write_dimension(*now, device, entry, value)?,
            Special::HomingMethod | Special::SensorSelection | Special::FollowingErrorWindow => {
                encoder::check(device, entry.object, value)?;
                values.set(entry, value);
            }
            Special::TargetVelocityVl if settings.scale.is_internal() && !is_internal(value) => {
                return Err(if (value as i32) < 0 { Abort::TooLow } else { Abort::TooHigh });
            }
            Special::TargetVelocityVl | Special::TargetVelocity => {
                values.set(entry, value);
                self.command(Drive::steer);
            }
            Special::ModeOfOperation => {
                values.set(entry, value);
                self.command(|drive, plant| drive.change_mode(plant, value));
            }
            Special::Controlword if self.tunnel.is_open() => return Err(Abort::State),
            Special::Controlword => {
                values.set(entry, value);
                self.command(|drive, plant| drive.obey(plant, value as u16));
            }
            Special::PhysicalOutputs
            | Special::OutputMask
            | Special::BrakeApplyCurrent
            | Special::BrakeReleaseCurrent => {
                values.set(entry, value);
                settings.switch_outputs(device, drive.has_released_brake());
            }
            Special::LimitSwitches => {
                values.set(entry, value);
                settings.switches().tell(device);
            }
            Special::PullUps => {
                values.set(entry, value);
                settings.switch_pull_ups(device);
            }
        }
        Ok(Poll::Ready(()))
    }

    /// Saves or restores a group, as the object asks for whose signature is given, if that is the value that was
    /// written. Not while a store is under way whose master has given it up: its values must not mix with others.
    #[inline(never)]
    fn keep(&mut self, value: u32, signature: u32, group: Group) -> Result<Poll<()>, Abort> {
        let (node, store) = (self.identity.address.node, self.device.store_mut());
        if value != signature {
            return Err(Abort::Signature);
        }
        if store.is_storing() {
            return Err(Abort::State);
        }
        let values = &self.settings.values;
        // A node whose number the EEPROM has lost keeps it, whatever is saved or restored besides it.
        if self.lost.address && group == Group::Motor {
            let _ = values.save(store, Group::Communication, node);
        }
        Ok(if signature == SAVE { values.save(store, group, node) } else { load_defaults(store, group) })
    }

    /// Enters TMCL mode; in TMCL mode nothing changes.
    fn enter_tmcl_mode(&mut self) {
        if !self.tunnel.is_open() {
            self.tunnel.open(self.now, self.settings.switches().inversion());
            self.command(Drive::yield_motor);
        }
    }

    /// Executes a command of TMCL mode. Until the brake is released, and while there is the cause of a fault, it starts
    /// no motion.
    ///
    /// # Errors
    /// [`Abort::State`] outside TMCL mode.
    fn execute(&mut self, command: [u8; COMMAND]) -> Result<(), Abort> {
        let barred = !self.drive.is_lasting() || self.errors.holds_fault();
        let Node { now, device, tunnel, identity, .. } = self;
        tunnel.execute(*now, device, (identity.address.node, barred), command)
    }
}

/// True for a velocity that fits the motion controller's internal units.
const fn is_internal(velocity: u32) -> bool {
    (velocity as i32).unsigned_abs() <= INTERNAL
}
