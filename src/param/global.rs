//! What global parameters of bank 0 do (manual section 5.1).

use super::functions;

/// What [`GlobalParameter::SerialBaudRate`] chooses from, in bit/s: 0 is the first.
pub const BAUD_RATES: [u32; 9] = [9_600, 14_400, 19_200, 28_800, 38_400, 57_600, 76_800, 115_200, 230_400];
/// What [`GlobalParameter::CanBitRate`] chooses from, in bit/s: 2 is the first.
pub const CAN_BIT_RATES: [u32; 7] = [20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 1_000_000];

functions! {
    /// What a global parameter of bank 0 does, whatever number it has.
    GlobalParameter;
    settings {
        /// RS485 baud rate.
        SerialBaudRate,
        /// Serial address.
        SerialAddress,
        /// ASCII mode.
        AsciiMode,
        /// Serial heartbeat.
        SerialHeartbeat,
        /// CAN bit rate.
        CanBitRate,
        /// CAN reply ID.
        CanReplyId,
        /// CAN ID.
        CanId,
        /// Telegram pause time.
        TelegramPause,
        /// Serial host address.
        SerialHostAddress,
        /// Auto start mode.
        AutoStart,
        /// End switch polarity.
        EndSwitchPolarity,
        /// TMCL code protection.
        CodeProtection,
        /// CAN heartbeat.
        CanHeartbeat,
        /// CAN secondary address.
        CanSecondaryId,
        /// Coordinate storage.
        CoordinateStorage,
        /// Do not restore user variables.
        DoNotRestoreVariables,
        /// Serial secondary address.
        SerialSecondaryAddress,
        /// Reverse shaft.
        ReverseShaft,
        /// Suppress reply.
        SuppressReply,
    }
    computed {
        /// TMCL application status.
        ApplicationStatus,
        /// Download mode.
        DownloadMode,
        /// TMCL program counter.
        ProgramCounter,
        /// TMCL tick timer.
        TickTimer,
        /// Random number.
        RandomNumber,
    }
}
