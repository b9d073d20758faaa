//! Motors that are moved by a TMC5160 each, which is ramp generator and driver at once.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Level, Output};
use embassy_stm32::pac::spi::vals::Br;

use super::parts::{Chips, Motors};
use crate::board::stm32f4::motion_bus::{Chip, MotionBus, Pace};
use crate::board::stm32f4::pins;
use crate::chip::tmc5160::Tmc5160;
use crate::device::{Controller, Parts};
use crate::module::Hooks;
use crate::motion::tmc5160::Tmc5160Axis;
use crate::store::{Memory, Store};

/// The TMC5160 gets a clock of 16 MHz from outside, so it allows 8 MHz: 84 MHz / 16 = 5.25 MHz. Between two datagrams
/// its select has to be high for two of its clocks and 10 ns: 135 ns, or 23 cycles. Many more cycles pass on the way
/// from the one to the other. The emulated microcontroller refuses an image that is faster. The first edge may follow
/// after 10 ns.
const TMC5160: Pace = Pace { clock: Br::DIV16, setup: 0 };

/// `AXES` motors at as many TMC5160s.
pub struct ChipMotors<const AXES: usize> {
    tmc5160: [Chip; AXES],
    enable: Output<'static>,
}

impl<const AXES: usize> ChipMotors<AXES> {
    /// The chips with their chip selects, and DRV_ENN of all of them, which is high: no current flows.
    pub(crate) fn new(bus: &MotionBus, tmc5160: [Peri<'static, AnyPin>; AXES], enable: Peri<'static, AnyPin>) -> Self {
        ChipMotors { tmc5160: bus.chips(tmc5160, &TMC5160), enable: pins::output(enable, Level::High) }
    }
}

impl<const AXES: usize> Motors<AXES> for ChipMotors<AXES> {
    type Hardware = Tmc5160Axis<Chip>;
    type Controllers = [Controller<Self::Hardware>; AXES];

    fn parts<P: Memory, H: Hooks>(self, store: &'static mut Store<P>) -> Parts<Chips<P, H, Self, AXES>, AXES> {
        let ChipMotors { tmc5160, enable } = self;
        let controllers = tmc5160.map(|chip| Controller::new(Tmc5160::new(chip)));
        Parts { controllers, axes: Tmc5160Axis::axes(), enable, store }
    }
}
