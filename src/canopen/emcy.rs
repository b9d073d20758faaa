//! Emergencies: the messages, what the drive does then, the error register (1001h), the error code (603Fh), and the queue
//! with its inhibit time (1015h).

use heapless::Deque;

use crate::units::Micros;

/// Number of messages that wait for the inhibit time; what comes when they are as many shows in the error register
/// alone.
const QUEUE: usize = 8;

/// What the drive does when an emergency comes up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Nothing.
    Message,
    /// The motor stops, and the drive stays in its state.
    Stop,
    /// The motor stops, and the drive enters FAULT, which it leaves by a fault reset when the cause is gone.
    Fault,
}

/// Makes the enum of emergencies and their data, which are written one a line: code, first and second byte of the
/// manufacturer's field, bits of the error register, reaction, name, meaning.
macro_rules! emergencies {
    ($($code:literal $first:literal $second:literal $register:literal $reaction:ident $name:ident $meaning:literal;)*) => {
        /// An emergency that a node can tell.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
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

            /// What the drive does when the emergency comes up.
            pub const fn reaction(self) -> Reaction {
                match self {
                    $(Emergency::$name => Reaction::$reaction,)*
                }
            }

            /// The bit of the emergency in a set of them.
            const fn bit(self) -> u32 {
                1_u32.unbounded_shl(self as u32)
            }
        }
    };
}

emergencies! {
    0x0000 0 0 0x00 Message Reset "fault reset executed, or an error that needs none is over";
    0x1000 1 0 0x01 Message OpenLoadA "open load bridge A";
    0x1000 2 0 0x01 Message OpenLoadB "open load bridge B";
    0x2310 0 0 0x03 Fault OverCurrentHighSide "overcurrent high side";
    0x2311 0 0 0x03 Fault OverCurrentB "overcurrent bridge B";
    0x2312 0 0 0x03 Fault OverCurrentA "overcurrent bridge A";
    0x3230 0 0 0x21 Stop Stall "stallGuard2 error";
    0x4310 1 0 0x09 Message TemperatureWarning "over-temperature pre-warning";
    0x4310 2 0 0x09 Fault OverTemperature "over-temperature";
    0x5000 0 255 0x81 Fault SilentController "motion controller silent";
    0x5441 0 255 0x21 Fault Shutdown "shutdown switch active";
    0x5530 0 255 0x81 Fault SilentEeprom "EEPROM silent: the saved settings are unknown";
    0x6310 0 255 0x21 Fault SettingsLost "saved settings lost, from the object in bytes 5 to 7 on";
    0x6310 1 255 0x21 Message SettingsWorn "a copy of the saved settings was bad, and is written again";
    0x6320 0 255 0x21 Message Refused "parameter error: data of an RPDO wrong or not acceptable now";
    0x8100 0 255 0x11 Message Communication "general CAN communication error";
    0x8110 1 255 0x11 Message ControllerOverflow "CAN controller overflow";
    0x8110 2 255 0x11 Message TransmitOverflow "CAN transmit buffer overflow";
    0x8110 3 255 0x11 Message ReceiveOverflow "CAN receive buffer overflow";
    0x8120 0 255 0x11 Message ErrorPassive "CAN error passive";
    0x8130 0 255 0x11 Fault MasterLost "heartbeat or life guarding lost";
    0x8140 0 255 0x11 Fault BusOff "recovered from bus-off";
    0x8210 0 255 0x11 Message PdoTooShort "PDO too short";
    0x8220 0 255 0x11 Message PdoTooLong "PDO too long";
    0x8611 0 0 0x21 Fault FollowingError "following error";
    0xFF00 0 0 0x05 Fault UnderVoltage "under-voltage";
    0xFF01 1 0 0x81 Stop PositiveSoftwareLimit "positive software limit";
    0xFF01 2 0 0x81 Stop NegativeSoftwareLimit "negative software limit";
    0xFF01 3 0 0x81 Stop PositiveLimitSwitch "positive limit switch";
    0xFF01 4 0 0x81 Stop NegativeLimitSwitch "negative limit switch";
}

/// What has become of a cause since it was looked at before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    None,
    Begun,
    Ended,
}

/// An object that a message names: index and sub-index.
pub(super) type Named = (u16, u8);

/// The errors that the error register tells of, and the messages that are still to be sent.
#[derive(Debug, Default)]
pub(super) struct Errors {
    /// The emergencies that have come up and have not been forgotten, each by its [`bit`](Emergency::bit).
    shown: u32,
    /// Those whose causes exist.
    existing: u32,
    /// The one that has come up last.
    last: Option<Emergency>,
    /// The data of the messages, oldest first.
    queue: Deque<[u8; 8], QUEUE>,
    /// So many of them, the oldest ones, are sent although the node is stopped: they tell why it has stopped itself.
    farewell: usize,
    /// When the last message was sent.
    sent: Option<Micros>,
}

impl Errors {
    /// The error register (1001h).
    pub(super) fn register(&self) -> u8 {
        self.shown().fold(0, |bits, emergency| bits | emergency.data().2)
    }

    /// The error code (603Fh): that of the error which has come up last, and still shows in the error register; else of
    /// any other that does, or 0.
    pub(super) fn code(&self) -> u16 {
        let last = self.last.filter(|last| self.shows(*last));
        last.or_else(|| self.shown().next()).map_or(0, |emergency| emergency.data().0)
    }

    /// True if the error register tells of an emergency.
    pub(super) const fn shows(&self, emergency: Emergency) -> bool {
        self.shown & emergency.bit() != 0
    }

    /// Notes an emergency in the error register, and puts its message into the queue, with the object that it is about.
    pub(super) fn raise(&mut self, emergency: Emergency, named: Option<Named>) {
        if emergency != Emergency::Reset {
            (self.shown, self.last) = (self.shown | emergency.bit(), Some(emergency));
        }
        let (code, [first, second], ..) = emergency.data();
        let ([low, high], (index, sub)) = (code.to_le_bytes(), named.unwrap_or_default());
        let [index_low, index_high] = index.to_le_bytes();
        let message = [low, high, self.register(), first, second, index_low, index_high, sub];
        // CiA 301 lets the newest be lost when there are too many; the register tells of it.
        let _ = self.queue.push_back(message);
    }

    /// An emergency that needs no reset is over: the error register forgets it, which is told.
    pub(super) fn end(&mut self, emergency: Emergency) {
        if self.shows(emergency) {
            self.shown &= !emergency.bit();
            self.raise(Emergency::Reset, None);
        }
    }

    /// Notes whether the cause of an emergency exists.
    pub(super) const fn note(&mut self, emergency: Emergency, exists: bool) -> Change {
        let before = self.existing & emergency.bit() != 0;
        self.existing = if exists { self.existing | emergency.bit() } else { self.existing & !emergency.bit() };
        match (before, exists) {
            (false, true) => Change::Begun,
            (true, false) => Change::Ended,
            (false, false) | (true, true) => Change::None,
        }
    }

    /// True if the causes of these emergencies exist or not as has been noted.
    pub(super) fn are_noted(&self, causes: &[(Emergency, bool)]) -> bool {
        let bit = |(emergency, exists): &(Emergency, bool)| {
            let noted = self.existing & emergency.bit() != 0;
            noted == *exists
        };
        causes.iter().all(bit)
    }

    /// True while the cause of a fault exists.
    pub(super) fn holds_fault(&self) -> bool {
        among(self.existing).any(|emergency| emergency.reaction() == Reaction::Fault)
    }

    /// Lets the error register forget all errors whose causes are gone.
    pub(super) const fn forget(&mut self) {
        self.shown = self.existing;
    }

    /// Drops messages and errors, but for the causes that exist.
    pub(super) fn restart(&mut self) {
        *self = Errors { existing: self.existing, shown: self.existing, last: self.last, ..Errors::default() };
    }

    fn shown(&self) -> impl Iterator<Item = Emergency> + use<> {
        among(self.shown)
    }

    /// The node stops itself; the messages that wait are still sent.
    pub(super) fn say_farewell(&mut self) {
        self.farewell = self.queue.len();
    }

    /// True if a message waits that the node sends, stopped or not.
    pub(super) fn has_message(&self, is_stopped: bool) -> bool {
        !self.queue.is_empty() && (self.farewell > 0 || !is_stopped)
    }

    /// Takes the next message, which is being sent at `now`; `None` also within the inhibit time after the one before.
    pub(super) fn take(&mut self, now: Micros, inhibit: Micros) -> Option<[u8; 8]> {
        if self.sent.is_some_and(|sent| now.since(sent) < inhibit) {
            return None;
        }
        let message = self.queue.pop_front()?;
        self.farewell = self.farewell.saturating_sub(1);
        self.sent = Some(now);
        Some(message)
    }

    /// Drops the messages that wait.
    pub(super) fn drop_messages(&mut self) {
        self.queue.clear();
        self.farewell = 0;
    }
}

/// The emergencies whose bits are set.
fn among(bits: u32) -> impl Iterator<Item = Emergency> {
    Emergency::ALL.iter().copied().filter(move |emergency| bits & emergency.bit() != 0)
}
