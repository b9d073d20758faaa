//! The owner of the firmware's logic, be it TMCL or another [`Firmware`]: the only part that calls it.
//!
//! It runs in the interrupt of TIM3, which comes when a poll is due, and whenever RS485 or USB has a request ([`wake`]);
//! and in those of the CAN controller, for received frames and free mailboxes. It serves the requests of the links, polls the
//! firmware when that is due, gives a program its slices, and a page to the EEPROM; between two of these it serves the links
//! again. No other code uses the firmware and the motion bus.

use core::cell::UnsafeCell;

use cortex_m::peripheral::{NVIC, SCB};
use embassy_stm32::interrupt;
use embassy_stm32::pac::Interrupt;
use static_cell::{ConstStaticCell, StaticCell};

use super::ends::Ends;
use super::firmware::Firmware;
use super::mail::{PAGE, USB, USB_GONE, USB_REQUESTS, WRITTEN, put_in_force};
use super::safe::{drivers_off, show_trouble};
use crate::board::boards::chosen::{AXES, Chips, Motors, Signals};
use crate::board::boards::parts::Motors as _;
use crate::board::stm32f4::clocks::now;
use crate::board::stm32f4::{can, rs485, wake, watchdog};
use crate::device::{self, Inputs, Outputs};
use crate::module::Source;
use crate::store::{Memory, Store};
use crate::units::Micros;

/// The longest time that a restart waits for replies to be sent: a host that does not fetch its replies must not
/// prevent it. The longest pause before a reply on RS485 (255 ms) and the reply itself at 9600 bit/s (9.4 ms) take 265
/// ms.
const LAST_WORDS: Micros = Micros::from_millis(300);

/// The owner's interrupts, and that of free mailboxes, as the first register of pending interrupts has them.
const OWNERS: u32 = bit(interrupt::TIM3) | bit(interrupt::CAN1_RX0) | bit(interrupt::CAN1_RX1);
const MAILBOXES: u32 = bit(interrupt::CAN1_TX);

/// The bit of an interrupt, one of the first 32.
const fn bit(interrupt: Interrupt) -> u32 {
    assert!((interrupt as u16) < 32);
    1 << interrupt as u16
}

/// The static memory of an image for its firmware, and the EEPROM's contents.
pub struct Room<F: Firmware<AXES>> {
    owner: StaticCell<Owner<F>>,
    store: ConstStaticCell<Store<<F::Board as device::Board>::Product>>,
}

impl<F: Firmware<AXES>> Room<F> {
    /// Room for a firmware.
    #[expect(clippy::new_without_default, reason = "only a static has use for it")]
    pub const fn new() -> Self {
        Room { owner: StaticCell::new(), store: ConstStaticCell::new(Store::new()) }
    }
}

/// A firmware, with the signals and links that the owner exchanges with it.
///
/// The firmware comes first, hence `repr(C)`: load and store instructions reach only so far.
#[repr(C)]
pub(super) struct Owner<F> {
    pub(super) firmware: F,
    signals: Signals,
    /// The inputs as they were read last.
    inputs: Inputs<AXES>,
    /// The outputs as they were set last.
    outputs: Option<Outputs>,
    ends: Ends,
    /// The time at which a restart became due; `None` without one.
    ending: Option<Micros>,
    /// The log says that a motion controller does not answer, and the error LED is lit.
    trouble: bool,
    /// A page for the EEPROM is to be looked for: since a turn, and until the links have nothing to do. The contents and the
    /// check sum of a page take half as long as a turn, and a request that waits for the one should not wait for both.
    page: bool,
}

/// Builds a firmware in its static memory; `seed` starts its random numbers. Never inlined: what it takes of the stack
/// is free again before anything else starts.
#[inline(never)]
pub(super) fn build<F, P>(room: &'static Room<F>, motors: Motors, signals: Signals, seed: u32) -> &'static mut Owner<F>
where
    F: Firmware<AXES, Board = Chips<P>>,
    P: Memory + 'static,
{
    let store = room.store.take();
    room.owner.init_with(|| {
        let (inputs, ends) = (Inputs::default(), Ends { can: None });
        let firmware = F::new(motors.parts(store), seed);
        Owner { firmware, signals, inputs, outputs: None, ends, ending: None, trouble: false, page: false }
    })
}

/// What the interrupt handlers call, whatever the firmware.
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
pub(super) fn start<F: Firmware<AXES>>(owner: &'static mut Owner<F>) {
    put_in_force(owner.firmware.link_settings());
    owner.signals.start();
    // SAFETY: the interrupt of TIM3 is not enabled yet, and those of CAN come only after a task of thread mode, where this
    // runs, has joined the bus.
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

impl<F: Firmware<AXES>> Turn for Owner<F> {
    /// Serves requests one by one until there is none, and after each checks whether a poll of the firmware is due, so
    /// that a host that sends without pause does not delay the motor; but a request that has come while another was
    /// served goes before the poll, the first time. When there was no request, the links are looked at again if one of
    /// them has asked for this interrupt meanwhile, or if replies may have gone out for which a link waited.
    fn turn(&mut self) {
        let (mut idle, mut second) = (false, false);
        loop {
            if !idle || self.wanted() {
                idle = !self.firmware.serve(&mut self.ends, now);
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
                if self.page {
                    self.pass_page_on();
                }
                return;
            }
        }
    }

    fn refill(&mut self) {
        self.firmware.refill(&mut self.ends);
    }

    fn hold(&self) {
        self.firmware.hold();
    }
}

impl<F: Firmware<AXES>> Owner<F> {
    /// True if one of the owner's interrupts has been asked for since it came, or since the last call: none of them comes
    /// while the owner runs, nor does that of the CAN mailboxes, whose work is done here.
    #[inline(always)]
    fn wanted(&mut self) -> bool {
        // SAFETY: these registers have no effects on others when they are read.
        let pending = unsafe { (*NVIC::PTR).ispr[0].read() };
        if pending & MAILBOXES != 0 {
            self.firmware.refill(&mut self.ends);
            NVIC::unpend(interrupt::CAN1_TX);
        }
        let wanted = pending & OWNERS;
        if wanted != 0 {
            // SAFETY: that an interrupt does not come for which the work is done here disturbs nobody.
            unsafe { (*NVIC::PTR).icpr[0].write(wanted) };
        }
        wanted != 0
    }

    /// Polls the firmware. True if something has been passed on. Never inlined: the stack frame that this function needs
    /// would be set up on the way to every reply in `turn`.
    #[inline(never)]
    fn poll(&mut self, now: Micros) -> bool {
        if self.firmware.takes_inputs(now) {
            self.signals.read(&mut self.inputs);
        }
        let outputs = self.firmware.poll(now, &self.inputs);
        if let Some(outputs) = &outputs {
            self.pass_on(outputs);
        }
        outputs.is_some()
    }

    /// Sets the outputs, passes on what has become due, and takes what others have left for the owner. Never inlined:
    /// most slices of a program have no use for its stack frame.
    #[inline(never)]
    fn pass_on(&mut self, outputs: &Outputs) {
        if self.outputs != Some(*outputs) {
            self.outputs = Some(*outputs);
            self.signals.write(outputs);
        }
        watchdog::MODULE.alive();
        if outputs.trouble != self.trouble {
            self.trouble = outputs.trouble;
            if outputs.trouble {
                defmt::error!("motion controller does not answer: motor drivers off");
            } else {
                defmt::info!("motion controllers answer again: motor drivers on");
            }
            show_trouble(outputs.trouble);
        }
        if let Some(written) = WRITTEN.try_take() {
            if !written {
                defmt::warn!("EEPROM: no answer, or a page that could not be written");
            }
            self.firmware.stored(written);
        }
        // Links that were never idle since the last turn do not keep pages from the EEPROM.
        if self.page {
            self.pass_page_on();
        }
        self.page = true;
        if self.ends.can.is_none() {
            self.ends.can = can::JOINED.try_take();
        }
        if USB_GONE.try_take().is_some() {
            self.forget_usb();
        }
        self.firmware.deliver(&mut self.ends);
        put_in_force(self.firmware.link_settings());
        rs485::tick();
        self.restart(outputs);
    }

    /// Passes a page on to the EEPROM, if there is one for it.
    #[inline(never)]
    fn pass_page_on(&mut self) {
        self.page = false;
        if let Some(job) = self.firmware.next_job() {
            PAGE.signal(job);
        }
    }

    /// Drops the requests of a USB host that is gone, and the replies to them. Another host can be connected only after
    /// a new enumeration, which takes longer than the millisecond between two polls.
    fn forget_usb(&mut self) {
        USB_REQUESTS.clear();
        self.firmware.forget(Source::Usb);
        USB.clear();
    }

    /// Restarts the firmware, if the firmware asks for it: as soon as all replies are sent, or [`LAST_WORDS`] later.
    fn restart(&mut self, outputs: &Outputs) {
        if !outputs.restart {
            return;
        }
        let over = now().since(*self.ending.get_or_insert_with(now)) >= LAST_WORDS;
        if over || rs485::is_idle() && USB.is_empty() && self.firmware.has_sent() {
            defmt::info!("restart");
            drivers_off();
            SCB::sys_reset();
        }
    }
}
