//! The parameters of the TMCM-3110: those of the TMCM-6110, and those of an ABN encoder for each axis, which has a
//! counter of its own outside the motion controller.

use super::{tmcm1140, tmcm6110};
use crate::param::{ANY, AxisParameter, GlobalParameter, Table, derived};

/// Axis parameters. Slots count from the first slot of the axis.
pub static AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(derived! { AxisParameter;
    of tmcm6110::AXIS.rows, without &[];
    201 EncoderMode "encoder mode" Bits &[(0, 65535)], ReadWrite OnCommand(46) 0 "its meaning is not published: stored, without effect",
    209 ExternalEncoderPosition "encoder position" Microsteps ANY, ReadWrite Volatile 0 "ABN encoder",
    210 ExternalEncoderPrescaler "encoder prescaler" Prescaler &[(0, i32::MAX)], ReadWrite OnCommand(44) 25600 "bits 2..4 are special functions: 4 zero at the next N event, 8 with 4 at every N event, 16 polarity of N",
    212 MaximumExternalEncoderDeviation "maximum encoder deviation" EncoderSteps &[(0, i32::MAX)], ReadWrite OnCommand(45) 0 "0 = off",
    254 StepDirectionMode "step/direction mode" Choice &[(0, 5)], ReadWrite OnCommand(47) 0 "stored, without effect",
});

/// Global parameters of bank 0: as on the TMCM-1140 there is one motion controller.
pub static GLOBAL: &Table<GlobalParameter> = &tmcm1140::GLOBAL;
