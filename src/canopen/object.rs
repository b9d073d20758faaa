//! The object table: a row for each object of the node, in the order of index and sub-index.

use super::cia301::record::{Direction, Field};
use super::cia301::{Access, Mapping};
use super::row::Initial::{self, Each, Number, PlusNode, Text, Varies};
use super::row::{ANY, Form, Kind, Storage, Type, When};
use crate::param::AxisParameter;

/// Version of the firmware: that of the manual it follows.
pub const VERSION: &str = "3.20";

/// The effect of writing an object, besides that its value changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writing {
    /// Nothing.
    Plain,
    /// A parameter of the axis changes.
    Axis(AxisParameter, Form),
    /// The scale of velocities and accelerations in the motion controller changes, and with it this parameter of the
    /// axis, if there is one.
    Scaled(Option<AxisParameter>),
    /// A PDO's record changes.
    Record(Direction, Field),
    /// Something that only this object does.
    Special(Special),
}

/// A row of the object table. Objects that each PDO has stand in one row. Names and units are for people, so an image
/// has none.
#[derive(Debug)]
pub struct Row {
    /// The index, or that of the first PDO.
    pub first: u16,
    /// The index, or that of the last PDO.
    pub last: u16,
    /// The sub-index.
    pub sub: u8,
    /// The name. A `#` in it stands for the number of the PDO. At sub-index 0 of an array or a record the name of the
    /// whole stands in front of a colon.
    #[cfg(not(target_os = "none"))]
    pub name: &'static str,
    /// The kind of the index.
    pub kind: Kind,
    /// Type of the value.
    pub data: Type,
    /// Whether the object may be written.
    pub access: Access,
    /// Whether the object may be mapped.
    pub mapping: Mapping,
    /// Accepted values, besides what the type allows: inclusive ranges, in ascending order; with [`ANY`] all.
    pub ranges: &'static [(i64, i64)],
    /// The value after a factory reset.
    pub default: Initial,
    /// The unit of the value; empty where a number speaks for itself.
    #[cfg(not(target_os = "none"))]
    pub unit: &'static str,
    /// Where the value is.
    pub storage: Storage,
    /// When the object may be written.
    pub when: When,
    /// The value that the firmware finds when the object is read; `None` where it is read from where its value is, or
    /// has its default always.
    pub computed: Option<Computed>,
    /// The effect of writing it.
    pub writing: Writing,
}

impl Row {
    /// True when the number lies in one of the ranges.
    pub fn accepts(&self, value: i64) -> bool {
        self.ranges.is_empty() || self.ranges.iter().any(|&(low, high)| (low..=high).contains(&value))
    }

    /// The number after a factory reset, of the PDO with this number, counted from 0, on the node with this ID; 0 where
    /// the default is none.
    pub const fn default_number(&self, nth: u8, node: u8) -> u32 {
        match self.default {
            Initial::Number(number) => number as u32,
            Initial::Each([first, second, third, fourth]) => match nth {
                0 => first as u32,
                1 => second as u32,
                2 => third as u32,
                _ => fourth as u32,
            },
            Initial::PlusNode(base) => base.wrapping_add((nth as u32).wrapping_mul(0x100)).wrapping_add(node as u32),
            Initial::Text(_) | Initial::Varies => 0,
        }
    }

    /// Number of indices that have this row.
    pub const fn count(&self) -> u8 {
        self.last.wrapping_sub(self.first).wrapping_add(1) as u8
    }

    /// The slot in the EEPROM of the PDO with this number, counted from 0; `None` if the value is not saved.
    pub const fn slot(&self, nth: u8) -> Option<usize> {
        match self.storage {
            Storage::Computed | Storage::Volatile => None,
            Storage::All(slot) | Storage::Motor(slot) | Storage::Communication(slot) => {
                Some((slot as usize).wrapping_add(nth as usize))
            }
        }
    }

    /// True for a COB-ID whose default has the node ID in it.
    pub const fn follows_node(&self) -> bool {
        matches!(self.default, Initial::PlusNode(_))
    }
}

/// Makes the enum of objects and their rows, which are written one a line. A line has the index, or first and last
/// index of the PDOs; sub-index, object, name, kind, type, access, mapping, ranges; default; unit, storage; when it may
/// be written. Then follows what reading and writing it does, if that is more than to get and to set the value. That is
/// *read specially*, and *written specially* or one of the other kinds of [`Writing`].
macro_rules! objects {
    ($(
        $first:literal $(..= $last:literal)? $sub:literal $object:ident $name:literal $kind:ident $data:ident
        $access:ident $mapping:ident $ranges:expr, $default:expr, $unit:literal $storage:ident $(($slot:literal))?,
        $when:ident
        $(, read $computed:ident)? $(, written $special:ident)?
        $(, axis $parameter:ident $form:ident)? $(, scaled $scaled:expr)? $(, record $direction:ident $field:ident)?;
    )*) => {
        /// An object, or one that each of the four PDOs of a direction has.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Object {
            $(#[doc = $name] $object,)*
        }

        impl Object {
            /// All objects, in the order of the table.
            pub const ALL: &'static [Object] = &[$(Object::$object),*];
        }

        /// The objects that are not read from where values are.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Computed {
            $($(#[doc = concat!($name, ": read ", stringify!($computed))] $object,)?)*
        }

        /// The objects that do something of their own when they are written.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Special {
            $($(#[doc = concat!($name, ": written ", stringify!($special))] $object,)?)*
        }

        /// The rows, by [`Object`].
        pub static ROWS: [Row; Object::ALL.len()] = [$(Row {
            first: $first,
            last: last!($first $($last)?),
            sub: $sub,
            #[cfg(not(target_os = "none"))]
            name: $name,
            kind: Kind::$kind,
            data: Type::$data,
            access: Access::$access,
            mapping: Mapping::$mapping,
            ranges: $ranges,
            default: $default,
            #[cfg(not(target_os = "none"))]
            unit: $unit,
            storage: Storage::$storage $(($slot))?,
            when: When::$when,
            computed: computed!($($object $computed)?),
            writing: writing!(
                $(special $object $special)? $(axis $parameter $form)? $(scaled $scaled)? $(record $direction $field)?
            ),
        }),*];
    };
}

/// Gives the computation that reading the object of a row takes.
macro_rules! computed {
    () => {
        None
    };
    ($object:ident $specially:ident) => {
        Some(Computed::$object)
    };
}

/// Gives the effect of writing the object of a row.
macro_rules! writing {
    () => {
        Writing::Plain
    };
    (special $object:ident $specially:ident) => {
        Writing::Special(Special::$object)
    };
    (axis $parameter:ident $form:ident) => {
        Writing::Axis(AxisParameter::$parameter, Form::$form)
    };
    (scaled $parameter:expr) => {
        Writing::Scaled($parameter)
    };
    (record $direction:ident $field:ident) => {
        Writing::Record(Direction::$direction, Field::$field)
    };
}

/// The last index of a row.
macro_rules! last {
    ($only:literal) => {
        $only
    };
    ($first:literal $last:literal) => {
        $last
    };
}

/// Ranges of an object that takes these numbers and no others.
macro_rules! listed {
    ($($value:literal),*) => { &[$(($value, $value)),*] };
}

objects! {
    0x1000 0 DeviceType "Device type" Var U32 Ro No ANY, Number(0x0004_0192), "" Computed, Always;
    0x1001 0 ErrorRegister "Error register" Var U8 Ro No ANY, Number(0), "" Computed, Always, read specially;
    0x1005 0 SyncCobId "COB-ID SYNC message" Var U32 Rw No ANY, Number(0x80), "" All(5), Always, written specially;
    0x1008 0 DeviceName "Manufacturer device name" Var Text Ro No ANY, Text("TMCM-1140"), "" Computed, Always;
    0x1009 0 HardwareVersion "Manufacturer hardware version" Var Text Ro No ANY, Text("1.0"), "" Computed, Always;
    0x100A 0 SoftwareVersion "Manufacturer software version" Var Text Ro No ANY, Text(VERSION), "" Computed, Always;
    0x100C 0 GuardTime "Guard time" Var U16 Rw No ANY, Number(0), "ms" All(6), Always, written specially;
    0x100D 0 LifeTimeFactor "Life time factor" Var U8 Rw No ANY, Number(0), "" All(7), Always, written specially;
    0x1010 0 SaveCount "Store parameters: highest sub-index" Array U8 Ro No &[(4, 4)], Number(4), "" Computed, Always;
    0x1010 1 SaveAll "Save all parameters" Array U32 Rw No ANY, Number(1), "" Computed, Always, read specially, written specially;
    0x1010 2 SaveCommunication "Save communication parameters (2704h, 2705h)" Array U32 Rw No ANY, Number(1), "" Computed, Always, read specially, written specially;
    0x1010 4 SaveMotor "Save motor 0 parameters" Array U32 Rw No ANY, Number(1), "" Computed, Always, read specially, written specially;
    0x1011 0 RestoreCount "Restore parameters: highest sub-index" Array U8 Ro No &[(4, 4)], Number(4), "" Computed, Always;
    0x1011 1 RestoreAll "Restore all parameters (factory reset)" Array U32 Rw No ANY, Number(1), "" Computed, Always, read specially, written specially;
    0x1011 2 RestoreCommunication "Restore communication parameters (2704h, 2705h)" Array U32 Rw No ANY, Number(1), "" Computed, Always, read specially, written specially;
    0x1011 4 RestoreMotor "Restore motor 0 parameters" Array U32 Rw No ANY, Number(1), "" Computed, Always, read specially, written specially;
    0x1014 0 EmergencyCobId "COB-ID emergency object" Var U32 Rw No ANY, PlusNode(0x80), "" All(8), Always, written specially;
    0x1015 0 EmergencyInhibitTime "Inhibit time EMCY" Var U16 Rw No ANY, Number(0), "100 us" All(9), Always;
    0x1016 0 ConsumerHeartbeatCount "Consumer heartbeat time: number of entries" Array U8 Ro No &[(1, 1)], Number(1), "" Computed, Always;
    0x1016 1 ConsumerHeartbeatTime "Consumer heartbeat time 1" Array U32 Rw No ANY, Number(0), "ms" All(10), Always, written specially;
    0x1017 0 ProducerHeartbeatTime "Producer heartbeat time" Var U16 Rw No ANY, Number(0), "ms" All(11), Always, written specially;
    0x1018 0 IdentityCount "Identity: number of entries" Record U8 Ro No &[(3, 3)], Number(3), "" Computed, Always;
    0x1018 1 VendorId "Vendor ID" Record U32 Ro No ANY, Number(0x286), "" Computed, Always;
    0x1018 2 ProductCode "Product code" Record U32 Ro No ANY, Number(1140), "" Computed, Always;
    0x1018 3 RevisionNumber "Revision number" Record U32 Ro No ANY, Number(0x0003_0014), "" Computed, Always;
    0x1023 0 OsCommandCount "OS command: number of entries" Record U8 Ro No &[(3, 3)], Number(3), "" Computed, Always;
    0x1023 1 OsCommand "TMCL command" Record Octets Rw No ANY, Varies, "" Computed, Always, read specially, written specially;
    0x1023 2 OsStatus "Reply (status)" Record U8 Ro No ANY, Number(0), "" Computed, Always, read specially;
    0x1023 3 OsReply "TMCL reply" Record Octets Ro No ANY, Varies, "" Computed, Always, read specially;
    0x1029 0 ErrorBehaviourCount "Error behaviour: number of error classes" Array U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x1029 1 CommunicationErrorBehaviour "Communication error" Array U8 Rw No listed![0, 1, 2], Number(0), "" All(12), Always;
    0x1029 2 ApplicationErrorBehaviour "Application error" Array U8 Rw No listed![0, 1, 2], Number(1), "" All(13), Always;
    0x1400..=0x1403 0 ReceiveCount "RPDO# communication: largest sub-index" Record U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x1400..=0x1403 1 ReceiveCobId "RPDO# COB-ID" Record U32 Rw No ANY, PlusNode(0x4000_0200), "" All(14), Always, record Receive CobId;
    0x1400..=0x1403 2 ReceiveType "RPDO# transmission type" Record U8 Rw No &[(0, 240), (254, 255)], Each([0xFF, 0xFF, 0xFF, 0xFE]), "" All(18), Always, record Receive Type;
    0x1600..=0x1603 0 ReceiveMapped "RPDO# mapping: number of mapped objects" Record U8 Rw No &[(0, 3)], Each([1, 2, 2, 2]), "" All(22), Always, record Receive Count;
    0x1600..=0x1603 1 ReceiveEntry1 "RPDO# mapping entry 1" Record U32 Rw No ANY, Number(0x6040_0010), "" All(26), Always, record Receive Entry;
    0x1600..=0x1603 2 ReceiveEntry2 "RPDO# mapping entry 2" Record U32 Rw No ANY, Each([0, 0x6060_0008, 0x607A_0020, 0x60FF_0020]), "" All(30), Always, record Receive Entry;
    0x1600..=0x1603 3 ReceiveEntry3 "RPDO# mapping entry 3" Record U32 Rw No ANY, Number(0), "" All(34), Always, record Receive Entry;
    0x1800..=0x1803 0 TransmitCount "TPDO# communication: largest sub-index" Record U8 Ro No &[(5, 5)], Number(5), "" Computed, Always;
    0x1800..=0x1803 1 TransmitCobId "TPDO# COB-ID" Record U32 Rw No ANY, PlusNode(0x4000_0180), "" All(38), Always, record Transmit CobId;
    0x1800..=0x1803 2 TransmitType "TPDO# transmission type" Record U8 Rw No &[(0, 240), (254, 255)], Each([0xFF, 0xFF, 1, 1]), "" All(42), Always, record Transmit Type;
    0x1800..=0x1803 3 TransmitInhibitTime "TPDO# inhibit time" Record U16 Rw No ANY, Number(0), "ms" All(46), Always, record Transmit Time;
    0x1800..=0x1803 4 TransmitCompatibility "TPDO# compatibility entry" Record U8 Ro No ANY, Number(0), "" Computed, Always;
    0x1800..=0x1803 5 TransmitEventTimer "TPDO# event timer" Record U16 Rw No ANY, Number(0), "ms" All(50), Always, record Transmit Time;
    0x1A00..=0x1A03 0 TransmitMapped "TPDO# mapping: number of mapped objects" Record U8 Rw No &[(0, 3)], Each([1, 2, 2, 2]), "" All(54), Always, record Transmit Count;
    0x1A00..=0x1A03 1 TransmitEntry1 "TPDO# mapping entry 1" Record U32 Rw No ANY, Number(0x6041_0010), "" All(58), Always, record Transmit Entry;
    0x1A00..=0x1A03 2 TransmitEntry2 "TPDO# mapping entry 2" Record U32 Rw No ANY, Each([0, 0x6061_0008, 0x6064_0020, 0x606C_0020]), "" All(62), Always, record Transmit Entry;
    0x1A00..=0x1A03 3 TransmitEntry3 "TPDO# mapping entry 3" Record U32 Rw No ANY, Number(0), "" All(66), Always, record Transmit Entry;
    0x2000 0 MicrostepResolution "Microstep resolution" Var U8 Rw No &[(0, 8)], Number(8), "2^n microsteps/fullstep" Motor(70), Always, scaled Some(AxisParameter::MicrostepResolution);
    0x2001 0 FullStepResolution "Motor full step resolution" Var U16 Rw No &[(1, 65535)], Number(200), "fullsteps/rev" Motor(71), Always, scaled None;
    0x2002 0 BrakeDelayCount "Brake delay times: highest sub-index" Array U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x2002 1 BrakeApplyDelay "Time between applying brake / disabling power stage" Array U16 Rw No ANY, Number(0), "ms" Motor(72), Always;
    0x2002 2 BrakeReleaseDelay "Time between releasing brake / switching to operational" Array U16 Rw No ANY, Number(0), "ms" Motor(73), Always;
    0x2003 0 MaximumCurrent "Maximum current" Var U8 Rw No ANY, Number(0x80), "1/255" Motor(74), Always, axis MaximumCurrent Same;
    0x2004 0 StandbyCurrent "Standby current" Var U8 Rw No ANY, Number(8), "1/255" Motor(75), Always, axis StandbyCurrent Same;
    0x2005 0 LimitSwitches "Limit switches" Var U32 Rw No &[(0, 127)], Number(0), "" Motor(76), Disabled, written specially;
    0x200A 0 EnableDelay "Enable drive delay time" Var U16 Rw No ANY, Number(0), "ms" Motor(77), Always;
    0x200B 0 EncoderCount "Encoder parameters: highest sub-index" Array U8 Ro No &[(3, 3)], Number(3), "" Computed, Always;
    0x200B 1 EncoderPolarity "(not used)" Array U8 Rw No ANY, Number(0), "" Motor(78), Disabled;
    0x200B 2 EncoderDirection "Direction of rotation (external encoders only)" Array U8 Rw No &[(0, 1)], Number(0), "" Motor(79), Disabled;
    0x200B 3 EncoderInitialise "Initialize position" Array U8 Rw No &[(0, 1)], Number(1), "" Motor(80), Disabled;
    0x200C 0 BrakeCurrentCount "Brake current feed: highest sub-index" Array U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x200C 1 BrakeApplyCurrent "Brake apply current" Array U8 Rw No ANY, Number(0), "1/255" Motor(81), Disabled, written specially;
    0x200C 2 BrakeReleaseCurrent "Brake release current" Array U8 Rw No ANY, Number(0), "1/255" Motor(82), Disabled, written specially;
    0x2085 0 RampDivisor "Ramp divisor" Var U8 Rw No &[(0, 13)], Number(7), "2^n" Motor(83), Disabled, scaled None;
    0x2086 0 PulseDivisor "Pulse divisor" Var U8 Rw No &[(0, 13)], Number(3), "2^n" Motor(84), Disabled, scaled None;
    0x2087 0 MaximumVelocity "Maximum velocity" Var U32 Rw No &[(1, u32::MAX as i64)], Number(2047), "208Ch" Motor(85), Disabled, written specially;
    0x2088 0 MaximumAcceleration "Maximum acceleration" Var U32 Rw No &[(1, u32::MAX as i64)], Number(2047), "208Eh" Motor(86), Disabled, written specially;
    0x2089 0 StandbyDelay "Standby delay" Var U16 Rw No ANY, Number(200), "10 ms" Motor(87), Always, axis PowerDownDelay Same;
    0x208C 0 VelocityDimension "Velocity dimension index" Var U8 Rw No listed![0, 164, 181], Number(0), "" Motor(88), Disabled, written specially;
    0x208E 0 AccelerationDimension "Acceleration dimension index" Var U8 Ro No listed![0, 177, 179], Number(0), "" Computed, Always, read specially;
    0x2092 0 ChopperBlankTime "Chopper blank time" Var U8 Rw No &[(0, 3)], Number(2), "" Motor(89), Always, axis ChopperBlankTime Same;
    0x2093 0 ChopperMode "Chopper mode" Var U8 Rw No listed![0, 1], Number(0), "" Motor(90), Always, axis ConstantToffMode Same;
    0x2094 0 ChopperHysteresisDecrement "Chopper hysteresis decrement" Var U8 Rw No &[(0, 3)], Number(0), "" Motor(91), Always, axis ChopperHysteresisDecrement Same;
    0x2095 0 ChopperHysteresisEnd "Chopper hysteresis end" Var I8 Rw No &[(-3, 12)], Number(0), "" Motor(92), Always, axis ChopperHysteresisEnd HysteresisEnd;
    0x2096 0 ChopperHysteresisStart "Chopper hysteresis start" Var U8 Rw No &[(0, 8)], Number(3), "" Motor(93), Always, axis ChopperHysteresisStart Same;
    0x2097 0 ChopperOffTime "Chopper off time" Var U8 Rw No &[(0, 0), (2, 15)], Number(5), "N=12+32*t clocks" Motor(94), Always, axis ChopperOffTime Same;
    0x2098 0 SmartEnergyCurrentMinimum "Smart energy current minimum" Var U8 Rw No listed![0, 1], Number(0), "" Motor(95), Always, axis SmartEnergyCurrentMinimum Same;
    0x2099 0 SmartEnergyDownStep "Smart energy current down step" Var U8 Rw No &[(0, 3)], Number(0), "" Motor(96), Always, axis SmartEnergyDownStep Same;
    0x209A 0 SmartEnergyHysteresis "Smart energy hysteresis" Var U8 Rw No &[(0, 15)], Number(0), "" Motor(97), Always, axis SmartEnergyHysteresis Same;
    0x209B 0 SmartEnergyUpStep "Smart energy current up step" Var U8 Rw No &[(0, 3)], Number(0), "" Motor(98), Always, axis SmartEnergyUpStep Same;
    0x209C 0 SmartEnergyHysteresisStart "Smart energy hysteresis start" Var U8 Rw No &[(0, 15)], Number(0), "" Motor(99), Always, axis SmartEnergyHysteresisStart Same;
    0x209D 0 StallGuardFilter "Smart energy (stallGuard2) filter enable" Var U8 Rw No &[(0, 1)], Number(0), "" Motor(100), Always, axis StallGuardFilter Same;
    0x209E 0 StallGuardThreshold "StallGuard2 threshold" Var I8 Rw No &[(-63, 63)], Number(0), "" Motor(101), Always, axis StallGuardThreshold Same;
    0x20A1 0 ShortProtectionDisable "Short protection disable" Var U8 Rw No &[(0, 1)], Number(0), "" Motor(102), Always, axis ShortProtectionDisable Same;
    0x20A4 0 StopOnStall "Stop on stall" Var U32 Rw No &[(0, i32::MAX as i64)], Number(0), "velocity unit (208Ch)" Motor(103), Always, axis StopOnStall Threshold;
    0x20A5 0 SmartEnergyThresholdSpeed "Smart energy threshold speed" Var U32 Rw No &[(0, i32::MAX as i64)], Number(0), "velocity unit (208Ch)" Motor(104), Always, axis SmartEnergyThresholdSpeed Threshold;
    0x20A6 0 SmartEnergySlowRunCurrent "Smart energy slow run current" Var U8 Rw No ANY, Number(0x80), "1/255" Motor(105), Always, axis SmartEnergySlowRunCurrent Same;
    0x2100 0 HomeOffsetDisplay "Home offset display" Var I32 Ro No ANY, Number(0), "microsteps" Computed, Always, read specially;
    0x2101 0 ActualLoad "Actual load value" Var U16 Ro No &[(0, 1023)], Number(0), "" Computed, Always, read specially;
    0x2102 0 DriverErrorFlags "Driver error flags" Var U8 Ro No ANY, Number(0), "" Computed, Always, read specially;
    0x2107 0 MicrostepResolutionDisplay "Microstep resolution display" Var U8 Ro No &[(0, 8)], Number(8), "" Computed, Always, read specially;
    0x210B 0 StepCounterCount "Step counter: highest sub-index" Record U8 Ro No &[(3, 3)], Number(3), "" Computed, Always;
    0x210B 1 StepCounterLow "Step counter: lower 32 bits" Record U32 Ro No ANY, Number(0), "microsteps" Computed, Always, read specially;
    0x210B 2 StepCounterHigh "Step counter: higher 32 bits" Record U32 Ro No ANY, Number(0), "microsteps" Computed, Always, read specially;
    0x210B 3 StepCounter "Step counter: 64 bit value" Record U64 Ro No ANY, Number(0), "microsteps" Computed, Always, read specially;
    0x2700 0 DirectCommunication "TMCL direct communication" Var U32 Rw No ANY, Number(0), "" Computed, Always, read specially, written specially;
    0x2701 0 ManufacturerMode "Manufacturer specific mode" Var U32 Rw No ANY, Number(0), "" Computed, Always, read specially, written specially;
    0x2702 0 DeviceInputs "Device digital inputs" Var U32 Ro Tx ANY, Number(0), "" Computed, Always, read specially;
    0x2703 0 OutputCount "Device digital outputs: highest sub-index" Array U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x2703 1 PhysicalOutputs "Device digital outputs: physical outputs" Array U32 Rw RxTx ANY, Number(0), "" Volatile, Always, written specially;
    0x2703 2 OutputMask "Device digital outputs: output mask" Array U32 Rw RxTx ANY, Number(0), "" Volatile, Always, written specially;
    0x2704 0 BitRate "CAN bit rate" Var U16 Rw No listed![20, 50, 100, 125, 250, 500, 800, 1000], Number(1000), "kbit/s" Communication(3), Always;
    0x2705 0 NodeId "Node ID" Var U8 Rw No &[(1, 127)], Number(1), "" Communication(4), Always;
    0x2706 0 StoreCount "Store: highest sub-index" Record U8 Ro No &[(1, 1)], Number(1), "" Computed, Always;
    0x2706 1 StoreCommunication "Store 2704h and 2705h permanently" Record U32 Rw No ANY, Number(0), "" Computed, Always, written specially;
    0x2707 0 BitRateInUse "CAN bit rate load" Var U16 Ro No &[(20, 1000)], Varies, "kbit/s" Computed, Always, read specially;
    0x2708 0 NodeIdInUse "Node ID load" Var U8 Ro No &[(1, 127)], Varies, "" Computed, Always, read specially;
    0x270E 0 AnalogCount "Device analog inputs: highest sub-index" Array U8 Ro No &[(1, 1)], Number(1), "" Computed, Always;
    0x270E 1 AnalogInput "Device analog input 0" Array U32 Ro Tx &[(0, 4095)], Varies, "" Computed, Always, read specially;
    0x2710 0 PullUps "Pull-up resistors" Var U8 Rw No &[(0, 1)], Number(0), "" All(106), Always, written specially;
    0x603F 0 ErrorCode "Error code" Var U16 Ro Tx ANY, Number(0), "" Computed, Always, read specially;
    0x6040 0 Controlword "Controlword" Var U16 Rw RxTx ANY, Number(0), "" Volatile, Always, written specially;
    0x6041 0 Statusword "Statusword" Var U16 Ro Tx ANY, Varies, "" Computed, Always, read specially;
    0x6042 0 TargetVelocityVl "vl target velocity" Var I16 Rw RxTx ANY, Number(0), "velocity unit (208Ch)" Volatile, Always, written specially;
    0x6043 0 VelocityDemandVl "vl velocity demand" Var I16 Ro No ANY, Number(0), "velocity unit (208Ch)" Computed, Always, read specially;
    0x6044 0 VelocityActualVl "vl velocity actual value" Var I16 Ro Tx ANY, Number(0), "velocity unit (208Ch)" Computed, Always, read specially;
    0x6046 0 VelocityAmountCount "vl velocity min max amount: highest sub-index" Array U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x6046 1 MinimumVelocityAmount "Minimum velocity amount" Array U32 Ro No &[(0, 2047)], Number(0), "velocity unit" Computed, Always;
    0x6046 2 MaximumVelocityAmount "Maximum velocity amount" Array U32 Ro No ANY, Number(2047), "velocity unit" Computed, Always, read specially;
    0x6048 0 AccelerationVlCount "vl velocity acceleration: highest sub-index" Record U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x6048 1 AccelerationDeltaSpeed "vl velocity acceleration: delta speed" Record U32 Rw No &[(1, u32::MAX as i64)], Number(1000), "velocity unit" Motor(107), Always;
    0x6048 2 AccelerationDeltaTime "vl velocity acceleration: delta time" Record U16 Ro No ANY, Number(1), "s" Computed, Always;
    0x6049 0 DecelerationVlCount "vl velocity deceleration: highest sub-index" Record U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x6049 1 DecelerationDeltaSpeed "vl velocity deceleration: delta speed" Record U32 Ro No ANY, Number(1000), "velocity unit" Computed, Always, read specially;
    0x6049 2 DecelerationDeltaTime "vl velocity deceleration: delta time" Record U16 Ro No ANY, Number(1), "s" Computed, Always;
    0x605A 0 QuickStopOption "Quick stop option code" Var I16 Rw No listed![1, 2, 5, 6], Number(2), "" Motor(108), Always;
    0x605B 0 ShutdownOption "Shutdown option code" Var I16 Rw No &[(0, 0)], Number(0), "" Volatile, Always;
    0x605C 0 DisableOperationOption "Disable operation option code" Var I16 Rw No &[(1, 1)], Number(1), "" Volatile, Always;
    0x605D 0 HaltOption "Halt option code" Var I16 Rw No &[(1, 1)], Number(1), "" Volatile, Always;
    0x605E 0 FaultReactionOption "Fault reaction option code" Var I16 Rw No &[(2, 2)], Number(2), "" Volatile, Always;
    0x6060 0 ModeOfOperation "Modes of operation" Var I8 Rw RxTx listed![0, 1, 2, 3, 6], Number(0), "" Volatile, Always, written specially;
    0x6061 0 ModeDisplay "Modes of operation display" Var I8 Ro Tx listed![0, 1, 2, 3, 6], Number(0), "" Computed, Always, read specially;
    0x6062 0 PositionDemand "Position demand value" Var I32 Ro Tx ANY, Varies, "microsteps" Computed, Always, read specially;
    0x6063 0 PositionActualInternal "Position actual internal value" Var I32 Ro Tx ANY, Varies, "microsteps" Computed, Always, read specially;
    0x6064 0 PositionActual "Position actual value" Var I32 Ro Tx ANY, Varies, "microsteps" Computed, Always, read specially;
    0x6065 0 FollowingErrorWindow "Following error window" Var U32 Rw No &[(0, i32::MAX as i64)], Number(0), "microsteps" Motor(109), Always, written specially;
    0x6067 0 PositionWindow "Position window" Var U32 Rw No ANY, Number(0xFFFF_FFFF), "increments" Motor(110), Always;
    0x6068 0 PositionWindowTime "Position window time" Var U16 Rw No ANY, Number(0), "ms" Motor(111), Always;
    0x606A 0 SensorSelection "Sensor selection code" Var I16 Rw No listed![-1, 0], Number(-1), "" Motor(112), Always, written specially;
    0x606C 0 VelocityActual "Velocity actual value" Var I32 Ro Tx ANY, Varies, "velocity unit (208Ch)" Computed, Always, read specially;
    0x607A 0 TargetPosition "Target position" Var I32 Rw RxTx ANY, Number(0), "microsteps" Volatile, Always;
    0x607C 0 HomeOffset "Home offset" Var I32 Rw No ANY, Number(0), "microsteps" Motor(113), Always;
    0x607D 0 PositionLimitCount "Software position limit: highest sub-index" Array U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x607D 1 MinimumPositionLimit "Minimum position limit" Array I32 Rw No ANY, Number(i32::MIN as i64), "microsteps" Motor(114), Always;
    0x607D 2 MaximumPositionLimit "Maximum position limit" Array I32 Rw No ANY, Number(i32::MAX as i64), "microsteps" Motor(115), Always;
    0x6081 0 ProfileVelocity "Profile velocity" Var U32 Rw No ANY, Number(1000), "velocity unit (208Ch)" Motor(116), Always;
    0x6083 0 ProfileAcceleration "Profile acceleration" Var U32 Rw No ANY, Number(1000), "acceleration unit (208Eh)" Motor(117), Always;
    0x6084 0 ProfileDeceleration "Profile deceleration" Var U32 Ro No ANY, Number(1000), "acceleration unit (208Eh)" Computed, Always, read specially;
    0x6085 0 QuickStopDeceleration "Quick stop deceleration" Var U32 Rw No ANY, Number(51200), "acceleration unit (208Eh)" Motor(118), Always;
    0x6098 0 HomingMethod "Homing method" Var I8 Rw No listed![0, 1, 2, 3, 5, 17, 18, 19, 21, 33, 34, 35], Number(0), "" Motor(119), Always, written specially;
    0x6099 0 HomingSpeedCount "Homing speeds: highest sub-index" Array U8 Ro No &[(2, 2)], Number(2), "" Computed, Always;
    0x6099 1 HomingFastSpeed "Fast homing speed (search switch)" Array U32 Rw No ANY, Number(500), "velocity unit (208Ch)" Motor(120), Always;
    0x6099 2 HomingSlowSpeed "Slow homing speed (search edge/index)" Array U32 Rw No ANY, Number(100), "velocity unit (208Ch)" Motor(121), Always;
    0x609A 0 HomingAcceleration "Homing acceleration" Var U32 Rw No ANY, Number(1000), "acceleration unit (208Eh)" Motor(122), Always;
    0x60F4 0 FollowingErrorActual "Following error actual value" Var I32 Ro Tx ANY, Varies, "microsteps" Computed, Always, read specially;
    0x60FD 0 DigitalInputs "Digital inputs" Var U32 Ro Tx ANY, Number(0), "" Computed, Always, read specially;
    0x60FF 0 TargetVelocity "Target velocity" Var I32 Rw RxTx ANY, Number(0), "velocity unit (208Ch)" Volatile, Always, written specially;
    0x6502 0 SupportedModes "Supported drive modes" Var U32 Ro No ANY, Number(39), "" Computed, Always;
}
