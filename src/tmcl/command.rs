//! A TMCL command: seven bytes in a telegram and in program memory (manual section 3.1).

/// A command as it is sent. Any number is possible, because a command with an unknown number must be answered, stored
/// and shown unchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// Command number.
    pub opcode: u8,
    /// Type field: parameter number, port, operation or variant.
    pub kind: u8,
    /// Motor or bank field.
    pub motor: u8,
    /// Value field.
    pub value: i32,
}

impl Command {
    /// Length in program memory and in a CAN frame, in bytes.
    pub const SIZE: usize = 7;
    /// Commands with this number or a higher one are carried out even while a program is downloaded, and cannot stand
    /// in a program.
    pub const FIRST_CONTROL: u8 = 128;

    /// The command that enters the vendor's boot loader: number 242 with operands that no host sends by mistake.
    pub const ENTER_BOOTLOADER: Command = Command::new(242, 0x81, 0x92, 0xA3B4_C5D6_u32.cast_signed());

    /// The command with these four fields.
    pub const fn new(opcode: u8, kind: u8, motor: u8, value: i32) -> Self {
        Command { opcode, kind, motor, value }
    }

    /// The seven bytes: number, type, motor, value with the most significant byte first.
    pub const fn to_bytes(self) -> [u8; Self::SIZE] {
        let [a, b, c, d] = self.value.to_be_bytes();
        [self.opcode, self.kind, self.motor, a, b, c, d]
    }

    /// The command with these seven bytes, as [`Command::to_bytes`] makes them.
    #[inline]
    pub const fn from_bytes(bytes: [u8; Self::SIZE]) -> Self {
        let [opcode, kind, motor, a, b, c, d] = bytes;
        Command { opcode, kind, motor, value: i32::from_be_bytes([a, b, c, d]) }
    }
}
