//! The CAN controller as a node of CANopen uses it. All frames are read as soon as they are there, and the lowest
//! identifier that is to be sent goes first.
//!
//! Commands of the master and SYNC have a receive queue of their own, out of which no burst of PDOs can push them. The
//! frames of both queues are read in the order in which they came, by their time stamps: a PDO that came before a SYNC
//! acts with this SYNC.

use core::array::from_fn;

use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::CAN1;

use super::can::{Can, post, take};
use super::can_link::CanLink;
use crate::can::Frame;
use crate::can::outbox::{MAILBOXES, Outbox, Step};
use crate::canopen::{Bus, BusState, Filter, Filters};

/// The receive queue of all frames that are not in [`URGENT`].
const USUAL: usize = 0;
/// The receive queue of commands and SYNC, which are the first of the filters.
const URGENT: usize = 1;
/// Number of frames that are urgent.
const URGENT_FRAMES: usize = 2;
/// Number of filter banks: one for what is urgent, two for all else.
const BANKS: usize = 3;
/// Number of identifiers in a filter bank.
const IN_BANK: usize = 4;

/// The queues of a node at the CAN controller.
pub struct NodeLink {
    outbox: Outbox,
    /// The driver, which would switch the controller off if it were dropped.
    _controller: Can,
}

impl NodeLink {
    fn fill(&mut self) {
        while let Some(step) = self.outbox.step() {
            match step {
                Step::Send(mailbox, frame) => post(mailbox, &frame),
                Step::Abort(mailbox) => CAN1.tsr().write(|w| w.set_abrq(mailbox, true)),
            }
        }
    }
}

/// A node sends in the order of identifiers, has no requests of TMCL, and takes all frames.
impl CanLink for NodeLink {
    type Node = Self;

    const IN_ORDER: bool = false;

    /// Both receive queues get their filter banks, and the second one its interrupt.
    fn new(controller: Can) -> Self {
        CAN1.fmr().modify(|w| w.set_finit(true));
        for bank in 0..BANKS {
            // Lists of identifiers of 16 bits.
            CAN1.fm1r().modify(|w| w.set_fbm(bank, true));
            CAN1.fs1r().modify(|w| w.set_fsc(bank, false));
            CAN1.ffa1r().modify(|w| w.set_ffa(bank, bank == 0));
        }
        CAN1.fmr().modify(|w| w.set_finit(false));
        // SAFETY: the handler uses the owner, which calls this.
        unsafe { interrupt::CAN1_RX1.enable() };
        NodeLink { outbox: Outbox::new(), _controller: controller }
    }

    #[inline(always)]
    fn as_node(&mut self) -> Option<&mut Self> {
        Some(self)
    }

    /// Off the bus nothing is on its way.
    fn has_sent(&self) -> bool {
        self.outbox.is_empty() || self.state() == BusState::Off
    }
}

impl Bus for NodeLink {
    /// By the error counters.
    fn state(&self) -> BusState {
        let errors = CAN1.esr().read();
        match (errors.boff(), errors.epvf()) {
            (true, _) => BusState::Off,
            (false, true) => BusState::Passive,
            (false, false) => BusState::Active,
        }
    }

    /// Banks that stay as they are let their frames pass all the time.
    fn listen_to(&mut self, filters: &Filters) {
        let (urgent, usual) = filters.split_at_checked(URGENT_FRAMES).unwrap_or((filters, &[]));
        let (first, second) = usual.split_at_checked(IN_BANK).unwrap_or((usual, &[]));
        for (number, listed) in [urgent, first, second].into_iter().enumerate() {
            let bank = CAN1.fb(number);
            let words = listed.first().map(|one| {
                let [a, b, c, d] = from_fn(|n| entry(listed.get(n).unwrap_or(one)));
                [b << 16 | a, d << 16 | c]
            });
            let active = CAN1.fa1r().read().fact(number);
            let there = active.then(|| [bank.fr1().read().0, bank.fr2().read().0]);
            if words != there {
                CAN1.fa1r().modify(|w| w.set_fact(number, false));
                if let Some([low, high]) = words {
                    bank.fr1().write(|w| w.0 = low);
                    bank.fr2().write(|w| w.0 = high);
                    CAN1.fa1r().modify(|w| w.set_fact(number, true));
                }
            }
        }
    }

    #[inline(always)]
    fn read(&mut self) -> Option<Frame> {
        let [usual, urgent] = [USUAL, URGENT].map(|fifo| CAN1.rfr(fifo).read().fmp() != 0);
        let fifo = match (usual, urgent) {
            (false, false) => return None,
            (true, true) => earlier(),
            (_, urgent) => usize::from(urgent),
        };
        take(fifo)
    }

    fn has_overrun(&mut self) -> bool {
        let mut overrun = false;
        for fifo in [USUAL, URGENT] {
            if CAN1.rfr(fifo).read().fovr() {
                CAN1.rfr(fifo).write(|w| w.set_fovr(true));
                overrun = true;
            }
        }
        overrun
    }

    /// The mailboxes that have become free are filled again.
    fn settle(&mut self) {
        let status = CAN1.tsr().read();
        let ended: [bool; MAILBOXES] = from_fn(|mailbox| status.rqcp(mailbox));
        if ended.contains(&true) {
            CAN1.tsr().write(|w| (0..MAILBOXES).for_each(|mailbox| w.set_rqcp(mailbox, ended[mailbox])));
            for mailbox in (0..MAILBOXES).filter(|mailbox| ended[*mailbox]) {
                self.outbox.ended(mailbox, status.txok(mailbox));
            }
        }
        self.fill();
    }

    fn has_room(&self) -> bool {
        self.outbox.has_room()
    }

    fn is_empty(&self) -> bool {
        self.outbox.is_empty()
    }

    fn write(&mut self, frame: &Frame) {
        if let Some(mailbox) = self.outbox.post(frame) {
            return post(mailbox, frame);
        }
        // Asked for by `has_room`.
        let _ = self.outbox.push(frame);
        self.fill();
    }

    fn clear(&mut self) {
        for mailbox in self.outbox.clear() {
            CAN1.tsr().write(|w| w.set_abrq(mailbox, true));
        }
        self.settle();
    }

    /// The interrupts of received frames come, and that of the mailboxes if somebody waits for it.
    fn wait(&mut self, waits: bool) {
        let waits = waits || self.outbox.waits();
        CAN1.ier().write(|w| {
            w.set_fmpie(USUAL, true);
            w.set_fmpie(URGENT, true);
            w.set_tmeie(waits);
        });
    }
}

/// The receive queue whose oldest frame has come first; both have one. Time stamps count bits, and wrap at 65 536.
#[cold]
fn earlier() -> usize {
    let [usual, urgent] = [USUAL, URGENT].map(|fifo| CAN1.rx(fifo).rdtr().read().time());
    if usual.wrapping_sub(urgent).cast_signed() < 0 { USUAL } else { URGENT }
}

/// A frame as a filter of 16 bits has it: the identifier, and bit 4 for remote frames.
fn entry(filter: &Filter) -> u32 {
    u32::from(filter.id) << 5 | u32::from(filter.remote) << 4
}
