//! The CAN link: the bxCAN controller and its filters. The owner of the module reads and writes frames by itself; a
//! task in thread mode only joins the bus at the start.

use core::array::from_fn;

use embassy_stm32::can::filter::{BankConfig, ListEntry16, Mask16};
use embassy_stm32::can::{self, CanRx, CanTx, Fifo, RxPin, TxPin};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::CAN1;
use embassy_stm32::pac::can::vals::{Ide, Rtr};
use embassy_stm32::{Peri, bind_interrupts, peripherals};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use heapless::Vec;

use super::wake::OnFrame;
use crate::can::{CanFrame, ExtendedId, Frame, Id, StandardId};

/// The receive queue to which the filters lead.
const FIFO: usize = 0;
/// Number of filter banks in use, each with room for four identifiers.
const BANKS: u8 = 3;
/// Number of mailboxes, in each of which a frame can wait to be sent.
const MAILBOXES: usize = 3;

bind_interrupts!(struct Irqs {
    CAN1_TX => can::TxInterruptHandler<peripherals::CAN1>;
    CAN1_RX0 => can::Rx0InterruptHandler<peripherals::CAN1>, OnFrame;
    CAN1_RX1 => can::Rx1InterruptHandler<peripherals::CAN1>;
    CAN1_SCE => can::SceInterruptHandler<peripherals::CAN1>;
});

/// The driver of the CAN controller with its pins.
pub(super) fn driver(
    controller: Peri<'static, peripherals::CAN1>,
    rx: Peri<'static, impl RxPin<peripherals::CAN1>>,
    tx: Peri<'static, impl TxPin<peripherals::CAN1>>,
) -> can::Can<'static> {
    for handler in [interrupt::CAN1_TX, interrupt::CAN1_RX0, interrupt::CAN1_RX1, interrupt::CAN1_SCE] {
        handler.set_priority(Priority::P5);
    }
    can::Can::new(controller, rx, tx, Irqs)
}

/// Both halves of the driver of the CAN controller.
pub(super) struct Can {
    /// The sending half, only kept: frames are sent at the controller's registers.
    _tx: CanTx<'static>,
    /// The receiving half, by which filters are set; frames are read at the controller's registers.
    rx: CanRx<'static>,
}

/// The identifiers of the frames that a firmware is to receive; `None` is all.
pub type Identifiers = Option<Vec<StandardId, { 4 * BANKS as usize }>>;

/// The CAN controller for the owner of the module, once the controller has joined the bus.
pub(super) static JOINED: Signal<CriticalSectionRawMutex, Can> = Signal::new();

/// Waits until the controller has seen 11 recessive bits on the bus, and hands it to the owner of the module.
#[embassy_executor::task]
pub(super) async fn join(mut can: can::Can<'static>, bit_rate: u32) {
    can.set_bitrate(bit_rate);
    // Mailboxes are sent in the order in which they were filled: replies all have the same identifier, and in the order
    // of identifiers only one of them could wait.
    can.set_tx_fifo_scheduling(true);
    can.enable().await;
    let (tx, rx) = can.split();
    // The destructor of `can` would reset the controller.
    core::mem::forget(can);
    defmt::info!("CAN at {=u32} bit/s", bit_rate);
    JOINED.signal(Can { _tx: tx, rx });
}

impl Can {
    /// The oldest frame that has been received; `None` while there is none, or while no reply could be sent.
    pub(super) fn read(&mut self) -> Option<Frame> {
        // The registers are read here, because Embassy's driver would look at both queues and at the clock, and for
        // errors, although the controller leaves bus-off by itself. A request stays in the queue while no mailbox is
        // free for its reply; only a host that does not wait for replies fills all three.
        if CAN1.rfr(FIFO).read().fmp() == 0 || !has_room() {
            return None;
        }
        let queued = CAN1.rx(FIFO);
        let (identity, size) = (queued.rir().read(), queued.rdtr().read());
        let [low, high] = [queued.rdlr().read().0, queued.rdhr().read().0];
        CAN1.rfr(FIFO).write(|w| w.set_rfom(true));
        // Embassy's interrupt handler has switched its own interrupt off until this frame is read.
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

    /// Sends a frame. If all three mailboxes are full, no node on the bus has acknowledged the last three replies, and
    /// this frame is dropped.
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
                    // EXID has the lower 18 of the identifier's 29 bits.
                    w.set_exid(id.as_raw() & 0x3_FFFF);
                }
            }
            w.set_rtr(if frame.is_remote_frame() { Rtr::REMOTE } else { Rtr::DATA });
            w.set_txrq(true);
        });
    }

    /// Has the filters let data frames with these identifiers pass, or all frames.
    pub(super) fn listen_to(&mut self, identifiers: &Identifiers) {
        let mut filters = self.rx.modify_filters();
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

/// True if a frame can be sent now.
fn has_room() -> bool {
    let status = CAN1.tsr().read();
    (0..MAILBOXES).any(|mailbox| status.tme(mailbox))
}
