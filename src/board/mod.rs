//! The microcontroller and its board: clocks, pins, interrupts and Embassy tasks. All that is not the same on the host
//! is here.
//!
//! | part | runs in | priority | owns |
//! |---|---|---|---|
//! | timers of Embassy | interrupt of TIM5 | 0 | the queue of tasks that wait for a time |
//! | `encoder` | interrupt of the pin of N | 3 | the counts at the edges of N |
//! | `rs485` | interrupts of USART3, and of TIM2 at the end of a stop bit | 4 | the port, framing, direction |
//! | USB driver of Embassy | interrupt of OTG_FS | 5 | the packets that come and go |
//! | `owner` | interrupts of TIM3, each millisecond and when a link asks for it, and of CAN: received frames, free mailboxes | 6 | the firmware's logic with SPI1 (`motion_bus`), the inputs and outputs, the CAN controller |
//! | `usb` | thread mode | - | the USB device; its requests go to the owner by a mailbox |
//! | `eeprom` | thread mode | - | the EEPROM with SPI3 |
//! | `analog` | thread mode | - | the ADC |
//! | `watchdog` | thread mode | - | the watchdog, fed while the others give signs of life |
//!
//! An interrupt of a lower number interrupts those of higher ones. A fault after which the firmware cannot go on ends
//! in `fault`: motor drivers off, the reason noted, and a restart by the watchdog.

mod analog;
mod can;
mod can_node;
mod canopen;
mod clocks;
mod eeprom;
#[cfg_attr(not(feature = "tmcm1140"), expect(dead_code, reason = "only some boards have encoders"))]
mod encoder;
mod ends;
mod fault;
mod firmware;
mod kept;
mod line;
mod mail;
mod motion_bus;
mod owner;
mod pads;
mod parts;
mod pins;
mod rs485;
mod safe;
mod signals;
mod spi;
mod tasks;
#[cfg(any(feature = "tmcm1140", feature = "tmcm6110"))]
mod tmc429_tmc262;
#[cfg(feature = "tmcm3212")]
mod tmc5160;
mod tmcl;
#[cfg(feature = "tmcm1140")]
mod tmcm1140;
#[cfg(feature = "tmcm3212")]
mod tmcm3212;
#[cfg(feature = "tmcm6110")]
mod tmcm6110;
mod usb;
mod wake;
mod watchdog;

pub use can::Identifiers;
pub use ends::Ends;
pub use fault::panicked;
pub use firmware::Firmware;
pub use owner::Room;
pub use tasks::run;

// The board of this image. Another one is another file, and another line here and above.
#[cfg(feature = "tmcm1140")]
use tmcm1140 as chosen;
#[cfg(all(feature = "tmcm3212", not(any(feature = "tmcm1140", feature = "tmcm6110"))))]
use tmcm3212 as chosen;
#[cfg(all(feature = "tmcm6110", not(feature = "tmcm1140")))]
use tmcm6110 as chosen;

/// The firmware that speaks TMCL, for the product `P` on this board.
pub type Tmcl<P> = tmcl::Tmcl<chosen::Chips<P>, { chosen::AXES }>;
/// The node of CANopen, for the product `P` on this board.
pub type Canopen<P> = canopen::Canopen<chosen::Chips<P>>;

#[cfg(any(
    all(feature = "tmcm1140", feature = "tmcm6110"),
    all(feature = "tmcm1140", feature = "tmcm3212"),
    all(feature = "tmcm6110", feature = "tmcm3212")
))]
compile_error!("an image is for one board: give the feature of that one alone");

use defmt_rtt as _;

use crate::units::Micros;

/// The time since the firmware started. The ticks of embassy-time are microseconds.
fn now() -> Micros {
    Micros(embassy_time::Instant::now().as_ticks())
}
