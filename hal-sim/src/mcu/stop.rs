//! Why a run ends early.

use core::fmt;

use super::misfit::Misfit;

/// The machine cannot go on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The image is none, or not for this microcontroller.
    Image(String),
    /// The firmware uses something that the models do not have, or uses it in a way that does not work.
    Access {
        /// The peripheral, or "nothing".
        peripheral: &'static str,
        /// The register's offset from the start of the peripheral.
        offset: u32,
        /// The address accessed.
        address: u32,
        /// The value written; none when it was a read.
        written: Option<u32>,
        /// Where the program stood right after the access.
        pc: u32,
        /// The mistake, in words.
        reason: &'static str,
    },
    /// The firmware uses a pin otherwise than the board.
    Pin(Misfit),
    /// The firmware executes something that the core does not model.
    Instruction {
        /// Where.
        pc: u32,
        /// The mistake, in words.
        reason: &'static str,
    },
    /// The core has locked up: a fault in the handler of a fault.
    LockedUp {
        /// Where.
        pc: u32,
    },
}

/// An access that ends the run, before it is known where the program stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fault {
    pub(super) peripheral: &'static str,
    pub(super) offset: u32,
    pub(super) address: u32,
    pub(super) written: Option<u32>,
    pub(super) reason: &'static str,
}

impl Fault {
    /// The end of the run, when the program stands at `pc`.
    pub(super) fn stop(self, pc: u32) -> Stop {
        let Self { peripheral, offset, address, written, reason } = self;
        Stop::Access { peripheral, offset, address, written, pc, reason }
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Image(what) => write!(f, "the image cannot be used: {what}"),
            Self::Access { peripheral, offset, address, written, pc, reason } => {
                match written {
                    Some(value) => write!(f, "write of {value:#x} to")?,
                    None => write!(f, "read of")?,
                }
                write!(
                    f,
                    " {peripheral} register {offset:#x} (address {address:#010x}, before pc {pc:#010x}): {reason}"
                )
            }
            Self::Pin(misfit) => misfit.fmt(f),
            Self::Instruction { pc, reason } => write!(f, "instruction at pc {pc:#010x}: {reason}"),
            Self::LockedUp { pc } => write!(f, "the core is locked up at pc {pc:#010x}"),
        }
    }
}

impl core::error::Error for Stop {}
