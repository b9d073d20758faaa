//! The look-up table of the microsteps (18.2): a quarter of a wave, stored as the differences between its entries.

use super::registers::{
    Registers,
    address::{MSLUT, MSLUTSEL, MSLUTSTART},
};
use crate::chip::bits::field;

/// The current of coil A at a position in the table of 1024 entries, -248..=247 with the power-on table; coil B is 256
/// entries ahead. The table begins with START_SIN; START_SIN90 is taken to agree with it.
pub(super) fn current(position: i64, registers: &Registers) -> i32 {
    let position = position.rem_euclid(1024) as u32;
    // The second quarter mirrors the first one, and the second half has the opposite sign: from 247 to -248.
    let index = position & 0xFF;
    let value = quarter(if position & 0x100 == 0 { index } else { 255 - index }, registers);
    if position & 0x200 == 0 { value } else { -1 - value }
}

/// The entry `index` of the quarter, 0..=255. Bit n is the difference that leads to entry n. So the table of the reset
/// values is the sine wave that 6.5 gives a formula for, and ends with its START_SIN90. "The difference between entry x
/// and entry x+1" would be off by one.
fn quarter(index: u32, registers: &Registers) -> i32 {
    let select = registers.get(MSLUTSEL);
    let starts = [8, 16, 24].map(|low| field(select, low, 8));
    let start = field(registers.get(MSLUTSTART), 0, 8).cast_signed();
    (1..=index).fold(start, |value, entry| {
        let segment = starts.iter().filter(|start| entry >= **start).count() as u32;
        let bit = registers.field(MSLUT + (entry / 32) as u8, entry % 32, 1);
        value + (field(select, 2 * segment, 2) + bit).cast_signed() - 1
    })
}
