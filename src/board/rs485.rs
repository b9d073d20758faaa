//! The RS485 link: bytes to requests, replies and echoes to bytes. The transceiver is half duplex; its direction
//! is a pin.
//!
//! All of it happens in the interrupt of USART3 and in calls from the owner of the module, so that a reply is under way
//! as soon as it is known: the last byte of a request completes it in the handler, the owner runs next, and its answer
//! goes into the port at once.

use core::cell::RefCell;

use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::USART3;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use heapless::Deque;

use super::mail::{Outgoing, REQUESTS};
use super::{now, owner};
use crate::module::{Links, Port, Source};
use crate::tmcl::ascii::LINE;
use crate::units::Micros;

/// Bytes that cannot be read before something is answered: a line that is typed ahead.
const AHEAD: usize = 128;
/// Bytes on their way out: a reply and the echo of a line.
const OUT: usize = 128;
const _: () = assert!(OUT >= LINE + 40);

static LINK: CriticalSectionMutex<RefCell<Option<Rs485>>> = CriticalSectionMutex::new(RefCell::new(None));

/// The state of the link.
struct Rs485 {
    direction: Output<'static>,
    links: Links,
    port: Port,
    ahead: Deque<u8, AHEAD>,
    /// When the last byte came.
    last: Micros,
    /// Answers whose pause is not over: a reply and an event, and one more of each.
    due: Deque<Outgoing, 4>,
    out: Deque<u8, OUT>,
    sending: bool,
}

/// Starts the link on USART3, which is set up and listens.
pub(super) fn start(direction: Output<'static>, links: Links) {
    let link = Rs485 {
        direction,
        links,
        port: Port::new(Source::Rs485, links.start),
        ahead: Deque::new(),
        last: now(),
        due: Deque::new(),
        out: Deque::new(),
        sending: false,
    };
    LINK.lock(|place| place.replace(Some(link)));
    USART3.cr1().modify(|w| w.set_rxneie(true));
    interrupt::USART3.set_priority(Priority::P4);
    // SAFETY: the handler has what it needs.
    unsafe { interrupt::USART3.enable() };
}

/// Takes an answer to be sent; false if there are too many.
pub(super) fn answer(outgoing: Outgoing) -> bool {
    with(|link| {
        let taken = link.due.push_back(outgoing).is_ok();
        link.send_due();
        taken
    })
}

/// Sends what has waited for the end of its pause. To be called every millisecond.
pub(super) fn tick() {
    with(Rs485::send_due);
}

/// Takes other interface settings.
pub(super) fn configure(links: &Links) {
    with(|link| link.links = *links);
}

/// True when all is said.
pub(super) fn is_idle() -> bool {
    with(|link| link.due.is_empty() && !link.sending)
}

fn with<R: Default>(act: impl FnOnce(&mut Rs485) -> R) -> R {
    LINK.lock(|place| place.borrow_mut().as_mut().map(act)).unwrap_or_default()
}

#[interrupt]
unsafe fn USART3() {
    with(Rs485::interrupt);
}

impl Rs485 {
    fn interrupt(&mut self) {
        let status = USART3.sr().read();
        let control = USART3.cr1().read();
        if status.rxne() || status.ore() {
            // Reading the data after the status clears the errors, too.
            let byte = USART3.dr().read().0 as u8;
            // A break, or noise: what has come so far is no telegram.
            if status.fe() || status.ne() {
                self.port.silence();
            } else if status.rxne() {
                self.receive(byte);
            }
        }
        if control.txeie() && status.txe() {
            match self.out.pop_front() {
                Some(byte) => USART3.dr().write(|w| w.set_dr(byte.into())),
                None => USART3.cr1().modify(|w| {
                    w.set_txeie(false);
                    w.set_tcie(true);
                }),
            }
        } else if control.tcie() && status.tc() {
            self.sent();
        }
    }

    fn receive(&mut self, byte: u8) {
        self.last = now();
        if self.ahead.push_back(byte).is_err() {
            defmt::warn!("RS485: a host does not wait for its replies: bytes dropped");
            self.port.give_up();
        }
        self.read();
    }

    /// Reads bytes as far as it is known how to.
    fn read(&mut self) {
        while !self.port.is_waiting()
            && let Some(byte) = self.ahead.pop_front()
        {
            let heard = self.port.push(byte, self.last, &self.links);
            for byte in heard.echo {
                // More than fits has come while a reply was on its way: such a host does not look at echoes.
                let _ = self.out.push_back(*byte);
            }
            let Some(request) = heard.request else { continue };
            if REQUESTS.try_send((Source::Rs485, request)).is_err() {
                defmt::warn!("RS485: a host does not wait for its replies: request dropped");
                self.port.give_up();
            }
            owner::pend();
        }
        self.send();
    }

    /// Puts the next answers on the wire whose pause after the last byte received is over. Bytes that come in
    /// meanwhile start it anew.
    fn send_due(&mut self) {
        while let Some(Outgoing { reply, mode, links }) = self.due.front() {
            let pause = Micros::from_millis(links.pause.into());
            if self.sending || reply.is_some() && pause > Micros(0) && now().since(self.last) < pause {
                return;
            }
            let message = self.port.answer(reply.as_ref(), *mode, links);
            for byte in message {
                let _ = self.out.push_back(byte);
            }
            let _ = self.due.pop_front();
            self.read();
        }
    }

    /// Begins to send, if there is something and the line is ours. What comes in while sending is the own echo.
    fn send(&mut self) {
        if self.sending || self.out.is_empty() {
            return;
        }
        self.sending = true;
        self.direction.set_high();
        USART3.cr1().modify(|w| {
            w.set_re(false);
            w.set_txeie(true);
        });
    }

    /// The last stop bit is out.
    fn sent(&mut self) {
        USART3.cr1().modify(|w| {
            w.set_tcie(false);
            w.set_re(true);
        });
        self.direction.set_low();
        self.sending = false;
        self.port.silence();
        self.send();
        self.send_due();
    }
}
