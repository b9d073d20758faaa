//! USB: the full-speed controller as a device, and a host that enumerates it as a serial port.

mod host;
mod otg;

pub use host::{UsbDevice, UsbHost, UsbTimes};
pub(super) use otg::Otg;
