//! Several pins at a time.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Input, Level, Output, Pull, Speed};

/// Makes these pins inputs, which are read as [`Line`](super::line::Line)s only. A destructor would disconnect them.
pub(super) fn listen<const N: usize>(pins: [Peri<'static, AnyPin>; N], pull: Pull) {
    core::mem::forget(pins.map(|pin| Input::new(pin, pull)));
}

/// Makes these pins outputs with this level.
pub(super) fn outputs<const N: usize>(pins: [Peri<'static, AnyPin>; N], level: Level) -> [Output<'static>; N] {
    pins.map(|pin| Output::new(pin, level, Speed::Low))
}

/// Makes a pin a chip select, which is high.
pub(super) fn select(pin: Peri<'static, AnyPin>) -> Output<'static> {
    Output::new(pin, Level::High, Speed::Medium)
}
