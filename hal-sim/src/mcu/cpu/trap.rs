//! Why an instruction cannot be executed.

use rsemu::cpu::arm::v7m::sys::{Exception, fsr};

/// The reason why an instruction cannot be executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trap {
    /// An instruction that does not exist.
    Undefined,
    /// An instruction for a coprocessor that is not there, or off.
    NoCoprocessor,
    /// Code that is not Thumb code.
    State,
    /// A return from an exception that cannot be.
    Return,
    /// An address that is no multiple of the size.
    Unaligned,
    /// A division by zero, which is to be noticed.
    Zero,
    /// An address at which there is no memory to execute.
    Fetch,
    /// An address at which there is no memory to access.
    Access,
}

impl Trap {
    /// The exception that it raises, and its bits in CFSR (DDI 0403 B3.2.15).
    pub(super) fn exception(self) -> (Exception, u32) {
        match self {
            Self::Undefined => (Exception::USAGE_FAULT, fsr::UF_UNDEFINSTR),
            Self::NoCoprocessor => (Exception::USAGE_FAULT, fsr::UF_NOCP),
            Self::State => (Exception::USAGE_FAULT, fsr::UF_INVSTATE),
            Self::Return => (Exception::USAGE_FAULT, fsr::UF_INVPC),
            Self::Unaligned => (Exception::USAGE_FAULT, fsr::UF_UNALIGNED),
            Self::Zero => (Exception::USAGE_FAULT, fsr::UF_DIVBYZERO),
            Self::Fetch => (Exception::BUS_FAULT, fsr::BF_IBUSERR),
            Self::Access => (Exception::BUS_FAULT, fsr::BF_PRECISERR | fsr::BF_BFARVALID),
        }
    }
}

/// The outcome of an instruction, or a part of one.
pub(super) type Outcome<T = ()> = Result<T, Trap>;
