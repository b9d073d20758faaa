//! The USB device: a serial port (CDC-ACM), as on the sibling modules.

use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::USB_OTG_FS;
use embassy_stm32::usb::{self, DmPin, DpPin, Driver};
use embassy_stm32::{Peri, bind_interrupts};
use embassy_usb::class::cdc_acm::{CdcAcmClass, State};
use embassy_usb::driver::EndpointError;
use embassy_usb::{Builder, Config, UsbDevice};
use heapless::String;
use static_cell::{ConstStaticCell, StaticCell};

use super::watchdog;

/// Vendor and product number of Trinamic's stepper motor modules (manual section 12.1, firmware 1.35), by which hosts
/// find them.
const IDS: (u16, u16) = (0x2A3C, 0x0100);
/// Length of a full packet, in bytes.
pub(crate) const PACKET: u16 = 64;

type Device = UsbDevice<'static, Driver<'static, USB_OTG_FS>>;
/// The serial port.
pub(crate) type Serial = CdcAcmClass<'static, Driver<'static, USB_OTG_FS>>;

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

/// Writes bytes in packets. A full packet at the end is followed by an empty one, without which a host may wait for
/// more.
pub(crate) async fn write(serial: &mut Serial, bytes: &[u8]) -> Result<(), EndpointError> {
    let full = !bytes.is_empty() && bytes.len().is_multiple_of(PACKET.into());
    for packet in bytes.chunks(PACKET.into()).chain(full.then_some(&[][..])) {
        watchdog::while_waiting(&watchdog::USB, serial.write_packet(packet)).await?;
    }
    Ok(())
}
