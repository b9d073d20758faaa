//! Several pins at a time.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Level, Output, Speed};

/// Makes these pins outputs with this level.
pub(crate) fn outputs<const N: usize>(pins: [Peri<'static, AnyPin>; N], level: Level) -> [Output<'static>; N] {
    pins.map(|pin| output(pin, level))
}

/// Makes a pin an output with this level.
pub(crate) fn output(pin: Peri<'static, AnyPin>, level: Level) -> Output<'static> {
    Output::new(pin, level, Speed::Low)
}

/// Makes a pin a chip select, which is high.
pub(crate) fn select(pin: Peri<'static, AnyPin>) -> Output<'static> {
    Output::new(pin, Level::High, Speed::Medium)
}
