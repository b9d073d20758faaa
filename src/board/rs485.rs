//! The RS485 link: bytes to requests, replies and echoes to bytes. The transceiver is half duplex; its direction
//! is a pin.
//!
//! All of it happens in the interrupt of USART3 and in calls from the owner of the module, so that a reply is under way
//! as soon as it is known: the last byte of a request completes it in the handler, the owner runs next, and the first
//! byte of its answer goes into the port as soon as the line is free.
//!
//! A byte is there in the middle of its stop bit. The other half of it still belongs to who sent it: TIM2 counts it,
//! and nothing is sent before it is over.

use core::cell::RefCell;

use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::{TIM2, USART3};
use embassy_stm32::peripherals;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use heapless::{Deque, Vec};

use super::mail::link_settings;
use super::{now, wake};
use crate::module::{LinkMode, LinkSettings, Port, Request, Source, Taken};
use crate::tmcl::Reply;
use crate::tmcl::ascii::LINE;
use crate::units::Micros;

/// Bytes that cannot be read before something is answered: a line that is typed ahead.
const AHEAD: usize = 128;
/// Bytes on their way out: a few replies and the echo of a line.
const OUT: usize = 128;
const _: () = assert!(OUT >= LINE + 40);

static LINK: CriticalSectionMutex<RefCell<Option<Rs485>>> = CriticalSectionMutex::new(RefCell::new(None));

/// The state of the link.
struct Rs485 {
    direction: Output<'static>,
    port: Port,
    ahead: Deque<u8, AHEAD>,
    /// When the last byte came.
    last: Micros,
    /// Requests that the owner has not taken. A host waits for each reply, so a few places do; they wait here, too, while a
    /// reply is due.
    requests: Deque<Request, 8>,
    /// What is to be sent, or is being sent.
    out: Vec<u8, OUT>,
    /// How many bytes of it have gone into the port.
    sent: usize,
    /// The pause after the last byte received that it waits for.
    pause: Micros,
    sending: bool,
}

/// Starts the link on USART3, which is set up and listens.
pub(super) fn start(direction: Output<'static>, mode: LinkMode) {
    let link = Rs485 {
        direction,
        port: Port::new(Source::Rs485, mode),
        ahead: Deque::new(),
        last: now(),
        requests: Deque::new(),
        out: Vec::new(),
        sent: 0,
        pause: Micros(0),
        sending: false,
    };
    LINK.lock(|place| place.try_borrow_mut().map(|mut place| *place = Some(link)).ok());
    // TIM2 counts at 84 MHz, the port's divider is the length of a bit at 42 MHz: so many are half a bit.
    embassy_stm32::rcc::enable_and_reset::<peripherals::TIM2>();
    TIM2.arr().write_value(USART3.brr().read().0);
    TIM2.cr1().write(|w| w.set_opm(true));
    USART3.cr1().modify(|w| w.set_rxneie(true));
    for handler in [interrupt::USART3, interrupt::TIM2] {
        handler.set_priority(Priority::P4);
        // SAFETY: the handlers have what they need.
        unsafe { handler.enable() };
    }
}

/// The next request.
pub(super) fn request() -> Option<Request> {
    with(|link| link.requests.pop_front())
}

/// Takes the answer to a request, or an event in between; false if there are too many. The link goes on in the mode
/// given, if one is.
pub(super) fn answer(reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings) -> bool {
    with(|link| {
        let taken = link.port.answer(reply, mode, settings.reply_addresses(), &mut link.out).is_ok();
        if reply.is_some() {
            link.pause = Micros::from_millis(settings.pause.into());
        }
        link.read_on();
        taken
    })
}

/// Sends what has waited for the end of its pause. To be called every millisecond.
pub(super) fn tick() {
    with(Rs485::send);
}

/// True when all is said, and also when there is no link.
pub(super) fn is_idle() -> bool {
    let busy = with(|link| !link.out.is_empty());
    !busy
}

/// Does something with the link, once it is there; nothing in here calls itself, so it is free.
fn with<R: Default>(act: impl FnOnce(&mut Rs485) -> R) -> R {
    LINK.lock(|place| place.try_borrow_mut().ok()?.as_mut().map(act)).unwrap_or_default()
}

#[interrupt]
unsafe fn USART3() {
    with(Rs485::interrupt);
}

/// The stop bit is over.
#[interrupt]
unsafe fn TIM2() {
    TIM2.sr().write(|w| w.set_uif(false));
    TIM2.dier().write(|w| w.set_uie(false));
    with(Rs485::send);
}

impl Rs485 {
    fn interrupt(&mut self) {
        let status = USART3.sr().read();
        let control = USART3.cr1().read();
        if status.rxne() || status.ore() {
            // Reading the data after the status clears the errors, too.
            let byte = USART3.dr().read().0 as u8;
            // A break, noise, or a byte was lost: what has come so far is no telegram.
            if status.fe() || status.ne() || status.ore() {
                self.port.silence();
            } else if status.rxne() {
                self.receive(byte);
            }
        }
        if control.txeie() && status.txe() {
            self.transmit();
        } else if control.tcie() && status.tc() {
            self.sent();
        }
    }

    fn receive(&mut self, byte: u8) {
        self.last = now();
        TIM2.sr().write(|w| w.set_uif(false));
        TIM2.cnt().write_value(0);
        TIM2.cr1().write(|w| {
            w.set_opm(true);
            w.set_cen(true);
        });
        if self.ahead.is_empty() && !self.port.is_waiting() {
            self.read(byte);
        } else if self.ahead.push_back(byte).is_err() {
            defmt::warn!("RS485: a host does not wait for its replies: bytes dropped");
            self.port.give_up();
        }
    }

    fn read(&mut self, byte: u8) {
        let Taken { echo, request } = self.port.push(byte, self.last, link_settings);
        if !echo.is_empty() {
            // More than fits has come while a reply was on its way: such a host does not look at echoes.
            let _ = self.out.extend_from_slice(echo);
            self.send();
        }
        if let Some(request) = request {
            if self.requests.push_back(request).is_err() {
                defmt::warn!("RS485: a host does not wait for its replies: request dropped");
                self.port.give_up();
            }
            wake::pend();
        }
    }

    /// Sends what there is to send, and reads what has come ahead as far as it is known how to.
    fn read_on(&mut self) {
        self.send();
        while !self.port.is_waiting()
            && let Some(byte) = self.ahead.pop_front()
        {
            self.read(byte);
        }
    }

    /// Begins to send, if there is something, the line is free, and the pause after the last byte received is over:
    /// bytes that come in meanwhile start it anew. What comes in while sending is the own echo.
    fn send(&mut self) {
        if self.sending || self.out.is_empty() {
            return;
        }
        if self.pause > Micros(0) && now().since(self.last) < self.pause {
            return;
        }
        if TIM2.cr1().read().cen() {
            TIM2.dier().write(|w| w.set_uie(true));
            return;
        }
        self.sending = true;
        self.direction.set_high();
        USART3.cr1().modify(|w| {
            w.set_re(false);
            w.set_txeie(true);
        });
        // Read before the first byte, the status forgets that the last one was complete.
        let _ = USART3.sr().read();
        self.transmit();
    }

    /// Hands the next byte to the port, which is ready for it; behind the last one it is to say when it is out.
    fn transmit(&mut self) {
        if let Some(byte) = self.out.get(self.sent) {
            USART3.dr().write(|w| w.set_dr((*byte).into()));
            self.sent = self.sent.saturating_add(1);
        } else {
            USART3.cr1().modify(|w| {
                w.set_txeie(false);
                w.set_tcie(true);
            });
        }
    }

    /// The last stop bit is out; what has been added since that byte was handed over follows.
    fn sent(&mut self) {
        if self.sent < self.out.len() {
            USART3.cr1().modify(|w| {
                w.set_tcie(false);
                w.set_txeie(true);
            });
            return self.transmit();
        }
        USART3.cr1().modify(|w| {
            w.set_tcie(false);
            w.set_re(true);
        });
        self.direction.set_low();
        self.out.clear();
        (self.sent, self.sending, self.pause) = (0, false, Micros(0));
        self.port.silence();
        self.read_on();
    }
}
