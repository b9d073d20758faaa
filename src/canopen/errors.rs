//! Emergencies: the messages, what the drive does then, the error register (1001h), and the error code (603Fh).

use super::cia301::emcy::Messages;

/// The reaction of the drive when an emergency comes up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Nothing.
    Message,
    /// The motor stops, and the drive stays in its state.
    Stop,
    /// The motor stops, and the drive enters FAULT, which it leaves by a fault reset when the cause is gone.
    Fault,
}

/// Makes the enum of emergencies and their data. They are written one a line: code, first and second byte of the
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

            /// The reaction of the drive when the emergency comes up.
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

/// An object that a message names: index and sub-index.
pub(super) type Named = (u16, u8);

/// The errors that the error register tells of, and the messages that are still to be sent.
#[derive(Debug, Default)]
pub(super) struct Errors {
    /// The emergencies that have come up and have not been forgotten, each by its [`bit`](Emergency::bit).
    shown: u32,
    /// The emergencies whose causes exist.
    existing: u32,
    /// The one that has come up last.
    last: Option<Emergency>,
    /// The error register or the error code may be another than when this was asked for.
    changed: bool,
    /// The messages on their way.
    pub(super) messages: Messages,
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

    /// True if the error register tells that saved settings are lost.
    pub(super) const fn tell_of_lost_settings(&self) -> bool {
        self.shows(Emergency::SettingsLost) || self.shows(Emergency::SilentEeprom)
    }

    /// True, once, when the error register or the error code may be another.
    pub(super) const fn have_changed(&mut self) -> bool {
        core::mem::replace(&mut self.changed, false)
    }

    /// Notes an emergency in the error register, and puts its message into the queue, with the object that it is about.
    pub(super) fn raise(&mut self, emergency: Emergency, named: Option<Named>) {
        self.changed = true;
        if emergency != Emergency::Reset {
            (self.shown, self.last) = (self.shown | emergency.bit(), Some(emergency));
        }
        let (code, [first, second], ..) = emergency.data();
        let ([low, high], (index, sub)) = (code.to_le_bytes(), named.unwrap_or_default());
        let [index_low, index_high] = index.to_le_bytes();
        self.messages.push([low, high, self.register(), first, second, index_low, index_high, sub]);
    }

    /// An emergency that needs no reset is over: the error register forgets it, which is told.
    fn end(&mut self, emergency: Emergency) {
        if self.shows(emergency) {
            self.shown &= !emergency.bit();
            self.raise(Emergency::Reset, None);
        }
    }

    /// Notes whether the cause of an emergency exists, which is raised when it begins to. When it has ended, an error
    /// that is no fault is over; a fault stays until it is reset. True if a fault has begun.
    ///
    /// Inlined as far as it asks whether anything has changed, which is asked for some of them in each turn.
    #[inline(always)]
    pub(super) fn report(&mut self, emergency: Emergency, exists: bool, named: Option<Named>) -> bool {
        (self.existing & emergency.bit() != 0) != exists && self.change(emergency, named)
    }

    /// The cause of an emergency has begun or ended.
    #[cold]
    #[inline(never)]
    fn change(&mut self, emergency: Emergency, named: Option<Named>) -> bool {
        let is_fault = emergency.reaction() == Reaction::Fault;
        self.existing ^= emergency.bit();
        if self.existing & emergency.bit() != 0 {
            self.raise(emergency, named);
            is_fault
        } else {
            if !is_fault {
                self.end(emergency);
            }
            false
        }
    }

    /// Forgets that the cause of an emergency exists: if it does, it is told once more.
    pub(super) const fn overlook(&mut self, emergency: Emergency) {
        self.existing &= !emergency.bit();
    }

    /// True if the causes of these emergencies exist or not as has been noted. So a turn, in which seldom one has
    /// changed, takes 375 cycles less than with a report of each.
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
        (self.shown, self.changed) = (self.existing, true);
    }

    /// Drops messages and errors, but for the causes that exist.
    pub(super) fn restart(&mut self) {
        *self = Errors { existing: self.existing, shown: self.existing, last: self.last, ..Errors::default() };
    }

    fn shown(&self) -> impl Iterator<Item = Emergency> + use<> {
        among(self.shown)
    }
}

/// The emergencies whose bits are set.
fn among(bits: u32) -> impl Iterator<Item = Emergency> {
    Emergency::ALL.iter().copied().filter(move |emergency| bits & emergency.bit() != 0)
}
