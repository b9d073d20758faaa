//! The RS485 link: bytes to requests, replies and echoes to bytes. The transceiver is half duplex; its direction
//! is a pin.

use embassy_futures::select::{Either, select};
use embassy_stm32::gpio::Output;
use embassy_stm32::usart::{BufferedUart, BufferedUartRx, BufferedUartTx};
use embassy_time::{Instant, Timer};
use embedded_io_async::{Read, ReadReady, Write};
use heapless::{Deque, Vec};

use super::mail::{LINKS, Outgoing, REQUESTS, RS485};
use super::now;
use crate::module::{Links, Port, Source};
use crate::tmcl::ascii::LINE;
use crate::units::Micros;

/// What is echoed at a time: a line and its CR, or what has been typed since.
type Echo = Vec<u8, { LINE + 1 }>;

/// Carries requests and replies between the bus and the owner of the module, which is there already.
#[embassy_executor::task]
pub(super) async fn carry(mut port: BufferedUart<'static>, direction: Output<'static>) {
    let (sender, mut receiver) = port.split_ref();
    let mut transmitter = Transmitter { sender, direction };
    let mut port = Port::new(Source::Rs485, links().start);
    let mut bytes = [0; 16];
    // Bytes that cannot be read before something is answered: a line that is typed ahead.
    let mut ahead = Deque::<u8, { LINE + 48 }>::new();
    let mut last = now();
    loop {
        match select(receiver.read(&mut bytes), due(last)).await {
            Either::First(Ok(count)) => {
                last = now();
                for byte in bytes.iter().take(count) {
                    if ahead.push_back(*byte).is_err() {
                        defmt::warn!("RS485: a host does not wait for its replies: bytes dropped");
                        port.give_up();
                    }
                }
            }
            // The driver reports no errors here: it logs them, and the byte goes on.
            Either::First(Err(_)) => {}
            Either::Second(Outgoing { reply, mode, links }) => {
                let message = port.answer(reply.as_ref(), mode, &links);
                if !message.is_empty() {
                    transmitter.send(&mut receiver, &message).await;
                    port.silence();
                }
                // On the wire: now it may go.
                let _ = RS485.try_receive();
            }
        }
        let echo = read(&mut port, &mut ahead, last);
        if !echo.is_empty() {
            transmitter.send(&mut receiver, &echo).await;
        }
    }
}

/// Reads bytes as far as it is known how to, and gives what is echoed of them.
fn read(port: &mut Port, ahead: &mut Deque<u8, { LINE + 48 }>, last: Micros) -> Echo {
    let mut echo = Echo::new();
    let links = links();
    while !port.is_waiting()
        && let Some(byte) = ahead.pop_front()
    {
        let taken = port.push(byte, last, &links);
        // More than fits has come while a reply was on its way: such a host does not look at echoes.
        let _ = echo.extend_from_slice(taken.echo);
        let Some(request) = taken.request else { continue };
        if REQUESTS.try_send((Source::Rs485, request)).is_err() {
            defmt::warn!("RS485: a host does not wait for its replies: request dropped");
            port.give_up();
        }
    }
    echo
}

/// The settings in force.
fn links() -> Links {
    LINKS.lock(|shared| shared.get()).unwrap_or_default()
}

/// The way out.
struct Transmitter<'a> {
    sender: BufferedUartTx<'a>,
    direction: Output<'static>,
}

impl Transmitter<'_> {
    async fn send(&mut self, receiver: &mut BufferedUartRx<'_>, message: &[u8]) {
        self.direction.set_high();
        // There is room: what was sent before has been waited for. Flush returns when the last stop bit is out.
        let sent = self.sender.write_all(message).await.and(self.sender.flush().await);
        self.direction.set_low();
        if sent.is_err() {
            defmt::warn!("RS485: not sent");
        }
        // What came in meanwhile is our own echo.
        let mut echo = [0; 16];
        while receiver.read_ready() == Ok(true) {
            let _ = receiver.read(&mut echo).await;
        }
    }
}

/// The next answer, as soon as the pause after the last byte received is over. Bytes that come in meanwhile
/// start it anew.
async fn due(last: Micros) -> Outgoing {
    loop {
        RS485.ready_to_receive().await;
        let Ok(outgoing) = RS485.try_peek() else { continue };
        if outgoing.reply.is_some() && outgoing.links.pause > 0 {
            let pause = Micros::from_millis(outgoing.links.pause.into());
            Timer::at(Instant::from_ticks(last.after(pause).0)).await;
        }
        return outgoing;
    }
}
