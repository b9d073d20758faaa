//! Motors that are moved by TMC429s, each of three of them at most, and by a TMC262 each.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Level, Output};
use embassy_stm32::pac::spi::vals::Br;

use super::parts::{Chips, Motors};
use crate::board::stm32f4::motion_bus::{Chip, MotionBus, Pace};
use crate::board::stm32f4::pins;
use crate::chip::tmc429::Tmc429;
use crate::device::{Controller, Parts};
use crate::module::Hooks;
use crate::motion::tmc429::Tmc429Tmc262;
use crate::store::{Memory, Store};

/// The TMC429 runs at 16 MHz. Eight of its clocks per bit allow 2 MHz at most: 84 MHz / 64 = 1.3125 MHz. Three of them,
/// 188 ns or 32 cycles, pass before the first edge.
const TMC429: Pace = Pace { clock: Br::DIV64, setup: 16 };
/// The TMC262 allows 4 MHz: 84 MHz / 32 = 2.625 MHz.
const TMC262: Pace = Pace { clock: Br::DIV32, ..TMC429 };

/// `AXES` motors at `N` TMC429s.
pub struct StepMotors<const AXES: usize, const N: usize> {
    tmc429: [Chip; N],
    tmc262: [Chip; AXES],
    enable: Output<'static>,
}

impl<const AXES: usize, const N: usize> StepMotors<AXES, N> {
    /// The chips with their chip selects, and ENN of all TMC262s, which is high: no current flows.
    pub(crate) fn new(
        bus: &MotionBus,
        tmc429: [Peri<'static, AnyPin>; N],
        tmc262: [Peri<'static, AnyPin>; AXES],
        enable: Peri<'static, AnyPin>,
    ) -> Self {
        StepMotors {
            tmc429: bus.chips(tmc429, &TMC429),
            tmc262: bus.chips(tmc262, &TMC262),
            enable: pins::output(enable, Level::High),
        }
    }
}

impl<const AXES: usize, const N: usize> Motors<AXES> for StepMotors<AXES, N> {
    type Hardware = Tmc429Tmc262<Chip, Chip>;
    type Controllers = [Controller<Self::Hardware>; N];

    fn parts<P: Memory, H: Hooks>(self, store: &'static mut Store<P>) -> Parts<Chips<P, H, Self, AXES>, AXES> {
        let StepMotors { tmc429, tmc262, enable } = self;
        let controllers = tmc429.map(|chip| Controller::new(Tmc429::new(chip)));
        Parts { controllers, axes: Tmc429Tmc262::axes(tmc262), enable, store }
    }
}
