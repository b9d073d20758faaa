//! All links of the simulator: the USB link of module 1, the buses and the control port.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::Instant;

use rustix::event::PollFlags;
use rustix::fd::{AsFd, BorrowedFd};
use tmcm_sim::VirtualModule;
use tmcm_sim::client::{Client, Sent};
use tmcm_sim::fleet::{Fleet, Lost};

use crate::control::Controller;
use crate::endpoint::{Arrival, Endpoint};
use crate::failure::Failure;
use crate::options::Options;
use crate::pty::{self, Master, Pty, Vacant};
use crate::slcan::HostAdapter;
use crate::tcp::{Guest, Server};

/// The TCP ports that are used by default, if they are free: for the USB link, and for the CAN bus.
const USUAL_PORT: u16 = 4140;
const USUAL_CAN_PORT: u16 = 4142;
/// The clients at the pseudo terminals; clients on TCP connections are numbered from 3 on.
const SERIAL: Client = Client(0);
const RS485: Client = Client(1);
const SLCAN: Client = Client(2);
/// The option of the pseudo terminal of the USB link.
const SERIAL_OPTION: &str = "--serial";

/// The open links.
#[derive(Debug)]
pub struct Links {
    pub(crate) serial: Option<Pty<Endpoint<Master>>>,
    pub(crate) tcp: Option<Server<Endpoint<TcpStream>>>,
    pub(crate) rs485: Option<Pty<Endpoint<Master>>>,
    pub(crate) slcan: Option<Pty<HostAdapter<Master>>>,
    pub(crate) slcan_tcp: Option<Server<HostAdapter<TcpStream>>>,
    /// The control port.
    pub control: Option<Server<Controller>>,
    /// The place of the pseudo terminal of the USB link while that has hung up.
    vacant: Option<Vacant>,
    last_client: Client,
}

impl Links {
    /// Opens the links that the options ask for. If they ask for none, it opens a serial port and a TCP port, or for a
    /// CANopen node a CAN adapter on a TCP port.
    pub fn open(options: &Options) -> Result<Self, Failure> {
        let bare = options.default_usb();
        let tcp = if bare { Some(usual("--tcp", USUAL_PORT)?) } else { listen("--tcp", options.tcp.as_deref())? };
        let slcan_tcp = if options.default_can() {
            Some(usual("--slcan-tcp", USUAL_CAN_PORT)?)
        } else {
            listen("--slcan-tcp", options.slcan_tcp.as_deref())?
        };
        let serial = if bare && pty::EXIST {
            Some(Pty::open(SERIAL_OPTION, None, |stream| Endpoint::new(stream, SERIAL))?)
        } else {
            at_path(SERIAL_OPTION, options.serial.as_deref(), SERIAL)?
        };
        let serial = serial.map(Pty::of_usb);
        let slcan = options.slcan.as_deref();
        let adapter = |link| Pty::open("--slcan", Some(link), |stream| HostAdapter::new(Endpoint::new(stream, SLCAN)));
        Ok(Links {
            serial,
            tcp,
            rs485: at_path("--rs485", options.rs485.as_deref(), RS485)?,
            slcan: slcan.map(adapter).transpose()?,
            slcan_tcp,
            control: listen("--control", options.control.as_deref())?,
            vacant: None,
            last_client: SLCAN,
        })
    }

    /// The TCP ports to which other computers may be able to connect, as options.
    pub(crate) fn open_to_others(&self) -> Vec<String> {
        fn option<C: Guest>(option: &str, server: Option<&Server<C>>) -> Option<String> {
            let server = server.filter(|server| server.is_open_to_others())?;
            Some(format!("{option} {}", server.address()))
        }
        let ports = [
            option("--tcp", self.tcp.as_ref()),
            option("--slcan-tcp", self.slcan_tcp.as_ref()),
            option("--control", self.control.as_ref()),
        ];
        ports.into_iter().flatten().collect()
    }

    /// Accepts connections and passes to the modules what has arrived, a limited number of bytes per client. Returns
    /// messages for the user.
    pub fn receive(&mut self, fleet: &mut Fleet<impl VirtualModule>) -> Vec<String> {
        let last = &mut self.last_client.0;
        let mut next = || {
            *last += 1;
            Client(*last)
        };
        let mut told = Vec::new();
        if let Some(server) = &mut self.tcp {
            told.extend(server.accept(|stream| Endpoint::over_tcp(stream, next())));
        }
        if let Some(server) = self.tcp.as_mut().filter(|_| fleet.is_hung_up()) {
            // Who comes while the cable is out finds the port, but nobody there.
            server.clients.clear();
        }
        if let Some(server) = &mut self.slcan_tcp {
            told.extend(server.accept(|stream| HostAdapter::new(Endpoint::new(stream, next()))));
        }
        if let Some(pty) = &mut self.serial {
            usb(fleet, &mut pty.end);
        }
        for endpoint in self.tcp.iter_mut().flat_map(|server| &mut server.clients) {
            usb(fleet, endpoint);
        }
        if let Some(pty) = &mut self.rs485 {
            pty.end.receive(fleet.unread_rs485(), |arrival| match arrival {
                Arrival::Bytes(bytes) => fleet.send_rs485(bytes),
                Arrival::Silence => fleet.silence_rs485(),
            });
        }
        self.slcan.iter_mut().for_each(|pty| pty.end.receive(fleet));
        self.slcan_tcp.iter_mut().flat_map(|server| &mut server.clients).for_each(|port| port.receive(fleet));
        told
    }

    /// Does to the links what has become of the modules: drops what hosts have sent in vain, so that it does not reach
    /// a module that gets power later. Ends the connections of the USB link if its cable was pulled out so that hosts
    /// see it, and makes a new pseudo terminal when it is plugged in. Returns a message for the user.
    pub fn follow(&mut self, fleet: &mut Fleet<impl VirtualModule>) -> Option<String> {
        let lost = fleet.take_lost();
        self.lose(lost);
        if lost.hosts {
            for endpoint in self.tcp.iter_mut().flat_map(|server| server.clients.drain(..)) {
                fleet.forget_usb(endpoint.client);
            }
            if let Some(pty) = self.serial.take() {
                self.vacant = Some(pty.hang_up());
            }
        }
        let vacant = self.vacant.as_mut().filter(|_| !fleet.is_hung_up())?;
        Some(match vacant.try_to_occupy(SERIAL_OPTION, |stream| Endpoint::new(stream, SERIAL))? {
            Ok(pty) => {
                let message = format!("the port of the USB link is {} again", pty.path().display());
                (self.serial, self.vacant) = (Some(pty.of_usb()), None);
                message
            }
            Err(failure) => failure.to_string(),
        })
    }

    /// Drops what hosts have sent on the links in `lost`.
    pub fn lose(&mut self, lost: Lost) {
        if lost.usb {
            self.serial.iter_mut().for_each(|pty| pty.end.throw_away(|_| {}));
            self.tcp.iter_mut().flat_map(|server| &mut server.clients).for_each(|endpoint| endpoint.throw_away(|_| {}));
        }
        if lost.buses {
            self.rs485.iter_mut().for_each(|pty| pty.end.throw_away(|_| {}));
            self.slcan.iter_mut().for_each(|pty| pty.end.throw_away());
            self.slcan_tcp.iter_mut().flat_map(|server| &mut server.clients).for_each(HostAdapter::throw_away);
        }
    }

    /// Writes what the modules have sent to the hosts.
    pub fn send(&mut self, fleet: &mut Fleet<impl VirtualModule>) {
        while let Some((module, sent)) = fleet.sent() {
            // Only module 1 has hosts at its USB connector.
            if module == 0 {
                self.reply(&sent);
            }
        }
        let bytes = fleet.rs485();
        if let Some(pty) = self.rs485.as_mut().filter(|_| !bytes.is_empty()) {
            pty.end.stream.write(&bytes);
        }
        while let Some(heard) = fleet.can() {
            self.slcan.iter_mut().for_each(|pty| pty.end.hear(&heard));
            self.slcan_tcp.iter_mut().flat_map(|server| &mut server.clients).for_each(|port| port.hear(&heard));
        }
    }

    fn reply(&mut self, sent: &Sent) {
        if sent.client == SERIAL
            && let Some(pty) = &mut self.serial
        {
            // A reply that the host does not read is lost, as on a real port.
            pty.end.stream.write(&sent.bytes);
        } else if let Some(server) = &mut self.tcp
            && let Some(endpoint) = server.clients.iter_mut().find(|endpoint| endpoint.client == sent.client)
            && !endpoint.stream.write(&sent.bytes)
        {
            // A client that sends and never reads is disconnected.
            endpoint.stream.give_up();
        }
    }

    /// Writes bytes that have waited, and closes the connections that have ended. `at_rest` is true while time stands
    /// still, so that nothing more comes although the modules are busy.
    pub fn tidy(&mut self, fleet: &mut Fleet<impl VirtualModule>, at_rest: bool) {
        let quiet = at_rest || !fleet.is_busy();
        self.serial.iter_mut().chain(&mut self.rs485).for_each(|pty| pty.end.stream.flush());
        self.slcan.iter_mut().for_each(|pty| pty.end.endpoint.stream.flush());
        if let Some(server) = &mut self.tcp {
            let ended = fleet.take_ended();
            server.clients.retain_mut(|Endpoint { stream, client, .. }| {
                stream.flush();
                if ended.contains(client) {
                    stream.give_up();
                }
                let done = stream.ended() && stream.drained() && !fleet.owes_usb(*client);
                if done || stream.broken() {
                    fleet.forget_usb(*client);
                }
                !done && !stream.broken()
            });
        }
        if let Some(server) = &mut self.slcan_tcp {
            server.clients.retain_mut(|port| {
                let Endpoint { stream, client, .. } = &mut port.endpoint;
                stream.flush();
                // A host that sends nothing more may still receive frames while the modules are busy.
                let done = stream.ended() && stream.drained() && quiet && fleet.unsent_frames(client.0) == 0;
                if done || stream.broken() {
                    fleet.forget_adapter(client.0);
                }
                !done && !stream.broken()
            });
        }
        if let Some(server) = &mut self.control {
            server.clients.retain_mut(|controller| !controller.finish());
        }
    }

    /// The descriptors and events to poll for.
    pub fn interests(&self) -> Vec<(BorrowedFd<'_>, PollFlags)> {
        let mut wanted: Vec<(BorrowedFd<'_>, PollFlags)> = Vec::new();
        wanted.extend(self.files().filter_map(Endpoint::interest));
        wanted.extend(self.sockets().filter_map(Endpoint::interest));
        let tcp = self.tcp.as_ref().map(Server::listening);
        let slcan_tcp = self.slcan_tcp.as_ref().map(Server::listening);
        let control = self.control.as_ref().map(Server::listening);
        wanted.extend([tcp, slcan_tcp, control].into_iter().flatten().flatten().map(|fd| (fd, PollFlags::IN)));
        let controllers = self.control.iter().flat_map(|server| &server.clients);
        wanted.extend(controllers.filter_map(Controller::interest));
        wanted
    }

    /// True if lines at the control port wait for the next turn.
    pub fn has_lines(&self) -> bool {
        self.control.iter().flat_map(|server| &server.clients).any(Controller::has_unread)
    }

    /// The connections to the control port.
    pub fn controllers(&mut self) -> &mut [Controller] {
        self.control.as_mut().map_or(&mut [], |server| &mut server.clients)
    }

    /// When the first silence on a link is to be reported.
    pub fn silence_ends(&self) -> Option<Instant> {
        let files = self.files().filter_map(Endpoint::silence_ends);
        files.chain(self.sockets().filter_map(Endpoint::silence_ends)).min()
    }

    fn files(&self) -> impl Iterator<Item = &Endpoint<Master>> {
        let slcan = self.slcan.iter().map(|pty| &pty.end.endpoint);
        self.serial.iter().chain(&self.rs485).map(|pty| &pty.end).chain(slcan)
    }

    fn sockets(&self) -> impl Iterator<Item = &Endpoint<TcpStream>> {
        let slcan = self.slcan_tcp.iter().flat_map(|server| &server.clients).map(|port| &port.endpoint);
        self.tcp.iter().flat_map(|server| &server.clients).chain(slcan)
    }
}

fn listen<C: Guest>(option: &str, address: Option<&str>) -> Result<Option<Server<C>>, Failure> {
    address.map(|address| Server::listen(option, address)).transpose()
}

/// A server at the usual port, or at a free one.
fn usual<C: Guest>(option: &str, port: u16) -> Result<Server<C>, Failure> {
    Server::bind(&format!("127.0.0.1:{port}")).or_else(|_| Server::listen(option, "127.0.0.1:0"))
}

fn at_path(option: &str, link: Option<&Path>, client: Client) -> Result<Option<Pty<Endpoint<Master>>>, Failure> {
    link.map(|link| Pty::open(option, Some(link), |stream| Endpoint::new(stream, client))).transpose()
}

/// Passes to module 1 what has arrived from a client on the USB link.
fn usb<T: Read + Write + AsFd>(fleet: &mut Fleet<impl VirtualModule>, endpoint: &mut Endpoint<T>) {
    let (client, unread) = (endpoint.client, fleet.unread_usb(endpoint.client));
    endpoint.receive(unread, |arrival| match arrival {
        Arrival::Bytes(bytes) => fleet.hear_usb(client, bytes),
        Arrival::Silence => fleet.silence_usb(client),
    });
}
