//! TCP ports: somebody who listens, and those who have connected.

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};

use super::stream::Stream;
use crate::failure::Failure;

/// Connections at one time to one port.
const MOST_CONNECTIONS: usize = 200;
/// Bytes that may wait for a client that does not read. More, and it is cut off.
const LIMIT: usize = 64 * 1024;

/// A port, and what is kept of each connection to it.
#[derive(Debug)]
pub struct Server<C> {
    listener: TcpListener,
    address: SocketAddr,
    /// The connections.
    pub clients: Vec<C>,
}

impl<C> Server<C> {
    /// Listens on the address that `option` was given as.
    pub fn listen(option: &str, address: &str) -> Result<Self, Failure> {
        Self::bind(address).map_err(|error| {
            let hint = match error.kind() {
                std::io::ErrorKind::AddrInUse => "; another program uses that port: give another one, or 0 for any",
                std::io::ErrorKind::PermissionDenied => "; ports below 1024 are not for everybody",
                _ => "",
            };
            Failure::Failed(format!("{option}: cannot listen on {address}: {error}{hint}"))
        })
    }

    /// Listens on an address.
    pub fn bind(address: &str) -> std::io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        Ok(Server { listener, address, clients: Vec::new() })
    }

    /// The address it listens on, with the real port.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// An address that a client on this computer can connect to.
    pub fn reachable(&self) -> SocketAddr {
        let mut address = self.address;
        match address {
            SocketAddr::V4(v4) if v4.ip().is_unspecified() => address.set_ip(std::net::Ipv4Addr::LOCALHOST.into()),
            SocketAddr::V6(v6) if v6.ip().is_unspecified() => address.set_ip(std::net::Ipv6Addr::LOCALHOST.into()),
            _ => {}
        }
        address
    }

    /// Takes those who have connected since the last call.
    pub fn accept(&mut self, mut make: impl FnMut(Stream<TcpStream>) -> C) {
        while self.has_room() {
            let Ok((socket, _)) = self.listener.accept() else { return };
            // A connection that breaks this early is no loss.
            if socket.set_nonblocking(true).is_ok() && socket.set_nodelay(true).is_ok() {
                self.clients.push(make(Stream::new(socket, LIMIT)));
            }
        }
    }

    /// What to wait on for new connections; none while there are too many.
    pub fn listening(&self) -> Option<BorrowedFd<'_>> {
        self.has_room().then(|| self.listener.as_fd())
    }

    fn has_room(&self) -> bool {
        self.clients.len() < MOST_CONNECTIONS
    }
}
