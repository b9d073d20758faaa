//! The core beside that of the library, which executes the same in its own way.
//!
//! They differ on purpose: the library forgets the state of an IT block when an exception comes within it, and it
//! counts more cycles for exceptions than the chip takes. See [`oracle`].

mod exceptions;
mod instructions;
mod oracle;
mod stalls;

use rsemu::cpu::arm::v7m::Config;
use rsemu::cpu::arm::v7m::sys::{Exception, Sys};

use super::core::PRIORITY_BITS;
use super::*;
use crate::random::Random;

/// Memory in the place of peripherals.
#[derive(Debug)]
struct Peripherals {
    ram: Vec<u8>,
    /// Something else has been accessed.
    missed: bool,
}

/// Where it is.
const PERIPHERALS: u32 = 0x4000_0000;
const SIZE: usize = 0x1000;

impl Peripherals {
    fn new() -> Self {
        Self { ram: vec![0; SIZE], missed: false }
    }

    fn cells(&mut self, address: u32, bytes: u32) -> Option<&mut [u8]> {
        let at = address.wrapping_sub(PERIPHERALS) as usize;
        let cells = self.ram.get_mut(at..at.saturating_add(bytes as usize));
        self.missed |= cells.is_none();
        cells
    }
}

impl Bus for Peripherals {
    fn read(&mut self, _: Cycles, address: u32, bytes: u32) -> u32 {
        let cells = self.cells(address, bytes);
        cells.map_or(0, |cells| cells.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte)))
    }

    fn write(&mut self, _: Cycles, address: u32, bytes: u32, value: u32) {
        if let Some(cells) = self.cells(address, bytes) {
            cells.copy_from_slice(&value.to_le_bytes()[..bytes as usize]);
        }
    }
}

/// A random word.
fn word(random: &mut Random) -> u32 {
    random.below(1 << 16) << 16 | random.below(1 << 16)
}

/// Picks one of these.
fn pick<T: Copy>(random: &mut Random, from: &[T]) -> T {
    from[random.below(from.len() as u32) as usize]
}
