//! The RS485 link: bytes to telegrams and back. The transceiver is half duplex; its direction is a pin.

use embassy_futures::select::{Either, select};
use embassy_stm32::gpio::Output;
use embassy_stm32::usart::BufferedUart;
use embassy_time::{Instant, Timer};
use embedded_io_async::{Read, ReadReady, Write};

use super::mail::{Outgoing, REQUESTS, RS485};
use super::now;
use crate::module::Source;
use crate::tmcl::binary::Framer;
use crate::units::Micros;

/// Carries telegrams between the bus and the owner of the module.
#[embassy_executor::task]
pub(super) async fn carry(mut port: BufferedUart<'static>, mut direction: Output<'static>) {
    let (mut sender, mut receiver) = port.split_ref();
    let mut framer = Framer::new();
    let mut bytes = [0; 16];
    let mut last = now();
    loop {
        match select(receiver.read(&mut bytes), due(last)).await {
            Either::First(Ok(count)) => {
                last = now();
                for byte in bytes.iter().take(count) {
                    let Some(telegram) = framer.push(*byte, last) else { continue };
                    if REQUESTS.try_send((Source::Rs485, telegram)).is_err() {
                        defmt::warn!("RS485: a host does not wait for its replies: telegram dropped");
                    }
                }
            }
            // The driver reports no errors here: it logs them, and the byte goes on.
            Either::First(Err(_)) => {}
            Either::Second(Outgoing { telegram, .. }) => {
                direction.set_high();
                // There is room: the last telegram has been waited for. Flush returns when the last stop bit
                // is out.
                let sent = sender.write_all(&telegram).await.and(sender.flush().await);
                direction.set_low();
                if sent.is_err() {
                    defmt::warn!("RS485: reply not sent");
                }
                // On the wire: now it may go.
                let _ = RS485.try_receive();
                // What came in meanwhile is our own echo.
                while receiver.read_ready() == Ok(true) {
                    let _ = receiver.read(&mut bytes).await;
                }
                framer.reset();
            }
        }
    }
}

/// The next telegram to be sent, as soon as the pause after the last byte received is over. Bytes that come in
/// meanwhile start it anew.
async fn due(last: Micros) -> Outgoing {
    loop {
        RS485.ready_to_receive().await;
        let Ok(outgoing) = RS485.try_peek() else { continue };
        if outgoing.pause > 0 {
            let pause = Micros::from_millis(outgoing.pause.into());
            Timer::at(Instant::from_ticks(last.after(pause).0)).await;
        }
        return outgoing;
    }
}
