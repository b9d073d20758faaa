//! The owner of the module: the only part of the firmware that calls the module.
//!
//! It runs in the interrupt of TIM3, which comes each millisecond when a poll is due, and whenever a link has a request
//! ([`wake`]). It serves the requests of the links, polls the module when that is due, and gives a program its slices;
//! between two of these it serves the links again. No other code uses the module, the motion bus, or the CAN mailboxes.

use core::cell::UnsafeCell;

use cortex_m::peripheral::SCB;
use embassy_stm32::interrupt;
use static_cell::{ConstStaticCell, StaticCell};

use super::can::{self, Can};
use super::chosen::{AXES, Chips, Motion, Signals, drivers_off, show_trouble};
use super::mail::{Outgoing, PAGE, USB, USB_GONE, USB_REQUESTS, WRITTEN, put_in_force};
use super::{now, rs485, wake, watchdog};
use crate::device::Outputs;
use crate::module::{Desk, LinkEnds, LinkMode, LinkSettings, Module, Origin, Request, Source, Tmcm1140};
use crate::store::Store;
use crate::tmcl::Reply;
use crate::tmcl::can::decode;
use crate::units::Micros;

/// The module on this board.
type Core = Module<Chips<Tmcm1140>, AXES>;

/// The longest time that a restart waits for replies to be sent: a host that does not fetch its replies must not
/// prevent it. The longest pause before a reply on RS485 (255 ms) and the reply itself at 9600 bit/s (9.4 ms) take 265
/// ms.
const LAST_WORDS: Micros = Micros::from_millis(300);

/// Builds the module in static memory and starts it, with a store that `load` fills from the EEPROM. `seed` starts the
/// random numbers.
pub(super) fn build(motion: Motion, signals: Signals, load: impl FnOnce(&mut Store<Tmcm1140>), seed: u32) -> Owner {
    static MODULE: StaticCell<Core> = StaticCell::new();
    static STORE: ConstStaticCell<Store<Tmcm1140>> = ConstStaticCell::new(Store::new());
    let parts = motion.parts(STORE.take());
    let module = MODULE.init_with(|| Module::new(parts, (), seed));
    module.start(now(), load);
    defmt::info!("module runs at address {=u8}", module.link_settings().address);
    Owner { module, signals, desk: Desk::new(), ends: Ends { can: None }, ending: None, trouble: false }
}

/// The module, with the signals and links that the owner exchanges with it.
pub(super) struct Owner {
    pub(super) module: &'static mut Core,
    signals: Signals,
    desk: Desk,
    ends: Ends,
    /// The time at which a restart became due; `None` without one.
    ending: Option<Micros>,
    /// The log already says that the motion controller does not answer.
    trouble: bool,
}

/// The owner in static memory. Only its interrupt handler uses it, and a handler does not interrupt itself.
struct OwnerCell(UnsafeCell<Option<Owner>>);

// SAFETY: the handler of TIM3 is the only user, and `start` before that interrupt is enabled.
unsafe impl Sync for OwnerCell {}

static OWNER: OwnerCell = OwnerCell(UnsafeCell::new(None));

/// Puts the owner into static memory and starts its timer.
pub(super) fn start(owner: Owner) {
    put_in_force(owner.module.link_settings());
    owner.signals.start();
    // SAFETY: the interrupt is not enabled yet.
    unsafe { *OWNER.0.get() = Some(owner) };
    wake::start();
}

#[interrupt]
unsafe fn TIM3() {
    wake::acknowledge();
    // SAFETY: the owner is used only here, and an interrupt handler does not interrupt itself.
    if let Some(owner) = unsafe { (*OWNER.0.get()).as_mut() } {
        owner.turn();
    }
}

impl Owner {
    /// Serves requests one by one until there is none, and after each checks whether a poll of the module is due, so
    /// that a host that sends without pause does not delay the motor.
    fn turn(&mut self) {
        loop {
            let idle = !self.desk.serve(self.module, &mut self.ends, now);
            let (now, deadline) = (now(), self.module.deadline());
            if now >= deadline {
                self.poll();
            } else if idle {
                return wake::after(deadline.since(now));
            }
        }
    }

    /// Polls the module, exchanges signals with it, and passes on what has become due. Never inlined: the stack frame
    /// that this function needs would be set up on the way to every reply in `turn`.
    #[inline(never)]
    fn poll(&mut self) {
        let outputs = self.module.poll(now(), &self.signals.read());
        self.signals.write(&outputs);
        watchdog::MODULE.alive();
        if outputs.trouble && !core::mem::replace(&mut self.trouble, true) {
            defmt::error!("motion controller does not answer: motor drivers off until the next start");
            show_trouble(true);
        }
        if let Some(written) = WRITTEN.try_take() {
            if !written {
                defmt::warn!("EEPROM: a page could not be written");
            }
            self.module.stored(written);
        }
        if let Some(job) = self.module.store().next_job() {
            PAGE.signal(job);
        }
        if self.ends.can.is_none() {
            self.ends.can = can::JOINED.try_take();
            if let Some(can) = &mut self.ends.can {
                can.listen_to(self.module.link_settings());
            }
        }
        if USB_GONE.try_take().is_some() {
            self.forget_usb();
        }
        Desk::deliver(self.module, &mut self.ends);
        if put_in_force(self.module.link_settings())
            && let Some(can) = &mut self.ends.can
        {
            can.listen_to(self.module.link_settings());
        }
        rs485::tick();
        self.restart(&outputs);
    }

    /// Drops the requests of a USB host that is gone, and the replies to them. Another host can be connected only after
    /// a new enumeration, which takes longer than the millisecond between two polls.
    fn forget_usb(&mut self) {
        USB_REQUESTS.clear();
        self.module.forget(Source::Usb);
        USB.clear();
    }

    /// Restarts the firmware, if the module asks for it: as soon as all replies are sent, or [`LAST_WORDS`] later.
    fn restart(&mut self, outputs: &Outputs) {
        if !outputs.restart {
            return;
        }
        let over = now().since(*self.ending.get_or_insert_with(now)) >= LAST_WORDS;
        if over || rs485::is_idle() && USB.is_empty() {
            defmt::info!("restart");
            drivers_off();
            SCB::sys_reset();
        }
    }
}

/// The links of the board, as the owner serves them.
struct Ends {
    /// The CAN controller; `None` until it has joined the bus.
    can: Option<Can>,
}

impl LinkEnds for Ends {
    #[inline(always)]
    fn request(&mut self, source: Source, _: &LinkSettings) -> Option<Request> {
        match source {
            Source::Can => self.can.as_mut()?.read().as_ref().and_then(decode).map(Request::Frame),
            Source::Rs485 => rs485::request(),
            // While the host has not fetched earlier replies there is no room for the reply to another request.
            Source::Usb if USB.is_full() => None,
            Source::Usb => USB_REQUESTS.try_receive().ok(),
        }
    }

    #[inline(always)]
    fn answer(&mut self, to: Origin, reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings) {
        let room = match to.source {
            Source::Rs485 => rs485::answer(reply, mode, settings),
            Source::Usb => {
                let addresses = settings.reply_addresses();
                USB.try_send(Outgoing { reply: reply.copied(), mode, addresses }).is_ok()
            }
            Source::Can => {
                if let (Some(can), Some(reply)) = (&mut self.can, reply) {
                    can.write(&settings.frame(to, reply));
                }
                true
            }
        };
        if !room {
            defmt::warn!("more replies than fit, one dropped");
        }
    }
}
