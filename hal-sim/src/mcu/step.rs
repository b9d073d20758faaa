//! The work of the core, step by step, for who wants to see it: profiles, latencies.

use crate::board::Chip;

/// Words of interrupt lines.
pub(super) const LINES: usize = 3;

/// The kind of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// An instruction.
    Instruction,
    /// The exception of this number is entered: 16 and up are the interrupts.
    Entry(u16),
    /// The core sleeps.
    Sleep,
    /// Rounds of a loop that waits for a register; they are not executed one by one.
    Wait {
        /// How many instructions they have.
        instructions: u64,
    },
}

/// A step of the core.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The core cycle in which it begins.
    pub at: u64,
    /// How many cycles it takes.
    pub cycles: u64,
    /// The act that is done.
    pub act: Act,
    /// The address of the instruction, or where the program stands.
    pub pc: u32,
    /// Number of the exception that is handled after the step; 0 in thread mode.
    pub exception: u16,
    /// Whether PRIMASK keeps interrupts out after the step.
    pub masked: bool,
    /// Interrupts that are enabled and wanted, after the step, one bit each: by their line or by the program.
    pub wanted: [u32; LINES],
    /// The chip that is selected on the motion bus when the step begins.
    pub chip: Option<Chip>,
    /// Cycles for which the core has waited for the flash memory. They are part of the step's only where that is asked
    /// for.
    pub stalls: u64,
    /// Whether a word is on the wire there then.
    pub clocked: bool,
}

/// Takes steps as they are done.
pub(super) type Observer<'a> = Option<&'a mut dyn FnMut(Step)>;

/// The core after a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// The exception that has been entered in it.
    pub(super) entered: Option<u16>,
    pub(super) exception: u16,
    pub(super) masked: bool,
    /// Interrupts that are enabled, and that the program or their line has asked for, one bit each.
    pub(super) enabled: [u32; LINES],
    pub(super) wanted: [u32; LINES],
}
