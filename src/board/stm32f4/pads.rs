//! The pads of the debug port, which ask for factory settings when they are connected with each other at power-up.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, OutputType, Pin, Pull, Speed};

/// Number of pulses with which the pads are tested.
const PULSES: usize = 10;

/// True if the pads of SWDIO and SWCLK are connected with each other, that is, if one follows the level of the other.
/// With a debugger attached the pins are left alone, and the answer is false.
pub(crate) fn connected(mut data: Peri<'static, impl Pin>, mut clock: Peri<'static, impl Pin>) -> bool {
    if cortex_m::peripheral::DCB::is_debugger_attached() {
        return false;
    }
    let mut follows = true;
    {
        let mut out = Flex::new(data.reborrow());
        let mut input = Flex::new(clock.reborrow());
        input.set_as_input(Pull::Up);
        out.set_as_output(Speed::Low);
        for pulse in 0..2 * PULSES {
            let high = pulse % 2 != 0;
            out.set_level(high.into());
            // 3360 cycles are 20 us, enough for the pull-up resistor of 40 kOhm to lift the line.
            cortex_m::asm::delay(3_360);
            follows &= input.is_high() == high;
        }
    }
    // The pins are made the debug port again, as after reset: function 0, SWDIO with a pull-up, SWCLK with a pull-down
    // resistor.
    Flex::new(data).set_as_af_unchecked(0, AfType::output_pull(OutputType::PushPull, Speed::VeryHigh, Pull::Up));
    Flex::new(clock).set_as_af_unchecked(0, AfType::input(Pull::Down));
    follows
}
