//! Global parameters of bank 0 (manual section 5.1), in the manual's order.

use super::{ANY, Access, FLAG, Row, Storage, Unit, parameters};

/// What [`GlobalParameter::SerialBaudRate`] chooses from, in bit/s: 0 is the first.
pub const BAUD_RATES: [u32; 9] = [9_600, 14_400, 19_200, 28_800, 38_400, 57_600, 76_800, 115_200, 230_400];
/// What [`GlobalParameter::CanBitRate`] chooses from, in bit/s: 2 is the first.
pub const CAN_BIT_RATES: [u32; 7] = [20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 1_000_000];

parameters! {
    /// Global parameters of bank 0, read by GGP and written by SGP and AGP (manual section 5.1). Numbers 65
    /// to 127 are stored by the command that sets them.
    GlobalParameter;
    65 SerialBaudRate "RS485 baud rate" Choice &[(0, 8)], ReadWrite Automatic 0 "0..8: 9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200, 230400 bit/s; takes effect after a restart",
    66 SerialAddress "serial address" Address &[(1, 255)], ReadWrite Automatic 1 "module address on RS485",
    67 AsciiMode "ASCII mode" Bits &[(0, 63)], ReadWrite Automatic 0 "bit 0 start in ASCII mode; bits 5 and 4: 00 echo each character, 01 echo the line after CR, 10 no echo",
    68 SerialHeartbeat "serial heartbeat" Milliseconds &[(0, 65535)], ReadWrite Automatic 0 "motor stops when no RS485 or USB command arrives in this time; 0 = off",
    69 CanBitRate "CAN bit rate" Choice &[(2, 8)], ReadWrite Automatic 8 "2..8: 20, 50, 100, 125, 250, 500, 1000 kbit/s; takes effect after a restart",
    70 CanReplyId "CAN reply ID" CanId &[(0, 2047)], ReadWrite Automatic 2 "identifier of replies",
    71 CanId "CAN ID" CanId &[(0, 2047)], ReadWrite Automatic 1 "identifier of requests",
    75 TelegramPause "telegram pause time" Milliseconds &[(0, 255)], ReadWrite Automatic 0 "pause before the RS485 reply",
    76 SerialHostAddress "serial host address" Address &[(0, 255)], ReadWrite Automatic 2 "reply address on RS485 and USB",
    77 AutoStart "auto start mode" Flag FLAG, ReadWrite Automatic 0 "1 = start the TMCL program after power up",
    79 EndSwitchPolarity "end switch polarity" Flag FLAG, ReadWrite Automatic 0 "1 = reverse polarity of the end switches; the home switch stays as it is",
    81 CodeProtection "TMCL code protection" Bits &[(0, 3)], ReadWrite Automatic 0 "bit 0 against disassembling; bit 1 against overwriting; clearing bit 0 erases the program first",
    82 CanHeartbeat "CAN heartbeat" Milliseconds &[(0, 65535)], ReadWrite Automatic 0 "motor stops when no CAN command arrives in this time; 0 = off",
    83 CanSecondaryId "CAN secondary address" CanId &[(0, 2047)], ReadWrite Automatic 0 "0 = off",
    84 CoordinateStorage "coordinate storage" Flag FLAG, ReadWrite Automatic 0 "1 = coordinates are always also stored in EEPROM (never coordinate 0)",
    85 DoNotRestoreVariables "do not restore user variables" Flag FLAG, ReadWrite Automatic 0 "1 = user variables start at zero",
    87 SerialSecondaryAddress "serial secondary address" Address &[(0, 255)], ReadWrite Automatic 0 "0 = off",
    90 ReverseShaft "reverse shaft" Flag FLAG, ReadWrite Automatic 0 "motor and encoder direction",
    128 ApplicationStatus "TMCL application status" Choice &[(0, 3)], Read Volatile 0 "0 stop, 1 run, 2 step, 3 reset",
    129 DownloadMode "download mode" Flag FLAG, Read Volatile 0 "1 = commands are stored, not executed",
    130 ProgramCounter "TMCL program counter" Address ANY, Read Volatile 0 "address of the current command",
    132 TickTimer "TMCL tick timer" Milliseconds &[(0, i32::MAX)], ReadWrite Volatile 0 "counts up once per millisecond",
    133 RandomNumber "random number" Number &[(0, i32::MAX)], ReadWrite Volatile 0 "writing seeds the generator",
    255 SuppressReply "suppress reply" Flag FLAG, ReadWrite Volatile 0 "not stored; replies to GAP, GGP and GIO are never suppressed",
}
