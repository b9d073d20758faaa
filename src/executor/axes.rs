//! Commands to an axis: motion and axis parameters (manual sections 3.7.1 to 3.7.8, 3.7.24 to 3.7.27).

use super::commands::slots;
use super::{Commands, Outcome, Product};
use crate::device::Circuit;
use crate::motion::{self, Axis, Hardware, RampMode, Shape};
use crate::param::{AxisParameter, Parameter};
use crate::tmcl::{AxisSet, SEARCH_STATUS, Status};

impl From<motion::Error> for Status {
    fn from(error: motion::Error) -> Self {
        match error {
            motion::Error::ReadOnly => Status::WrongType,
            motion::Error::OutOfRange => Status::InvalidValue,
            motion::Error::NotNow | motion::Error::Chip => Status::NotAvailable,
        }
    }
}

impl<T: Circuit<Product: Product>, const AXES: usize> Commands<'_, T, AXES> {
    /// Rotates an axis and those of its group: ROR with a positive speed, ROL with a negative one, MST with zero; in
    /// the unit and the range of the parameter "target speed". `echo` is the value of the reply.
    pub(super) fn rotate(&mut self, axis: u8, speed: i32, echo: i32) -> Result<Outcome, Status> {
        let (lowest, highest) = const { T::Product::SPEC.speeds() };
        let limited = speed.clamp(lowest, highest);
        if limited != speed && !Self::SPEC.limits_speed {
            return Err(Status::InvalidValue);
        }
        let (now, speed) = (self.now, limited);
        if speed != 0 {
            self.unlocked()?;
        }
        let group = self.group(axis)?.bits;
        self.device.command(group, |device| device.tell_each(group, |axis| axis.rotate(now, speed)))?;
        Ok(Outcome::Moved { value: echo, ended: group, begun: 0 })
    }

    /// RFS: starts a reference search (0), stops it (1), or tells its leg (2). The first two are for the group of the
    /// axis.
    pub(super) fn reference_search(&mut self, kind: u8, axis: u8, echo: i32) -> Result<Outcome, Status> {
        let now = self.now;
        match kind {
            0 => {
                self.unlocked()?;
                let group = self.group(axis)?.bits;
                if AXES > 1 {
                    self.device.tell_each(group, |axis| axis.may_search())?;
                }
                self.device.command(group, |device| device.tell_each(group, |axis| axis.start_search(now)))?;
                Ok(Outcome::Moved { value: echo, ended: group, begun: group })
            }
            1 => {
                let group = self.group(axis)?.bits & self.searching();
                self.device.command(group, |device| device.tell_each(group, |axis| axis.stop_search(now)))?;
                Ok(Outcome::Moved { value: echo, ended: group, begun: 0 })
            }
            SEARCH_STATUS => Ok(Outcome::Read(self.axis(axis)?.state().search_status())),
            _ => Err(Status::WrongType),
        }
    }

    /// MVP: to a position (0), by a distance (1), or to a coordinate (2), for the group of the axis, or a set of axes.
    /// The reply carries the absolute target, that of the first axis where several move.
    pub(super) fn move_position(&mut self, kind: u8, motor: u8, value: i32) -> Result<Outcome, Status> {
        let now = self.now;
        let set = AxisSet::of(motor, AXES as u8).ok_or(Status::InvalidValue)?;
        let one = usize::from(motor) < AXES;
        let moving = if one { self.group(motor)? } else { set };
        let first = if one { motor } else { moving.first() };
        let mut targets = [None; AXES];
        for (axis, target) in (0..).zip(&mut targets).filter(|(axis, _)| moving.contains(*axis)) {
            *target = Some(match kind {
                0 if one => value,
                1 if one => self.base(axis)?.wrapping_add(value),
                2 => {
                    let number = u8::try_from(value).map_err(|_| Status::InvalidValue)?;
                    self.executor.coordinates.get(axis, number)?
                }
                0 | 1 => return Err(Status::InvalidValue),
                _ => return Err(Status::WrongType),
            });
        }
        let target = targets.get(usize::from(first)).copied().flatten().ok_or(Status::InvalidValue)?;
        self.unlocked()?;
        let searching = moving.bits & self.searching();
        self.device.command(moving.bits, |device| {
            if AXES == 1 || moving.bits.count_ones() == 1 {
                device.tell_each(moving.bits, |axis| axis.move_to(now, target))
            } else if moving.straight {
                device.start_interpolation(now, &targets)
            } else {
                device.start_together(now, &targets)
            }
        })?;
        Ok(Outcome::Moved { value: target, ended: searching, begun: moving.bits })
    }

    /// Where the distance of MVP REL counts from: the actual position, or, on products that leave it to a parameter,
    /// what this says.
    fn base(&mut self, axis: u8) -> Result<i32, Status> {
        let chosen = const { T::Product::SPEC.has(AxisParameter::RelativePositioning) };
        let mut axis = self.axis(axis)?;
        Ok(match axis.state().setting(AxisParameter::RelativePositioning) {
            0 if chosen => axis.read(AxisParameter::TargetPosition)?,
            2 if chosen => axis.read(AxisParameter::ChipEncoderPosition)?,
            _ => axis.actual_position()?,
        })
    }

    /// The axes that are on a reference search, axis n in bit n.
    fn searching(&self) -> u8 {
        let axes = (0..).zip(self.device.axes()).filter(|(_, axis)| axis.searches());
        axes.fold(0, |bits, (axis, _)| bits | 1_u8.unbounded_shl(axis))
    }

    /// The axes that have the group index (parameter 213) of an axis, itself among them; it alone if that is 0.
    fn group(&mut self, axis: u8) -> Result<AxisSet, Status> {
        if AXES == 1 {
            self.axis(axis)?;
        }
        let mut set = AxisSet::of(axis, AXES as u8).ok_or(Status::InvalidValue)?;
        if AXES > 1 {
            let index = |axis: &Axis<T::Hardware>| axis.setting(AxisParameter::GroupIndex);
            let group = self.device.axes().get(usize::from(axis)).map_or(0, index);
            let members = (0..).zip(self.device.axes()).filter(|(_, other)| group != 0 && index(other) == group);
            set.bits |= members.fold(0, |bits, (axis, _)| bits | 1_u8.unbounded_shl(axis));
        }
        Ok(set)
    }

    /// GAP: reads an axis parameter.
    pub(crate) fn get_axis(&mut self, number: u8, axis: u8) -> Result<i32, Status> {
        let parameter = parameter::<T::Product>(number)?;
        Ok(self.axis(axis)?.read(parameter.function)?)
    }

    /// SAP and AAP: sets an axis parameter. `echo` is the value of the reply.
    pub(super) fn set_axis(&mut self, number: u8, axis: u8, value: i32, echo: i32) -> Result<Outcome, Status> {
        let parameter = parameter::<T::Product>(number)?;
        let state = self.axis(axis)?;
        let (searched, rotates) = (state.state().searches(), state.state().takes_speed());
        let moves = match parameter.function {
            AxisParameter::TargetPosition | AxisParameter::RampMode => true,
            AxisParameter::TargetSpeed => rotates && value != 0,
            _ => false,
        };
        if moves {
            self.unlocked()?;
        }
        self.write_axis(axis, parameter, value)?;
        let travels_on = match parameter.function {
            AxisParameter::TargetPosition | AxisParameter::ActualPosition => false,
            AxisParameter::TargetSpeed => !rotates,
            AxisParameter::RampMode => value != RampMode::Velocity as i32 && !searched,
            _ => true,
        };
        let ended = if travels_on { 0 } else { 1_u8.unbounded_shl(axis.into()) };
        Ok(Outcome::Moved { value: echo, ended, begun: 0 })
    }

    /// STAP: stores an axis parameter in the EEPROM.
    pub(super) fn store_axis(&mut self, number: u8, axis: u8, echo: i32) -> Result<Outcome, Status> {
        let (parameter, slot) = stored_parameter::<T::Product>(number, axis)?;
        let value = self.axis(axis)?.read(parameter.function)?;
        self.keep(slot, value)?;
        Ok(Outcome::stored(echo))
    }

    /// RSAP: sets an axis parameter to its stored value.
    pub(super) fn restore_axis(&mut self, number: u8, axis: u8, echo: i32) -> Result<Outcome, Status> {
        let (parameter, slot) = stored_parameter::<T::Product>(number, axis)?;
        let value = self.recall(slot)?;
        self.write_axis(axis, parameter, value)?;
        Ok(Outcome::Value(echo))
    }

    /// The actual position of an axis, in microsteps, which CCO makes a coordinate.
    pub(super) fn position(&mut self, axis: u8) -> Result<i32, Status> {
        Ok(self.axis(axis)?.actual_position()?)
    }

    /// Writes a parameter of an axis. On a straight line the others have to keep up with a new speed or acceleration.
    /// One that gets other units, or another kind of ramps, is on it no longer.
    fn write_axis(&mut self, axis: u8, parameter: &Parameter<AxisParameter>, value: i32) -> Result<(), Status> {
        let (now, function, number) = (self.now, parameter.function, usize::from(axis));
        let former = self.axis(axis)?.state().setting(function);
        let bit = 1_u8.unbounded_shl(number as u32);
        let told = self.device.command(bit, |device| {
            device.tell_each(bit, |axis| axis.write(now, parameter, value))?;
            if AXES == 1 {
                Ok(())
            } else if <T::Hardware as Hardware>::Shape::RAMPS.contains(&function) {
                device.repace(number)
            } else if <T::Hardware as Hardware>::Shape::UNITS.contains(&function) || function == AxisParameter::RampMode
            {
                device.leave_interpolation(number)
            } else {
                Ok(())
            }
        });
        if AXES > 1 && told.is_err() {
            self.axis(axis)?.state_mut().preset_setting(function, former);
        }
        Ok(told?)
    }
}

/// The row of an axis parameter in the product's table.
fn parameter<P: Product>(number: u8) -> Result<&'static Parameter<AxisParameter>, Status> {
    P::SPEC.axis.find(number).ok_or(Status::WrongType)
}

/// The row of an axis parameter and its slot for an axis. A parameter without a slot can be neither stored nor
/// restored.
fn stored_parameter<P: Product>(
    number: u8,
    axis: u8,
) -> Result<(&'static Parameter<AxisParameter>, Option<usize>), Status> {
    let parameter = parameter::<P>(number)?;
    let slot = parameter.row.slot().ok_or(Status::WrongType)?;
    Ok((parameter, slots::<P>()?.axis(axis, slot)))
}
