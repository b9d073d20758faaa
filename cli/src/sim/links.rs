//! All that the simulator listens to, and how it says so.

use std::io::{self, Write};
use std::net::TcpStream;
use std::os::fd::BorrowedFd;
use std::time::Instant;

use rustix::event::PollFlags;

use super::Options;
use super::control::Controller;
use super::endpoint::Endpoint;
use super::pty::Pty;
use super::tcp::Server;
use crate::failure::Failure;
use crate::virtual_module::{Client, Sent, VirtualModule};
use tmcm::module::Source;

/// The TCP port that is used when none is asked for, if it is free.
const USUAL_PORT: u16 = 4140;
/// The client at the serial port; TCP connections count up from there.
const SERIAL: Client = Client(0);
/// Telegrams that may wait in the module; while there are more, nothing is read from its links.
const BACKLOG: usize = 64;

/// The links of the USB interface of module 1, and the control port.
#[derive(Debug)]
pub struct Links {
    serial: Option<Pty>,
    tcp: Option<Server<Endpoint<TcpStream>>>,
    /// The control port.
    pub control: Option<Server<Controller>>,
    last_client: Client,
}

impl Links {
    /// Opens what the options ask for, and one link of each kind if they ask for none.
    pub fn open(options: &Options) -> Result<Self, Failure> {
        let bare = options.serial.is_none() && options.tcp.is_none();
        let tcp = match &options.tcp {
            Some(address) => Some(Server::listen("--tcp", address)?),
            None if bare => Some(
                Server::bind(&format!("127.0.0.1:{USUAL_PORT}")).or_else(|_| Server::listen("--tcp", "127.0.0.1:0"))?,
            ),
            None => None,
        };
        let control = match &options.control {
            Some(address) => Some(Server::listen("--control", address)?),
            None => None,
        };
        let link = options.serial.as_deref();
        let serial = if bare || link.is_some() { Some(Pty::open(link, SERIAL)?) } else { None };
        Ok(Links { serial, tcp, control, last_client: SERIAL })
    }

    /// Says where the module can be reached, with lines to copy.
    pub fn introduce(&self, out: &mut impl Write) -> io::Result<()> {
        if let Some(pty) = &self.serial {
            let path = pty.path().display();
            writeln!(out, "serial: {path}")?;
            if pty.path() != pty.device() {
                writeln!(out, "    (a link to {})", pty.device().display())?;
            }
            writeln!(out, "    tmcl send {path} \"GAP 1, 0\"")?;
            writeln!(out, "    ConnectionManager(\"--interface usb_tmcl --port {path}\")")?;
            writeln!(out, "    ConnectionManager(\"--interface serial_tmcl --port {path} --data-rate 9600\")")?;
        }
        if let Some(server) = &self.tcp {
            let to = server.reachable();
            writeln!(out, "tcp: {}", server.address())?;
            writeln!(out, "    tmcl send tcp:{to} \"GAP 1, 0\"")?;
            if to.is_ipv4() {
                writeln!(out, "    ConnectionManager(\"--interface socket_serial_tmcl --port {to}\")")?;
            }
        }
        if let Some(server) = &self.control {
            let to = server.reachable();
            writeln!(out, "control: {}", server.address())?;
            writeln!(out, "    echo state | nc {} {}", to.ip(), to.port())?;
        }
        Ok(())
    }

    /// Gives the module the telegrams that have arrived.
    pub fn receive(&mut self, module: &mut VirtualModule) {
        if module.backlog() < BACKLOG
            && let Some(pty) = &mut self.serial
        {
            pty.endpoint.receive(|telegram| module.receive_from(Source::Usb, SERIAL, telegram));
        }
        let Some(server) = &mut self.tcp else { return };
        let last = &mut self.last_client.0;
        server.accept(|stream| {
            *last += 1;
            Endpoint::new(stream, Client(*last))
        });
        for endpoint in &mut server.clients {
            let client = endpoint.client;
            if module.backlog() < BACKLOG {
                endpoint.receive(|telegram| module.receive_from(Source::Usb, client, telegram));
            }
        }
    }

    /// Takes a reply to the client that it is for.
    pub fn send(&mut self, sent: &Sent) {
        if sent.client == SERIAL
            && let Some(pty) = &mut self.serial
        {
            // A reply that nobody reads is lost.
            pty.endpoint.stream.write(&sent.telegram);
        } else if let Some(server) = &mut self.tcp
            && let Some(endpoint) = server.clients.iter_mut().find(|endpoint| endpoint.client == sent.client)
            && !endpoint.stream.write(&sent.telegram)
        {
            // A client that sends and never reads is cut off.
            endpoint.stream.give_up();
        }
    }

    /// Writes what waits and closes connections that are done with.
    pub fn tidy(&mut self, module: &mut VirtualModule) {
        if let Some(pty) = &mut self.serial {
            pty.endpoint.stream.flush();
        }
        if let Some(server) = &mut self.tcp {
            server.clients.retain_mut(|Endpoint { stream, client, .. }| {
                stream.flush();
                let done = stream.ended() && stream.drained() && !module.owes(*client);
                if done || stream.broken() {
                    module.forget(*client);
                }
                !done && !stream.broken()
            });
        }
        if let Some(server) = &mut self.control {
            server.clients.retain_mut(|Controller { stream, .. }| {
                stream.flush();
                !(stream.ended() && stream.drained())
            });
        }
    }

    /// What there is to wait for.
    pub fn interests(&self, module: &VirtualModule) -> Vec<(BorrowedFd<'_>, PollFlags)> {
        let full = module.backlog() >= BACKLOG;
        let mut wanted: Vec<(BorrowedFd<'_>, PollFlags)> = Vec::new();
        wanted.extend(self.serial.as_ref().and_then(|pty| pty.endpoint.stream.interest(full)));
        if let Some(server) = &self.tcp {
            wanted.extend(server.listening().map(|fd| (fd, PollFlags::IN)));
            wanted.extend(server.clients.iter().filter_map(|endpoint| endpoint.stream.interest(full)));
        }
        if let Some(server) = &self.control {
            wanted.extend(server.listening().map(|fd| (fd, PollFlags::IN)));
            wanted.extend(server.clients.iter().filter_map(|controller| controller.stream.interest(false)));
        }
        wanted
    }

    /// When the first unfinished telegram is given up.
    pub fn silence_ends(&self) -> Option<Instant> {
        let serial = self.serial.iter().filter_map(|pty| pty.endpoint.silence_ends());
        let tcp = self.tcp.iter().flat_map(|server| server.clients.iter().filter_map(Endpoint::silence_ends));
        serial.chain(tcp).min()
    }
}
