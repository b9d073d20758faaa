//! The surroundings of the firmware on a board: its links, its inputs and outputs, and what is handed over to those who
//! run in thread mode.

use cortex_m::peripheral::SCB;

use super::handover::{Outgoing, PAGE, USB, USB_GONE, USB_REQUESTS, WRITTEN, put_in_force};
use super::safe::{drivers_off, show_trouble};
use crate::board::boards::chosen::{AXES, Signals};
use crate::board::stm32f4::can;
use crate::board::stm32f4::can_link::CanLink;
use crate::board::stm32f4::clocks::now;
use crate::board::stm32f4::rs485;
use crate::device::{Inputs, Outputs};
use crate::firmware::Surroundings;
use crate::module::{LinkEnds, LinkMode, LinkSettings, Origin, Request, Source};
use crate::store::Job;
use crate::tmcl::Reply;
use crate::units::Micros;

/// The longest time that a restart waits for replies to be sent: a host that does not fetch its replies must not
/// prevent it. The longest pause before a reply on RS485 (255 ms) and the reply itself at 9600 bit/s (9.4 ms) take 265
/// ms.
const LAST_WORDS: Micros = Micros::from_millis(300);

/// The surroundings of a firmware that uses the CAN controller by `C`.
pub struct Around<C> {
    signals: Signals,
    /// The inputs as they were read last.
    pub(super) inputs: Inputs<AXES>,
    /// The outputs as they were set last.
    outputs: Option<Outputs>,
    /// The CAN link; `None` until the controller has joined the bus.
    pub(super) can: Option<C>,
    /// The time at which a restart became due; `None` without one.
    ending: Option<Micros>,
    /// The log says that a motion controller does not answer, and the error LED is lit.
    trouble: bool,
    /// A page for the EEPROM is to be looked for: since a turn, and until the links have nothing to do. The contents
    /// and the check sum of a page take half as long as a turn, and a request that waits for the one should not wait
    /// for both.
    page: bool,
}

impl<C: CanLink> Around<C> {
    /// Around a firmware that has not started.
    pub(super) fn new(signals: Signals) -> Self {
        let inputs = Inputs::default();
        Around { signals, inputs, outputs: None, can: None, ending: None, trouble: false, page: false }
    }

    /// Begins to notice what the inputs do.
    pub(super) fn start(&mut self, settings: &LinkSettings) {
        put_in_force(settings);
        self.signals.start();
    }

    /// Reads the inputs anew.
    pub(super) fn read_inputs(&mut self) {
        self.signals.read(&mut self.inputs);
    }

    /// The CAN controller takes part, once it has joined the bus.
    #[inline(always)]
    pub(super) fn look_for_can(&mut self) {
        if self.can.is_none() {
            self.can = can::JOINED.try_take().map(C::new);
        }
    }

    /// True, once, after the USB host has gone. Its requests are dropped, and the replies to them. Another host can be
    /// connected only after a new enumeration, which takes longer than the millisecond between two polls.
    #[inline(always)]
    pub(super) fn has_lost_usb(&mut self) -> bool {
        let gone = USB_GONE.try_take().is_some();
        if gone {
            USB_REQUESTS.clear();
            USB.clear();
        }
        gone
    }

    /// True while a page for the EEPROM is to be looked for.
    #[inline(always)]
    pub(super) fn wants_page(&self) -> bool {
        self.page
    }

    /// Passes a page on to the EEPROM, if there is one for it.
    #[inline(never)]
    pub(super) fn pass_page_on(&mut self, next: impl FnOnce() -> Option<Job>) {
        self.page = false;
        if let Some(job) = next() {
            PAGE.signal(job);
        }
    }
}

impl<C: CanLink> LinkEnds for Around<C> {
    #[inline(always)]
    fn now(&self) -> Micros {
        now()
    }

    #[inline(always)]
    fn request(&mut self, source: Source, _: &LinkSettings) -> Option<Request> {
        match source {
            Source::Can => self.can.as_mut()?.request().map(Request::Frame),
            Source::Rs485 => rs485::request(),
            // While the host has not fetched earlier replies there is no room for the reply to another request.
            Source::Usb if USB.is_full() => None,
            Source::Usb => USB_REQUESTS.try_receive().ok(),
        }
    }

    /// Each link keeps room for the reply of a request, for which a host waits.
    #[cold]
    #[inline(never)]
    fn takes_event(&mut self, source: Source) -> bool {
        match source {
            Source::Rs485 => rs485::takes_event(),
            Source::Usb => USB.free_capacity() > 1,
            Source::Can => self.can.as_ref().is_some_and(C::takes_event),
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
                    can.answer(&settings.frame(to, reply));
                }
                true
            }
        };
        if !room {
            defmt::warn!("more replies than fit, one dropped");
        }
    }
}

impl<C: CanLink> Surroundings for Around<C> {
    type Bus = C::Node;

    #[inline(always)]
    fn bus(&mut self) -> Option<&mut C::Node> {
        self.can.as_mut()?.as_node()
    }

    #[inline(always)]
    fn set(&mut self, outputs: &Outputs) {
        if self.outputs != Some(*outputs) {
            self.outputs = Some(*outputs);
            self.signals.write(outputs);
        }
        if outputs.trouble != self.trouble {
            self.trouble = outputs.trouble;
            if outputs.trouble {
                defmt::error!("motion controller does not answer: motor drivers off");
            } else {
                defmt::info!("motion controllers answer again: motor drivers on");
            }
            show_trouble(outputs.trouble);
        }
    }

    /// Jobs end in a task of thread mode. The next one is passed on when the links have nothing to do, but links that
    /// were never idle since the last turn do not keep pages from the EEPROM.
    #[inline(always)]
    fn keep(&mut self, next: impl FnOnce() -> Option<Job>) -> Option<bool> {
        if let Some(written) = WRITTEN.try_take() {
            if !written {
                defmt::warn!("EEPROM: no answer, or a page that could not be written");
            }
            return Some(written);
        }
        if self.page {
            self.pass_page_on(next);
        }
        self.page = true;
        None
    }

    #[inline(always)]
    fn put_in_force(&mut self, settings: &LinkSettings) {
        if let Some(can) = &mut self.can {
            can.put_in_force(settings);
        }
        put_in_force(settings);
        rs485::tick();
    }

    /// As soon as all replies are sent, or [`LAST_WORDS`] later.
    #[cold]
    fn restart(&mut self) {
        let over = now().since(*self.ending.get_or_insert_with(now)) >= LAST_WORDS;
        if over || rs485::is_idle() && USB.is_empty() && self.can.as_ref().is_none_or(C::has_sent) {
            defmt::info!("restart");
            drivers_off();
            SCB::sys_reset();
        }
    }
}
