//! The mailboxes between the links, the EEPROM and the owner of the module.

use core::cell::Cell;

use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;

use crate::module::{LinkMode, LinkSettings, ReplyAddresses, Request};
use crate::store::Job;
use crate::tmcl::Reply;

/// The answer to a request, or an event.
#[derive(Clone)]
pub(super) struct Outgoing {
    /// To be sent; nothing, where a request is not answered.
    pub(super) reply: Option<Reply>,
    /// The mode the link goes on in, if that is said.
    pub(super) mode: Option<LinkMode>,
    /// The addresses at the head of the reply: those in force when it was made.
    pub(super) addresses: ReplyAddresses,
}

/// Requests from the USB link to the owner. A host waits for each reply, so a few places do.
pub(super) static USB_REQUESTS: Channel<CriticalSectionRawMutex, Request, 4> = Channel::new();

/// The host on USB is gone; what it has asked and waits for is to be forgotten.
pub(super) static USB_GONE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Answers to the USB link: a reply and an event, and one more of each. They stay in here until they are sent, so
/// that "empty" means that all is said.
pub(super) static USB: Channel<CriticalSectionRawMutex, Outgoing, 4> = Channel::new();

/// The link settings in force, for the links' own ends: they run in other interrupts than the module, which has the
/// settings. `None` before the module is there.
static LINK_SETTINGS: CriticalSectionMutex<Cell<Option<LinkSettings>>> = CriticalSectionMutex::new(Cell::new(None));

/// The link settings in force.
pub(super) fn link_settings() -> LinkSettings {
    LINK_SETTINGS.lock(Cell::get).unwrap_or_default()
}

/// Puts other link settings in force; false if they are the same.
pub(super) fn put_in_force(settings: &LinkSettings) -> bool {
    LINK_SETTINGS.lock(|shared| shared.replace(Some(*settings)) != Some(*settings))
}

/// The EEPROM page to be written. The store hands out one at a time.
pub(super) static PAGE: Signal<CriticalSectionRawMutex, Job> = Signal::new();

/// Whether it was written.
pub(super) static WRITTEN: Signal<CriticalSectionRawMutex, bool> = Signal::new();
