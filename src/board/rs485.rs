//! The RS485 link on USART3: it makes requests of bytes, and bytes of replies and echoes. The transceiver is half
//! duplex; a pin is its direction.
//!
//! All of this happens in the interrupt of USART3 and in calls from the owner of the module, so that a reply is sent as
//! soon as it is known: the last byte of a request completes the request in the interrupt handler, the owner runs next,
//! and the first byte of its reply goes into the port as soon as the line is free.
//!
//! The port gives a byte out in the middle of its stop bit. During the other half of the stop bit the sender still
//! drives the line: TIM2 times that half, and nothing is sent before it is over.

use core::cell::RefCell;

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Output, Pull};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::{TIM2, USART3};
use embassy_stm32::peripherals;
use embassy_stm32::usart::{self, RxPin, TxPin, Uart};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use heapless::{Deque, Vec};

use super::mail::link_settings;
use super::{now, wake};
use crate::module::{LinkMode, LinkSettings, Port, Request, Source, Taken};
use crate::tmcl::Reply;
use crate::tmcl::ascii::LINE;
use crate::units::Micros;

/// Number of received bytes that can wait to be decoded while a reply is due: a line that is typed ahead.
const AHEAD: usize = 128;
/// Number of bytes that can wait to be sent: a few replies and the echo of a line.
const OUT: usize = 128;
const _: () = assert!(OUT >= LINE + 40);

static LINK: CriticalSectionMutex<RefCell<Option<Rs485>>> = CriticalSectionMutex::new(RefCell::new(None));

/// The state of the link.
struct Rs485 {
    direction: Output<'static>,
    port: Port,
    /// Received bytes that wait to be decoded until a reply is out.
    ahead: Deque<u8, AHEAD>,
    /// The time at which the last byte was received.
    last: Micros,
    /// Requests that the owner of the module has not taken yet. A host waits for each reply, so eight are enough;
    /// requests also stay here while a reply is due.
    requests: Deque<Request, 8>,
    /// The bytes to be sent or being sent.
    out: Vec<u8, OUT>,
    /// Number of bytes of `out` that have gone into the port.
    sent: usize,
    /// The pause between the last byte received and the reply in `out`.
    pause: Micros,
    /// The port is sending, and the transceiver drives the line.
    sending: bool,
}

/// The port and its pins before the link is started, because its baud rate is a stored setting.
pub(super) struct Pins<Rx: RxPin<peripherals::USART3>, Tx: TxPin<peripherals::USART3>> {
    pub(super) port: Peri<'static, peripherals::USART3>,
    pub(super) rx: Peri<'static, Rx>,
    pub(super) tx: Peri<'static, Tx>,
    /// The direction of the transceiver: high sends.
    pub(super) direction: Output<'static>,
}

impl<Rx: RxPin<peripherals::USART3>, Tx: TxPin<peripherals::USART3>> Pins<Rx, Tx> {
    /// Sets up the port and starts the link. The port's clock of 42 MHz gives the rates of parameter 65 within 0.2 %.
    pub(super) fn start(self, baud: u32, mode: LinkMode) -> Result<(), usart::ConfigError> {
        let mut config = usart::Config::default();
        config.baudrate = baud;
        // While the transceiver sends, it does not drive its output to the microcontroller.
        config.rx_pull = Pull::Up;
        // The destructor of `Uart` would switch the port off.
        core::mem::forget(Uart::new_blocking(self.port, self.rx, self.tx, config)?);
        start(self.direction, mode);
        Ok(())
    }
}

/// Starts the link on USART3, which is set up and receives already. All else is done by interrupt handlers.
fn start(direction: Output<'static>, mode: LinkMode) {
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
    LINK.lock(|cell| cell.try_borrow_mut().map(|mut cell| *cell = Some(link)).ok());
    // TIM2 counts at 84 MHz, and the port's divider is the length of a bit at 42 MHz: as many counts of TIM2 are half a
    // bit.
    embassy_stm32::rcc::enable_and_reset::<peripherals::TIM2>();
    TIM2.arr().write_value(USART3.brr().read().0);
    TIM2.cr1().write(|w| w.set_opm(true));
    USART3.cr1().modify(|w| w.set_rxneie(true));
    for handler in [interrupt::USART3, interrupt::TIM2] {
        handler.set_priority(Priority::P4);
        // SAFETY: the handlers use only registers and `LINK`, which is filled.
        unsafe { handler.enable() };
    }
}

/// The next request; `None` while there is none.
pub(super) fn request() -> Option<Request> {
    with(|link| link.requests.pop_front())
}

/// Sends the answer to a request, or an event in between. False if there are too many to be sent. The link goes on in
/// `mode`, if one is given.
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

/// Sends a reply whose pause is over. To be called every millisecond.
pub(super) fn tick() {
    with(Rs485::send);
}

/// True when all replies are sent, and also if there is no link.
pub(super) fn is_idle() -> bool {
    let busy = with(|link| !link.out.is_empty());
    !busy
}

/// Calls a function with the link; without a link it returns the default. No function within calls this one again, so
/// the link can always be borrowed.
fn with<R: Default>(act: impl FnOnce(&mut Rs485) -> R) -> R {
    LINK.lock(|cell| cell.try_borrow_mut().ok()?.as_mut().map(act)).unwrap_or_default()
}

#[interrupt]
unsafe fn USART3() {
    with(Rs485::interrupt);
}

/// Called when the stop bit of the last byte received is over.
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
            // Reading the data after the status also clears the errors.
            let byte = USART3.dr().read().0 as u8;
            // After a break, noise, or a lost byte the bytes received so far are no telegram.
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
            // If an echo does not fit, the host has sent much while a reply was due: such a host does not look at
            // echoes.
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

    /// Sends what is waiting to be sent, and decodes the bytes received ahead until a request among them is to be
    /// answered.
    fn read_on(&mut self) {
        self.send();
        while !self.port.is_waiting()
            && let Some(byte) = self.ahead.pop_front()
        {
            self.read(byte);
        }
    }

    /// Begins to send, if there are bytes to be sent, the line is free, and the pause after the last byte received is
    /// over: a byte that is received meanwhile starts the pause anew. The receiver is off while sending, as it would
    /// hear the link's own bytes.
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
        // Reading the status before the first byte is written clears the flag that the byte before was complete.
        let _ = USART3.sr().read();
        self.transmit();
    }

    /// Hands the next byte to the port, which has room for one; after the last byte, enables the interrupt at its end.
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

    /// Ends the sending after the last stop bit, or goes on with bytes that were added since the last byte was handed
    /// over.
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
