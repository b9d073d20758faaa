//! The CAN link: the bxCAN controller, and its filters and queues as TMCL uses them; a node of CANopen has its own ones in
//! `can_node`. The owner of the module reads and writes frames by itself; a task in thread mode only joins the bus at the
//! start.
//!
//! Embassy sets the controller up. Its interrupts are handled here and by the owner, at the owner's priority: so nothing
//! that touches the controller interrupts anything else that does.

use core::array::from_fn;
use core::cell::UnsafeCell;
use core::num::{NonZeroU8, NonZeroU16};

use embassy_stm32::can::filter::{BankConfig, ListEntry16, Mask16};
use embassy_stm32::can::util::NominalBitTiming;
use embassy_stm32::can::{self, Fifo, RxPin, TxPin};
use embassy_stm32::interrupt::{self, InterruptExt, Priority, typelevel};
use embassy_stm32::pac::CAN1;
use embassy_stm32::pac::can::vals::{Ide, Rtr};
use embassy_stm32::{Peri, peripherals};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use heapless::{Deque, Vec};

use crate::can::outbox::MAILBOXES;
use crate::can::{CanFrame, ExtendedId, Frame, Id, StandardId};

/// The receive queue to which the filters lead.
const FIFO: usize = 0;
/// Number of filter banks in use, each with room for four identifiers.
const BANKS: u8 = 3;
/// Number of frames that can wait for a mailbox: events, and a late reply behind them.
const WAITING: usize = 4;

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
    // The driver has enabled all interrupts. Those of the second queue come in an image that has use for it; the controller
    // leaves bus-off by itself, and errors are seen in the poll of each millisecond.
    CAN1.ier().write(|_| {});
    interrupt::CAN1_RX1.disable();
    interrupt::CAN1_SCE.disable();
    for handler in [interrupt::CAN1_TX, interrupt::CAN1_RX0, interrupt::CAN1_RX1] {
        handler.set_priority(Priority::P6);
    }
    driver
}

/// The CAN controller on the bus.
pub(crate) struct Can {
    /// The driver, by which filters are set; frames are read and written at the controller's registers.
    driver: can::Can<'static>,
}

/// The identifiers of the frames that a firmware is to receive; `None` is all.
pub(crate) type Identifiers = Option<Vec<StandardId, { 4 * BANKS as usize }>>;

/// The CAN controller for the owner of the module, once the controller has joined the bus.
pub(crate) static JOINED: Signal<CriticalSectionRawMutex, Can> = Signal::new();

/// The bit rate in bit/s, once it is known: before, the controller is not started, and acknowledges no frame of others.
pub(crate) static BIT_RATE: Signal<CriticalSectionRawMutex, u32> = Signal::new();

/// Waits for the bit rate, and until the controller has seen 11 recessive bits on the bus, and hands it to the owner of the
/// module.
#[embassy_executor::task]
pub(crate) async fn join(mut can: can::Can<'static>, in_order: bool) {
    let bit_rate = BIT_RATE.wait().await;
    can.modify_config().set_bit_timing(timing(bit_rate));
    // Where mailboxes are sent in the order in which they were filled, it is because replies all have the same identifier:
    // in the order of identifiers only one of them could wait.
    can.set_tx_fifo_scheduling(in_order);
    can.enable().await;
    defmt::info!("CAN at {=u32} bit/s", bit_rate);
    // Until the owner has set the filters no frame passes them.
    CAN1.ier().write(|w| w.set_fmpie(FIFO, true));
    JOINED.signal(Can { driver: can });
}

/// The timing of a bit. The controller's clock of 42 MHz is divided into quanta, of which a bit has 14, sampled after the
/// twelfth.
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

impl Can {
    /// The oldest frame that has been received; `None` while there is none, or while no reply could be sent.
    #[inline(always)]
    pub(crate) fn read(&mut self) -> Option<Frame> {
        if CAN1.rfr(FIFO).read().fmp() == 0 {
            return None;
        }
        // A request stays in the queue while no mailbox is free for its reply; only a host that does not wait for replies
        // fills all three.
        if !has_room() {
            wait_for_room();
            return None;
        }
        let frame = take(FIFO);
        CAN1.ier().write(|w| w.set_fmpie(FIFO, true));
        frame
    }

    /// Sends a frame, behind those that wait. If as many as there is room for wait, no node on the bus has acknowledged
    /// the last replies, and this frame is dropped.
    #[inline(always)]
    pub(crate) fn write(&mut self, frame: &Frame) {
        if has_room() {
            send(frame);
        } else {
            wait(frame);
        }
    }

    /// Has the filters let data frames with these identifiers pass, or all frames.
    pub(crate) fn listen_to(&mut self, identifiers: &Identifiers) {
        let mut filters = self.driver.modify_filters();
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

/// Keeps the interrupt of received frames from coming again and again while the owner cannot read them: until it has read
/// one. To be called at the end of the handler.
pub(crate) fn hold() {
    if CAN1.rfr(FIFO).read().fmp() != 0 {
        CAN1.ier().modify(|w| w.set_fmpie(FIFO, false));
    }
}

/// The frames that wait for a mailbox, oldest first.
struct Queue(UnsafeCell<Deque<Frame, WAITING>>);

// SAFETY: only the owner uses it, in handlers of the same priority, none of which interrupts another.
unsafe impl Sync for Queue {}

static QUEUE: Queue = Queue(UnsafeCell::new(Deque::new()));

impl Queue {
    /// Calls a function with the queue. To be called at the owner's priority only, and not within such a function.
    fn with<R>(&self, act: impl FnOnce(&mut Deque<Frame, WAITING>) -> R) -> R {
        // SAFETY: see above.
        act(unsafe { &mut *self.0.get() })
    }
}

/// A mailbox has become free: frames that wait are sent, and then requests are read again. To be called at the owner's
/// priority.
#[inline(never)]
pub(crate) fn refill() {
    CAN1.tsr().write(|w| (0..MAILBOXES).for_each(|mailbox| w.set_rqcp(mailbox, true)));
    let room = QUEUE.with(|queue| {
        while is_free() {
            let Some(frame) = queue.pop_front() else { return true };
            send(&frame);
        }
        false
    });
    if room {
        CAN1.ier().write(|w| w.set_fmpie(FIFO, true));
    }
}

/// Has the interrupt of the mailboxes come when one is free, and that of the queue of received frames only after it.
#[cold]
fn wait_for_room() {
    CAN1.ier().write(|w| w.set_tmeie(true));
}

/// True if a frame can wait, and another one behind it. While a mailbox has room none waits.
pub(crate) fn takes_event() -> bool {
    QUEUE.with(|queue| queue.len() < WAITING - 1)
}

/// Puts a frame behind those that wait for a mailbox.
#[cold]
fn wait(frame: &Frame) {
    wait_for_room();
    if QUEUE.with(|queue| queue.push_back(*frame)).is_err() {
        defmt::debug!("CAN: nobody listens, reply dropped");
    }
}

/// True if a frame can be sent now, and none waits to be sent before it: while one does, the interrupt of the mailboxes is
/// enabled.
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
