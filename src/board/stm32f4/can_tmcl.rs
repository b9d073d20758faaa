//! The CAN controller as TMCL uses it: replies, which all have the same identifier, go in their order, and a request is
//! read when its reply can be sent.

use core::array::from_fn;

use embassy_stm32::can::Fifo;
use embassy_stm32::can::filter::{BankConfig, ListEntry16, Mask16};
use embassy_stm32::pac::CAN1;
use heapless::{Deque, Vec};

use super::can::{Can, post, take};
use super::can_link::CanLink;
use super::can_node::NodeLink;
use crate::can::outbox::MAILBOXES;
use crate::can::{Frame, StandardId};
use crate::module::LinkSettings;
use crate::tmcl::can::{Request, decode};

/// The receive queue to which the filters lead.
const FIFO: usize = 0;
/// Number of filter banks in use, each with room for four identifiers.
const BANKS: u8 = 3;
/// Number of frames that can wait for a mailbox: events, and a late reply behind them.
const WAITING: usize = 4;

/// The identifiers of the frames that a module is to receive; `None` is all.
type Identifiers = Option<Vec<StandardId, { 4 * BANKS as usize }>>;

/// The CAN link of TMCL.
pub struct TmclLink {
    controller: Can,
    /// Identifiers of requests and of replies with which the controller was told what to bring.
    told: Option<[Option<StandardId>; 3]>,
    /// The frames that wait for a mailbox, oldest first.
    waiting: Deque<Frame, WAITING>,
}

impl TmclLink {
    /// The identifiers of the frames that are to come from the bus, if they are not those of the last call.
    ///
    /// A module whose own identifier is that of replies receives everything, as it must know the requests to other
    /// modules to tell their replies from requests.
    #[inline(always)]
    fn new_identifiers(&mut self, settings: &LinkSettings) -> Option<Identifiers> {
        let LinkSettings { can_id, can_secondary, can_reply, .. } = *settings;
        let settings = Some([Some(can_id), can_secondary, Some(can_reply)]);
        if core::mem::replace(&mut self.told, settings) == settings {
            return None;
        }
        let own = [Some(can_id), can_secondary];
        Some((!own.contains(&Some(can_reply))).then(|| own.into_iter().flatten().collect()))
    }

    /// The oldest frame that has been received; `None` while there is none, or while no reply could be sent.
    #[inline(always)]
    fn read(&mut self) -> Option<Frame> {
        if CAN1.rfr(FIFO).read().fmp() == 0 {
            return None;
        }
        // A request stays in the queue while no mailbox is free for its reply; only a host that does not wait for
        // replies fills all three.
        if !has_room() {
            wait_for_room();
            return None;
        }
        let frame = take(FIFO);
        CAN1.ier().write(|w| w.set_fmpie(FIFO, true));
        frame
    }

    /// Puts a frame behind those that wait for a mailbox. If as many as there is room for wait, no node on the bus has
    /// acknowledged the last replies, and this frame is dropped.
    #[cold]
    fn wait(&mut self, frame: &Frame) {
        wait_for_room();
        if self.waiting.push_back(*frame).is_err() {
            defmt::debug!("CAN: nobody listens, reply dropped");
        }
    }

    /// Has the filters let data frames with these identifiers pass, or all frames.
    fn listen_to(&mut self, identifiers: &Identifiers) {
        let mut filters = self.controller.driver.modify_filters();
        let mut rest = match identifiers {
            None => {
                filters.enable_bank(0, Fifo::Fifo0, BankConfig::Mask16([Mask16::accept_all(); 2]));
                &[]
            }
            Some(identifiers) => identifiers.as_slice(),
        };
        for bank in u8::from(identifiers.is_none())..BANKS {
            let (four, others) = rest.split_at_checked(4).unwrap_or((rest, &[]));
            rest = others;
            let Some(first) = four.first() else {
                filters.disable_bank(bank);
                continue;
            };
            let listed = from_fn(|n| ListEntry16::data_frames_with_id(*four.get(n).unwrap_or(first)));
            filters.enable_bank(bank, Fifo::Fifo0, BankConfig::List16(listed));
        }
    }
}

impl CanLink for TmclLink {
    type Node = NodeLink;

    const IN_ORDER: bool = true;

    fn new(controller: Can) -> Self {
        TmclLink { controller, told: None, waiting: Deque::new() }
    }

    /// Frames that are no requests are passed over.
    #[inline(always)]
    fn request(&mut self) -> Option<Request> {
        loop {
            if let Some(request) = decode(&self.read()?) {
                return Some(request);
            }
        }
    }

    /// True if a frame can wait, and another one behind it. While a mailbox has room none waits.
    fn takes_event(&self) -> bool {
        self.waiting.len() < WAITING - 1
    }

    #[inline(always)]
    fn answer(&mut self, frame: &Frame) {
        if has_room() {
            send(frame);
        } else {
            self.wait(frame);
        }
    }

    #[inline(always)]
    fn put_in_force(&mut self, settings: &LinkSettings) {
        if let Some(identifiers) = self.new_identifiers(settings) {
            self.listen_to(&identifiers);
        }
    }

    /// Frames that wait are sent, and then requests are read again.
    #[inline(never)]
    fn refill(&mut self) {
        CAN1.tsr().write(|w| (0..MAILBOXES).for_each(|mailbox| w.set_rqcp(mailbox, true)));
        while is_free() {
            let Some(frame) = self.waiting.pop_front() else {
                CAN1.ier().write(|w| w.set_fmpie(FIFO, true));
                return;
            };
            send(&frame);
        }
    }

    /// Until the owner has read a frame. To be called at the end of the handler.
    fn hold(&self) {
        if CAN1.rfr(FIFO).read().fmp() != 0 {
            CAN1.ier().modify(|w| w.set_fmpie(FIFO, false));
        }
    }
}

/// Has the interrupt of the mailboxes come when one is free, and that of the queue of received frames only after it.
#[cold]
fn wait_for_room() {
    CAN1.ier().write(|w| w.set_tmeie(true));
}

/// True if a frame can be sent now, and none waits to be sent before it: while one does, the interrupt of the mailboxes
/// is enabled.
#[inline(always)]
fn has_room() -> bool {
    is_free() && !CAN1.ier().read().tmeie()
}

/// True if a mailbox is free.
fn is_free() -> bool {
    let status = CAN1.tsr().read();
    (0..MAILBOXES).any(|mailbox| status.tme(mailbox))
}

/// Hands a frame to a mailbox, of which one is free.
#[inline(always)]
fn send(frame: &Frame) {
    post(CAN1.tsr().read().code().into(), frame);
}
