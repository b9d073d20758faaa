//! A TCP port of the simulator and the connections to it.

use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

use rustix::fd::{AsFd, BorrowedFd};
use rustix::net::sockopt;
use tmcl_link::wording::words;

use crate::endpoint::Endpoint;
use crate::failure::Failure;
use crate::slcan::HostAdapter;
use crate::stream::Stream;

/// Most connections to one port at a time. With an image each client's request takes about 2 ms of the USB cable, so
/// with 16 clients none waits for 50 ms.
pub const MOST_CONNECTIONS: usize = 16;
/// Pause after a connection could not be accepted for lack of file descriptors or memory.
const PAUSE: Duration = Duration::from_millis(100);
/// Silence after which a connection is probed for whether the client still exists.
const PROBED_AFTER: Duration = Duration::from_secs(10);
/// Time between two probes.
const PROBED_EVERY: Duration = Duration::from_secs(5);
/// Number of probes without an answer after which a connection is closed.
const PROBES: u32 = 3;
/// Most bytes that may wait for a client that does not read; a client for which more would wait is disconnected.
const LIMIT: usize = 64 * 1024;

/// The state that a server keeps for a connection.
pub trait Guest: Sized {
    /// Since when the connection has been idle; `None` if it may not be closed in favour of a new one.
    fn idle_since(&self) -> Option<Instant> {
        None
    }

    /// Closes the connection, because there are too many.
    fn dismiss(self) {}
}

/// A host may wait for bytes that it has not asked for, such as events, so the connection of a host never counts as
/// idle.
impl Guest for Endpoint<TcpStream> {}
impl Guest for HostAdapter<TcpStream> {}

/// A TCP port and its connections.
#[derive(Debug)]
pub struct Server<C> {
    listener: TcpListener,
    address: SocketAddr,
    /// End of the pause in which no connection is accepted.
    paused: Option<Instant>,
    /// True once a refused connection has been reported, until there is room again.
    refusal_told: bool,
    /// The connections.
    pub clients: Vec<C>,
}

impl<C: Guest> Server<C> {
    /// Listens on the address that the user gave for `option`, which is named in error messages.
    pub fn listen(option: &str, address: &str) -> Result<Self, Failure> {
        Self::bind(address).map_err(|error| {
            let hint = match error.kind() {
                std::io::ErrorKind::AddrInUse => "; another program uses that port: give another one, or 0 for any",
                std::io::ErrorKind::PermissionDenied => "; ports below 1024 are not for everybody",
                _ => "",
            };
            Failure::Failed(format!("{option}: cannot listen on {address}: {}{hint}", words(error)))
        })
    }

    /// Listens on an address.
    pub fn bind(address: &str) -> std::io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        Ok(Server { listener, address, paused: None, refusal_told: false, clients: Vec::new() })
    }

    /// The address that the server listens on, with the real port if the system chose one.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// True if other computers may be able to connect.
    pub fn is_open_to_others(&self) -> bool {
        !self.address.ip().to_canonical().is_loopback()
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

    /// Accepts new connections. If there are too many, the connection that has been idle longest is closed, or the new
    /// one if none is idle. Returns a message about the first connection refused since there last was room.
    pub fn accept(&mut self, mut make: impl FnMut(Stream<TcpStream>) -> C) -> Option<String> {
        if self.is_paused() {
            return None;
        }
        self.refusal_told &= self.clients.len() >= MOST_CONNECTIONS;
        for _ in 0..MOST_CONNECTIONS {
            match self.listener.accept() {
                // A connection that breaks before it is set up is ignored.
                Ok((socket, _)) if prepare(&socket).is_err() => {}
                Ok((socket, from)) => {
                    let refused = !self.admit(make(Stream::guarded(socket, LIMIT)));
                    if refused && !std::mem::replace(&mut self.refusal_told, true) {
                        return Some(format!(
                            "{}: the connection from {from} is refused: there are {MOST_CONNECTIONS}, and no more at one time",
                            self.address
                        ));
                    }
                }
                Err(error) if matches!(error.kind(), ErrorKind::ConnectionAborted | ErrorKind::Interrupted) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(_) => {
                    self.paused = Some(Instant::now() + PAUSE);
                    break;
                }
            }
        }
        None
    }

    /// Keeps a new connection; false if it was dismissed because there is no room.
    fn admit(&mut self, guest: C) -> bool {
        if self.clients.len() < MOST_CONNECTIONS {
            self.clients.push(guest);
            return true;
        }
        let idle = self.clients.iter_mut().filter(|client| client.idle_since().is_some());
        let longest = idle.min_by_key(|client| client.idle_since());
        let admitted = longest.is_some();
        match longest {
            Some(longest) => std::mem::replace(longest, guest).dismiss(),
            None => guest.dismiss(),
        }
        admitted
    }

    /// The descriptor to poll for new connections; `None` during a pause.
    pub fn listening(&self) -> Option<BorrowedFd<'_>> {
        (!self.is_paused()).then(|| self.listener.as_fd())
    }

    fn is_paused(&self) -> bool {
        self.paused.is_some_and(|end| Instant::now() < end)
    }
}

/// Sets a new connection up: non-blocking, without delay of small packets, and with probes that end it when the client
/// has vanished without closing the connection.
fn prepare(socket: &TcpStream) -> std::io::Result<()> {
    socket.set_nonblocking(true)?;
    socket.set_nodelay(true)?;
    sockopt::set_socket_keepalive(socket, true)?;
    // A system that does not know one of these, such as Windows before 2017, probes at times of its own.
    let _ = sockopt::set_tcp_keepidle(socket, PROBED_AFTER);
    let _ = sockopt::set_tcp_keepintvl(socket, PROBED_EVERY);
    let _ = sockopt::set_tcp_keepcnt(socket, PROBES);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{self, Sender};

    /// A connection that reports its number when it is dismissed.
    struct Visitor {
        number: usize,
        idle_since: Option<Instant>,
        sent_away: Sender<usize>,
    }

    impl Guest for Visitor {
        fn idle_since(&self) -> Option<Instant> {
            self.idle_since
        }

        fn dismiss(self) {
            self.sent_away.send(self.number).unwrap();
        }
    }

    #[test]
    fn the_connection_that_was_idle_longest_makes_room_else_the_new_one_is_refused() {
        let mut server = Server::bind("127.0.0.1:0").unwrap();
        let (sent_away, gone) = mpsc::channel();
        let mut connections = Vec::new();
        let mut number = 0;
        let mut visit = |server: &mut Server<Visitor>, count: usize| {
            for _ in 0..count {
                connections.push(TcpStream::connect(server.address()).unwrap());
                server.accept(|_| {
                    number += 1;
                    Visitor { number, idle_since: None, sent_away: sent_away.clone() }
                });
            }
            gone.try_iter().collect::<Vec<usize>>()
        };
        assert!(visit(&mut server, MOST_CONNECTIONS).is_empty());
        assert_eq!(visit(&mut server, 1), [MOST_CONNECTIONS + 1], "all others are busy");
        let now = Instant::now();
        for (index, at) in [(4, now + PAUSE), (7, now)] {
            server.clients[index].idle_since = Some(at);
        }
        assert_eq!(visit(&mut server, 3), [8, 5, MOST_CONNECTIONS + 4]);
        assert_eq!((server.clients.len(), server.clients[7].number), (MOST_CONNECTIONS, MOST_CONNECTIONS + 2));
    }
}
