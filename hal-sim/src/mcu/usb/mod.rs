//! USB: the full-speed controller as a device, and a host that enumerates it as a serial port.

mod device;
mod endpoint;
mod host;
mod otg;

pub use device::UsbDevice;
pub use host::{UsbHost, UsbTimes};
pub(super) use otg::Otg;
