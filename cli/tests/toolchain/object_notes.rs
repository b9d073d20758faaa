//! Notes on an object in `docs/objects.md`, besides its properties.

use tmcm::canopen::Object;

const COB_ID: &str = "bits 10..0: the identifier, bit 31: the PDO is off, bit 30: reads 1; the identifier changes only \
                      while the PDO is or becomes off, or while 2701h is on";
const MAPPED: &str = "changes only while the PDO is off, or while 2701h is on";
const MAPPING: &str = "index, sub-index and length in bits; changes only while the PDO is off and nothing is mapped, or \
                       while 2701h is on";
const SAVE: &str = "write 65766173h (*save*); reads 1, or 0 if the EEPROM has not answered since the start";
const RESTORE: &str = "write 64616F6Ch (*load*), in force after the next reset; reads 1, or 0 if the EEPROM has not \
                       answered since the start";
const BRAKE: &str = "0 in both: no automatic brake; OUT0 belongs to the brake otherwise";
const FIXED: &str = "takes this one value only";
const ENCODER: &str = "the motor's counter if 606Ah is -1, the encoder if it is 0";
const LARGEST: &str = "fixed in internal units; otherwise up to what the motion controller can (06090031h), and more \
                       than this works as this; writing 208Ch sets it to the largest value of the new unit";
const THRESHOLD: &str = "0: off; what is too large for the motion controller works as its largest velocity";

/// The note of an object; empty where the name says all.
pub(crate) fn note(object: Object) -> &'static str {
    match object {
        Object::DeviceType => "a drive (402), a stepper motor",
        Object::ErrorRegister => {
            "bits: 0 any error, 1 current, 2 voltage, 3 temperature, 4 communication, 5 profile, 7 manufacturer"
        }
        Object::SyncCobId => {
            "the node only receives the SYNC: bit 30 set is refused, and so are restricted identifiers"
        }
        Object::GuardTime => "with 100Dh: how long the master may leave the node without guarding",
        Object::SaveAll | Object::SaveCommunication | Object::SaveMotor => SAVE,
        Object::RestoreAll | Object::RestoreCommunication | Object::RestoreMotor => RESTORE,
        Object::EmergencyCobId => {
            "bit 31 set: no emergency messages; the identifier changes only while it is set (08000022h)"
        }
        Object::ConsumerHeartbeatTime => {
            "bits 23..16: node, bits 15..0: time; watched from the first heartbeat on; a time or node of 0: not watched"
        }
        Object::ProducerHeartbeatTime => "0: no heartbeats",
        Object::OsCommand => {
            "a TMCL request: command, type, motor, value (four bytes, most significant first); refused with 08000022h \
             outside TMCL mode"
        }
        Object::OsStatus => {
            "what became of the last TMCL request: 0 there was none, 1 executed (status 100), 3 refused (another status); \
             FFh, *under way*, does not occur, because the reply is there before the confirmation"
        }
        Object::OsReply => {
            "the reply to the last TMCL request: low byte of the node ID, status, command, value (four bytes, most \
             significant first); zeros before the first one"
        }
        Object::CommunicationErrorBehaviour => {
            "what becomes of an operational node that has lost its master: 0 and 2 stopped, 1 no change"
        }
        Object::ApplicationErrorBehaviour => "what becomes of a node with a fault: 0 and 2 stopped, 1 no change",
        Object::ReceiveCobId | Object::TransmitCobId => COB_ID,
        Object::ReceiveType => "0..240: acts with the next SYNC; 254, 255: acts at once",
        Object::ReceiveMapped | Object::TransmitMapped => MAPPED,
        Object::ReceiveEntry1
        | Object::ReceiveEntry2
        | Object::ReceiveEntry3
        | Object::TransmitEntry1
        | Object::TransmitEntry2
        | Object::TransmitEntry3 => MAPPING,
        Object::TransmitType => {
            "0: with the next SYNC after a change; n = 1..240: with every nth SYNC; 254, 255: when something \
             changes, and by the event timer"
        }
        Object::TransmitInhibitTime => "milliseconds, as the manual has it, not the 100 us of CiA 301",
        Object::TransmitEventTimer => "for the types 254 and 255; 0: none",
        Object::LimitSwitches => {
            "bits: 0 left off, 1 right off, 2 left inverted, 3 right inverted, 4 home off, 5 home inverted, 6 shutdown \
             input enabled"
        }
        Object::StandbyDelay => "0: at once",
        Object::StandbyCurrent => "in force 2089h after the last move",
        Object::MaximumCurrent => "32 steps of 8",
        Object::MicrostepResolution => "with 208Ch = 164 written in SWITCH ON DISABLED only (08000022h)",
        Object::FullStepResolution => {
            "used by the unit rpm alone; with 208Ch = 164 written in SWITCH ON DISABLED only (08000022h)"
        }
        Object::EncoderPolarity => "has no effect",
        Object::EncoderDirection => "stored and read back; this firmware does not use an external encoder",
        Object::EncoderInitialise => "1: at the start the position is taken from the built-in encoder",
        Object::BrakeApplyCurrent | Object::BrakeReleaseCurrent => BRAKE,
        Object::RampDivisor | Object::PulseDivisor => {
            "of the TMC429, in internal units; otherwise the firmware chooses; 13 in one and 0 in the other is refused \
             with 06090030h"
        }
        Object::MaximumVelocity | Object::MaximumAcceleration => LARGEST,
        Object::VelocityDimension => "0: internal units of the TMC429, 164: rpm, 181: microsteps per second (pps)",
        Object::AccelerationDimension => "follows 208Ch: 0 internal units, 177 rpm/s, 179 pps/s",
        Object::ChopperMode => "0: spreadCycle, 1: constant off time",
        Object::ChopperHysteresisDecrement => "with spreadCycle only",
        Object::ChopperHysteresisStart => "8 works as 7",
        Object::ChopperOffTime => "0: the bridges are off",
        Object::SmartEnergyCurrentMinimum => "0: half, 1: a quarter",
        Object::StopOnStall => THRESHOLD,
        Object::SmartEnergyThresholdSpeed => "0: coolStep at every speed; otherwise as 20A4h",
        Object::SmartEnergySlowRunCurrent => "the current below the speed of 20A5h; 0: that of 2003h",
        Object::HomeOffsetDisplay => "607Ch as it was at the beginning of the last homing that has come to its end",
        Object::DriverErrorFlags => {
            "bits: 0 short A, 1 short B, 2 open load A, 3 open load B, 5 supply too low, 6 temperature pre-warning, 7 \
             too hot"
        }
        Object::StepCounterLow | Object::StepCounterHigh => "the half of sub-index 3",
        Object::StepCounter => "the motor's way in both directions, added up; lost with the power",
        Object::DirectCommunication => {
            "write 656B616Dh (*make*) to enter TMCL mode, which only NMT reset node (81h) ends; reads 1 in TMCL mode"
        }
        Object::ManufacturerMode => {
            "write 656B616Dh (*make*) or 6C6C696Bh (*kill*): on, PDOs can be changed while they are valid; off after \
             each reset; reads 1 or 0"
        }
        Object::DeviceInputs => "bits 16..19: IN0..IN3",
        Object::PhysicalOutputs => "bits 16, 17: OUT0, OUT1; only those that sub-index 2 allows are switched",
        Object::OutputMask => "bits 16, 17: OUT0, OUT1",
        Object::BitRate => "in force after it has been saved (2706h or 1010h) and the next reset; see 2707h",
        Object::NodeId => "in force after it has been saved (2706h or 1010h) and the next reset; see 2708h",
        Object::StoreCommunication => "write 65766173h (*save*), here or to sub-index 0",
        Object::BitRateInUse => "the bit rate in force",
        Object::NodeIdInUse => "the node ID in force",
        Object::PullUps => "1: the inputs have pull-up resistors",
        Object::Controlword => {
            "bits 0..3 and 7 commands, 4 new set-point or start of homing, 6 relative, 8 halt; the others are ignored"
        }
        Object::Statusword => {
            "bits 0..3, 5, 6 state, 4 supply, 7 warning, 9 operational, 10 target reached, 11 limit, 12 by mode, 13 \
             following error, in profile position mode, 14 moves, 15 in negative direction"
        }
        Object::TargetVelocityVl => "-2047..2047 in internal units; otherwise more than 2087h works as that",
        Object::VelocityDemandVl => "the last 6042h",
        Object::VelocityActualVl => "606Ch, or the nearest number of 16 bits",
        Object::MaximumVelocityAmount => "2087h",
        Object::DecelerationDeltaSpeed => "the same as 6048h.1",
        Object::QuickStopOption => {
            "1: slow-down ramp, 2: quick-stop ramp, then SWITCH ON DISABLED; 5, 6: the same, then QUICK STOP ACTIVE"
        }
        Object::ShutdownOption | Object::DisableOperationOption | Object::HaltOption | Object::FaultReactionOption => {
            FIXED
        }
        Object::ModeOfOperation => "0 none, 1 profile position, 2 velocity, 3 profile velocity, 6 homing",
        Object::PositionActualInternal | Object::PositionActual => ENCODER,
        Object::FollowingErrorWindow => "0: off",
        Object::PositionWindow => "FFFFFFFFh: off",
        Object::SensorSelection => "0: encoder, -1: none",
        Object::ProfileVelocity => "internal units above 2047 work as 2047; 0: no motion",
        Object::ProfileDeceleration => "the same as 6083h",
        Object::QuickStopDeceleration => "internal units above 2047 work as 2047",
        Object::DigitalInputs => "bits: 0 left, 1 right, 2 home as 2005h has them, 16..19 IN0..IN3",
        Object::SupportedModes => "profile position, velocity, profile velocity, homing",
        _ => "",
    }
}
