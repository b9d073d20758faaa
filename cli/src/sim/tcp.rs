//! TCP ports: somebody who listens, and those who have connected.

use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::{Duration, Instant};

use rustix::net::sockopt;

use super::endpoint::Endpoint;
use super::slcan::HostAdapter;
use super::stream::Stream;
use crate::failure::Failure;

/// Connections at one time to one port. All of them together hold up nobody for 50 ms: with an image a request takes its
/// turn of 2 ms on the USB cable.
pub const MOST_CONNECTIONS: usize = 16;
/// How long nobody is let in after that has failed: there is no file descriptor left, or no memory.
const PAUSE: Duration = Duration::from_millis(100);
/// A connection that has been silent for so long is tried for whether anybody is there.
const TRIED_AFTER: Duration = Duration::from_secs(10);
/// And again after so long.
const TRIED_EVERY: Duration = Duration::from_secs(5);
/// After so many tries without an answer it is at its end.
const TRIES: u32 = 3;
/// Bytes that may wait for a client that does not read. More, and it is cut off.
const LIMIT: usize = 64 * 1024;

/// What is kept of a connection.
pub trait Guest: Sized {
    /// Since when it has been idle, if it may be closed in favour of another.
    fn idle_since(&self) -> Option<Instant> {
        None
    }

    /// There is no room for it: closes it.
    fn dismiss(self) {}
}

/// A host waits for what it has not asked for, too: it is never idle.
impl Guest for Endpoint<TcpStream> {}
impl Guest for HostAdapter<TcpStream> {}

/// A port, and what is kept of each connection to it.
#[derive(Debug)]
pub struct Server<C> {
    listener: TcpListener,
    address: SocketAddr,
    /// Until when nobody is let in.
    paused: Option<Instant>,
    /// It has been said that no more connections are taken.
    refusal_told: bool,
    /// The connections.
    pub clients: Vec<C>,
}

impl<C: Guest> Server<C> {
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
        Ok(Server { listener, address, paused: None, refusal_told: false, clients: Vec::new() })
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

    /// Takes those who have connected since the last call. Where there is no room the one that has been idle longest
    /// is closed, or the new one if none is idle; gives what there is to be told of that, the first time until there is a
    /// place again.
    pub fn accept(&mut self, mut make: impl FnMut(Stream<TcpStream>) -> C) -> Option<String> {
        if self.is_paused() {
            return None;
        }
        self.refusal_told &= self.clients.len() >= MOST_CONNECTIONS;
        for _ in 0..MOST_CONNECTIONS {
            match self.listener.accept() {
                // A connection that breaks this early is no loss.
                Ok((socket, _)) if prepare(&socket).is_err() => {}
                Ok((socket, from)) => {
                    let refused = !self.admit(make(Stream::new(socket, LIMIT)));
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

    /// Gives a new guest a place; false if there is none.
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

    /// What to wait on for new connections; none while nobody is let in.
    pub fn listening(&self) -> Option<BorrowedFd<'_>> {
        (!self.is_paused()).then(|| self.listener.as_fd())
    }

    fn is_paused(&self) -> bool {
        self.paused.is_some_and(|end| Instant::now() < end)
    }
}

/// Makes a new connection one that makes nobody wait, and that ends when nobody is there any more: who vanishes, without a
/// word, keeps no place.
fn prepare(socket: &TcpStream) -> std::io::Result<()> {
    socket.set_nonblocking(true)?;
    socket.set_nodelay(true)?;
    sockopt::set_socket_keepalive(socket, true)?;
    sockopt::set_tcp_keepidle(socket, TRIED_AFTER)?;
    sockopt::set_tcp_keepintvl(socket, TRIED_EVERY)?;
    Ok(sockopt::set_tcp_keepcnt(socket, TRIES)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{self, Sender};

    /// Says its number when it is sent away.
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
    fn who_has_been_idle_longest_makes_room_and_else_the_new_one_goes() {
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
