//! The board as devices of embedded-hal, for drivers that do not know of a simulation.

use super::{Board, Chip};
use crate::clock::{Nanos, SECOND};
use core::cell::{Ref, RefCell, RefMut};
use core::convert::Infallible;
use embedded_hal::digital;
use embedded_hal::spi::{self, Operation, SpiDevice};
use std::rc::Rc;

/// Time between chip select and the first clock, and between the last clock and chip select, in nanoseconds: four
/// periods of the TMC429's clock, which needs at least three.
pub const SELECT_TIME: Nanos = 250;

/// A handle to a board, to be used in one thread. Clones are handles to the same board.
#[derive(Clone, Debug)]
pub struct SharedBoard(Rc<RefCell<Board>>);

impl SharedBoard {
    /// Makes `board` shareable.
    pub fn new(board: Board) -> Self {
        Self(Rc::new(RefCell::new(board)))
    }

    /// The board, to look at. The borrow must end before a device or another borrow uses the board.
    #[inline]
    pub fn borrow(&self) -> Ref<'_, Board> {
        if self.0.borrow().behind.is_some() {
            self.0.borrow_mut().catch_up();
        }
        self.0.borrow()
    }

    /// The board, to change it. The borrow must end before a device or another borrow uses the board.
    #[inline]
    pub fn borrow_mut(&self) -> RefMut<'_, Board> {
        let mut board = self.0.borrow_mut();
        board.catch_up();
        board
    }

    /// The virtual time since the board was made, in nanoseconds.
    #[inline]
    pub fn now(&self) -> Nanos {
        self.0.borrow().now
    }

    /// As [`Board::changes`].
    #[inline]
    pub fn changes(&self) -> u64 {
        self.0.borrow().changes()
    }

    /// As [`Board::advance_to`]; what only moves on is moved when somebody looks.
    #[inline]
    pub fn advance_to(&self, to: Nanos) {
        self.0.borrow_mut().pass_to(to);
    }

    /// The SPI device of a chip, with a clock of `hz` (at least 1).
    pub fn spi(&self, chip: Chip, hz: u32) -> SimSpi {
        let hz = u64::from(hz.max(1));
        SimSpi { board: self.clone(), chip, hz, byte: (8 * SECOND / hz, 8 * SECOND % hz) }
    }

    /// The microcontroller's pin that enables the driver when it is low (ENN).
    pub fn enable_pin(&self) -> SimPin {
        SimPin(self.clone())
    }
}

/// An SPI device on the board, which cannot fail. A transaction takes its time on the wire - [`SELECT_TIME`], eight
/// clocks per byte, [`SELECT_TIME`] - and the world moves on meanwhile. It begins no earlier than the chip understands
/// another select.
#[derive(Clone, Debug)]
pub struct SimSpi {
    board: SharedBoard,
    chip: Chip,
    /// The clock in Hz.
    hz: u64,
    /// How long a byte takes: nanoseconds, and parts of another one, of which `hz` are a nanosecond.
    byte: (Nanos, u64),
}

/// The clocks of one transaction. Parts of nanoseconds are kept, so that no rounding adds up and no byte needs a
/// division.
struct Clocks<'a> {
    board: &'a mut Board,
    spi: &'a SimSpi,
    /// When the last byte has ended: nanoseconds, and parts of another one.
    now: (Nanos, u64),
    /// Steps that change nothing but positions are nothing to this transaction.
    ignores_steps: bool,
}

impl Clocks<'_> {
    /// Exchanges bytes with the chip. The answer of a chip on the motion bus is settled with the first byte, which has
    /// the register. The chip only shifts the other bytes until its chip select rises, so all of them are exchanged at
    /// the end of the first. The EEPROM is asked byte by byte.
    fn bytes(&mut self, bytes: &mut [u8]) {
        if self.spi.chip == Chip::At25 {
            bytes.chunks_mut(1).for_each(|byte| self.together(byte));
        } else if !bytes.is_empty() {
            self.together(bytes);
        }
    }

    /// Exchanges bytes at the end of the first of them.
    fn together(&mut self, bytes: &mut [u8]) {
        self.pass(1);
        self.reach();
        self.board.exchange(self.spi.chip, bytes);
        self.pass(bytes.len() as u64 - 1);
    }

    /// So many bytes take their time.
    fn pass(&mut self, bytes: u64) {
        let SimSpi { hz, byte: (whole, part), .. } = *self.spi;
        self.now = (self.now.0 + bytes * whole, self.now.1 + bytes * part);
        while self.now.1 >= hz {
            self.now = (self.now.0 + 1, self.now.1 - hz);
        }
    }

    /// No clocks for some time, from a whole nanosecond on.
    fn pause(&mut self, time: Nanos) {
        self.now = (self.now.0 + time, 0);
    }

    /// Lets the board's time pass until then.
    fn reach(&mut self) {
        if self.ignores_steps {
            self.board.pass_to(self.now.0);
        } else {
            self.board.advance_to(self.now.0);
        }
    }
}

impl spi::ErrorType for SimSpi {
    type Error = Infallible;
}

impl SpiDevice for SimSpi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let mut board = self.board.0.borrow_mut();
        let ignores_steps = match operations {
            [Operation::TransferInPlace([first, ..])] => board.motion.chips().ignores_steps(self.chip, *first),
            _ => false,
        };
        if !ignores_steps {
            board.catch_up();
        }
        let ready = board.ready(self.chip);
        board.advance_to(ready);
        board.select(self.chip);
        let now = (board.now() + SELECT_TIME, 0);
        let mut clocks = Clocks { board: &mut board, spi: self, now, ignores_steps };
        for operation in operations {
            match operation {
                Operation::Read(read) => {
                    read.fill(0);
                    clocks.bytes(read);
                }
                Operation::Write(write) => write.iter().for_each(|&byte| clocks.bytes(&mut [byte])),
                Operation::Transfer(read, write) => {
                    let mut rest = write.iter().copied();
                    read.iter_mut().for_each(|byte| *byte = rest.next().unwrap_or(0));
                    clocks.bytes(read);
                    rest.for_each(|byte| clocks.bytes(&mut [byte]));
                }
                Operation::TransferInPlace(bytes) => clocks.bytes(bytes),
                Operation::DelayNs(time) => clocks.pause(u64::from(*time)),
            }
        }
        clocks.pause(SELECT_TIME);
        clocks.reach();
        board.deselect(self.chip);
        Ok(())
    }
}

/// The pin that enables the drivers while it is low. It cannot fail.
#[derive(Clone, Debug)]
pub struct SimPin(SharedBoard);

impl digital::ErrorType for SimPin {
    type Error = Infallible;
}

impl digital::OutputPin for SimPin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().set_disable_pin(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().set_disable_pin(true);
        Ok(())
    }
}
