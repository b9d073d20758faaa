//! The line of `tmcl sim --ready-json`: for programs that start the simulator, what it is and where it can be reached.

use std::io::{self, Write};
use std::net::SocketAddr;

use serde::Serialize;
use tmcl_tools::desk::Going;

use crate::links::Links;
use crate::options::{FirmwareOption, Options};
use crate::pty::Pty;

/// The contents of the line. A link that is not offered is null.
#[derive(Serialize)]
struct Ready {
    /// Of the program.
    version: &'static str,
    /// Of its process.
    pid: u32,
    /// Product of module 1.
    product: &'static str,
    /// Products of all modules, module 1 first.
    products: Vec<&'static str>,
    firmware: FirmwareOption,
    /// The file of the flash image, if one runs.
    image: Option<String>,
    time: Going,
    serial: Option<String>,
    tcp: Option<SocketAddr>,
    rs485: Option<String>,
    slcan: Option<String>,
    slcan_tcp: Option<SocketAddr>,
    control: Option<SocketAddr>,
}

/// Prints the line.
pub(crate) fn line(links: &Links, options: &Options, out: &mut impl Write) -> io::Result<()> {
    let products: Vec<&str> = options.product.iter().map(|product| product.name()).collect();
    let ready = Ready {
        version: env!("CARGO_PKG_VERSION"),
        pid: std::process::id(),
        product: products.first().copied().unwrap_or_default(),
        products,
        firmware: options.firmware(),
        image: options.image.as_ref().map(|path| path.display().to_string()),
        time: if options.paused.is_some() { Going::Paused } else { Going::Running },
        serial: links.serial.as_ref().map(path),
        tcp: links.tcp.as_ref().map(|server| server.address()),
        rs485: links.rs485.as_ref().map(path),
        slcan: links.slcan.as_ref().map(path),
        slcan_tcp: links.slcan_tcp.as_ref().map(|server| server.address()),
        control: links.control.as_ref().map(|server| server.address()),
    };
    writeln!(out, "{}", serde_json::to_string(&ready)?)
}

fn path<E>(pty: &Pty<E>) -> String {
    pty.path().display().to_string()
}
