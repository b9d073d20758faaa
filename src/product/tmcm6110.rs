//! The parameters of the TMCM-6110. Published are their numbers and names, and some ranges; where nothing is known they
//! are those of the TMCM-1140, in the same slots. The module has no encoders.

use super::tmcm1140;
use crate::param::{AxisParameter, GlobalParameter, Table, derived};

/// Numbers of the parameters of encoders.
const ENCODERS: &[u8] = &[209, 210, 212, 215, 216, 217, 218];

/// Axis parameters. Slots count from the first slot of the axis.
pub static AXIS: Table<AxisParameter> = Table::<AxisParameter>::new(derived! { AxisParameter;
    of tmcm1140::AXIS.rows, without ENCODERS;
    4 MaximumSpeed "maximum positioning speed" Internal &[(0, 2047)], ReadWrite OnCommand(0) 1000 "top speed of positioning ramps; 0: the motor stays where it is",
    5 MaximumAcceleration "maximum acceleration" Internal &[(0, 2047)], ReadWrite OnCommand(1) 1000 "reads back as written; velocity mode takes it as it is, so that with 0 the speed does not change. For positioning the motion controller gets the smallest value from there on that has a PMUL/PDIV pair, at least 2^(153 - 154 - 1) where parameter 4 is above 1448, and at most 2^(153 - 154 + 12) - 1",
    9 HomeSwitch "reference (home) switch state" Flag &[(0, 1)], Read Volatile 0 "logical state; which pin of the module it is, is not published",
    208 DriverErrorFlags "driver error flags" Bits &[(0, 255)], Read Volatile 0 "bits 0 SG, 1 OT, 2 OTPW, 3 S2GA, 4 S2GB, 5 OLA, 6 OLB, 7 STST",
    213 GroupIndex "group index" Number &[(0, 255)], ReadWrite Volatile 0 "axes with the same index also do what ROR, ROL, MST, MVP and RFS tell one of them; 0 = no group",
});

/// Global parameters of bank 0. The axes 0 to 2 are on one motion controller, and the axes 3 to 5 on another.
pub static GLOBAL: Table<GlobalParameter> = Table::<GlobalParameter>::new(derived! { GlobalParameter;
    of tmcm1140::GLOBAL.rows, without &[];
    79 EndSwitchPolarity "end switch polarity" Bits &[(0, 3)], ReadWrite Automatic(12) 0 "1 = reverse polarity of the end switches, bit 0 of axes 0..2, bit 1 of axes 3..5; the home switches stay as they are",
    90 ReverseShaft "reverse shaft" Bits &[(0, 3)], ReadWrite Automatic(19) 0 "direction of the motors, bit 0 of axes 0..2, bit 1 of axes 3..5",
});
