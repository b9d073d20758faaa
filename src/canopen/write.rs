//! What writing an object does.

use core::task::Poll;

use super::Node;
use super::abort::Abort;
use super::cob;
use super::drive::State;
use super::drive::unit::INTERNAL;
use super::map::Way;
use super::object::{Entry, Object};
use super::read::PINS;
use super::row::When;
use super::store::{Group, Tmcm1140};
use crate::device::Board;

/// `save`, written to 1010h and 2706h.
const SAVE: u32 = u32::from_le_bytes(*b"save");
/// `load`, written to 1011h.
const LOAD: u32 = u32::from_le_bytes(*b"load");
/// `make`, written to 2700h and 2701h.
const MAKE: u32 = u32::from_le_bytes(*b"make");
/// `kill`, written to 2701h.
const KILL: u32 = u32::from_le_bytes(*b"kill");

/// The outputs OUT0 and OUT1.
const OUTPUTS: u8 = 0b11;
/// The output of the brake, OUT0.
const BRAKE: u8 = 0b01;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Writes a number, as [`Type::extend`](super::Type::extend) gives it, to an object. Pending while it is being saved.
    ///
    /// # Errors
    /// The value is refused, and nothing has changed.
    pub(super) fn write(&mut self, entry: Entry, value: u32) -> Result<Poll<()>, Abort> {
        let row = entry.row();
        let mapped = matches!(entry.object, Object::ReceiveMapped | Object::TransmitMapped);
        let number = row.data.value(value);
        if !row.accepts(number) && !mapped {
            return Err(match row.ranges {
                [(low, high)] if low < high => {
                    if number < *low {
                        Abort::TooLow
                    } else {
                        Abort::TooHigh
                    }
                }
                _ => Abort::Value,
            });
        }
        // What is lost can be written in the FAULT that it has led to, with the bridges off.
        let replaces = self.drive.state == State::Fault && self.lost.contains(entry);
        if row.when == When::Disabled && !self.is_disabled() && !replaces {
            return Err(Abort::State);
        }
        self.check_encoder(entry.object, value)?;
        self.touched = true;
        match entry.object {
            Object::SaveAll => return self.keep(value, SAVE, Group::All),
            Object::SaveMotor => return self.keep(value, SAVE, Group::Motor),
            Object::SaveCommunication | Object::StoreCommunication => {
                return self.keep(value, SAVE, Group::Communication);
            }
            Object::RestoreAll => return self.keep(value, LOAD, Group::All),
            Object::RestoreMotor => return self.keep(value, LOAD, Group::Motor),
            Object::RestoreCommunication => return self.keep(value, LOAD, Group::Communication),
            // Its seven bytes are no number: the server has them executed.
            Object::OsCommand => return Err(Abort::State),
            Object::DirectCommunication if value == MAKE => self.enter_tmcl_mode(),
            Object::DirectCommunication => return Err(Abort::Value),
            Object::Controlword if self.tunnel.in_tmcl_mode() => return Err(Abort::State),
            Object::ManufacturerMode => {
                self.manufacturer_mode = match value {
                    MAKE => true,
                    KILL => false,
                    _ => return Err(Abort::Value),
                };
            }
            Object::SyncCobId => {
                self.values.set(entry, cob::sync(value)?);
                self.filters_changed = true;
            }
            Object::EmergencyCobId => self.write_emergency_cob_id(entry, value)?,
            Object::ConsumerHeartbeatTime => self.write_consumer(entry, value)?,
            Object::ProducerHeartbeatTime => {
                self.values.set(entry, value);
                self.heartbeat = Default::default();
            }
            Object::GuardTime | Object::LifeTimeFactor => {
                self.values.set(entry, value);
                self.guarding = Default::default();
            }
            Object::ReceiveCobId => self.write_cob_id(Way::Receive, entry, value)?,
            Object::TransmitCobId => self.write_cob_id(Way::Transmit, entry, value)?,
            Object::ReceiveType => self.set_record(Way::Receive, entry, value),
            Object::TransmitType => self.set_record(Way::Transmit, entry, value),
            Object::ReceiveMapped => self.write_mapped(Way::Receive, entry, value)?,
            Object::TransmitMapped => self.write_mapped(Way::Transmit, entry, value)?,
            Object::ReceiveEntry1 | Object::ReceiveEntry2 | Object::ReceiveEntry3 => {
                self.write_mapping(Way::Receive, entry, value)?;
            }
            Object::TransmitEntry1 | Object::TransmitEntry2 | Object::TransmitEntry3 => {
                self.write_mapping(Way::Transmit, entry, value)?;
            }
            Object::MaximumVelocity => {
                self.write_largest(entry, value, self.scale.largest_velocity())?;
            }
            Object::MaximumAcceleration => {
                self.write_largest(entry, value, self.scale.largest_acceleration())?;
            }
            Object::VelocityDimension => self.write_dimension(entry, value)?,
            Object::TargetVelocityVl => {
                let (limit, internal) = (i64::from(INTERNAL), self.scale.is_internal());
                match number {
                    _ if !internal => {}
                    number if number > limit => return Err(Abort::TooHigh),
                    number if number.unsigned_abs() > limit.unsigned_abs() => return Err(Abort::TooLow),
                    _ => {}
                }
                self.values.set(entry, value);
                self.steer();
            }
            Object::TargetVelocity => {
                self.values.set(entry, value);
                self.steer();
            }
            Object::ModeOfOperation => {
                self.values.set(entry, value);
                self.change_mode(value);
            }
            Object::Controlword => {
                self.values.set(entry, value);
                self.obey(value as u16);
            }
            Object::PhysicalOutputs | Object::OutputMask | Object::BrakeApplyCurrent | Object::BrakeReleaseCurrent => {
                self.values.set(entry, value);
                self.switch_outputs();
            }
            Object::LimitSwitches => {
                self.values.set(entry, value);
                self.tell_switches();
            }
            Object::PullUps => {
                self.values.set(entry, value);
                self.switch_pull_ups();
            }
            Object::MicrostepResolution | Object::FullStepResolution | Object::RampDivisor | Object::PulseDivisor => {
                self.write_scaled(entry, value)?;
                self.tell_turn();
            }
            Object::MaximumCurrent
            | Object::StandbyCurrent
            | Object::StandbyDelay
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
            | Object::SmartEnergySlowRunCurrent => self.write_parameter(entry, value)?,
            Object::EmergencyInhibitTime
            | Object::CommunicationErrorBehaviour
            | Object::ApplicationErrorBehaviour
            | Object::TransmitInhibitTime
            | Object::TransmitEventTimer
            | Object::BrakeApplyDelay
            | Object::BrakeReleaseDelay
            | Object::EnableDelay
            | Object::EncoderPolarity
            | Object::EncoderDirection
            | Object::EncoderInitialise
            | Object::BitRate
            | Object::NodeId
            | Object::AccelerationDeltaSpeed
            | Object::QuickStopOption
            | Object::ShutdownOption
            | Object::DisableOperationOption
            | Object::HaltOption
            | Object::FaultReactionOption
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
            | Object::HomingAcceleration => self.values.set(entry, value),
            Object::DeviceType
            | Object::ErrorRegister
            | Object::DeviceName
            | Object::HardwareVersion
            | Object::SoftwareVersion
            | Object::SaveCount
            | Object::RestoreCount
            | Object::ConsumerHeartbeatCount
            | Object::IdentityCount
            | Object::VendorId
            | Object::ProductCode
            | Object::RevisionNumber
            | Object::OsCommandCount
            | Object::OsStatus
            | Object::OsReply
            | Object::ErrorBehaviourCount
            | Object::ReceiveCount
            | Object::TransmitCount
            | Object::TransmitCompatibility
            | Object::BrakeDelayCount
            | Object::EncoderCount
            | Object::BrakeCurrentCount
            | Object::AccelerationDimension
            | Object::HomeOffsetDisplay
            | Object::ActualLoad
            | Object::DriverErrorFlags
            | Object::MicrostepResolutionDisplay
            | Object::StepCounterCount
            | Object::StepCounterLow
            | Object::StepCounterHigh
            | Object::StepCounter
            | Object::DeviceInputs
            | Object::OutputCount
            | Object::StoreCount
            | Object::BitRateInUse
            | Object::NodeIdInUse
            | Object::AnalogCount
            | Object::AnalogInput
            | Object::ErrorCode
            | Object::Statusword
            | Object::VelocityDemandVl
            | Object::VelocityActualVl
            | Object::VelocityAmountCount
            | Object::MinimumVelocityAmount
            | Object::MaximumVelocityAmount
            | Object::AccelerationVlCount
            | Object::AccelerationDeltaTime
            | Object::DecelerationVlCount
            | Object::DecelerationDeltaSpeed
            | Object::DecelerationDeltaTime
            | Object::ModeDisplay
            | Object::PositionDemand
            | Object::PositionActualInternal
            | Object::PositionActual
            | Object::VelocityActual
            | Object::PositionLimitCount
            | Object::ProfileDeceleration
            | Object::HomingSpeedCount
            | Object::FollowingErrorActual
            | Object::DigitalInputs
            | Object::SupportedModes => return Err(Abort::ReadOnly),
        }
        self.lost.written(entry);
        Ok(Poll::Ready(()))
    }

    /// Saves or restores a group, as the object asks for whose signature is given, if that is the value that was written. Not
    /// while a store is under way whose master has given it up: its values must not mix with others.
    #[inline(never)]
    fn keep(&mut self, value: u32, signature: u32, group: Group) -> Result<Poll<()>, Abort> {
        if value != signature {
            return Err(Abort::Signature);
        }
        if self.device.store().is_storing() {
            return Err(Abort::State);
        }
        Ok(if signature == SAVE { self.save(group) } else { self.load_defaults(group) })
    }

    /// Writes the COB-ID of emergency messages, whose identifier changes only while they are off.
    fn write_emergency_cob_id(&mut self, entry: Entry, cob_id: u32) -> Result<(), Abort> {
        cob::emergency(cob_id)?;
        let old = self.values.get(entry);
        if old & cob::OFF == 0 && cob::can_id(old) != cob::can_id(cob_id) {
            return Err(Abort::State);
        }
        self.values.set(entry, cob_id);
        Ok(())
    }

    /// Writes which node's heartbeat is watched, and how long it may be silent.
    fn write_consumer(&mut self, entry: Entry, value: u32) -> Result<(), Abort> {
        if value >> 24 != 0 {
            return Err(Abort::Value);
        }
        self.values.set(entry, value);
        self.master = Default::default();
        self.filters_changed = true;
        Ok(())
    }

    /// Writes the largest velocity or acceleration, which is fixed in internal units.
    fn write_largest(&mut self, entry: Entry, value: u32, largest: u32) -> Result<(), Abort> {
        if self.scale.is_internal() && value != largest {
            return Err(Abort::Value);
        }
        if value > largest {
            return Err(Abort::TooHigh);
        }
        self.write_scaled(entry, value)
    }

    /// Sets the outputs that the mask lets be switched, and the brake at OUT0 if there is one.
    pub(super) fn switch_outputs(&mut self) {
        let pins = |object| (self.values.of_object(object) >> PINS) as u8;
        let (mut mask, mut wanted) = (pins(Object::OutputMask) & OUTPUTS, pins(Object::PhysicalOutputs));
        if let Some(on) = self.brake() {
            (mask, wanted) = (mask | BRAKE, wanted & !BRAKE | if on { BRAKE } else { 0 });
        }
        let outputs = self.device.outputs_mut();
        outputs.digital = outputs.digital & !mask | wanted & mask;
    }

    /// Switches the pull-up resistors.
    pub(super) fn switch_pull_ups(&mut self) {
        let on = self.values.of_object(Object::PullUps) != 0;
        self.device.outputs_mut().pull_ups = on.into();
    }
}
