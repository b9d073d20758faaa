//! The microcontroller: clocks, pins, Embassy tasks.
//!
//! | who | runs in | prio | owns |
//! |---|---|---|---|
//! | `rs485` | interrupt executor, UART5 | 5 | USART3 (its own interrupt: 4), framing and direction |
//! | `owner` | interrupt executor, UART4 | 6 | the module with SPI1, the inputs and outputs; 1 kHz |
//! | `eeprom` | thread mode | - | the EEPROM with SPI3 |
//!
//! A lower number goes first. They talk through the mailboxes of `mail`, never through shared state.
//! Anything that goes wrong for good ends in `fault`: motor drivers off, and stop.

mod eeprom;
mod fault;
mod mail;
mod owner;
mod rs485;
mod tasks;
mod tmcm1140;

pub use fault::panicked;
pub use tasks::run;
pub use tmcm1140::Board;

use defmt_rtt as _;

use crate::units::Micros;

/// The time since the firmware started; the ticks of embassy-time are microseconds.
fn now() -> Micros {
    Micros(embassy_time::Instant::now().as_ticks())
}
