//! The registers of TMCL programs: accumulator, X register and error flags, with the arithmetic on them
//! (manual sections 3.7.16, 3.7.28, 3.7.31). Direct mode works on the same registers.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

/// An operation of CALC and CALCX, by its type number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// Accumulator plus operand.
    Add,
    /// Accumulator minus operand.
    Sub,
    /// Accumulator times operand.
    Mul,
    /// Accumulator by operand; 0 if that is zero.
    Div,
    /// Remainder; the accumulator itself if the operand is zero.
    Mod,
    /// Bitwise and.
    And,
    /// Bitwise or.
    Or,
    /// Bitwise exclusive or.
    Xor,
    /// Bitwise not: of the accumulator by CALC, of the X register by CALCX.
    Not,
    /// Operand to accumulator by CALC, accumulator to X register by CALCX.
    Load,
    /// Exchange of accumulator and X register; CALCX only.
    Swap,
}

impl Operation {
    /// The operation with this type number, 0..=10.
    pub const fn from_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Operation::Add,
            1 => Operation::Sub,
            2 => Operation::Mul,
            3 => Operation::Div,
            4 => Operation::Mod,
            5 => Operation::And,
            6 => Operation::Or,
            7 => Operation::Xor,
            8 => Operation::Not,
            9 => Operation::Load,
            10 => Operation::Swap,
            _ => return None,
        })
    }
}

/// Error flags, by their number in CLE (manual section 3.7.31).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ErrorFlag {
    /// ETO: a WAIT timed out.
    Timeout = 1,
    /// EAL: driver alarm.
    Alarm = 2,
    /// EDV: encoder deviation.
    Deviation = 3,
    /// EPO: a positioning move ended before its target.
    Position = 4,
    /// ESD: the motor is locked by under-voltage.
    Shutdown = 5,
}

impl ErrorFlag {
    /// Number of the last flag; CLE takes 0, all, up to here.
    pub const LAST: u8 = ErrorFlag::Shutdown as u8;
}

/// Accumulator, X register and error flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Registers {
    /// The accumulator.
    pub accumulator: i32,
    /// The X register.
    pub x: i32,
    errors: u8,
}

impl Registers {
    /// CALC: accumulator and a constant. False for SWAP, which CALC has not.
    pub fn calc(&mut self, operation: Operation, operand: i32) -> bool {
        let a = self.accumulator;
        self.accumulator = match operation {
            Operation::Not => !a,
            Operation::Load => operand,
            Operation::Swap => return false,
            _ => binary(operation, a, operand),
        };
        true
    }

    /// CALCX: accumulator and X register.
    pub fn calcx(&mut self, operation: Operation) {
        match operation {
            Operation::Not => self.x = !self.x,
            Operation::Load => self.x = self.accumulator,
            Operation::Swap => core::mem::swap(&mut self.accumulator, &mut self.x),
            _ => self.accumulator = binary(operation, self.accumulator, self.x),
        }
    }

    /// Sets an error flag; it stays until it is cleared.
    pub fn raise(&mut self, flag: ErrorFlag) {
        self.errors |= bit(flag as u8);
    }

    /// True while an error flag is set.
    pub fn raised(&self, flag: ErrorFlag) -> bool {
        self.errors & bit(flag as u8) != 0
    }

    /// CLE: clears the flag with this number, or all by 0. False for an unknown number.
    pub fn clear(&mut self, number: u8) -> bool {
        match number {
            0 => self.errors = 0,
            1..=ErrorFlag::LAST => self.errors &= !bit(number),
            _ => return false,
        }
        true
    }
}

const fn bit(number: u8) -> u8 {
    1_u8.wrapping_shl(number as u32)
}

/// Two operands, wrapping at 32 bits; nothing a program can write faults.
#[expect(clippy::arithmetic_side_effects, reason = "division by zero has arms of its own")]
fn binary(operation: Operation, a: i32, b: i32) -> i32 {
    match operation {
        Operation::Add => a.wrapping_add(b),
        Operation::Sub => a.wrapping_sub(b),
        Operation::Mul => a.wrapping_mul(b),
        Operation::Div if b == 0 => 0,
        Operation::Div => a.wrapping_div(b),
        Operation::Mod if b == 0 => a,
        Operation::Mod => a.wrapping_rem(b),
        Operation::And => a & b,
        Operation::Or => a | b,
        Operation::Xor => a ^ b,
        Operation::Not | Operation::Load | Operation::Swap => a,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn calc(a: i32, operation: Operation, b: i32) -> i32 {
        let mut registers = Registers { accumulator: a, ..Registers::default() };
        assert!(registers.calc(operation, b));
        registers.accumulator
    }

    #[test]
    fn arithmetic_wraps_and_never_faults() {
        assert_eq!(calc(i32::MAX, Operation::Add, 1), i32::MIN);
        assert_eq!(calc(i32::MIN, Operation::Sub, 1), i32::MAX);
        assert_eq!(calc(65_536, Operation::Mul, 65_537), 65_536);
        assert_eq!(calc(-7, Operation::Div, 2), -3);
        assert_eq!(calc(-7, Operation::Mod, 2), -1);
        assert_eq!(calc(5, Operation::Div, 0), 0);
        assert_eq!(calc(5, Operation::Mod, 0), 5);
        assert_eq!(calc(i32::MIN, Operation::Div, -1), i32::MIN);
        assert_eq!(calc(i32::MIN, Operation::Mod, -1), 0);
        assert_eq!(calc(0b1100, Operation::Xor, 0b1010), 0b0110);
        assert_eq!(calc(0, Operation::Not, 9), -1);
    }

    #[test]
    fn calcx_not_inverts_the_x_register() {
        let mut registers = Registers { accumulator: 3, x: 5, ..Registers::default() };
        registers.calcx(Operation::Not);
        assert_eq!((registers.accumulator, registers.x), (3, !5));
        registers.calcx(Operation::Swap);
        assert_eq!((registers.accumulator, registers.x), (!5, 3));
        registers.calcx(Operation::Mul);
        assert_eq!((registers.accumulator, registers.x), (!5 * 3, 3));
        assert!(!registers.calc(Operation::Swap, 0));
    }

    #[test]
    fn flags_stay_until_cleared() {
        let mut registers = Registers::default();
        registers.raise(ErrorFlag::Position);
        registers.raise(ErrorFlag::Timeout);
        assert!(registers.clear(4) && !registers.raised(ErrorFlag::Position));
        assert!(registers.raised(ErrorFlag::Timeout));
        assert!(registers.clear(0) && !registers.raised(ErrorFlag::Timeout));
        assert!(!registers.clear(6));
    }
}
