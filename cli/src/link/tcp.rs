//! A link over TCP.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use tmcm::tmcl::binary::Telegram;

use super::{LinkError, read_reply};
use crate::failure::Failure;

/// An open connection in non-blocking mode.
#[derive(Debug)]
pub(super) struct Tcp(pub(super) TcpStream);

impl Tcp {
    pub(super) fn connect(address: &str, timeout: Duration) -> Result<Self, Failure> {
        let failed = |error: std::io::Error| {
            let hint = match error.kind() {
                ErrorKind::ConnectionRefused => ". Does the virtual module run? Start it with tmcl sim --tcp",
                _ => "",
            };
            Failure::Failed(format!("cannot connect to {address}: {error}{hint}"))
        };
        let mut last = std::io::Error::new(ErrorKind::NotFound, "there is no such host");
        for resolved in address.to_socket_addrs().map_err(failed)? {
            match TcpStream::connect_timeout(&resolved, timeout) {
                Ok(stream) => {
                    stream.set_nodelay(true).map_err(failed)?;
                    stream.set_nonblocking(true).map_err(failed)?;
                    return Ok(Tcp(stream));
                }
                Err(error) => last = error,
            }
        }
        Err(failed(last))
    }

    pub(super) fn exchange(&mut self, request: &Telegram, timeout: Duration) -> Result<Telegram, LinkError> {
        let mut late = [0; 256];
        while self.0.read(&mut late).is_ok_and(|count| count > 0) {}
        // The write does not block, because a telegram fits the socket's buffer.
        self.0.write_all(request)?;
        read_reply(&mut self.0, timeout)
    }
}
