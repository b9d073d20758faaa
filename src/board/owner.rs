//! The owner of the module: the one place that calls it.
//!
//! It runs in the interrupt of TIM3, which comes when a poll is due, each millisecond, and whenever a link has
//! something ([`wake`]). It takes what the links have, polls when that is due, and gives a program its slices; between
//! two of these it looks at the links again. Nothing else touches the module, the motion bus, or the CAN mailboxes.

use core::cell::UnsafeCell;

use cortex_m::peripheral::SCB;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt;
use heapless::Vec;
use static_cell::{ConstStaticCell, StaticCell};

use super::can::{self, Can};
use super::mail::{LINKS, Outgoing, PAGE, USB, USB_GONE, USB_REQUESTS, WRITTEN};
use super::motion_bus::Chip;
use super::signals::Signals;
use super::tmcm1140::{Motion, drivers_off, show_trouble};
use super::{motion_bus, now, rs485, wake, watchdog};
use crate::module::{
    Due, Links, Mode, Module, Outcome, Outputs, Parts, Platform, Request, Source, TMCM_1140_AXES, Tmcm1140,
};
use crate::store::Store;
use crate::tmcl::Reply;
use crate::tmcl::can::decode;
use crate::units::Micros;

/// This board as a platform.
pub(super) struct Stm32;

impl Platform for Stm32 {
    type Tmc429 = Chip;
    type Tmc262 = Chip;
    type Enable = Output<'static>;
    type Product = Tmcm1140;
    type Store = &'static mut Store<Tmcm1140>;
    type Hooks = ();
}

/// The module on this board.
type Core = Module<Stm32, TMCM_1140_AXES>;

/// A host that does not fetch its replies, or talks all the time, does not keep a restart waiting for longer. The
/// longest pause before a reply on RS485 and the reply itself take 265 ms.
const LAST_WORDS: Micros = Micros::from_millis(300);

/// Builds the module where it stays, with what `load` reads from the EEPROM.
pub(super) fn build(motion: Motion, load: impl FnOnce(&mut Store<Tmcm1140>), seed: u32) -> Owner {
    static MODULE: StaticCell<Core> = StaticCell::new();
    static STORE: ConstStaticCell<Store<Tmcm1140>> = ConstStaticCell::new(Store::new());
    let Motion { bus, select_tmc429, select_tmc262, enable, signals } = motion;
    let (tmc429, tmc262) = motion_bus::chips(bus, select_tmc429, select_tmc262);
    let parts = Parts { tmc429, tmc262: [tmc262], enable, store: STORE.take(), hooks: () };
    let module = MODULE.init_with(|| Module::new(parts, seed));
    module.start(now(), load);
    defmt::info!("module runs at address {=u8}", module.links().address);
    let links = *module.links();
    Owner { module, signals, links, can: None, held: Vec::new(), ending: None, trouble: false }
}

/// The module and what belongs to it.
pub(super) struct Owner {
    pub(super) module: &'static mut Core,
    signals: Signals,
    /// The interface settings that the links have been told.
    links: Links,
    can: Option<Can>,
    /// Requests that wait until their link has its last reply.
    held: Vec<(Source, Request), 4>,
    /// Since when a restart is due.
    ending: Option<Micros>,
    /// Trouble has been told.
    trouble: bool,
}

/// The owner at its place. Nobody looks at it but its interrupt handler, which does not interrupt itself.
struct Place(UnsafeCell<Option<Owner>>);

// SAFETY: see above; before the interrupt is enabled, `start` has it for itself.
unsafe impl Sync for Place {}

static OWNER: Place = Place(UnsafeCell::new(None));

/// Puts the owner to its place and starts its timer.
pub(super) fn start(owner: Owner) {
    LINKS.lock(|shared| shared.set(Some(owner.links)));
    // SAFETY: the interrupt is not enabled yet.
    unsafe { *OWNER.0.get() = Some(owner) };
    wake::start();
}

#[interrupt]
unsafe fn TIM3() {
    wake::acknowledge();
    // SAFETY: only here, and an interrupt does not interrupt itself.
    if let Some(owner) = unsafe { (*OWNER.0.get()).as_mut() } {
        owner.turn();
    }
}

impl Owner {
    /// Does all there is to do. Each link gets its turn before any gets a second one, and a busy host does not hold
    /// up the motor.
    fn turn(&mut self) {
        loop {
            let mut idle = true;
            if let Some(can) = &mut self.can
                && !self.module.awaits(Source::Can)
                && let Some(frame) = can.read()
            {
                if let Some(frame) = decode(&frame) {
                    let request = Request::Frame(frame);
                    if let (Outcome::Reply(reply), _) = self.module.request(now(), Source::Can, &request) {
                        can.write(&self.module.links().frame(request.origin(Source::Can), &reply));
                    }
                }
                idle = false;
            }
            if let Some(request) = rs485::request() {
                self.take(Source::Rs485, request);
                idle = false;
            }
            if let Ok(request) = USB_REQUESTS.try_receive() {
                self.take(Source::Usb, request);
                idle = false;
            }
            let (now, deadline) = (now(), self.module.deadline());
            if now >= deadline {
                self.poll();
            } else if idle {
                return wake::after(deadline.since(now));
            }
        }
    }

    fn take(&mut self, source: Source, request: Request) {
        if !self.module.awaits(source) {
            self.serve(source, &request);
        } else if self.held.push((source, request)).is_err() {
            defmt::warn!("a host does not wait for its replies: request dropped");
            self.answer(source, None, None);
        }
    }

    /// Serves one request.
    fn serve(&mut self, source: Source, request: &Request) {
        let (outcome, mode) = self.module.request(now(), source, request);
        match outcome {
            Outcome::Reply(reply) => self.answer(source, Some(&reply), Some(mode)),
            Outcome::Silent => self.answer(source, None, Some(mode)),
            Outcome::Pending => {}
        }
    }

    /// Apart from `turn`, whose way to a reply would have to make room for all this first.
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
        if self.can.is_none() {
            self.can = can::JOINED.try_take();
            if let Some(can) = &mut self.can {
                can.listen_to(&self.links);
            }
        }
        if USB_GONE.try_take().is_some() {
            self.forget_usb();
        }
        self.deliver();
        while let Some(index) = self.held.iter().position(|(source, _)| !self.module.awaits(*source)) {
            let (source, request) = self.held.remove(index);
            self.serve(source, &request);
        }
        if self.links != *self.module.links() {
            self.links = *self.module.links();
            rs485::configure(&self.links);
            LINKS.lock(|shared| shared.set(Some(self.links)));
            if let Some(can) = &mut self.can {
                can.listen_to(&self.links);
            }
        }
        rs485::tick();
        self.restart(&outputs);
    }

    /// Before another host comes, which takes longer than a poll.
    fn forget_usb(&mut self) {
        USB_REQUESTS.clear();
        self.held.retain(|(source, _)| *source != Source::Usb);
        self.module.forget(Source::Usb);
        USB.clear();
    }

    /// Gives the links the replies that have become due.
    fn deliver(&mut self) {
        while let Some(Due { to, reply }) = self.module.next_reply() {
            match (to.source, reply, &mut self.can) {
                (Source::Can, Some(reply), Some(can)) => can.write(&self.module.links().frame(to, &reply)),
                (source, ..) => self.answer(source, reply.as_ref(), None),
            }
        }
    }

    fn answer(&self, source: Source, reply: Option<&Reply>, mode: Option<Mode>) {
        deliver(source, reply, mode, self.module.links());
    }

    /// Starts the firmware anew, if that is wanted, when all is said, or nobody has listened for long.
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

/// Gives a byte link an answer, or an event; the link goes on in the mode given, if one is.
fn deliver(source: Source, reply: Option<&Reply>, mode: Option<Mode>, links: &Links) {
    let room = match source {
        Source::Rs485 => rs485::answer(reply, mode, links),
        Source::Usb => USB.try_send(Outgoing { reply: reply.copied(), mode, links: *links }).is_ok(),
        Source::Can => true,
    };
    if !room {
        defmt::warn!("more replies than fit, one dropped");
    }
}
