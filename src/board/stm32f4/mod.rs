//! The microcontroller, an STM32F405: its clocks, ports and converters as the firmware uses them. A board gives the
//! pins, and the runtime says who is served; nothing here knows which board and which runtime they are.

pub(super) mod analog;
pub(super) mod can;
pub(super) mod can_link;
pub(super) mod can_node;
pub(super) mod can_tmcl;
pub(super) mod clocks;
pub(super) mod eeprom;
#[cfg_attr(not(feature = "tmcm1140"), expect(dead_code, reason = "only some boards have encoders"))]
pub(super) mod encoder;
pub(super) mod kept;
pub(super) mod line;
pub(super) mod motion_bus;
pub(super) mod pads;
pub(super) mod pins;
pub(super) mod rs485;
mod spi;
pub(super) mod usb;
pub(super) mod wake;
pub(super) mod watchdog;
