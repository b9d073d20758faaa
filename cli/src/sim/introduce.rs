//! The lines that `tmcl sim` prints at its start: where the modules can be reached, with commands to copy.

use std::io::{self, Write};

use super::links::Links;
use super::options::Firmware;
use super::pty::Pty;

/// Prints where the modules can be reached, each link under the name of its option. How is for a host of this firmware;
/// there are `count` modules.
pub(super) fn introduce(links: &Links, firmware: Firmware, count: usize, out: &mut impl Write) -> io::Result<()> {
    let tmcl = firmware == Firmware::Tmcl;
    if let Some(pty) = &links.serial {
        let path = head(out, "serial", pty)?;
        writeln!(out, "    tmcl send {path} \"{}\"", request(tmcl))?;
        if tmcl {
            writeln!(out, "    ConnectionManager(\"--interface usb_tmcl --port {path}\")")?;
            writeln!(out, "    ConnectionManager(\"--interface serial_tmcl --port {path} --data-rate 9600\")")?;
        }
    }
    if let Some(server) = &links.tcp {
        let to = server.reachable();
        writeln!(out, "tcp: {}", server.address())?;
        writeln!(out, "    tmcl send tcp:{to} \"{}\"", request(tmcl))?;
        if tmcl && to.is_ipv4() {
            writeln!(out, "    ConnectionManager(\"--interface socket_serial_tmcl --port {to}\")")?;
        }
    }
    if let Some(pty) = &links.rs485 {
        let path = head(out, "rs485", pty)?;
        writeln!(out, "    tmcl send {path} --address 1 \"GAP 1, 0\"")?;
        let module = "--data-rate 9600 --module-id 1";
        writeln!(out, "    ConnectionManager(\"--interface serial_tmcl --port {path} {module}\")")?;
    }
    if let Some(pty) = &links.slcan {
        let path = head(out, "slcan", pty)?;
        if tmcl { adapter(out, &path, &path)? } else { master(out, &path, count)? }
    }
    if let Some(server) = &links.slcan_tcp {
        let to = server.reachable();
        writeln!(out, "slcan-tcp: {}", server.address())?;
        let url = format!("socket://{to}");
        if tmcl { adapter(out, &format!("tcp:{to}"), &url)? } else { master(out, &url, count)? }
    }
    if let Some(server) = &links.control {
        let to = server.reachable();
        writeln!(out, "control: {}", server.address())?;
        writeln!(out, "    echo state | nc -N {} {}", to.ip(), to.port())?;
    }
    Ok(())
}

/// Prints the path of a serial port, and returns it.
fn head<E>(out: &mut impl Write, name: &str, pty: &Pty<E>) -> io::Result<String> {
    let path = pty.path().display().to_string();
    writeln!(out, "{name}: {path}")?;
    if pty.path() != pty.device() {
        writeln!(out, "    (a link to {})", pty.device().display())?;
    }
    Ok(path)
}

/// A request that every module answers over USB.
fn request(tmcl: bool) -> &'static str {
    if tmcl { "GAP 1, 0" } else { "136, 1, 0, 0" }
}

/// Prints the lines with which python-canopen reaches `count` nodes over a CAN adapter; `url` is its name for pySerial.
fn master(out: &mut impl Write, url: &str, count: usize) -> io::Result<()> {
    writeln!(out, "    network = canopen.Network()")?;
    writeln!(out, "    network.connect(interface=\"slcan\", channel=\"{url}\")")?;
    (1..=count).try_for_each(|node| writeln!(out, "    network.add_node({node}, \"docs/tmcm1140-canopen.eds\")"))
}

/// Prints the lines for a CAN adapter: `device` is its name for `tmcl`, `url` its name for pySerial.
fn adapter(out: &mut impl Write, device: &str, url: &str) -> io::Result<()> {
    writeln!(out, "    tmcl send slcan:{device} --address 1 \"GAP 1, 0\"")?;
    writeln!(out, "    ConnectionManager(\"--interface slcan_tmcl --port {url} --module-id 1\")")?;
    writeln!(out, "    can.Bus(interface=\"slcan\", channel=\"{url}\", bitrate=1000000)")
}
