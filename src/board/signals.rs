//! The signals that the module exchanges with the board in each poll: stall output and switches, the outputs, and what
//! `analog` and `encoder` have read.

use embassy_stm32::gpio::{Input, Output};
use embassy_stm32::pac::GPIOD;
use embassy_stm32::peripherals;
use embassy_stm32::timer::qei::Qei;

use super::{analog, encoder};
use crate::device::{ANALOG, Inputs, Outputs};
use crate::module::TMCM_1140_AXES;
use crate::motion::Sensors;

/// Number of the first of the four pins of port D that are IN0 to IN3.
const FIRST_INPUT: usize = 11;
/// The bits of the digital inputs, IN0 in bit 0 to IN3 in bit 3.
const INPUTS: u16 = 0b1111;
/// The bit of IN3, which is the home switch of the axis.
const HOME: u16 = 1 << 3;

/// The pins of the signals.
pub(super) struct Signals {
    /// SG_TST of the TMC262, high while the load value is 0.
    pub(super) stall: Input<'static>,
    /// IN0 and IN3. IN1 and IN2 are inputs of the encoder's timer, where their levels can still be read.
    pub(super) _inputs: [Input<'static>; 2],
    /// The timer that counts the external encoder, kept so that it stays on.
    pub(super) _encoder: Qei<'static, peripherals::TIM4>,
    /// OUT0 and OUT1.
    pub(super) outputs: [Output<'static>; 2],
    /// The pull-up resistors of IN1 to IN3; high is on.
    pub(super) pull_ups: Output<'static>,
    /// LED1, the status LED.
    pub(super) led: Output<'static>,
}

impl Signals {
    /// Reads all inputs of the module.
    pub(super) fn read(&self) -> Inputs<TMCM_1140_AXES> {
        let digital = (GPIOD.idr().read().0 >> FIRST_INPUT) as u16 & INPUTS;
        let axis = Sensors {
            stall: self.stall.is_high(),
            home: digital & HOME != 0,
            // The built-in encoder is not read, because its pins are not known.
            encoder: 0,
            external: encoder::count(),
            null: encoder::edges(),
        };
        let mut analog = [0; ANALOG];
        analog[0] = analog::in0();
        let (supply, temperature) = (Some(analog::supply()), analog::temperature());
        Inputs { axes: [axis], digital, analog, supply, temperature }
    }

    /// Sets all outputs of the module. LED2 is `fault`'s.
    pub(super) fn write(&mut self, outputs: &Outputs) {
        for (bit, pin) in self.outputs.iter_mut().enumerate() {
            pin.set_level((outputs.digital >> bit & 1 != 0).into());
        }
        self.pull_ups.set_level((outputs.pull_ups & 1 != 0).into());
        self.led.set_level(outputs.led.into());
    }
}
