//! Why a motion controller did not take a datagram, or did not answer one.

use embedded_hal::spi::{self, ErrorKind};

/// Why a datagram did not get through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The SPI bus failed.
    Spi(E),
    /// The chip did not answer: the bus reads as if no chip drove it, or the version is not that of the chip.
    NoAnswer,
}

impl<E: spi::Error> spi::Error for Error<E> {
    fn kind(&self) -> ErrorKind {
        match self {
            Error::Spi(error) => error.kind(),
            Error::NoAnswer => ErrorKind::Other,
        }
    }
}
