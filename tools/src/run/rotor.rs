//! Where the rotor of an axis is while that is not where the counter of its motion controller says.

use hal_sim::control::AxisState;
use tmcm::param::{AxisParameter, GlobalParameter};
use tmcm::tmcl::{Command, Opcode};
use tmcm_sim::NativeModule;

use crate::product::{Product, axis_number, global_number};

/// Units of position of the world in a full step.
const FULL_STEP: i64 = hal_sim::world::motor::FULL_STEP;
/// Number of axes that one motion controller of the TMCM-6110 moves, with one setting of the direction.
const AXES_OF_A_CONTROLLER: usize = 3;

/// The position of the rotor in microsteps of an axis, on the scale of the counter; `None` while the rotor is where the
/// counter says, to a full step.
pub(super) fn elsewhere(
    module: &mut NativeModule,
    product: Product,
    axis: usize,
    counter: i32,
    state: &AxisState,
) -> Option<i32> {
    if state.lost_steps == 0 {
        return None;
    }
    let motor = u8::try_from(axis).ok()?;
    let mut axis_value = |parameter| {
        let number = axis_number(Some(product), parameter)?;
        module.read(Command::new(Opcode::Gap as u8, number, motor, 0))
    };
    let resolution = axis_value(AxisParameter::MicrostepResolution)?;
    let reversed = match axis_value(AxisParameter::ReverseShaft) {
        Some(flag) => flag != 0,
        None => {
            let number = global_number(Some(product), GlobalParameter::ReverseShaft)?;
            let bits = module.read(Command::new(Opcode::Ggp as u8, number, 0, 0))?;
            bits >> (usize::from(motor) / AXES_OF_A_CONTROLLER) & 1 != 0
        }
    };
    let microsteps = 1_i64.checked_shl(u32::try_from(resolution).ok()?)?;
    let behind = (state.field - state.rotor) * microsteps / FULL_STEP;
    i32::try_from(i64::from(counter) - if reversed { -behind } else { behind }).ok()
}
