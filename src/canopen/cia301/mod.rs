//! The services of CiA 301 as values: each is fed with frames and with the time, and gives frames and effects back.
//!
//! They know the objects of a node by what a [`Description`] says, and name one by a value of the type `E`, which is
//! the node's affair. What an SDO asks for is returned, and answered by the node; a PDO that was received gives what it
//! carries. So nothing here leads back to the node, which may change the very services that a master writes to.
//!
//! * `sdo` - the server, one transfer at a time
//! * `pdo`, `record`, `map` - PDOs, their records, and which objects they carry
//! * `nmt` - the states of the node and the commands of the master
//! * `control` - boot-up, heartbeat, guarding, and the watch over the master
//! * `emcy` - emergency messages on their way
//! * `cob`, `abort` - COB-IDs, and why a request is refused

pub(super) mod abort;
pub(super) mod cob;
pub(super) mod control;
pub(super) mod emcy;
mod map;
pub(super) mod nmt;
pub(super) mod pdo;
pub(super) mod record;
pub(super) mod sdo;

pub(super) use map::Map;

use crate::units::Micros;
use control::Control;
use nmt::Nmt;
use pdo::Pdos;
use sdo::Server;

/// The access to an object: whether it may be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// The object is only read.
    Ro,
    /// The object is read and written.
    Rw,
}

/// In which PDOs an object may be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mapping {
    /// In none.
    No,
    /// In those that the node sends.
    Tx,
    /// In those that it sends and in those that it receives.
    RxTx,
}

/// The facts about an object that the services have to know.
#[derive(Clone, Copy, Debug)]
pub(super) struct Description {
    /// Number of bytes that are written to it.
    pub(super) size: u8,
    pub(super) access: Access,
    pub(super) mapping: Mapping,
}

/// The services of a node.
#[derive(Debug)]
pub(super) struct Services<E> {
    /// The state in network management.
    pub(super) state: Nmt,
    pub(super) control: Control,
    pub(super) server: Server<E>,
    pub(super) pdos: Pdos<E>,
}

impl<E: Copy> Services<E> {
    /// The services before their first [reset](Self::reset).
    pub(super) fn new() -> Self {
        Services {
            state: Nmt::PreOperational,
            control: Control::default(),
            server: Server::default(),
            pdos: Pdos::new(),
        }
    }

    /// Enters a state. PDOs begin anew when the node becomes operational, and no SDO outlives a stop.
    pub(super) fn enter(&mut self, now: Micros, state: Nmt) {
        if self.state != state {
            self.state = state;
            self.pdos.forget_data(now);
        }
        if state == Nmt::Stopped {
            self.server = Server::default();
        }
    }

    /// Resets communication: the node boots up, and its heartbeat has this period, 0 for none. The PDOs are to be
    /// [set up](Pdos::set_up) after that.
    pub(super) fn reset(&mut self, now: Micros, period: Micros) {
        self.state = Nmt::PreOperational;
        self.server = Server::default();
        self.control = Control::begin(now, period);
        self.pdos.forget_data(now);
    }

    /// True while PDOs are received and sent.
    pub(super) fn is_operational(&self) -> bool {
        self.state == Nmt::Operational
    }
}
