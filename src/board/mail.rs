//! The mailboxes between the links, the EEPROM and the owner of the module.

use core::cell::Cell;

use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;

use crate::module::{Links, Mode, Request};
use crate::store::Job;
use crate::tmcl::Reply;

/// The answer to a request, or an event.
#[derive(Clone)]
pub(super) struct Outgoing {
    /// To be sent; nothing, where a request is not answered.
    pub(super) reply: Option<Reply>,
    /// The mode the link goes on in, if that is said.
    pub(super) mode: Option<Mode>,
    /// The settings under which it is sent.
    pub(super) links: Links,
}

/// Requests from the USB link to the owner. A host waits for each reply, so a few places do.
pub(super) static USB_REQUESTS: Channel<CriticalSectionRawMutex, Request, 4> = Channel::new();

/// The host on USB is gone; what it has asked and waits for is to be forgotten.
pub(super) static USB_GONE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Answers to the USB link: a reply and an event, and one more of each. They stay in here until they are sent, so
/// that "empty" means that all is said.
pub(super) static USB: Channel<CriticalSectionRawMutex, Outgoing, 4> = Channel::new();

/// The interface settings in force; none before the module is there.
pub(super) static LINKS: CriticalSectionMutex<Cell<Option<Links>>> = CriticalSectionMutex::new(Cell::new(None));

/// The EEPROM page to be written. The store hands out one at a time.
pub(super) static PAGE: Signal<CriticalSectionRawMutex, Job> = Signal::new();

/// Whether it was written.
pub(super) static WRITTEN: Signal<CriticalSectionRawMutex, bool> = Signal::new();
