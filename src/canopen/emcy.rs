//! Emergencies: the messages, the error register (1001h), and the queue with its inhibit time (1015h).

use heapless::Deque;

use crate::units::Micros;

/// Number of messages that wait for the inhibit time; what comes when they are as many shows in the error register
/// alone.
const QUEUE: usize = 8;

/// Makes the enum of emergencies and their data, which are written one a line: code, first and second byte of the
/// manufacturer's field, bits of the error register, name, meaning.
macro_rules! emergencies {
    ($($code:literal $first:literal $second:literal $register:literal $name:ident $meaning:literal;)*) => {
        /// An emergency that a node can tell.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Emergency {
            $(#[doc = $meaning] $name,)*
        }

        impl Emergency {
            /// All emergencies, in the order of their codes.
            pub const ALL: &'static [Emergency] = &[$(Emergency::$name),*];

            /// The error code, the first two bytes of the manufacturer's field, the bits that it sets in the error
            /// register, and its meaning.
            pub const fn data(self) -> (u16, [u8; 2], u8, &'static str) {
                match self {
                    $(Emergency::$name => ($code, [$first, $second], $register, $meaning),)*
                }
            }
        }
    };
}

emergencies! {
    0x0000 0 0 0x00 Reset "fault reset executed";
    0x1000 1 0 0x01 OpenLoadA "open load bridge A";
    0x1000 2 0 0x01 OpenLoadB "open load bridge B";
    0x2310 0 0 0x03 OverCurrentHighSide "overcurrent high side";
    0x2311 0 0 0x03 OverCurrentB "overcurrent bridge B";
    0x2312 0 0 0x03 OverCurrentA "overcurrent bridge A";
    0x3230 0 0 0x21 Stall "stallGuard2 error";
    0x4310 1 0 0x09 TemperatureWarning "over-temperature pre-warning";
    0x4310 2 0 0x09 OverTemperature "over-temperature";
    0x5000 0 255 0x81 SilentController "motion controller silent";
    0x5441 0 255 0x21 Shutdown "shutdown switch active";
    0x6320 0 255 0x21 Refused "parameter error: data of an RPDO wrong or not acceptable now";
    0x8100 0 255 0x11 Communication "general CAN communication error";
    0x8110 1 255 0x11 ControllerOverflow "CAN controller overflow";
    0x8110 2 255 0x11 TransmitOverflow "CAN transmit buffer overflow";
    0x8110 3 255 0x11 ReceiveOverflow "CAN receive buffer overflow";
    0x8120 0 255 0x11 ErrorPassive "CAN error passive";
    0x8130 0 255 0x11 MasterLost "heartbeat or life guarding lost";
    0x8140 0 255 0x11 BusOff "recovered from bus-off";
    0x8210 0 255 0x11 PdoTooShort "PDO too short";
    0x8220 0 255 0x11 PdoTooLong "PDO too long";
    0x8611 0 0 0x21 FollowingError "following error";
    0xFF00 0 0 0x05 UnderVoltage "under-voltage";
    0xFF01 1 0 0x81 PositiveSoftwareLimit "positive software limit";
    0xFF01 2 0 0x81 NegativeSoftwareLimit "negative software limit";
    0xFF01 3 0 0x81 PositiveLimitSwitch "positive limit switch";
    0xFF01 4 0 0x81 NegativeLimitSwitch "negative limit switch";
}

/// The error register, and the messages that are still to be sent.
#[derive(Debug, Default)]
pub(super) struct Errors {
    /// The error register. Its bits stay until all errors are forgotten.
    pub(super) register: u8,
    /// The data of the messages, oldest first.
    queue: Deque<[u8; 8], QUEUE>,
    /// When the last message was sent.
    sent: Option<Micros>,
}

impl Errors {
    /// Notes an emergency in the error register, and puts its message into the queue if it is to be `told`.
    pub(super) fn raise(&mut self, emergency: Emergency, told: bool) {
        let (code, [first, second], bits, _) = emergency.data();
        self.register |= bits;
        if told {
            let [low, high] = code.to_le_bytes();
            let _ = self.queue.push_back([low, high, self.register, first, second, 0, 0, 0]);
        }
    }

    /// Takes the next message, which is being sent at `now`; `None` also within the inhibit time after the one before.
    pub(super) fn take(&mut self, now: Micros, inhibit: Micros) -> Option<[u8; 8]> {
        if self.sent.is_some_and(|sent| now.since(sent) < inhibit) {
            return None;
        }
        let message = self.queue.pop_front()?;
        self.sent = Some(now);
        Some(message)
    }

    /// Drops the messages that wait.
    pub(super) fn drop_messages(&mut self) {
        self.queue.clear();
    }

    /// True when no message waits.
    pub(super) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }
}
