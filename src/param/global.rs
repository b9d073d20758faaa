//! The functions of global parameters of bank 0 (manual section 5.1).

use super::functions;

/// Bit rates of RS485 in bit/s, indexed by [`GlobalParameter::SerialBaudRate`].
pub const BAUD_RATES: [u32; 12] =
    [9_600, 14_400, 19_200, 28_800, 38_400, 57_600, 76_800, 115_200, 230_400, 250_000, 500_000, 1_000_000];
/// Bit rates of CAN in bit/s, indexed by [`GlobalParameter::CanBitRate`] minus 2.
pub const CAN_BIT_RATES: [u32; 7] = [20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 1_000_000];

functions! {
    /// The function of a global parameter of bank 0; its number belongs to the product's [`Row`](super::Row).
    GlobalParameter;
    settings {
        /// With another value than its default, all settings become factory defaults at the next start.
        EepromMagic,
        /// RS485 bit rate, an index into [`BAUD_RATES`]; takes effect after a restart.
        SerialBaudRate,
        /// Address of the module on RS485 and in ASCII mode; USB ignores it in binary mode.
        SerialAddress,
        /// Bit 0: start in ASCII mode; bits 4 and 5: how characters are echoed.
        AsciiMode,
        /// Milliseconds without an RS485 or USB command after which the motors stop; 0: never.
        SerialHeartbeat,
        /// CAN bit rate, 2 + index into [`CAN_BIT_RATES`]; takes effect after a restart.
        CanBitRate,
        /// CAN identifier (11 bits) of replies.
        CanReplyId,
        /// CAN identifier (11 bits) of requests.
        CanId,
        /// 1: the EEPROM is locked, so that nothing but this parameter can be stored. Two numbers, 1234 and 4321, can
        /// be written in place of 1 and 0.
        EepromLock,
        /// Pause before a reply on RS485, in milliseconds.
        TelegramPause,
        /// Address of the host in replies on RS485 and USB.
        SerialHostAddress,
        /// 1: the TMCL program starts after power-on.
        AutoStart,
        /// 1: the end switches have reversed polarity.
        EndSwitchPolarity,
        /// Protection of the program: [`AGAINST_READING`](super::AGAINST_READING) and
        /// [`AGAINST_WRITING`](super::AGAINST_WRITING).
        CodeProtection,
        /// Milliseconds without a CAN command after which the motors stop; 0: never.
        CanHeartbeat,
        /// Second CAN identifier (11 bits) of requests; 0: none.
        CanSecondaryId,
        /// 1: coordinates are stored in the EEPROM by the command that sets them.
        CoordinateStorage,
        /// 1: user variables are 0 after power-on in place of their stored values.
        DoNotRestoreVariables,
        /// Length of a pulse at the step outputs, in microseconds minus one. It is kept, without effect.
        StepPulseLength,
        /// Second address of the module on RS485 and in ASCII mode; 0: none.
        SerialSecondaryAddress,
        /// 1: motor and encoder count in the other direction.
        ReverseShaft,
        /// 1: commands other than GAP, GGP and GIO are not answered.
        SuppressReply,
    }
    computed {
        /// State of the TMCL program, 0: stop, 1: run, 2: step, 3: reset.
        ApplicationStatus,
        /// 1 while commands are stored as a program in place of being executed.
        DownloadMode,
        /// Address of the present command of the TMCL program.
        ProgramCounter,
        /// Counter that goes up by one each millisecond.
        TickTimer,
        /// A random number; writing it seeds the generator.
        RandomNumber,
    }
}
