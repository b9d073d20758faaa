//! The microcontroller and its board: clocks, pins, interrupts and Embassy tasks. All that is not the same on the host
//! is here, on three floors, each of which uses only those declared above it (`tests/layers.rs` keeps it so):
//!
//! * `stm32f4` - the microcontroller: clocks, ports, converters, watchdog. A board is no more to it than the pins that
//!   it is given.
//! * `boards` - the boards, one file each, with every pin: a board sets up the microcontroller and hands its parts out.
//! * `runtime` - what runs on a board: the owner of the firmware, tasks, mailboxes, faults.
//!
//! So a board is written without knowing what will run on it, and what runs knows a board only by the names that all of
//! them have.
//!
//! | part | runs in | priority | owns |
//! |---|---|---|---|
//! | timers of Embassy | interrupt of TIM5 | 0 | the queue of tasks that wait for a time |
//! | `stm32f4/encoder` | interrupt of the pin of N | 3 | the counts at the edges of N |
//! | `stm32f4/rs485` | interrupts of USART3, and of TIM2 at the end of a stop bit | 4 | the port, framing, direction |
//! | USB driver of Embassy | interrupt of OTG_FS | 5 | the packets that come and go |
//! | `runtime/owner` | interrupts of TIM3, each millisecond and when a link asks for it, and of CAN: received frames, free mailboxes | 6 | the firmware's logic with SPI1 (`motion_bus`), the inputs and outputs, the CAN controller |
//! | `runtime/usb_link` | thread mode | - | the USB device; its requests go to the owner by a mailbox |
//! | `runtime/keeper` | thread mode | - | the EEPROM with SPI3 |
//! | `stm32f4/analog` | thread mode | - | the ADC |
//! | `stm32f4/watchdog` | thread mode | - | the watchdog, fed while the others give signs of life |
//!
//! An interrupt of a lower number interrupts those of higher ones. A fault after which the firmware cannot go on ends
//! in `runtime/fault`: motor drivers off, the reason noted, and a restart by the watchdog.

mod stm32f4;

mod boards;

mod runtime;

pub use runtime::{Around, Canopen, Room, Runs, Tmcl, panicked, run};

#[doc(hidden)]
pub use cortex_m_rt::entry;

use defmt_rtt as _;
