//! A link over a serial device.

use std::io::ErrorKind;

use serial2::{KeepSettings, SerialPort};

use super::Error;
use crate::system;
use crate::wording::words;

/// Message about a device that another program has.
const IN_USE: &str = "another program uses this port. End it, or wait for its end";

/// Opens a serial device in raw mode, locked against other programs.
pub(super) fn open(path: &str, baud: u32) -> Result<SerialPort, Error> {
    let in_use = || Error(format!("{path}: {IN_USE}"));
    let none = || Error(format!("{path} is not a serial device"));
    // Another program that has the device is to find it as it was.
    let mut port = SerialPort::open(system::port_name(path), KeepSettings).map_err(|error| {
        if system::is_taken(&error) {
            return in_use();
        }
        if system::is_no_port(&error) {
            return none();
        }
        let hint = match error.kind() {
            ErrorKind::NotFound => {
                format!(". Is the module connected? Or start a virtual one: {}", system::VIRTUAL_PORT)
            }
            _ => system::port_hint(&error).into(),
        };
        Error(format!("cannot open {path}: {}{hint}", words(error)))
    })?;
    let failed = |error| Error(format!("cannot set up {path}: {}", words(error)));
    if !system::lock(&port).map_err(failed)? {
        return Err(in_use());
    }
    let mut settings = port.get_configuration().map_err(|_| none())?;
    settings.set_raw();
    let configured = settings.set_baud_rate(baud).and_then(|()| port.set_configuration(&settings));
    configured.map_err(|error| match error.kind() {
        // The library has no kind for a device that has not done what it was told.
        ErrorKind::InvalidInput | ErrorKind::Other => Error(format!("{path} does not do {baud} baud")),
        _ => failed(error),
    })?;
    system::settle(&port, path).map_err(failed)?;
    Ok(port)
}
