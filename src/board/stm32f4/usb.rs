//! The USB link: a serial port (CDC-ACM), as on the sibling modules. It runs in thread mode.

use embassy_futures::select::{Either, select};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::USB_OTG_FS;
use embassy_stm32::usb::{self, DmPin, DpPin, Driver};
use embassy_stm32::{Peri, bind_interrupts};
use embassy_usb::class::cdc_acm::{CdcAcmClass, State};
use embassy_usb::driver::EndpointError;
use embassy_usb::{Builder, Config, UsbDevice};
use heapless::String;
use static_cell::{ConstStaticCell, StaticCell};

use super::clocks::now;
use super::{wake, watchdog};
use crate::board::runtime::mail::{USB, USB_GONE, USB_REQUESTS, link_settings};
use crate::module::{Message, Port, Source};

/// Vendor and product number of Trinamic's stepper motor modules (manual section 12.1, firmware 1.35), by which hosts
/// find them.
const IDS: (u16, u16) = (0x2A3C, 0x0100);
/// Length of a full packet, in bytes.
const PACKET: u16 = 64;

type Device = UsbDevice<'static, Driver<'static, USB_OTG_FS>>;
type Serial = CdcAcmClass<'static, Driver<'static, USB_OTG_FS>>;

bind_interrupts!(struct Irqs {
    OTG_FS => usb::InterruptHandler<USB_OTG_FS>;
});

/// The driver of the USB port with its data pins.
pub(crate) fn driver(
    port: Peri<'static, USB_OTG_FS>,
    plus: Peri<'static, impl DpPin<USB_OTG_FS>>,
    minus: Peri<'static, impl DmPin<USB_OTG_FS>>,
) -> Driver<'static, USB_OTG_FS> {
    static OUT: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; _]);
    interrupt::OTG_FS.set_priority(Priority::P5);
    // The supply pin of the USB connector is not read: a host that communicates is connected.
    let mut config = usb::Config::default();
    config.vbus_detection = false;
    Driver::new_fs(port, Irqs, plus, minus, OUT.take(), config)
}

/// Builds the USB device on its driver. `product` is the product's name, and `serial` distinguishes the module from
/// others.
pub(crate) fn build(
    driver: Driver<'static, USB_OTG_FS>,
    product: &'static str,
    serial: &'static str,
) -> (Device, Serial) {
    static CONFIGURATION: ConstStaticCell<[u8; 128]> = ConstStaticCell::new([0; _]);
    static CONTROL: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; _]);
    static STATE: StaticCell<State> = StaticCell::new();
    let mut config = Config::new(IDS.0, IDS.1);
    config.manufacturer = Some("open firmware");
    config.product = Some(product);
    config.serial_number = Some(serial);
    config.device_release = 0x0100;
    config.max_power = 100;
    let mut builder = Builder::new(driver, config, CONFIGURATION.take(), &mut [], &mut [], CONTROL.take());
    let serial = CdcAcmClass::new(&mut builder, STATE.init(State::new()), PACKET);
    (builder.build(), serial)
}

/// The serial number of the microcontroller as text: 24 hexadecimal digits.
pub(crate) fn serial_number() -> &'static str {
    static TEXT: StaticCell<String<24>> = StaticCell::new();
    let text = TEXT.init(String::new());
    for byte in embassy_stm32::uid::uid() {
        for digit in [byte >> 4, byte & 0xF] {
            // The text has room for 24 digits.
            let _ = text.push(char::from_digit(digit.into(), 16).unwrap_or('0'));
        }
    }
    text
}

/// Runs the USB device.
#[embassy_executor::task]
pub(crate) async fn run(mut device: Device) {
    device.run().await;
}

/// Carries requests and replies between the host and the owner of the module.
#[embassy_executor::task]
pub(crate) async fn carry(mut serial: Serial) {
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
    let mut port = Port::new(Source::Usb, link_settings().start);
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
                    let echo = port.push(*byte, at, link_settings);
                    if !echo.is_empty() {
                        write(serial, echo).await?;
                    }
                    if let Some(request) = port.take() {
                        // The owner takes no request while it owes the reply to the one before, so without room for this
                        // one there is a reply to come. It is to be fetched: nobody else does.
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
async fn send(serial: &mut Serial, port: &mut Port) -> Result<(), EndpointError> {
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

/// Writes bytes in packets. A full packet at the end is followed by an empty one, without which a host may wait for
/// more.
async fn write(serial: &mut Serial, bytes: &[u8]) -> Result<(), EndpointError> {
    let full = !bytes.is_empty() && bytes.len().is_multiple_of(PACKET.into());
    for packet in bytes.chunks(PACKET.into()).chain(full.then_some(&[][..])) {
        watchdog::while_waiting(&watchdog::USB, serial.write_packet(packet)).await?;
    }
    Ok(())
}
