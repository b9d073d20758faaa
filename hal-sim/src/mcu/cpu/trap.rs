//! Why an instruction cannot be executed.

use rsemu::cpu::arm::v7m::sys::{Exception, fsr};

/// What is wrong with an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trap {
    /// There is no such instruction.
    Undefined,
    /// It is for a coprocessor that is not there, or off.
    NoCoprocessor,
    /// It is not Thumb code.
    State,
    /// A return from an exception that cannot be.
    Return,
    /// An address that is no multiple of the size.
    Unaligned,
    /// A division by zero, which is to be noticed.
    Zero,
    /// There is no memory to execute.
    Fetch,
    /// There is no memory to access.
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
