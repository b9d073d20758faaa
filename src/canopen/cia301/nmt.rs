//! Network management: the states of a node, and the commands of the master.

/// State of a node in network management, by the numbers of a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Nmt {
    /// Only commands of the master and error control.
    Stopped = 4,
    /// All services.
    Operational = 5,
    /// All services but PDOs.
    PreOperational = 127,
}

/// A command of the master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    /// The node enters a state.
    Enter(Nmt),
    /// *Reset node*: the node restarts.
    Restart,
    /// *Reset communication*.
    ResetCommunication,
}

impl Command {
    /// The command in a frame, if it is for the node with this ID, or with 0 for all. A frame of another length than
    /// two is none.
    pub(crate) fn of(data: &[u8], node: u8) -> Option<Self> {
        let [command, to] = data else { return None };
        if *to != 0 && *to != node {
            return None;
        }
        Some(match command {
            0x01 => Command::Enter(Nmt::Operational),
            0x02 => Command::Enter(Nmt::Stopped),
            0x80 => Command::Enter(Nmt::PreOperational),
            0x81 => Command::Restart,
            0x82 => Command::ResetCommunication,
            _ => return None,
        })
    }
}
