//! The lines that `tmcl sim` prints at its start: where the modules can be reached, with commands to copy.

use std::io::{self, Write};

use super::links::Links;
use super::pty::Pty;

/// Prints where the modules can be reached, each link under the name of its option.
pub(super) fn introduce(links: &Links, out: &mut impl Write) -> io::Result<()> {
    if let Some(pty) = &links.serial {
        let path = head(out, "serial", pty)?;
        writeln!(out, "    tmcl send {path} \"GAP 1, 0\"")?;
        writeln!(out, "    ConnectionManager(\"--interface usb_tmcl --port {path}\")")?;
        writeln!(out, "    ConnectionManager(\"--interface serial_tmcl --port {path} --data-rate 9600\")")?;
    }
    if let Some(server) = &links.tcp {
        let to = server.reachable();
        writeln!(out, "tcp: {}", server.address())?;
        writeln!(out, "    tmcl send tcp:{to} \"GAP 1, 0\"")?;
        if to.is_ipv4() {
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
        adapter(out, &path, &path)?;
    }
    if let Some(server) = &links.slcan_tcp {
        let to = server.reachable();
        writeln!(out, "slcan-tcp: {}", server.address())?;
        adapter(out, &format!("tcp:{to}"), &format!("socket://{to}"))?;
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

/// Prints the lines for a CAN adapter: `device` is its name for `tmcl`, `url` its name for pySerial.
fn adapter(out: &mut impl Write, device: &str, url: &str) -> io::Result<()> {
    writeln!(out, "    tmcl send slcan:{device} --address 1 \"GAP 1, 0\"")?;
    writeln!(out, "    ConnectionManager(\"--interface slcan_tmcl --port {url} --module-id 1\")")?;
    writeln!(out, "    can.Bus(interface=\"slcan\", channel=\"{url}\", bitrate=1000000)")
}
