//! A link over TCP.

use std::io::ErrorKind;
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use super::Error;
use crate::wording::words;

/// Connects to a port that `tmcl sim` offers with the option `offered_by`, and sends each write at once.
///
/// # Errors
/// There is no such host, or nobody takes the connection within `timeout`.
pub fn connect(address: &str, timeout: Duration, offered_by: &str) -> Result<TcpStream, Error> {
    let failed = |error: std::io::Error| {
        let hint = match error.kind() {
            ErrorKind::ConnectionRefused => {
                format!(". Does the virtual module run? Start it with tmcl sim {offered_by}")
            }
            _ => String::new(),
        };
        Error(format!("cannot connect to {address}: {}{hint}", words(error)))
    };
    let mut last = std::io::Error::new(ErrorKind::NotFound, "there is no such host");
    for resolved in address.to_socket_addrs().map_err(failed)? {
        match TcpStream::connect_timeout(&resolved, timeout) {
            Ok(stream) => {
                stream.set_nodelay(true).map_err(failed)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(failed(last))
}
