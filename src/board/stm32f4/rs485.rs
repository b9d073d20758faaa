//! The RS485 link on USART3: it makes requests of bytes, and bytes of replies and echoes. The transceiver is half
//! duplex; a pin is its direction.
//!
//! All of this happens in the interrupt of USART3 and in calls from the owner of the module, so that a reply is sent as
//! soon as it is known. The last byte of a request completes the request in the interrupt handler, and the owner runs
//! next. The first byte of its reply goes into the port as soon as the line is free.
//!
//! The port gives a byte out in the middle of its stop bit. During the other half of the stop bit the sender still
//! drives the line, and nothing is sent before that half is over. TIM2 counts since the last byte. It tells whether the
//! line is free when a reply is known. If it is not, the timer's handler begins to send as soon as it is.

use core::cell::UnsafeCell;
use core::ops::{Deref, DerefMut};
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::register::primask::{self, Primask};
use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Level, Output, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::usart::regs::Sr;
use embassy_stm32::pac::{TIM2, USART3};
use embassy_stm32::peripherals;
use embassy_stm32::usart::{self, RxPin, TxPin, Uart};
use heapless::{Deque, Vec};

use super::clocks::now;
use super::wake;
use crate::module::{LinkMode, LinkPort, LinkSettings, Request, Source};
use crate::tmcl::Reply;
use crate::tmcl::ascii::{LINE, REPLY};
use crate::units::Micros;

/// Number of received bytes that can wait to be decoded while a reply is due: a line that is typed ahead.
const AHEAD: usize = 128;
/// Number of bytes that can wait to be sent: a few replies and the echo of a line.
const OUT: usize = 128;
const _: () = assert!(OUT >= LINE + 40);

/// Core cycles that pass at least between a byte and the start of TIM2's count. They are the 6 that the core needs to
/// go from one handler to the next, and one for each instruction.
const START: u32 = 31;
/// Counts of TIM2, of two core cycles each, by which its interrupt is asked for before the end of the stop bit. From
/// the interrupt to the direction of the transceiver it takes 37 cycles at least.
const LEAD: u32 = (START + 37) / 2;
/// The same for the owner of the module, who begins to send at once if the line is free: 9 cycles at least.
const OWNERS_LEAD: u32 = (START + 9) / 2;

/// The link, which the handlers of USART3 and TIM2 use, and the owner while interrupts are off.
struct Link(UnsafeCell<Rs485>);

// SAFETY: the two handlers have the same priority, so neither interrupts the other, and nothing else that uses the link
// interrupts them.
unsafe impl Sync for Link {}

static LINK: Link = Link(UnsafeCell::new(Rs485::OFF));

/// True if there may be a request. The owner looks here first, because the other links wait meanwhile.
static ASKED: AtomicBool = AtomicBool::new(false);

/// The state of the link.
struct Rs485 {
    /// `None` until the link is started.
    direction: Option<Output<'static>>,
    port: LinkPort,
    /// Gives the link settings in force.
    settings: fn() -> LinkSettings,
    /// Received bytes that wait to be decoded until a reply is out.
    ahead: Deque<u8, AHEAD>,
    /// The time at which the last byte was received.
    last: Micros,
    /// Requests that the owner of the module has not taken out of the port before the next byte came. A host waits for
    /// each reply, so eight are enough.
    requests: Deque<Request, 8>,
    /// Something is in `ahead` or `requests`.
    behind: bool,
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
pub(crate) struct Pins<Rx: RxPin<peripherals::USART3>, Tx: TxPin<peripherals::USART3>> {
    port: Peri<'static, peripherals::USART3>,
    rx: Peri<'static, Rx>,
    tx: Peri<'static, Tx>,
    /// The direction of the transceiver: high sends.
    direction: Output<'static>,
}

impl<Rx: RxPin<peripherals::USART3>, Tx: TxPin<peripherals::USART3>> Pins<Rx, Tx> {
    /// The port, with the pins of its input, its output and the direction, which is to the module.
    pub(crate) fn new(
        port: Peri<'static, peripherals::USART3>,
        rx: Peri<'static, Rx>,
        tx: Peri<'static, Tx>,
        direction: Peri<'static, AnyPin>,
    ) -> Self {
        Pins { port, rx, tx, direction: Output::new(direction, Level::Low, Speed::Medium) }
    }

    /// Sets up the port and starts the link; `settings` gives the link settings in force. The port's clock of 42 MHz
    /// gives the rates of parameter 65 within 0.2 %.
    pub(crate) fn start(
        self,
        baud: u32,
        mode: LinkMode,
        settings: fn() -> LinkSettings,
    ) -> Result<(), usart::ConfigError> {
        let mut config = usart::Config::default();
        config.baudrate = baud;
        // While the transceiver sends, it does not drive its output to the microcontroller.
        config.rx_pull = Pull::Up;
        // The destructor of `Uart` would switch the port off.
        core::mem::forget(Uart::new_blocking(self.port, self.rx, self.tx, config)?);
        start(self.direction, mode, settings);
        Ok(())
    }
}

/// Starts the link on USART3, which is set up and receives already. All else is done by interrupt handlers.
fn start(direction: Output<'static>, mode: LinkMode, settings: fn() -> LinkSettings) {
    let mut link = lock();
    link.direction = Some(direction);
    link.port = LinkPort::new(Source::Rs485, mode);
    link.settings = settings;
    link.last = now();
    drop(link);
    // TIM2 counts at 84 MHz, and the port's divider is the length of a bit at 42 MHz: as many counts of TIM2 are half a
    // bit.
    embassy_stm32::rcc::enable_and_reset::<peripherals::TIM2>();
    TIM2.ccr(0).write_value(USART3.brr().read().0.saturating_sub(LEAD));
    TIM2.cr1().write(|w| w.set_cen(true));
    USART3.cr1().modify(|w| w.set_rxneie(true));
    for handler in [interrupt::USART3, interrupt::TIM2] {
        handler.set_priority(Priority::P4);
        // SAFETY: the handlers use only registers and `LINK`.
        unsafe { handler.enable() };
    }
}

/// The next request; `None` while there is none.
#[inline(always)]
pub(crate) fn request() -> Option<Request> {
    if !ASKED.load(Ordering::Relaxed) {
        return None;
    }
    let mut link = lock();
    ASKED.store(link.behind, Ordering::Relaxed);
    if !link.behind && link.port.is_binary() {
        return link.port.take();
    }
    // Without this barrier the compiler would build both requests at the same place in memory, where that of a telegram
    // is better kept in registers.
    core::hint::black_box(link.oldest())
}

/// Sends the answer to a request, or an event in between. False if there are too many to be sent. The link goes on in
/// `mode`, if one is given.
#[inline(always)]
pub(crate) fn answer(reply: Option<&Reply>, mode: Option<LinkMode>, settings: &LinkSettings) -> bool {
    let mut link = lock();
    let link = &mut *link;
    let taken = link.port.answer(reply, mode, settings.reply_addresses(), &mut link.out).is_ok();
    if reply.is_some() {
        link.pause = Micros::from_millis(settings.pause.into());
    }
    link.send();
    if link.behind {
        link.catch_up();
    }
    taken
}

/// True if there is room for an event, and for a reply behind it.
pub(crate) fn takes_event() -> bool {
    lock().out.len() + 2 * REPLY <= OUT
}

/// Sends a reply whose pause is over. To be called every millisecond.
pub(crate) fn tick() {
    lock().send();
}

/// True when all replies are sent, and also if there is no link.
pub(crate) fn is_idle() -> bool {
    lock().out.is_empty()
}

/// The link for others than its handlers: interrupts are off as long as this lives.
struct Lock {
    masked: Primask,
}

/// Switches interrupts off. To be called by the owner, and before the handlers are enabled, which both have one lock at
/// a time.
#[inline(always)]
fn lock() -> Lock {
    let masked = primask::read();
    cortex_m::interrupt::disable();
    Lock { masked }
}

impl Deref for Lock {
    type Target = Rs485;

    #[inline(always)]
    fn deref(&self) -> &Rs485 {
        // SAFETY: no handler runs meanwhile.
        unsafe { &*LINK.0.get() }
    }
}

impl DerefMut for Lock {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Rs485 {
        // SAFETY: no handler runs meanwhile.
        unsafe { &mut *LINK.0.get() }
    }
}

impl Drop for Lock {
    #[inline(always)]
    fn drop(&mut self) {
        if self.masked.is_active() {
            // SAFETY: they were on before.
            unsafe { cortex_m::interrupt::enable() };
        }
    }
}

#[interrupt]
unsafe fn USART3() {
    // SAFETY: see `Link`.
    unsafe { &mut *LINK.0.get() }.interrupt();
}

/// Called when the stop bit of the last byte received is over, if something waits for that.
#[interrupt]
unsafe fn TIM2() {
    // A byte that has come at the same time begins a new stop bit.
    if TIM2.sr().read().ccif(0) {
        TIM2.dier().write(|_| {});
        // SAFETY: see `Link`.
        let link = unsafe { &mut *LINK.0.get() };
        if link.is_to_send() {
            link.begin();
        }
    }
}

impl Rs485 {
    /// A link that has not been started.
    const OFF: Rs485 = Rs485 {
        direction: None,
        port: LinkPort::new(Source::Rs485, LinkMode::Binary),
        settings: LinkSettings::default,
        ahead: Deque::new(),
        last: Micros(0),
        requests: Deque::new(),
        behind: false,
        out: Vec::new(),
        sent: 0,
        pause: Micros(0),
        sending: false,
    };

    #[inline(always)]
    fn interrupt(&mut self) {
        let status = USART3.sr().read();
        if status.rxne() || status.ore() {
            TIM2.cnt().write_value(0);
            TIM2.sr().write(|_| {});
            // Reading the data after the status also clears the errors.
            let byte = USART3.dr().read().0 as u8;
            // After a break, noise, or a lost byte the bytes received so far are no telegram.
            if status.fe() || status.ne() || status.ore() {
                self.port.silence();
            } else {
                self.receive(byte);
            }
        }
        if self.sending {
            self.go_on(status);
        }
    }

    #[inline(always)]
    fn receive(&mut self, byte: u8) {
        self.last = now();
        if self.behind || self.port.is_ready() || self.port.is_waiting() {
            self.receive_ahead(byte);
        } else {
            self.read(byte);
        }
    }

    /// Takes a byte that comes before the request before it is taken, or answered.
    #[cold]
    #[inline(never)]
    fn receive_ahead(&mut self, byte: u8) {
        self.behind = true;
        if !self.port.is_waiting() && self.ahead.is_empty() {
            self.read_behind(byte);
        } else if self.ahead.push_back(byte).is_err() {
            defmt::warn!("RS485: a host does not wait for its replies: bytes dropped");
            self.port.give_up();
        }
    }

    /// Reads a byte behind a request that may still be in the port.
    #[inline(never)]
    fn read_behind(&mut self, byte: u8) {
        if let Some(request) = self.port.take()
            && self.requests.push_back(request).is_err()
        {
            defmt::warn!("RS485: a host does not wait for its replies: request dropped");
            self.port.give_up();
        }
        self.read(byte);
    }

    /// The oldest request, where some were put off.
    #[cold]
    #[inline(never)]
    fn oldest(&mut self) -> Option<Request> {
        let oldest = self.requests.pop_front().or_else(|| self.port.take());
        self.behind = !self.ahead.is_empty() || !self.requests.is_empty();
        oldest
    }

    #[inline(always)]
    fn read(&mut self, byte: u8) {
        let echo = self.port.push(byte, self.last, self.settings);
        if !echo.is_empty() {
            // If an echo does not fit, the host has sent much while a reply was due: such a host does not look at
            // echoes.
            let _ = self.out.extend_from_slice(echo);
            self.send_echo();
        }
        if self.port.is_ready() {
            ASKED.store(true, Ordering::Relaxed);
            wake::pend();
        }
    }

    /// Decodes the bytes received ahead until a request among them is to be answered.
    #[cold]
    #[inline(never)]
    fn catch_up(&mut self) {
        while !self.port.is_waiting()
            && let Some(byte) = self.ahead.pop_front()
        {
            self.read_behind(byte);
        }
    }

    /// Has the sending begun as soon as the line is free, if there are bytes to be sent, and the pause after the last
    /// byte received is over. A byte that is received meanwhile starts the pause anew.
    #[inline(always)]
    fn send(&mut self) {
        if !self.is_to_send() {
            return;
        }
        let due = TIM2.ccr(0).read();
        if TIM2.cnt().read() < due {
            // Comes at once where it was due already: after 51 s the count begins anew.
            return TIM2.dier().write(|w| w.set_ccie(0, true));
        }
        // At most 28 cycles: the interrupt would take longer.
        while TIM2.cnt().read() < due.wrapping_add(LEAD - OWNERS_LEAD) {}
        self.begin();
    }

    #[cold]
    #[inline(never)]
    fn send_echo(&mut self) {
        self.send();
    }

    #[inline(always)]
    fn is_to_send(&self) -> bool {
        !self.sending && !self.out.is_empty() && (self.pause == Micros(0) || now().since(self.last) >= self.pause)
    }

    /// Begins to send. The receiver is off meanwhile, as it would hear the link's own bytes.
    #[inline(always)]
    fn begin(&mut self) {
        let (Some(direction), Some(first)) = (&mut self.direction, self.out.first()) else { return };
        direction.set_high();
        // Reading the status before the first byte is written clears the flag that the byte before was complete.
        let _ = USART3.sr().read();
        USART3.dr().write(|w| w.set_dr((*first).into()));
        (self.sent, self.sending) = (1, true);
        USART3.cr1().modify(|w| {
            w.set_re(false);
            w.set_txeie(true);
        });
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

    /// Goes on with sending: the port has room for a byte, or the last one is out.
    #[inline(never)]
    fn go_on(&mut self, status: Sr) {
        let control = USART3.cr1().read();
        if control.txeie() && status.txe() {
            self.transmit();
        } else if control.tcie() && status.tc() {
            self.sent();
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
        if let Some(direction) = &mut self.direction {
            direction.set_low();
        }
        self.out.clear();
        (self.sent, self.sending, self.pause) = (0, false, Micros(0));
        self.port.silence();
        self.send();
        if self.behind {
            self.catch_up();
        }
    }
}
