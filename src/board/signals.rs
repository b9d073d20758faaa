//! The signals that the module exchanges with each poll: stall and switches, the outputs, what `analog` and `encoder`
//! have read.

use embassy_stm32::gpio::{Input, Output};
use embassy_stm32::pac::GPIOD;
use embassy_stm32::peripherals;
use embassy_stm32::timer::qei::Qei;

use super::{analog, encoder};
use crate::device::{ANALOG, Inputs, Outputs};
use crate::module::TMCM_1140_AXES;
use crate::motion::Sensors;

/// First of the four pins of port D that are IN0 to IN3.
const FIRST_INPUT: usize = 11;
/// Bits of the inputs, as they are numbered in the manual: IN0 to IN3.
const INPUTS: u16 = 0b1111;
/// IN3 is the home switch of the axis.
const HOME: u16 = 1 << 3;

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
    pub(super) fn read(&self) -> Inputs<TMCM_1140_AXES> {
        let digital = (GPIOD.idr().read().0 >> FIRST_INPUT) as u16 & INPUTS;
        let axis = Sensors {
            stall: self.stall.is_high(),
            home: digital & HOME != 0,
            // The built-in encoder is not connected: its pins are not known.
            encoder: 0,
            external: encoder::count(),
            null: encoder::edges(),
        };
        let mut analog = [0; ANALOG];
        analog[0] = analog::in0();
        let (supply, temperature) = (Some(analog::supply()), analog::temperature());
        Inputs { axes: [axis], digital, analog, supply, temperature }
    }

    pub(super) fn write(&mut self, outputs: &Outputs) {
        for (bit, pin) in self.outputs.iter_mut().enumerate() {
            pin.set_level((outputs.digital >> bit & 1 != 0).into());
        }
        self.pull_ups.set_level((outputs.pull_ups & 1 != 0).into());
        self.led.set_level(outputs.led.into());
    }
}
