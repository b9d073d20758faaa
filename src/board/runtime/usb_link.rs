//! The USB link: requests and replies between the host at the serial port and the owner of the module. It runs in
//! thread mode.

use embassy_futures::select::{Either, select};
use embassy_usb::driver::EndpointError;

use super::handover::{USB, USB_GONE, USB_REQUESTS, link_settings};
use crate::board::stm32f4::clocks::now;
use crate::board::stm32f4::usb::{PACKET, Serial, write};
use crate::board::stm32f4::{wake, watchdog};
use crate::module::{LinkPort, LinkSettings, Message, Source};

/// Carries requests and replies between the host and the owner of the module.
#[embassy_executor::task]
pub(super) async fn carry(mut serial: Serial) {
    loop {
        watchdog::while_waiting(&watchdog::USB, serial.wait_connection()).await;
        defmt::info!("USB: host connected");
        let _ = talk(&mut serial).await;
        defmt::info!("USB: host gone");
        // Replies to this host, also those that are still to be made, must not go to the next one.
        USB_GONE.signal(());
    }
}

/// Carries requests and replies until the host is gone.
async fn talk(serial: &mut Serial) -> Result<(), EndpointError> {
    let mut port = LinkPort::new(Source::Usb, link_settings().start);
    let mut packet = [0; PACKET as usize];
    loop {
        let event = select(serial.read_packet(&mut packet), USB.ready_to_receive());
        match watchdog::while_waiting(&watchdog::USB, event).await {
            Either::First(count) => {
                while !USB.is_empty() {
                    send(serial, &mut port).await?;
                }
                // Asked for once a packet, and after each wait: a telegram may go over the border of two packets.
                let mut at = now();
                for byte in packet.iter().take(count?) {
                    while port.is_waiting() {
                        send(serial, &mut port).await?;
                        at = now();
                    }
                    // A pointer, as RS485 has one: so both links run the same code of ASCII mode.
                    let echo = port.push(*byte, at, link_settings as fn() -> LinkSettings);
                    if !echo.is_empty() {
                        write(serial, echo).await?;
                    }
                    if let Some(request) = port.take() {
                        // The owner takes no request while it owes the reply to the one before, so without room for
                        // this one there is a reply to come. It is to be fetched: nobody else does.
                        while USB_REQUESTS.try_send(request).is_err() {
                            send(serial, &mut port).await?;
                        }
                        // As a rule the reply is there when this returns.
                        wake::pend();
                        // A host may send many requests at once, but the reply to each is sent before the next one is
                        // decoded, unless it is late.
                        while !USB.is_empty() {
                            send(serial, &mut port).await?;
                        }
                        at = now();
                    }
                }
            }
            Either::Second(()) => send(serial, &mut port).await?,
        }
    }
}

/// Sends the next reply. The end of a request that is not answered also lets the port decode the next one.
async fn send(serial: &mut Serial, port: &mut LinkPort) -> Result<(), EndpointError> {
    if USB.is_empty() {
        watchdog::while_waiting(&watchdog::USB, USB.ready_to_receive()).await;
    }
    let Ok(outgoing) = USB.try_peek() else { return Ok(()) };
    let mut message = Message::new();
    // A message has room for every reply.
    let _ = port.answer(outgoing.reply.as_ref(), outgoing.mode, outgoing.addresses, &mut message);
    let sent = write(serial, &message).await;
    let _ = USB.try_receive();
    sent
}
