//! The CAN link: the bxCAN with its filters. Its owner is that of the module; here is how it gets there.

use embassy_stm32::can::filter::{BankConfig, ListEntry16, Mask16};
use embassy_stm32::can::{self, CanRx, CanTx, Fifo};
use embassy_stm32::pac::CAN1;
use embassy_stm32::pac::can::vals::{Ide, Rtr};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

use crate::can::{CanFrame, ExtendedId, Frame, Id, StandardId};
use crate::module::LinkSettings;

/// The receive queue that the filters lead to.
const FIFO: usize = 0;
/// Frames that can wait to be sent.
const MAILBOXES: usize = 3;

/// Both halves of the interface.
pub(super) struct Can {
    /// Replies go to the mailboxes at the registers.
    _tx: CanTx<'static>,
    /// Frames are read there, too; the filters are set here.
    rx: CanRx<'static>,
}

/// The interface for the owner, once it has joined the bus.
pub(super) static JOINED: Signal<CriticalSectionRawMutex, Can> = Signal::new();

/// Waits until the bus is there - 11 recessive bits - and hands the interface over.
#[embassy_executor::task]
pub(super) async fn join(mut can: can::Can<'static>, bit_rate: u32) {
    can.set_bitrate(bit_rate);
    // In the order of their identifiers only one frame of each could wait, and replies all have the same.
    can.set_tx_fifo_scheduling(true);
    can.enable().await;
    let (tx, rx) = can.split();
    // Dropped, it would reset the controller.
    core::mem::forget(can);
    defmt::info!("CAN at {=u32} bit/s", bit_rate);
    JOINED.signal(Can { _tx: tx, rx });
}

impl Can {
    /// The oldest frame that has come.
    pub(super) fn read(&mut self) -> Option<Frame> {
        // Asked at each turn of the owner; the driver looks at both queues and for errors. A request whose reply could
        // not be sent waits, for the next turn or poll: only a host that does not wait for replies brings so many.
        if CAN1.rfr(FIFO).read().fmp() == 0 || !has_room() {
            return None;
        }
        // Read at the registers: the driver would look at the clock, at both queues and for errors, which are the
        // controller's to handle: it leaves bus-off by itself.
        let queued = CAN1.rx(FIFO);
        let (identity, size) = (queued.rir().read(), queued.rdtr().read());
        let [low, high] = [queued.rdlr().read().0, queued.rdhr().read().0];
        CAN1.rfr(FIFO).write(|w| w.set_rfom(true));
        // The driver's handler has asked not to be called for more until this one is read.
        cortex_m::interrupt::free(|_| CAN1.ier().modify(|w| w.set_fmpie(FIFO, true)));
        let id = if identity.ide() == Ide::STANDARD {
            StandardId::new(identity.stid())?.into()
        } else {
            ExtendedId::new(u32::from(identity.stid()) << 18 | identity.exid())?.into()
        };
        let bytes = (u64::from(high) << 32 | u64::from(low)).to_le_bytes();
        let remote = identity.rtr() == Rtr::REMOTE;
        Some(Frame::received(id, remote, size.dlc(), bytes))
    }

    /// Sends a frame. With all three mailboxes full nobody has acknowledged the last three replies, and this one is
    /// dropped.
    pub(super) fn write(&mut self, frame: &Frame) {
        if !has_room() {
            return defmt::debug!("CAN: nobody listens, reply dropped");
        }
        let [a, b, c, d, high @ ..] = frame.bytes();
        let mailbox = CAN1.tx(CAN1.tsr().read().code().into());
        mailbox.tdtr().write(|w| w.set_dlc(frame.dlc() as u8));
        mailbox.tdlr().write(|w| w.0 = u32::from_le_bytes([a, b, c, d]));
        mailbox.tdhr().write(|w| w.0 = u32::from_le_bytes(high));
        mailbox.tir().write(|w| {
            match frame.id() {
                Id::Standard(id) => w.set_stid(id.as_raw()),
                Id::Extended(id) => {
                    w.set_ide(Ide::EXTENDED);
                    w.set_stid(id.standard_id().as_raw());
                    // The lower 18 of its 29 bits.
                    w.set_exid(id.as_raw() & 0x3_FFFF);
                }
            }
            w.set_rtr(if frame.is_remote_frame() { Rtr::REMOTE } else { Rtr::DATA });
            w.set_txrq(true);
        });
    }

    /// Lets in what is for the module. A module whose own identifier is that of replies has to hear the requests to
    /// others, to know their replies.
    pub(super) fn listen_to(&mut self, settings: &LinkSettings) {
        let LinkSettings { can_id, can_secondary, can_reply, .. } = *settings;
        let own = [can_id, can_secondary.unwrap_or(can_id)];
        let mut filters = self.rx.modify_filters();
        if own.contains(&can_reply) {
            filters.enable_bank(0, Fifo::Fifo0, BankConfig::Mask16([Mask16::accept_all(); 2]));
            return;
        }
        let [first, second] = own.map(ListEntry16::data_frames_with_id);
        filters.enable_bank(0, Fifo::Fifo0, BankConfig::List16([first, second, first, second]));
    }
}

/// True if a frame can be sent now.
fn has_room() -> bool {
    let status = CAN1.tsr().read();
    (0..MAILBOXES).any(|mailbox| status.tme(mailbox))
}
