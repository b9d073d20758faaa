//! The mailboxes between the tasks.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;

use crate::module::Source;
use crate::store::Job;
use crate::tmcl::binary::Telegram;

/// A telegram to be sent, and the silence it is to be preceded by.
#[derive(Clone)]
pub(super) struct Outgoing {
    pub(super) telegram: Telegram,
    /// Milliseconds since the last byte received (global parameter 75).
    pub(super) pause: u8,
}

/// Telegrams from all links to the owner of the module. A host waits for each reply, so a few places do.
pub(super) static REQUESTS: Channel<CriticalSectionRawMutex, (Source, Telegram), 4> = Channel::new();

/// Telegrams to the RS485 link: a reply and an event, and one more of each. They stay in here until they are
/// on the wire, so that "empty" means that all is said.
pub(super) static RS485: Channel<CriticalSectionRawMutex, Outgoing, 4> = Channel::new();

/// The EEPROM page to be written. The store hands out one at a time.
pub(super) static PAGE: Signal<CriticalSectionRawMutex, Job> = Signal::new();

/// Whether it was written.
pub(super) static WRITTEN: Signal<CriticalSectionRawMutex, bool> = Signal::new();
