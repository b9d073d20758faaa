//! The microcontroller: clocks, pins, Embassy tasks.
//!
//! | who | runs in | prio | owns |
//! |---|---|---|---|
//! | timers of Embassy | interrupt of TIM5 | 0 | who is to be woken when |
//! | `encoder` | interrupt of PD14 | 3 | where the count was at an edge of N |
//! | `rs485` | interrupts of USART3, and of TIM2 at the end of a stop bit | 4 | the port, framing, direction |
//! | CAN and USB drivers of Embassy | interrupts of CAN1 and OTG_FS | 5 | the frames and packets that come and go |
//! | `owner` | interrupt of TIM3, each millisecond and when it is called | 6 | the module with SPI1 (`motion_bus`), the inputs and outputs, the CAN interface |
//! | `usb` | thread mode | - | the USB device; its requests go to the owner by a mailbox |
//! | `eeprom` | thread mode | - | the EEPROM with SPI3 |
//! | `analog` | thread mode | - | the ADC |
//! | `watchdog` | thread mode | - | the watchdog, fed while the others give signs of life |
//!
//! A lower number goes first. Anything that goes wrong for good ends in `fault`: motor drivers off, the reason noted,
//! and a restart by the watchdog.

mod analog;
mod can;
mod eeprom;
mod encoder;
mod fault;
mod mail;
mod motion_bus;
mod owner;
mod rs485;
mod signals;
mod spi;
mod tasks;
mod tmcm1140;
mod usb;
mod wake;
mod watchdog;

pub use fault::panicked;
pub use tasks::run;
pub use tmcm1140::Board;

use defmt_rtt as _;

use crate::units::Micros;

/// The time since the firmware started; the ticks of embassy-time are microseconds.
fn now() -> Micros {
    Micros(embassy_time::Instant::now().as_ticks())
}
