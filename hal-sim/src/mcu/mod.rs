//! The emulated microcontroller: an STM32F405 that runs the firmware's flash image as it is, on the same board
//! model as the native core.
//!
//! A Cortex-M4 core executes the image; around it stand the peripherals, one file each, with the registers and
//! names of the reference manual (RM0090). Time is counted in core cycles at the clock that RCC makes; while the
//! core sleeps, or waits for a status register, time goes on to the next event. A run is reproducible to the byte.
//!
//! What is not modelled is not guessed: an access to a register that the models do not have ends the run with
//! [`Stop`], which says where.
//!
//! | layer | files |
//! |---|---|
//! | what is used from outside | `machine`, `step`, `stop`, `serial`, `log` |
//! | the core and its memories | `cpu`, `accelerator`, `elf` |
//! | addresses, clocks, interrupts, DMA requests between the peripherals | `soc`, `unit`, `timebase` |
//! | the peripherals | `rcc`, `gpio`, `timer`, `usart`, `spi` ... |
//! | what the pins are connected to | `pinout`, `wiring`, `misfit`, `rs485` |

mod accelerator;
mod adc;
mod can;
mod cpu;
mod dbgmcu;
mod dma;
mod elf;
mod exti;
mod flash;
mod gpio;
mod iwdg;
mod log;
mod machine;
mod misfit;
mod peripheral;
pub(crate) mod pinout;
mod pwr;
mod rcc;
mod rs485;
mod select;
mod serial;
mod soc;
mod spi;
mod step;
mod stop;
mod syscfg;
mod timebase;
mod timer;
mod unit;
mod usart;
mod usb;
mod wiring;

pub use can::{Can, CanBus, CanFrame};
pub use cpu::Cpu;
pub use elf::mark;
pub use log::{Log, LogLine};
pub use machine::{BitRates, Counters, Machine, Part, Waiting};
pub use misfit::Misfit;
pub use pinout::{Pin, Pinout};
pub use rs485::Rs485;
pub use serial::Character;
pub use step::{Act, Step};
pub use stop::Stop;
pub use usb::{UsbDevice, UsbHost, UsbTimes};
pub use wiring::Wiring;
