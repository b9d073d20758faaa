//! The instruction table: for each command its number, mnemonic and operands, and whether hosts, programs and the ASCII
//! command line may use it (manual sections 3.5, 3.7).

use super::Command;

/// An operand of a command written with its mnemonic: the field of the command that the operand fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// The type field as a number.
    Kind,
    /// The type field by name; a name stands for its index in the list.
    Named(&'static [&'static str]),
    /// The motor or bank field.
    Motor,
    /// The value field.
    Value,
    /// A zero behind the other operands that fills no field. The manual prints it; it may be left out.
    Zero,
}

/// Meaning of the motor or bank field of a command. Axis numbers are checked before the command is executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorField {
    /// An axis.
    Axis,
    /// An axis, or [`ALL_AXES`] for a form of the command that concerns all axes.
    AxisOrAll,
    /// An axis, or a set of them that [`AxisSet::of`](super::AxisSet::of) knows.
    AxisSet,
    /// A bank of parameters or ports, or no meaning.
    Other,
}

/// Motor field that stands for all axes, as in SCO and MVP COORD.
pub const ALL_AXES: u8 = 255;

/// Value that commands 137 (factory settings) and 255 (software reset) need, as a safeguard.
pub const CONFIRMATION: i32 = 1234;

/// A row of the instruction table.
#[derive(Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Command number.
    pub opcode: Opcode,
    /// Mnemonic; empty for control commands, which have none.
    pub mnemonic: &'static str,
    /// Operands in the order in which they are written.
    pub fields: &'static [Field],
    /// Meaning of the motor field.
    pub motor: MotorField,
    /// True if a host may send the command for immediate execution.
    pub direct: bool,
    /// True if the command may stand in a program.
    pub program: bool,
    /// True if the command may be entered on the ASCII command line (manual section 3.4).
    pub ascii: bool,
    /// True if the command may exchange SPI datagrams with a chip, which costs a program more of its time.
    pub chip: bool,
}

const MVP: &[&str] = &["ABS", "REL", "COORD"];
const RFS: &[&str] = &["START", "STOP", "STATUS"];
/// The kind of RFS that asks for the status of a reference search; the other two begin and end one (manual section
/// 3.7.11).
pub const SEARCH_STATUS: u8 = 2;
const CALC: &[&str] = &["ADD", "SUB", "MUL", "DIV", "MOD", "AND", "OR", "XOR", "NOT", "LOAD"];
const CALCX: &[&str] = &["ADD", "SUB", "MUL", "DIV", "MOD", "AND", "OR", "XOR", "NOT", "LOAD", "SWAP"];
/// Conditions of JC. The manual has no condition ESD, but a flag of this name.
const JC: &[&str] = &["ZE", "NZ", "EQ", "NE", "GT", "GE", "LT", "LE", "ETO", "EAL", "EDV", "EPO", "ESD"];
const WAIT: &[&str] = &["TICKS", "POS", "REFSW", "LIMSW", "RFS"];
const CLE: &[&str] = &["ALL", "ETO", "EAL", "EDV", "EPO", "ESD"];

macro_rules! instructions {
    ($($number:literal $opcode:ident $mnemonic:literal [$($field:expr),*] $motor:ident $direct:literal $program:literal $ascii:literal $chip:literal,)*) => {
        /// Every command number this firmware family knows; the variants are named after the mnemonics.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        #[allow(missing_docs)]
        pub enum Opcode {
            $($opcode = $number,)*
        }

        impl Opcode {
            /// The command with this number, if there is one.
            pub fn from_number(number: u8) -> Option<Self> {
                Instruction::numbered(number).map(|instruction| instruction.opcode)
            }

            /// The command's row of the instruction table.
            pub const fn instruction(self) -> &'static Instruction {
                match self {
                    $(Opcode::$opcode => const { &Instruction {
                        opcode: Opcode::$opcode,
                        mnemonic: $mnemonic,
                        fields: &[$($field),*],
                        motor: MotorField::$motor,
                        direct: $direct != 0,
                        program: $program != 0,
                        ascii: $ascii != 0,
                        chip: $chip != 0,
                    } },)*
                }
            }
        }

        /// All commands in the order of their numbers.
        const ALL: &[Opcode] = &[$(Opcode::$opcode),*];

        /// All instructions, indexed by number: a search would take too long for each command of a program.
        static BY_NUMBER: [Option<&Instruction>; 256] = {
            let mut table = [None; 256];
            $(table[$number] = Some(Opcode::$opcode.instruction());)*
            table
        };
    };
}

use Field::{Kind, Named, Value, Zero};

/// The motor operand, under the name it has in the table below.
const AXIS: Field = Field::Motor;

instructions! {
    // number, variant, mnemonic, operands, motor field, direct mode, program, ASCII, chips
    1 Ror "ROR" [AXIS, Value] Axis 1 1 1 1,
    2 Rol "ROL" [AXIS, Value] Axis 1 1 1 1,
    3 Mst "MST" [AXIS] Axis 1 1 1 1,
    4 Mvp "MVP" [Named(MVP), AXIS, Value] AxisSet 1 1 1 1,
    5 Sap "SAP" [Kind, AXIS, Value] Axis 1 1 1 1,
    6 Gap "GAP" [Kind, AXIS] Axis 1 1 1 1,
    7 Stap "STAP" [Kind, AXIS, Zero] Axis 1 1 1 1,
    8 Rsap "RSAP" [Kind, AXIS, Zero] Axis 1 1 1 1,
    9 Sgp "SGP" [Kind, AXIS, Value] Other 1 1 1 0,
    10 Ggp "GGP" [Kind, AXIS] Other 1 1 1 0,
    11 Stgp "STGP" [Kind, AXIS, Zero] Other 1 1 1 0,
    12 Rsgp "RSGP" [Kind, AXIS, Zero] Other 1 1 1 0,
    13 Rfs "RFS" [Named(RFS), AXIS] Axis 1 1 1 1,
    14 Sio "SIO" [Kind, AXIS, Value] Other 1 1 1 0,
    15 Gio "GIO" [Kind, AXIS] Other 1 1 1 0,
    19 Calc "CALC" [Named(CALC), Value] Other 1 1 0 0,
    20 Comp "COMP" [Value] Other 0 1 0 0,
    21 Jc "JC" [Named(JC), Value] Other 0 1 0 0,
    22 Ja "JA" [Value] Other 0 1 0 0,
    23 Csub "CSUB" [Value] Other 0 1 0 0,
    24 Rsub "RSUB" [] Other 0 1 0 0,
    25 Ei "EI" [Kind] Other 1 1 0 0,
    26 Di "DI" [Kind] Other 1 1 0 0,
    27 Wait "WAIT" [Named(WAIT), AXIS, Value] Other 0 1 0 0,
    28 Stop "STOP" [] Other 0 1 0 0,
    30 Sco "SCO" [Kind, AXIS, Value] AxisOrAll 1 1 1 0,
    31 Gco "GCO" [Kind, AXIS, Zero] AxisOrAll 1 1 1 0,
    32 Cco "CCO" [Kind, AXIS] Axis 1 1 1 1,
    33 Calcx "CALCX" [Named(CALCX)] Other 1 1 0 0,
    34 Aap "AAP" [Kind, AXIS] Axis 1 1 0 1,
    35 Agp "AGP" [Kind, AXIS] Other 1 1 0 0,
    36 Cle "CLE" [Named(CLE)] Other 1 1 0 0,
    37 Vect "VECT" [Kind, Value] Other 1 1 0 0,
    38 Reti "RETI" [] Other 0 1 0 0,
    39 Aco "ACO" [Kind, AXIS] Axis 1 1 0 0,
    64 Uf0 "UF0" [Kind, AXIS, Value] Other 1 1 1 1,
    65 Uf1 "UF1" [Kind, AXIS, Value] Other 1 1 1 1,
    66 Uf2 "UF2" [Kind, AXIS, Value] Other 1 1 1 1,
    67 Uf3 "UF3" [Kind, AXIS, Value] Other 1 1 1 1,
    68 Uf4 "UF4" [Kind, AXIS, Value] Other 1 1 1 1,
    69 Uf5 "UF5" [Kind, AXIS, Value] Other 1 1 1 1,
    70 Uf6 "UF6" [Kind, AXIS, Value] Other 1 1 1 1,
    71 Uf7 "UF7" [Kind, AXIS, Value] Other 1 1 1 1,
    128 StopApplication "" [] Other 1 0 0 0,
    129 RunApplication "" [] Other 1 0 0 0,
    130 StepApplication "" [] Other 1 0 0 0,
    131 ResetApplication "" [] Other 1 0 0 0,
    132 EnterDownload "" [] Other 1 0 0 0,
    133 ExitDownload "" [] Other 1 0 0 0,
    134 ReadMemory "" [] Other 1 0 0 0,
    135 ApplicationStatus "" [] Other 1 0 0 0,
    136 FirmwareVersion "" [] Other 1 0 0 0,
    137 FactorySettings "" [] Other 1 0 0 0,
    138 PositionReachedEvent "" [] Other 1 0 0 0,
    139 EnterAscii "" [] Other 1 0 0 0,
    242 EnterBootloader "" [] Other 1 0 0 0,
    255 SoftwareReset "" [] Other 1 0 0 0,
}

impl Opcode {
    /// Number of the user function, 0 to 7, that the command calls, if it calls one.
    pub(crate) const fn user_function(self) -> Option<u8> {
        let (first, last) = (Opcode::Uf0 as u8, Opcode::Uf7 as u8);
        let number = (self as u8).wrapping_sub(first);
        if number <= last.wrapping_sub(first) { Some(number) } else { None }
    }
}

impl Instruction {
    /// All instructions, in the order of their numbers.
    pub fn all() -> impl Iterator<Item = &'static Instruction> {
        ALL.iter().map(|opcode| opcode.instruction())
    }

    /// The instruction with this number, if there is one.
    #[inline]
    pub fn numbered(number: u8) -> Option<&'static Instruction> {
        BY_NUMBER.get(usize::from(number)).copied().flatten()
    }

    /// The operands that fill a field: all but a [`Field::Zero`] at the end.
    pub fn operands(&self) -> &'static [Field] {
        match self.fields {
            [operands @ .., Field::Zero] => operands,
            all => all,
        }
    }

    /// Number of operands that must be written. A motor at the end may be left out; a user function needs none, because
    /// the meaning of its operands is the user's.
    pub fn required(&self) -> usize {
        match self.operands() {
            [others @ .., Field::Motor] => others.len(),
            _ if self.opcode.user_function().is_some() => 0,
            all => all.len(),
        }
    }

    /// The instruction with this mnemonic, in upper or lower case.
    pub fn by_mnemonic(mnemonic: &str) -> Option<&'static Instruction> {
        Self::all().find(|i| !i.mnemonic.is_empty() && i.mnemonic.eq_ignore_ascii_case(mnemonic))
    }

    /// True when there is a mnemonic, and every field of `command` that the mnemonic form does not show is 0.
    pub(super) fn tells(&self, command: &Command) -> bool {
        let kind = self.fields.iter().any(|f| matches!(f, Field::Kind | Field::Named(_)));
        let (motor, value) = (self.fields.contains(&Field::Motor), self.fields.contains(&Field::Value));
        let hidden = (!kind && command.kind != 0) || (!motor && command.motor != 0) || (!value && command.value != 0);
        !self.mnemonic.is_empty() && !hidden
    }
}
