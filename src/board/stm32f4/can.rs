//! The bxCAN controller: its pins, its bit rate, and frames in its mailboxes. Filters and queues are those of who uses
//! it, TMCL (`can_tmcl`) or a node of CANopen (`can_node`). The owner of the module reads and writes frames by itself;
//! a task in thread mode only joins the bus at the start.
//!
//! Embassy sets the controller up. Its interrupts are handled here and by the owner, at the owner's priority: so
//! nothing that touches the controller interrupts anything else that does.

use core::num::{NonZeroU8, NonZeroU16};

use embassy_stm32::can::util::NominalBitTiming;
use embassy_stm32::can::{self, RxPin, TxPin};
use embassy_stm32::interrupt::{self, InterruptExt, Priority, typelevel};
use embassy_stm32::pac::CAN1;
use embassy_stm32::pac::can::vals::{Ide, Rtr};
use embassy_stm32::{Peri, peripherals};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

use crate::can::{CanFrame, ExtendedId, Frame, Id, StandardId};

/// The receive queue whose interrupt comes first.
const FIFO: usize = 0;

/// Stands for Embassy's handlers, which are not in use.
#[derive(Clone, Copy)]
struct Unhandled;

// SAFETY: the handlers wake those who wait in Embassy's driver for a frame, a mailbox or an error; nobody does.
unsafe impl typelevel::Binding<typelevel::CAN1_TX, can::TxInterruptHandler<peripherals::CAN1>> for Unhandled {}
// SAFETY: as above.
unsafe impl typelevel::Binding<typelevel::CAN1_RX0, can::Rx0InterruptHandler<peripherals::CAN1>> for Unhandled {}
// SAFETY: as above.
unsafe impl typelevel::Binding<typelevel::CAN1_RX1, can::Rx1InterruptHandler<peripherals::CAN1>> for Unhandled {}
// SAFETY: as above.
unsafe impl typelevel::Binding<typelevel::CAN1_SCE, can::SceInterruptHandler<peripherals::CAN1>> for Unhandled {}

/// The driver of the CAN controller with its pins.
pub(crate) fn driver(
    controller: Peri<'static, peripherals::CAN1>,
    rx: Peri<'static, impl RxPin<peripherals::CAN1>>,
    tx: Peri<'static, impl TxPin<peripherals::CAN1>>,
) -> can::Can<'static> {
    let driver = can::Can::new(controller, rx, tx, Unhandled);
    // The driver has enabled all interrupts. Those of the second queue come in an image that has use for it; the
    // controller leaves bus-off by itself, and errors are seen in the poll of each millisecond.
    CAN1.ier().write(|_| {});
    interrupt::CAN1_RX1.disable();
    interrupt::CAN1_SCE.disable();
    for handler in [interrupt::CAN1_TX, interrupt::CAN1_RX0, interrupt::CAN1_RX1] {
        handler.set_priority(Priority::P6);
    }
    driver
}

/// The CAN controller on the bus.
pub struct Can {
    /// The driver, by which filters are set; frames are read and written at the controller's registers.
    pub(super) driver: can::Can<'static>,
}

/// The CAN controller for the owner of the module, once the controller has joined the bus.
pub(crate) static JOINED: Signal<CriticalSectionRawMutex, Can> = Signal::new();

/// The bit rate in bit/s, once it is known: before, the controller is not started, and acknowledges no frame of others.
pub(crate) static BIT_RATE: Signal<CriticalSectionRawMutex, u32> = Signal::new();

/// Waits for the bit rate, and until the controller has seen 11 recessive bits on the bus, and hands it to the owner of
/// the module.
#[embassy_executor::task]
pub(crate) async fn join(mut can: can::Can<'static>, in_order: bool) {
    let bit_rate = BIT_RATE.wait().await;
    can.modify_config().set_bit_timing(timing(bit_rate));
    // Where mailboxes are sent in the order in which they were filled, it is because replies all have the same
    // identifier. In the order of identifiers only one of them could wait.
    can.set_tx_fifo_scheduling(in_order);
    can.enable().await;
    defmt::info!("CAN at {=u32} bit/s", bit_rate);
    // Until the owner has set the filters no frame passes them.
    CAN1.ier().write(|w| w.set_fmpie(FIFO, true));
    JOINED.signal(Can { driver: can });
}

/// The timing of a bit. The controller's clock of 42 MHz is divided into quanta, of which a bit has 14, sampled after
/// the twelfth.
///
/// For 800 kbit/s there is no such divider: 13 quanta of 4 clocks make 807.7 kbit/s, 0.96 % too much. A jump of three
/// quanta and a second segment of four, after a sample at the ninth, bear 1.15 % between two nodes. Any other rate that
/// is none of CANopen's or TMCL's becomes 1 Mbit/s.
fn timing(bit_rate: u32) -> NominalBitTiming {
    let (prescaler, [seg1, seg2, jump]) = match bit_rate {
        800_000 => (4, [8, 4, 3]),
        20_000 | 50_000 | 100_000 | 125_000 | 250_000 | 500_000 => ((3_000_000 / bit_rate) as u16, [11, 2, 1]),
        _ => (3, [11, 2, 1]),
    };
    let [seg1, seg2, sync_jump_width] =
        [seg1, seg2, jump].map(|quanta| NonZeroU8::new(quanta).unwrap_or(NonZeroU8::MIN));
    NominalBitTiming { prescaler: NonZeroU16::new(prescaler).unwrap_or(NonZeroU16::MIN), seg1, seg2, sync_jump_width }
}

/// Takes the oldest frame out of a receive queue, which holds one.
#[inline(always)]
pub(crate) fn take(fifo: usize) -> Option<Frame> {
    let queued = CAN1.rx(fifo);
    let (identity, size) = (queued.rir().read(), queued.rdtr().read());
    let [low, high] = [queued.rdlr().read().0, queued.rdhr().read().0];
    CAN1.rfr(fifo).write(|w| w.set_rfom(true));
    let id = if identity.ide() == Ide::STANDARD {
        StandardId::new(identity.stid())?.into()
    } else {
        ExtendedId::new(u32::from(identity.stid()) << 18 | identity.exid())?.into()
    };
    let bytes = (u64::from(high) << 32 | u64::from(low)).to_le_bytes();
    let remote = identity.rtr() == Rtr::REMOTE;
    Some(Frame::received(id, remote, size.dlc(), bytes))
}

/// Hands a frame to a mailbox, which is free.
#[inline(always)]
pub(crate) fn post(mailbox: usize, frame: &Frame) {
    let [a, b, c, d, high @ ..] = frame.bytes();
    let mailbox = CAN1.tx(mailbox);
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
