//! The owner of the firmware's logic, be it TMCL or another one that [runs](Runs) here: the only part that calls it.
//!
//! It runs in the interrupt of TIM3, which comes when a poll is due, and whenever RS485 or USB has a request
//! ([`wake`]). It also runs in those of the CAN controller, for received frames and free mailboxes. It serves the
//! requests of the links, polls the firmware when that is due, gives a program its slices, and a page to the EEPROM.
//! Between two of these it serves the links again. No other code uses the firmware and the motion bus.

use core::cell::UnsafeCell;

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt;
use embassy_stm32::pac::Interrupt;
use static_cell::{ConstStaticCell, StaticCell};

use super::around::Around;
use super::runs::Runs;
use crate::board::boards::chosen::{Chips, Motors, Signals};
use crate::board::boards::parts::Motors as _;
use crate::board::stm32f4::can_link::CanLink;
use crate::board::stm32f4::clocks::now;
use crate::board::stm32f4::kept::Kept;
use crate::board::stm32f4::{can, wake, watchdog};
use crate::device::{self, Outputs};
use crate::firmware::pass_on;
use crate::module::{Hooks, Source};
use crate::store::{Memory, Store};
use crate::units::Micros;

/// The owner's interrupts, and that of free mailboxes, as the first register of pending interrupts has them.
const OWNERS: u32 = bit(interrupt::TIM3) | bit(interrupt::CAN1_RX0) | bit(interrupt::CAN1_RX1);
const MAILBOXES: u32 = bit(interrupt::CAN1_TX);

/// The bit of an interrupt, one of the first 32.
const fn bit(interrupt: Interrupt) -> u32 {
    assert!((interrupt as u16) < 32);
    1 << interrupt as u16
}

/// The words that a firmware keeps for the time after a restart.
#[unsafe(link_section = ".uninit.kept")]
static KEPT: Kept<[u32; 2]> = Kept::new();

/// The static memory of an image for its firmware, and the EEPROM's contents.
pub struct Room<F: Runs> {
    owner: StaticCell<Owner<F>>,
    store: ConstStaticCell<Store<<F::Circuit as device::Circuit>::Product>>,
}

impl<F: Runs> Room<F> {
    /// Room for a firmware.
    #[expect(clippy::new_without_default, reason = "only a static has use for it")]
    pub const fn new() -> Self {
        Room { owner: StaticCell::new(), store: ConstStaticCell::new(Store::new()) }
    }
}

/// A firmware, with its surroundings.
///
/// The firmware comes first, hence `repr(C)`: load and store instructions reach only so far.
#[repr(C)]
pub(super) struct Owner<F: Runs> {
    pub(super) firmware: F,
    around: Around<F::Can>,
    /// The bit rate of CAN is not known yet.
    asks_bit_rate: bool,
}

/// Builds a firmware in its static memory; `seed` starts its random numbers. Never inlined: what it takes of the stack
/// is free again before anything else starts.
#[inline(never)]
pub(super) fn build<F, P, H>(
    room: &'static Room<F>,
    motors: Motors,
    signals: Signals,
    seed: u32,
) -> &'static mut Owner<F>
where
    F: Runs<Circuit = Chips<P, H>>,
    P: Memory + 'static,
    H: Hooks,
{
    let store = room.store.take();
    room.owner.init_with(|| {
        let firmware = F::new(motors.parts(store), seed);
        Owner { firmware, around: Around::new(signals), asks_bit_rate: true }
    })
}

/// Returns what the firmware has kept before a restart. To be called before the owner is [started](start).
pub(super) fn kept() -> [u32; 2] {
    // SAFETY: the owner alone writes this, and its interrupts have not been enabled; and any bits are two words.
    unsafe { KEPT.read() }
}

/// Functions that the interrupt handlers call, whatever the firmware.
trait Turn {
    fn turn(&mut self);

    /// A mailbox of the CAN controller has become free.
    fn refill(&mut self);

    /// The end of the interrupt of received frames.
    fn hold(&self);
}

/// The owner, for its interrupt handlers, which alone use it, and which do not interrupt each other.
struct OwnerCell(UnsafeCell<Option<&'static mut dyn Turn>>);

// SAFETY: the handlers of TIM3 and CAN are the only users, and `start` before these interrupts come.
unsafe impl Sync for OwnerCell {}

static OWNER: OwnerCell = OwnerCell(UnsafeCell::new(None));

/// Hands the owner to its interrupt handler and starts its timer.
pub(super) fn start<F: Runs>(owner: &'static mut Owner<F>) {
    owner.look_for_bit_rate();
    owner.around.start(owner.firmware.link_settings());
    // SAFETY: the interrupt of TIM3 is not enabled yet, and those of CAN come only after a task of thread mode, where
    // this runs, has joined the bus.
    unsafe { *OWNER.0.get() = Some(owner) };
    wake::start();
}

#[interrupt]
unsafe fn TIM3() {
    wake::acknowledge();
    with_owner(|owner| owner.turn());
}

/// A CAN frame has been received.
#[interrupt]
unsafe fn CAN1_RX0() {
    with_owner(|owner| {
        owner.turn();
        owner.hold();
    });
}

/// A CAN frame has come into the second queue.
#[interrupt]
unsafe fn CAN1_RX1() {
    with_owner(|owner| owner.turn());
}

/// A mailbox of the CAN controller has become free.
#[interrupt]
unsafe fn CAN1_TX() {
    with_owner(|owner| owner.refill());
}

/// To be called only by handlers of the owner's priority.
#[inline(always)]
fn with_owner(act: impl FnOnce(&mut dyn Turn)) {
    // SAFETY: the owner is used only here, and interrupt handlers of the same priority do not interrupt each other.
    if let Some(owner) = unsafe { (*OWNER.0.get()).as_mut() } {
        act(*owner);
    }
}

impl<F: Runs> Turn for Owner<F> {
    /// Serves requests one by one until there is none. After each it checks whether a poll of the firmware is due, so
    /// that a host that sends without pause does not delay the motor. But a request that has come while another was
    /// served goes before the poll, the first time. When there was no request, the links are looked at again if one of
    /// them has asked for this interrupt meanwhile. They are also looked at again if replies may have gone out for
    /// which a link waited.
    fn turn(&mut self) {
        let (mut idle, mut second) = (false, false);
        loop {
            if !idle || self.wanted() {
                idle = !self.firmware.serve(&mut self.around);
                second = !idle && !second && self.wanted();
                if second {
                    continue;
                }
            }
            let (now, deadline) = (now(), self.firmware.deadline());
            if now >= deadline {
                idle &= !self.poll(now);
            } else if idle {
                wake::after(deadline.since(now));
                if self.around.wants_page() {
                    self.around.pass_page_on(|| self.firmware.next_job());
                }
                return;
            }
        }
    }

    /// Never inlined: most turns come by without it.
    #[inline(never)]
    fn refill(&mut self) {
        if let Some(can) = &mut self.around.can {
            can.refill();
        }
        self.firmware.refill(&mut self.around);
    }

    fn hold(&self) {
        if let Some(can) = &self.around.can {
            can.hold();
        }
    }
}

impl<F: Runs> Owner<F> {
    /// True if one of the owner's interrupts has been asked for since it came, or since the last call. None of them
    /// comes while the owner runs, nor does that of the CAN mailboxes, whose work is done here.
    #[inline(always)]
    fn wanted(&mut self) -> bool {
        // SAFETY: these registers have no effects on others when they are read.
        let pending = unsafe { (*NVIC::PTR).ispr[0].read() };
        if pending & MAILBOXES != 0 {
            self.refill();
            NVIC::unpend(interrupt::CAN1_TX);
        }
        let wanted = pending & OWNERS;
        if wanted != 0 {
            // SAFETY: that an interrupt does not come for which the work is done here disturbs nobody.
            unsafe { (*NVIC::PTR).icpr[0].write(wanted) };
        }
        wanted != 0
    }

    /// Polls the firmware. True if something has been passed on. Never inlined: the stack frame that this function
    /// needs would be set up on the way to every reply in `turn`.
    #[inline(never)]
    fn poll(&mut self, now: Micros) -> bool {
        if self.firmware.takes_inputs(now) {
            self.around.read_inputs();
        }
        let outputs = self.firmware.poll(now, &self.around.inputs);
        if let Some(outputs) = &outputs {
            self.pass_on(outputs);
        }
        outputs.is_some()
    }

    /// Passes on what has become due, and takes what others have left for the owner. Never inlined: most slices of a
    /// program have no use for its stack frame.
    #[inline(never)]
    fn pass_on(&mut self, outputs: &Outputs) {
        let Owner { firmware, around, .. } = self;
        watchdog::MODULE.alive();
        around.look_for_can();
        if around.has_lost_usb() {
            firmware.forget(Source::Usb);
        }
        pass_on(firmware, around, outputs);
        if self.asks_bit_rate && self.look_for_bit_rate() {
            self.firmware.introduce();
        }
    }

    /// Has the CAN controller join the bus, if its bit rate is known, and keeps what belongs to that; true if so.
    fn look_for_bit_rate(&mut self) -> bool {
        let bit_rate = self.firmware.can_bit_rate();
        if let Some(bit_rate) = bit_rate {
            can::BIT_RATE.signal(bit_rate);
        }
        if let Some(words) = self.firmware.kept() {
            // SAFETY: the owner alone, and the start before it, use this.
            unsafe { KEPT.write(words) };
        }
        self.asks_bit_rate = bit_rate.is_none();
        bit_rate.is_some()
    }
}
