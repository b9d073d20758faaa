//! The values that reading an object gives.

use super::address::Address;
use super::cia301::nmt::Nmt;
use super::drive::{Drive, Shown};
use super::entry::Entry;
use super::errors::Errors;
use super::live::Live;
use super::object::{Computed, Object};
use super::row::{Initial, Storage};
use super::settings::{PINS, Settings};
use super::tunnel::Tunnel;
use crate::device::{Circuit, Device};
use crate::executor::Product;

/// The value of an object that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Value {
    /// A number of up to 32 bits; a signed one is extended to them.
    Number(u32),
    /// A number of 64 bits.
    Long(u64),
    /// A text.
    Text(&'static str),
    /// The bytes of an octet string.
    Octets([u8; 7]),
}

/// The sources from which the objects are read.
pub(super) struct View<'a, T: Circuit<Product: Product>> {
    pub(super) device: &'a Device<T, 1>,
    pub(super) settings: &'a Settings,
    pub(super) live: &'a Live,
    pub(super) errors: &'a Errors,
    pub(super) drive: &'a Drive,
    pub(super) tunnel: &'a Tunnel,
    pub(super) address: Address,
    pub(super) state: Nmt,
    pub(super) manufacturer_mode: bool,
}

impl<T: Circuit<Product: Product>> View<'_, T> {
    /// Reads an object. What is measured is as the last turn has read it.
    pub(super) fn read(&self, entry: Entry) -> Value {
        let row = entry.row();
        if let Some(object) = row.computed {
            return self.compute(object);
        }
        match (row.storage, row.default) {
            (Storage::Computed, Initial::Text(text)) => Value::Text(text),
            (Storage::Computed, _) => Value::Number(row.default_number(entry.nth, self.address.node)),
            _ => Value::Number(self.settings.values.get(entry)),
        }
    }

    /// Returns a function that reads the number of an object of up to 32 bits; of any other object it reads 0.
    pub(super) fn reader(&self) -> impl Fn(Entry) -> u32 {
        |entry| match self.read(entry) {
            Value::Number(number) => number,
            Value::Long(_) | Value::Text(_) | Value::Octets(_) => 0,
        }
    }

    /// The value of an object that is no setting. Never inlined: reading the others is not to have its stack frame.
    #[inline(never)]
    fn compute(&self, object: Computed) -> Value {
        let View { device, settings, live, errors, drive, tunnel, .. } = self;
        Value::Number(match object {
            Computed::ErrorRegister => errors.register().into(),
            Computed::SaveAll
            | Computed::SaveCommunication
            | Computed::SaveMotor
            | Computed::RestoreAll
            | Computed::RestoreCommunication
            | Computed::RestoreMotor => u32::from(!device.store().is_unreachable()),
            Computed::OsCommand => return Value::Octets([0; _]),
            Computed::OsStatus => tunnel.status().into(),
            Computed::OsReply => return Value::Octets(tunnel.reply()),
            Computed::DirectCommunication => tunnel.is_open().into(),
            Computed::ManufacturerMode => self.manufacturer_mode.into(),
            Computed::BitRateInUse => self.address.bit_rate.into(),
            Computed::NodeIdInUse => self.address.node.into(),
            Computed::AccelerationDimension => settings.scale.acceleration_dimension(),
            Computed::ActualLoad => live.load.into(),
            Computed::DriverErrorFlags => driver_errors(live.flags, device.lacks_supply()),
            Computed::MicrostepResolutionDisplay => settings.of(Object::MicrostepResolution),
            Computed::StepCounterLow => live.way as u32,
            Computed::StepCounterHigh => (live.way >> 32) as u32,
            Computed::StepCounter => return Value::Long(live.way),
            Computed::DeviceInputs => u32::from(live.inputs) << PINS,
            Computed::AnalogInput => live.analog.into(),
            Computed::ErrorCode => errors.code().into(),
            Computed::Statusword => drive.statusword(&self.shown()),
            Computed::VelocityDemandVl => settings.of(Object::TargetVelocityVl),
            Computed::VelocityActualVl => {
                let speed = settings.scale.velocity_of(live.speed);
                speed.clamp(i16::MIN.into(), i16::MAX.into()) as u32
            }
            Computed::MaximumVelocityAmount => settings.of(Object::MaximumVelocity),
            Computed::DecelerationDeltaSpeed => settings.of(Object::AccelerationDeltaSpeed),
            Computed::ModeDisplay => drive.mode(),
            Computed::PositionDemand => live.position as u32,
            Computed::PositionActualInternal | Computed::PositionActual => {
                live.actual_position(&settings.values) as u32
            }
            Computed::VelocityActual => settings.scale.velocity_of(live.speed) as u32,
            Computed::ProfileDeceleration => settings.of(Object::ProfileAcceleration),
            Computed::HomeOffsetDisplay => drive.home_offset_used(),
            Computed::FollowingErrorActual => live.following_error() as u32,
            Computed::DigitalInputs => settings.switches().shown(live) | u32::from(live.inputs) << PINS,
        })
    }

    /// The part of the view that the statusword shows.
    fn shown(&self) -> Shown<'_, T> {
        let View { device, settings, live, errors, state, tunnel, .. } = *self;
        Shown { device, settings, live, errors, state, in_tmcl_mode: tunnel.is_open() }
    }
}

/// The driver's errors as 2102h has them, from the bits of axis parameter 208.
fn driver_errors(flags: u32, lacks_supply: bool) -> u32 {
    // Bits of 208: OT, OTPW, S2GA, S2GB, OLA, OLB; each with its bit of 2102h.
    const BITS: [(u32, u32); 6] = [(1, 7), (2, 6), (3, 0), (4, 1), (5, 2), (6, 3)];
    let bit = |(from, to)| (flags.unbounded_shr(from) & 1).unbounded_shl(to);
    BITS.into_iter().map(bit).fold(u32::from(lacks_supply) << 5, |all, bit| all | bit)
}
