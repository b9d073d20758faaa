//! The signals that the module exchanges with each poll: stall and switches, the outputs, what `analog` and `encoder`
//! have read.

use embassy_stm32::gpio::{Input, Output};
use embassy_stm32::pac::GPIOD;
use embassy_stm32::peripherals;
use embassy_stm32::timer::qei::Qei;

use super::{analog, encoder};
use crate::module::{Inputs, Outputs};

/// First of the four pins of port D that are IN0..IN3.
const FIRST_INPUT: usize = 11;

/// The pins of the signals.
pub(super) struct Signals {
    pub(super) stall: Input<'static>,
    /// IN0 and IN3; IN1 and IN2 belong to the encoder's timer, which leaves them readable.
    pub(super) _inputs: [Input<'static>; 2],
    pub(super) _encoder: Qei<'static, peripherals::TIM4>,
    pub(super) outputs: [Output<'static>; 2],
    pub(super) pull_ups: Output<'static>,
    pub(super) led: Output<'static>,
}

impl Signals {
    pub(super) fn read(&self) -> Inputs {
        let port = GPIOD.idr().read().0;
        Inputs {
            digital: core::array::from_fn(|n| port >> (FIRST_INPUT + n) & 1 != 0),
            analog: analog::in0(),
            supply: Some(analog::supply()),
            temperature: analog::temperature(),
            stall: self.stall.is_high(),
            external: encoder::count(),
            null: encoder::edges(),
            ..Inputs::default()
        }
    }

    pub(super) fn write(&mut self, outputs: &Outputs) {
        for (bit, pin) in self.outputs.iter_mut().enumerate() {
            pin.set_level((outputs.digital >> bit & 1 != 0).into());
        }
        self.pull_ups.set_level(outputs.pull_ups.into());
        self.led.set_level(outputs.led.into());
    }
}
