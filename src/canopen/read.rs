//! What reading an object gives.

use super::Node;
use super::drive::unit::Scale;
use super::object::{Entry, Object};
use super::row::Initial;
use super::store::Tmcm1140;
use crate::device::Board;

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

/// The general purpose pins stand from this bit on in 2702h, 2703h and 60FDh.
pub(super) const PINS: u32 = 16;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Reads an object. What is measured is as the last turn has read it.
    pub(super) fn read(&self, entry: Entry) -> Value {
        let live = &self.live;
        Value::Number(match entry.object {
            Object::DeviceName | Object::HardwareVersion | Object::SoftwareVersion => {
                return match entry.row().default {
                    Initial::Text(text) => Value::Text(text),
                    _ => Value::Text(""),
                };
            }
            Object::ErrorRegister => self.errors.register().into(),
            Object::SaveAll
            | Object::SaveCommunication
            | Object::SaveMotor
            | Object::RestoreAll
            | Object::RestoreCommunication
            | Object::RestoreMotor => u32::from(!self.device.store().is_unreachable()),
            Object::OsCommand => return Value::Octets([0; _]),
            Object::OsStatus => self.tunnel.status.into(),
            Object::OsReply => return Value::Octets(self.tunnel.reply),
            Object::DirectCommunication => self.tunnel.in_tmcl_mode().into(),
            Object::ManufacturerMode => self.manufacturer_mode.into(),
            Object::BitRateInUse => self.bit_rate.into(),
            Object::NodeIdInUse => self.node.into(),
            Object::AccelerationDimension => self.scale.acceleration_dimension(),
            Object::ActualLoad => live.load.into(),
            Object::DriverErrorFlags => driver_errors(live.flags, self.device.lacks_supply()),
            Object::MicrostepResolutionDisplay => self.values.of_object(Object::MicrostepResolution),
            Object::StepCounterLow => self.way as u32,
            Object::StepCounterHigh => (self.way >> 32) as u32,
            Object::StepCounter => return Value::Long(self.way),
            Object::DeviceInputs => u32::from(live.inputs) << PINS,
            Object::AnalogInput => live.analog.into(),
            Object::ErrorCode => self.errors.code().into(),
            Object::Statusword => self.statusword(),
            Object::VelocityDemandVl => self.values.of_object(Object::TargetVelocityVl),
            Object::VelocityActualVl => {
                let speed = self.scale.velocity_of(live.speed);
                speed.clamp(i16::MIN.into(), i16::MAX.into()) as u32
            }
            Object::MaximumVelocityAmount => self.values.of_object(Object::MaximumVelocity),
            Object::DecelerationDeltaSpeed => self.values.of_object(Object::AccelerationDeltaSpeed),
            Object::ModeDisplay => self.drive.motion.mode as u32,
            Object::PositionDemand => live.position as u32,
            Object::PositionActualInternal | Object::PositionActual => self.actual_position() as u32,
            Object::VelocityActual => self.scale.velocity_of(live.speed) as u32,
            Object::ProfileDeceleration => self.values.of_object(Object::ProfileAcceleration),
            Object::HomeOffsetDisplay => self.home_offset_display(),
            Object::FollowingErrorActual => self.following_error() as u32,
            Object::DigitalInputs => self.switches() | u32::from(live.inputs) << PINS,
            Object::DeviceType
            | Object::SaveCount
            | Object::RestoreCount
            | Object::ConsumerHeartbeatCount
            | Object::IdentityCount
            | Object::VendorId
            | Object::ProductCode
            | Object::RevisionNumber
            | Object::OsCommandCount
            | Object::ErrorBehaviourCount
            | Object::ReceiveCount
            | Object::TransmitCount
            | Object::TransmitCompatibility
            | Object::BrakeDelayCount
            | Object::EncoderCount
            | Object::BrakeCurrentCount
            | Object::StepCounterCount
            | Object::OutputCount
            | Object::StoreCount
            | Object::StoreCommunication
            | Object::AnalogCount
            | Object::VelocityAmountCount
            | Object::MinimumVelocityAmount
            | Object::AccelerationVlCount
            | Object::AccelerationDeltaTime
            | Object::DecelerationVlCount
            | Object::DecelerationDeltaTime
            | Object::PositionLimitCount
            | Object::HomingSpeedCount
            | Object::SupportedModes => entry.row().default_number(entry.nth, self.node),
            Object::SyncCobId
            | Object::GuardTime
            | Object::LifeTimeFactor
            | Object::EmergencyCobId
            | Object::EmergencyInhibitTime
            | Object::ConsumerHeartbeatTime
            | Object::ProducerHeartbeatTime
            | Object::CommunicationErrorBehaviour
            | Object::ApplicationErrorBehaviour
            | Object::ReceiveCobId
            | Object::ReceiveType
            | Object::ReceiveMapped
            | Object::ReceiveEntry1
            | Object::ReceiveEntry2
            | Object::ReceiveEntry3
            | Object::TransmitCobId
            | Object::TransmitType
            | Object::TransmitInhibitTime
            | Object::TransmitEventTimer
            | Object::TransmitMapped
            | Object::TransmitEntry1
            | Object::TransmitEntry2
            | Object::TransmitEntry3
            | Object::MicrostepResolution
            | Object::FullStepResolution
            | Object::BrakeApplyDelay
            | Object::BrakeReleaseDelay
            | Object::MaximumCurrent
            | Object::StandbyCurrent
            | Object::LimitSwitches
            | Object::EnableDelay
            | Object::EncoderPolarity
            | Object::EncoderDirection
            | Object::EncoderInitialise
            | Object::BrakeApplyCurrent
            | Object::BrakeReleaseCurrent
            | Object::RampDivisor
            | Object::PulseDivisor
            | Object::MaximumVelocity
            | Object::MaximumAcceleration
            | Object::StandbyDelay
            | Object::VelocityDimension
            | Object::ChopperBlankTime
            | Object::ChopperMode
            | Object::ChopperHysteresisDecrement
            | Object::ChopperHysteresisEnd
            | Object::ChopperHysteresisStart
            | Object::ChopperOffTime
            | Object::SmartEnergyCurrentMinimum
            | Object::SmartEnergyDownStep
            | Object::SmartEnergyHysteresis
            | Object::SmartEnergyUpStep
            | Object::SmartEnergyHysteresisStart
            | Object::StallGuardFilter
            | Object::StallGuardThreshold
            | Object::ShortProtectionDisable
            | Object::StopOnStall
            | Object::SmartEnergyThresholdSpeed
            | Object::SmartEnergySlowRunCurrent
            | Object::PhysicalOutputs
            | Object::OutputMask
            | Object::BitRate
            | Object::NodeId
            | Object::PullUps
            | Object::Controlword
            | Object::TargetVelocityVl
            | Object::AccelerationDeltaSpeed
            | Object::QuickStopOption
            | Object::ShutdownOption
            | Object::DisableOperationOption
            | Object::HaltOption
            | Object::FaultReactionOption
            | Object::ModeOfOperation
            | Object::FollowingErrorWindow
            | Object::PositionWindow
            | Object::PositionWindowTime
            | Object::SensorSelection
            | Object::TargetPosition
            | Object::HomeOffset
            | Object::MinimumPositionLimit
            | Object::MaximumPositionLimit
            | Object::ProfileVelocity
            | Object::ProfileAcceleration
            | Object::QuickStopDeceleration
            | Object::HomingMethod
            | Object::HomingFastSpeed
            | Object::HomingSlowSpeed
            | Object::HomingAcceleration
            | Object::TargetVelocity => self.values.get(entry),
        })
    }

    /// The number that an object of up to 32 bits has; 0 for any other.
    pub(super) fn number(&self, entry: Entry) -> u32 {
        match self.read(entry) {
            Value::Number(number) => number,
            Value::Long(_) | Value::Text(_) | Value::Octets(_) => 0,
        }
    }

    pub(super) const fn scale(&self) -> &Scale {
        &self.scale
    }

    /// The actual position in microsteps, by the sensor that 606Ah selects.
    pub(super) fn actual_position(&self) -> i32 {
        let encoder = self.values.of_object(Object::SensorSelection) == 0;
        if encoder { self.live.encoder } else { self.live.position }
    }
}

/// The driver's errors as 2102h has them, from the bits of axis parameter 208.
fn driver_errors(flags: u32, lacks_supply: bool) -> u32 {
    // Bits of 208: OT, OTPW, S2GA, S2GB, OLA, OLB; each with its bit of 2102h.
    const BITS: [(u32, u32); 6] = [(1, 7), (2, 6), (3, 0), (4, 1), (5, 2), (6, 3)];
    let bit = |(from, to)| (flags.unbounded_shr(from) & 1).unbounded_shl(to);
    BITS.into_iter().map(bit).fold(u32::from(lacks_supply) << 5, |all, bit| all | bit)
}
