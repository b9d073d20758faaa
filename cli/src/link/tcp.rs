//! A link over TCP.

use std::io::ErrorKind;
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use tmcm::tmcl::binary::Telegram;

use super::exchange::{converse, drop_stale};
use super::{LinkError, Log, Question};
use crate::failure::Failure;
use crate::wording::words;

/// An open connection in non-blocking mode.
#[derive(Debug)]
pub(super) struct Tcp(pub(super) TcpStream);

/// Connects to a port that `tmcl sim` offers with the option `offered_by`, and sends each write at once.
///
/// # Errors
/// There is no such host, or nobody takes the connection within `timeout`.
pub(crate) fn connect(address: &str, timeout: Duration, offered_by: &str) -> Result<TcpStream, Failure> {
    let failed = |error: std::io::Error| {
        let hint = match error.kind() {
            ErrorKind::ConnectionRefused => {
                format!(". Does the virtual module run? Start it with tmcl sim {offered_by}")
            }
            _ => String::new(),
        };
        Failure::Failed(format!("cannot connect to {address}: {}{hint}", words(error)))
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

impl Tcp {
    pub(super) fn connect(address: &str, timeout: Duration) -> Result<Self, Failure> {
        let stream = connect(address, timeout, "--tcp")?;
        let failed = |error: std::io::Error| Failure::Failed(format!("cannot connect to {address}: {}", words(error)));
        stream.set_nonblocking(true).map_err(failed)?;
        Ok(Tcp(stream))
    }

    pub(super) fn exchange(
        &mut self,
        question: &Question,
        timeout: Duration,
        log: &mut Log,
    ) -> Result<Telegram, LinkError> {
        drop_stale(&mut self.0, log);
        converse(&mut self.0, question, timeout, log)
    }
}
