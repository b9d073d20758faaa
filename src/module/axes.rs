//! Commands to an axis: motion, axis parameters, coordinates (manual sections 3.7.1 to 3.7.8, 3.7.24 to
//! 3.7.27).

use super::arrival::Arrivals;
use super::outcome::{Outcome, Undo};
use super::{Module, Platform, Product};
use crate::motion::{self, Axis, Events, Hardware, Joined, Mode};
use crate::param::{AxisParameter, COORDINATES, GlobalParameter as G, Parameter};
use crate::store::Need;
use crate::tmcl::{AxisSet, Command, Status};
use crate::units::Micros;
use crate::vm::ErrorFlag;

impl From<motion::Error> for Status {
    fn from(error: motion::Error) -> Self {
        match error {
            motion::Error::ReadOnly => Status::WrongType,
            motion::Error::OutOfRange => Status::InvalidValue,
            motion::Error::NotNow | motion::Error::Chip => Status::NotAvailable,
        }
    }
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Passes the events of an axis on: to the error flags, to the interrupts of the program, and to the host of
    /// command 138.
    pub(super) fn heed(&mut self, axis: u8, events: Events) {
        let Events { reached, at_target, stall, cut_short, deviation, alarm, at_switch, limit: _ } = events;
        if at_switch && let Ok(mut axis) = self.axis(axis) {
            axis.end_at_switch();
        }
        for (event, flag) in
            [(cut_short, ErrorFlag::Position), (deviation, ErrorFlag::Deviation), (alarm, ErrorFlag::Alarm)]
        {
            if event {
                self.machine.errors.raise(flag);
            }
        }
        if at_target {
            self.signals.reached(axis);
        }
        if stall {
            self.signals.stall(axis);
        }
        if deviation {
            self.signals.deviation(axis);
        }
        if reached {
            self.arrivals.arrive(axis);
        } else if cut_short || stall || deviation || alarm {
            self.arrivals.disarm(axis);
        }
    }

    /// Refuses motion commands while no motor may move: the supply is too low, a motion controller is silent, a
    /// heartbeat is missed, or the firmware around the module forbids it.
    fn unlocked(&self, now: Micros) -> Result<(), Status> {
        if self.device.is_locked() || self.heartbeat_missed(now) || self.is_barred() {
            Err(Status::NotAvailable)
        } else {
            Ok(())
        }
    }

    /// Rotates an axis and those of its group: ROR with a positive speed, ROL with a negative one, MST with zero; in
    /// the unit and the range of the parameter "target speed".
    pub(super) fn rotate(&mut self, now: Micros, axis: u8, speed: i32) -> Result<(), Status> {
        let (lowest, highest) = const { T::Product::SPEC.speeds() };
        let limited = speed.clamp(lowest, highest);
        if limited != speed && !self.spec().limits_speed {
            return Err(Status::InvalidValue);
        }
        let speed = limited;
        if speed != 0 {
            self.unlocked(now)?;
        }
        let group = self.group(axis)?;
        self.device.command(group.bits, |device| device.tell_each(group.bits, |axis| axis.rotate(now, speed)))?;
        self.each_of(group, Arrivals::disarm);
        Ok(())
    }

    /// RFS: starts a reference search (0), stops it (1), or tells its leg (2). The first two are for the group of the axis.
    pub(super) fn reference_search(&mut self, now: Micros, kind: u8, axis: u8, echo: i32) -> Result<Outcome, Status> {
        if kind == 0 {
            self.unlocked(now)?;
        }
        match kind {
            0 | 1 => {
                let mut group = self.group(axis)?;
                if kind == 0 && AXES > 1 {
                    self.device.tell_each(group.bits, |axis| axis.may_search())?;
                } else if kind != 0 {
                    group.bits &= self.searching();
                }
                self.device.command(group.bits, |device| {
                    device.tell_each(group.bits, |axis| match kind {
                        0 => axis.start_search(now),
                        _ => axis.stop_search(now),
                    })
                })?;
                self.each_of(group, Arrivals::disarm);
                if kind == 0 {
                    self.each_of(group, Arrivals::arm);
                }
            }
            2 => return Ok(Outcome::Read(self.axis(axis)?.search_status())),
            _ => return Err(Status::WrongType),
        }
        Ok(Outcome::Value(echo))
    }

    /// MVP: to a position (0), by a distance (1), or to a coordinate (2), for the group of the axis, or a set of axes. The
    /// reply carries the absolute target, that of the first axis where several move.
    pub(super) fn move_position(&mut self, now: Micros, command: Command) -> Result<Outcome, Status> {
        let Command { kind, motor, value, .. } = command;
        let set = AxisSet::of(motor, AXES as u8).ok_or(Status::InvalidValue)?;
        let one = usize::from(motor) < AXES;
        let moving = if one { self.group(motor)? } else { set };
        let first = if one { motor } else { moving.first() };
        let mut targets = [None; AXES];
        for (axis, target) in (0..).zip(&mut targets).filter(|(axis, _)| moving.contains(*axis)) {
            *target = Some(match kind {
                0 if one => value,
                1 if one => self.base(axis)?.wrapping_add(value),
                2 => self.coordinate(axis, u8::try_from(value).map_err(|_| Status::InvalidValue)?)?,
                0 | 1 => return Err(Status::InvalidValue),
                _ => return Err(Status::WrongType),
            });
        }
        let target = targets.get(usize::from(first)).copied().flatten().ok_or(Status::InvalidValue)?;
        self.unlocked(now)?;
        let searching = AxisSet { bits: moving.bits & self.searching(), ..moving };
        self.device.command(moving.bits, |device| {
            if AXES == 1 || moving.bits.count_ones() == 1 {
                device.tell_each(moving.bits, |axis| axis.move_to(now, target))
            } else if moving.straight {
                device.start_line(now, &targets)
            } else {
                device.start_together(now, &targets)
            }
        })?;
        self.each_of(searching, Arrivals::disarm);
        self.each_of(moving, Arrivals::arm);
        Ok(Outcome::Value(target))
    }

    /// Where the distance of MVP REL counts from: the actual position, or, on products that leave it to a parameter,
    /// what this says.
    fn base(&mut self, axis: u8) -> Result<i32, Status> {
        let chosen = const { T::Product::SPEC.has(AxisParameter::RelativePositioning) };
        let mut axis = self.axis(axis)?;
        Ok(match axis.setting(AxisParameter::RelativePositioning) {
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

    /// Notes something of the arrivals of each axis of a set.
    fn each_of(&mut self, set: AxisSet, note: impl Fn(&mut Arrivals, u8)) {
        (0..AXES as u8).filter(|axis| set.contains(*axis)).for_each(|axis| note(&mut self.arrivals, axis));
    }

    /// GAP: reads an axis parameter.
    pub(super) fn get_axis(&mut self, number: u8, axis: u8) -> Result<i32, Status> {
        let parameter = self.parameter(number)?;
        Ok(self.axis(axis)?.read(parameter.function)?)
    }

    /// SAP and AAP: sets an axis parameter. `echo` is the value of the reply.
    pub(super) fn set_axis(
        &mut self,
        now: Micros,
        number: u8,
        axis: u8,
        value: i32,
        echo: i32,
    ) -> Result<Outcome, Status> {
        let parameter = self.parameter(number)?;
        let state = self.axis(axis)?;
        let (searched, rotates) = (state.searches(), state.takes_speed());
        let moves = match parameter.function {
            AxisParameter::TargetPosition | AxisParameter::RampMode => true,
            AxisParameter::TargetSpeed => rotates && value != 0,
            _ => false,
        };
        if moves {
            self.unlocked(now)?;
        }
        self.write_axis(now, axis, parameter, value)?;
        let travels_on = match parameter.function {
            AxisParameter::TargetPosition | AxisParameter::ActualPosition => false,
            AxisParameter::TargetSpeed => !rotates,
            AxisParameter::RampMode => value != Mode::Velocity as i32 && !searched,
            _ => true,
        };
        if !travels_on {
            self.arrivals.disarm(axis);
        }
        Ok(Outcome::Value(echo))
    }

    /// STAP: stores an axis parameter in the EEPROM.
    pub(super) fn store_axis(&mut self, number: u8, axis: u8, echo: i32) -> Result<Outcome, Status> {
        let (parameter, slot) = self.stored_parameter(number, axis)?;
        let value = self.axis(axis)?.read(parameter.function)?;
        self.keep(slot, value)?;
        Ok(Outcome::stored(echo))
    }

    /// RSAP: sets an axis parameter to its stored value.
    pub(super) fn restore_axis(&mut self, now: Micros, number: u8, axis: u8, echo: i32) -> Result<Outcome, Status> {
        let (parameter, slot) = self.stored_parameter(number, axis)?;
        let value = self.recall(slot)?;
        self.write_axis(now, axis, parameter, value)?;
        Ok(Outcome::Value(echo))
    }

    /// SCO, CCO and ACO: sets a coordinate of one axis, in microsteps, in RAM, and in the EEPROM where parameter 84
    /// says so.
    pub(super) fn set_coordinate(&mut self, number: u8, axis: u8, value: i32, echo: i32) -> Result<Outcome, Status> {
        let number = coordinate(number)?;
        let before = core::mem::replace(self.coordinate_cell(axis, number)?, value);
        if self.global(G::CoordinateStorage) != 0 {
            // Coordinate 0 has no slot in the EEPROM.
            if number > 0 {
                self.keep(self.spec().slots.coordinate(axis, number), value)?;
            }
            let undo = Some(Undo { axis, number, value: before });
            return Ok(Outcome::Stored { value: echo, need: Need::Settings, undo });
        }
        Ok(Outcome::Value(echo))
    }

    /// GCO: a coordinate of one axis, in microsteps.
    pub(super) fn coordinate(&mut self, axis: u8, number: u8) -> Result<i32, Status> {
        let number = coordinate(number)?;
        Ok(*self.coordinate_cell(axis, number)?)
    }

    /// SCO with motor 255: stores one coordinate of each axis, or, with number 0, all of them.
    pub(super) fn store_coordinates(&mut self, number: u8, echo: i32) -> Result<Outcome, Status> {
        for (axis, number) in selection::<AXES>(number)? {
            let value = *self.coordinate_cell(axis, number)?;
            self.keep(self.spec().slots.coordinate(axis, number), value)?;
        }
        Ok(Outcome::stored(echo))
    }

    /// GCO with motor 255: restores one stored coordinate of each axis, or, with number 0, all of them.
    pub(super) fn restore_coordinates(&mut self, number: u8, echo: i32) -> Result<Outcome, Status> {
        for (axis, number) in selection::<AXES>(number)? {
            let value = self.recall(self.spec().slots.coordinate(axis, number))?;
            *self.coordinate_cell(axis, number)? = value;
        }
        Ok(Outcome::Value(echo))
    }

    /// The actual position of an axis, in microsteps, which CCO makes a coordinate.
    pub(super) fn position(&mut self, axis: u8) -> Result<i32, Status> {
        Ok(self.axis(axis)?.actual_position()?)
    }

    /// Writes a parameter of an axis. On a straight line the others have to keep up with a new speed or acceleration; and one
    /// that gets other units, or another kind of ramps, is on it no longer.
    fn write_axis(
        &mut self,
        now: Micros,
        axis: u8,
        parameter: &Parameter<AxisParameter>,
        value: i32,
    ) -> Result<(), Status> {
        let (function, number) = (parameter.function, usize::from(axis));
        let former = self.axis(axis)?.setting(function);
        let bit = 1_u8.unbounded_shl(number as u32);
        let told = self.device.command(bit, |device| {
            device.tell_each(bit, |axis| axis.write(now, parameter, value))?;
            if AXES == 1 {
                Ok(())
            } else if T::Hardware::RAMPS.contains(&function) {
                device.repace(number)
            } else if T::Hardware::UNITS.contains(&function) || function == AxisParameter::RampMode {
                device.leave_line(number)
            } else {
                Ok(())
            }
        });
        if AXES > 1 && told.is_err() {
            self.axis(axis)?.preset_setting(function, former);
        }
        Ok(told?)
    }

    /// The row of an axis parameter in the product's table.
    fn parameter(&self, number: u8) -> Result<&'static Parameter<AxisParameter>, Status> {
        self.spec().axis.find(number).ok_or(Status::WrongType)
    }

    /// The row of an axis parameter and its slot for an axis. A parameter without a slot can be neither stored nor
    /// restored.
    fn stored_parameter(
        &self,
        number: u8,
        axis: u8,
    ) -> Result<(&'static Parameter<AxisParameter>, Option<usize>), Status> {
        let parameter = self.parameter(number)?;
        let slot = parameter.row.slot().ok_or(Status::WrongType)?;
        Ok((parameter, self.spec().slots.axis(axis, slot)))
    }

    fn axis(&mut self, number: u8) -> Result<Joined<'_, T::Hardware>, Status> {
        self.device.axis(number.into()).ok_or(Status::InvalidValue)
    }

    /// A coordinate of an axis in RAM, in microsteps.
    pub(super) fn coordinate_cell(&mut self, axis: u8, number: u8) -> Result<&mut i32, Status> {
        let of_axis = self.coordinates.get_mut(usize::from(axis)).ok_or(Status::InvalidValue)?;
        of_axis.get_mut(usize::from(number)).ok_or(Status::InvalidValue)
    }
}

/// Checks the number of a coordinate.
fn coordinate(number: u8) -> Result<u8, Status> {
    if usize::from(number) < COORDINATES { Ok(number) } else { Err(Status::InvalidValue) }
}

/// The coordinates, as axis and number, that a command with motor 255 means: one of 1..=20, or all of them by 0, of
/// every axis.
fn selection<const AXES: usize>(number: u8) -> Result<impl Iterator<Item = (u8, u8)>, Status> {
    let (first, last) = match coordinate(number)? {
        0 => (1, (COORDINATES as u8).saturating_sub(1)),
        one => (one, one),
    };
    Ok((0..AXES as u8).flat_map(move |axis| (first..=last).map(move |number| (axis, number))))
}
