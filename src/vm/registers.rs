//! Accumulator, X register and flags, with the arithmetic on them (manual sections 3.7.16 to 3.7.18, 3.7.28,
//! 3.7.31). Commands from a host work on the same registers as the program.

use core::cmp::Ordering;

use crate::tmcl::Status;

/// An operation of CALC and CALCX, by its type number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Operation {
    /// Accumulator plus operand.
    Add,
    /// Accumulator minus operand.
    Sub,
    /// Accumulator times operand.
    Mul,
    /// Accumulator divided by operand; 0 if the operand is zero.
    Div,
    /// Remainder of that division; the accumulator itself if the operand is zero.
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
    #[inline(always)]
    const fn from_number(number: u8) -> Result<Self, Status> {
        Ok(match number {
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
            _ => return Err(Status::WrongType),
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
    /// Number of the last flag. CLE takes 0, which stands for all flags, to this number.
    pub const LAST: u8 = ErrorFlag::Shutdown as u8;
}

/// The error flags. They stay set until they are cleared; unlike the arithmetic flags they are not restored when an
/// interrupt handler ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Errors(u8);

impl Errors {
    /// Sets a flag.
    pub fn raise(&mut self, flag: ErrorFlag) {
        self.0 |= bit(flag as u8);
    }

    /// True while a flag is set.
    pub const fn raised(self, flag: ErrorFlag) -> bool {
        self.0 & bit(flag as u8) != 0
    }

    /// CLE: clears the flag with this number, or all flags for 0. False for an unknown number.
    pub fn clear(&mut self, number: u8) -> bool {
        match number {
            0 => self.0 = 0,
            1..=ErrorFlag::LAST => self.0 &= !bit(number),
            _ => return false,
        }
        true
    }
}

/// A condition of JC, by its type number (manual section 3.7.18).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// ZE: the value loaded last into the accumulator, or the difference of the last COMP, is zero.
    Zero,
    /// NZ: the opposite of [`Condition::Zero`].
    NotZero,
    /// EQ: in the last COMP the accumulator was equal to the operand.
    Equal,
    /// NE: in the last COMP the accumulator was not equal to the operand.
    NotEqual,
    /// GT: in the last COMP the accumulator was greater than the operand.
    Greater,
    /// GE: in the last COMP the accumulator was greater than or equal to the operand.
    GreaterOrEqual,
    /// LT: in the last COMP the accumulator was lower than the operand.
    Lower,
    /// LE: in the last COMP the accumulator was lower than or equal to the operand.
    LowerOrEqual,
    /// ETO, EAL, EDV, EPO: an error flag is set. ESD is an extension of the manual's list.
    Error(ErrorFlag),
}

impl Condition {
    /// The condition with this type number, 0..=12.
    #[inline(always)]
    pub const fn from_number(number: u8) -> Option<Self> {
        Some(match number {
            0 => Condition::Zero,
            1 => Condition::NotZero,
            2 => Condition::Equal,
            3 => Condition::NotEqual,
            4 => Condition::Greater,
            5 => Condition::GreaterOrEqual,
            6 => Condition::Lower,
            7 => Condition::LowerOrEqual,
            8 => Condition::Error(ErrorFlag::Timeout),
            9 => Condition::Error(ErrorFlag::Alarm),
            10 => Condition::Error(ErrorFlag::Deviation),
            11 => Condition::Error(ErrorFlag::Position),
            12 => Condition::Error(ErrorFlag::Shutdown),
            _ => return None,
        })
    }
}

/// Accumulator, X register and arithmetic flags. RETI restores all of them, so an interrupt handler may use them
/// freely.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Registers {
    /// The accumulator.
    pub accumulator: i32,
    /// The X register.
    pub x: i32,
    /// The zero flag: the value loaded last, or the difference of the last COMP, was zero.
    pub zero: bool,
    /// How the accumulator compared with the operand of the last COMP; `None` before the first COMP.
    pub compared: Option<Ordering>,
}

impl Registers {
    /// Loads the accumulator and sets the zero flag accordingly.
    #[inline(always)]
    pub fn load(&mut self, value: i32) {
        self.accumulator = value;
        self.zero = value == 0;
    }

    /// CALC: the operation with this type number on accumulator and constant.
    ///
    /// # Errors
    /// [`Status::WrongType`] if there is no such operation, or for SWAP, which only CALCX has.
    #[inline(always)]
    pub fn calc(&mut self, kind: u8, operand: i32) -> Result<(), Status> {
        let a = self.accumulator;
        self.load(match Operation::from_number(kind)? {
            Operation::Not => !a,
            Operation::Load => operand,
            Operation::Swap => return Err(Status::WrongType),
            operation => binary(operation, a, operand),
        });
        Ok(())
    }

    /// CALCX: the operation with this type number on accumulator and X register.
    ///
    /// # Errors
    /// [`Status::WrongType`] if there is no such operation.
    #[inline(always)]
    pub fn calcx(&mut self, kind: u8) -> Result<(), Status> {
        match Operation::from_number(kind)? {
            Operation::Not => self.x = !self.x,
            Operation::Load => self.x = self.accumulator,
            Operation::Swap => {
                let x = core::mem::replace(&mut self.x, self.accumulator);
                self.load(x);
            }
            operation => self.load(binary(operation, self.accumulator, self.x)),
        }
        Ok(())
    }

    /// COMP: compares the accumulator with the operand.
    #[inline(always)]
    pub fn compare(&mut self, operand: i32) {
        let ordering = self.accumulator.cmp(&operand);
        self.zero = ordering.is_eq();
        self.compared = Some(ordering);
    }

    /// True when a condition of JC holds. Before the first COMP of a program EQ, GT, GE, LT and LE do not hold, and NE
    /// does.
    #[inline(always)]
    pub fn meets(&self, condition: Condition, errors: Errors) -> bool {
        match condition {
            Condition::Zero => self.zero,
            Condition::NotZero => !self.zero,
            Condition::Equal => self.compared.is_some_and(Ordering::is_eq),
            Condition::NotEqual => !self.compared.is_some_and(Ordering::is_eq),
            Condition::Greater => self.compared.is_some_and(Ordering::is_gt),
            Condition::GreaterOrEqual => self.compared.is_some_and(Ordering::is_ge),
            Condition::Lower => self.compared.is_some_and(Ordering::is_lt),
            Condition::LowerOrEqual => self.compared.is_some_and(Ordering::is_le),
            Condition::Error(flag) => errors.raised(flag),
        }
    }
}

const fn bit(number: u8) -> u8 {
    1_u8.wrapping_shl(number as u32)
}

/// The result of an operation on two operands. Results wrap at 32 bits, and division by zero has a result, too,
/// because no program may stop the firmware.
#[expect(clippy::arithmetic_side_effects, reason = "division by zero has arms of its own")]
#[inline(always)]
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
        registers.calc(operation as u8, b).unwrap();
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
        registers.calcx(Operation::Not as u8).unwrap();
        assert_eq!((registers.accumulator, registers.x), (3, !5));
        registers.calcx(Operation::Swap as u8).unwrap();
        assert_eq!((registers.accumulator, registers.x), (!5, 3));
        registers.calcx(Operation::Mul as u8).unwrap();
        assert_eq!((registers.accumulator, registers.x), (!5 * 3, 3));
        assert_eq!(registers.calc(Operation::Swap as u8, 0), Err(Status::WrongType));
        assert_eq!((registers.calc(11, 0), registers.calcx(11)), (Err(Status::WrongType), Err(Status::WrongType)));
    }

    #[test]
    fn zero_follows_the_loaded_value_and_the_other_conditions_follow_comp() {
        let met = |registers: &Registers| {
            (0..8)
                .filter(|n| registers.meets(Condition::from_number(*n).unwrap(), Errors::default()))
                .collect::<Vec<_>>()
        };
        let mut registers = Registers::default();
        assert_eq!(met(&registers), [1, 3], "after a reset all flags are clear");
        registers.compare(1);
        assert_eq!(met(&registers), [1, 3, 6, 7]);
        registers.compare(0);
        assert_eq!(met(&registers), [0, 2, 5, 7]);
        registers.load(5);
        assert_eq!(met(&registers), [1, 2, 5, 7]);
        registers.compare(i32::MIN);
        assert_eq!(met(&registers), [1, 3, 4, 5], "the comparison does not overflow");
        registers.calcx(Operation::Swap as u8).unwrap();
        assert_eq!(met(&registers), [0, 3, 4, 5]);
        registers.calcx(Operation::Not as u8).unwrap();
        assert_eq!((registers.x, registers.zero), (!5, true), "NOT leaves the accumulator alone, and its flag");
    }

    #[test]
    fn flags_stay_until_cleared() {
        let mut errors = Errors::default();
        errors.raise(ErrorFlag::Position);
        errors.raise(ErrorFlag::Timeout);
        assert!(errors.clear(4) && !errors.raised(ErrorFlag::Position));
        assert!(errors.raised(ErrorFlag::Timeout));
        assert!(errors.clear(0) && !errors.raised(ErrorFlag::Timeout));
        assert!(!errors.clear(6));
    }
}
