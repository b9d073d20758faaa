//! Data that goes between the owner of the module, which runs in an interrupt, and the links and the EEPROM, which run
//! in others or in thread mode.

use core::cell::Cell;

use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;

use crate::module::{LinkMode, LinkSettings, ReplyAddresses, Request};
use crate::store::Job;
use crate::tmcl::Reply;

/// A reply on its way to a link: the end of a request, or an event.
#[derive(Clone)]
pub(super) struct Outgoing {
    /// The reply to be sent; `None` if the request is not answered.
    pub(super) reply: Option<Reply>,
    /// The mode, binary or ASCII, in which the link goes on; `None` for the mode it has.
    pub(super) mode: Option<LinkMode>,
    /// The addresses at the head of the reply, as in force when the reply was made.
    pub(super) addresses: ReplyAddresses,
}

/// Requests from the USB link to the owner of the module. A host waits for each reply, so four are enough.
pub(super) static USB_REQUESTS: Channel<CriticalSectionRawMutex, Request, 4> = Channel::new();

/// Tells the owner that the USB host is gone: its requests and the replies to them are to be dropped.
pub(super) static USB_GONE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Replies to the USB link: a reply and an event, and one more of each. Each stays here until it is sent, so that an
/// empty channel means that all replies are out.
pub(super) static USB: Channel<CriticalSectionRawMutex, Outgoing, 4> = Channel::new();

/// The link settings in force, for the code of the links that runs in other interrupts than the module, which owns the
/// settings. `None` before the module is started.
static LINK_SETTINGS: CriticalSectionMutex<Cell<Option<LinkSettings>>> = CriticalSectionMutex::new(Cell::new(None));

/// The link settings in force.
pub(super) fn link_settings() -> LinkSettings {
    LINK_SETTINGS.lock(Cell::get).unwrap_or_default()
}

/// Puts link settings in force.
pub(super) fn put_in_force(settings: &LinkSettings) {
    LINK_SETTINGS.lock(|shared| shared.set(Some(*settings)));
}

/// The EEPROM page to be written, from the owner of the module to the task of the EEPROM. The store hands out one at a
/// time.
pub(super) static PAGE: Signal<CriticalSectionRawMutex, Job> = Signal::new();

/// Whether the page of [`PAGE`] was written, from the task of the EEPROM to the owner of the module.
pub(super) static WRITTEN: Signal<CriticalSectionRawMutex, bool> = Signal::new();
