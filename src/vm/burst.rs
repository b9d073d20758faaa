//! The commands that need no more than the interpreter's registers, the program and the user variables. They are
//! arithmetic, jumps and calls (manual sections 3.7.16 to 3.7.21, 3.7.28), and GGP, SGP and AGP of user variables.
//!
//! They are executed in bursts, one after the other, with the registers in local variables: nothing outside the
//! interpreter can see or change anything between two of them. A command by itself is a burst of one.

use super::{Condition, Machine, Registers};
use crate::param::USER_VARIABLES;
use crate::tmcl::{Command, Opcode, Status};

/// The number of the bank of global parameters in which the user variables are.
const VARIABLES: u8 = 2;

const CALC: u8 = Opcode::Calc as u8;
const CALCX: u8 = Opcode::Calcx as u8;
const COMP: u8 = Opcode::Comp as u8;
const JC: u8 = Opcode::Jc as u8;
const JA: u8 = Opcode::Ja as u8;
const CSUB: u8 = Opcode::Csub as u8;
const RSUB: u8 = Opcode::Rsub as u8;
const GGP: u8 = Opcode::Ggp as u8;
const SGP: u8 = Opcode::Sgp as u8;
const AGP: u8 = Opcode::Agp as u8;

/// True if a command with this number may be part of a burst.
#[inline(always)]
pub const fn is_brief(opcode: u8) -> bool {
    matches!(opcode, CALC | CALCX | COMP | JC | JA | CSUB | RSUB | GGP | SGP | AGP)
}

impl Machine {
    /// Executes commands from the present one on: at most `most` of them, and only one if a handler may begin after it
    /// or a host steps through the program. It ends before a command that needs more than registers, `program` and
    /// `variables`, and where the program ends. `executed` is told of each command: its address, the status with which
    /// it was refused, and the registers after it. Returns how many there were; 0 if the present command is none of
    /// these. To be called while the program is busy and does not wait.
    #[inline(always)]
    pub fn burst(
        &mut self,
        program: &[[u8; Command::SIZE]],
        variables: &mut [i32; USER_VARIABLES],
        most: u32,
        mut executed: impl FnMut(u16, Command, Option<Status>, &Registers),
    ) -> u32 {
        let most = if self.may_be_interrupted() { most.min(1) } else { most };
        let (mut registers, errors) = (self.registers, self.errors);
        // The commands from the present one on: none where the program ends.
        let from = |address: usize| program.get(address..).unwrap_or_default().iter();
        let address_of = |rest: &[_]| program.len().wrapping_sub(rest.len());
        let mut rest = from(self.counter.into());
        let mut left = most;
        while left > 0 {
            let present = rest.as_slice();
            let Some(bytes) = rest.next() else { break };
            let command = Command::from_bytes(*bytes);
            let Command { opcode, kind, motor, value } = command;
            let mut refused = None;
            match opcode {
                CALC => refused = registers.calc(kind, value).err(),
                CALCX => refused = registers.calcx(kind).err(),
                COMP => registers.compare(value),
                JC => {
                    if Condition::from_number(kind).is_some_and(|condition| registers.meets(condition, errors)) {
                        rest = from(value as usize);
                    }
                }
                JA => rest = from(value as usize),
                // A call that finds the stack full has no effect.
                CSUB => {
                    if self.stack.push(address_of(rest.as_slice()) as u16).is_ok() {
                        rest = from(value as usize);
                    }
                }
                RSUB => {
                    if let Some(back) = self.stack.pop() {
                        rest = from(back.into());
                    }
                }
                GGP | SGP | AGP if motor == VARIABLES => {
                    if let Some(variable) = variables.get_mut(usize::from(kind)) {
                        match opcode {
                            GGP => registers.load(*variable),
                            SGP => *variable = value,
                            _ => *variable = registers.accumulator,
                        }
                    }
                }
                _ => {
                    rest = present.iter();
                    break;
                }
            }
            executed(address_of(present) as u16, command, refused, &registers);
            left = left.wrapping_sub(1);
        }
        let done = most.wrapping_sub(left);
        if done > 0 {
            self.registers = registers;
            self.go_to(address_of(rest.as_slice()) as u16);
        }
        done
    }
}
