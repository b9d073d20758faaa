//! The lines that `tmcl sim` prints at its start: what the modules are, and where they can be reached, with commands to
//! copy.

use std::io::{self, Write};

use tmcm_sim::Product;

use crate::links::Links;
use crate::options::{FirmwareOption, Options};
use crate::pty::Pty;

/// Prints what the modules are. `what_runs` tells what runs in a module of a product.
pub(crate) fn modules(
    options: &Options,
    what_runs: impl Fn(Product) -> String,
    out: &mut impl Write,
) -> io::Result<()> {
    let products = &options.product;
    let (first, count) = (products.first().copied().unwrap_or_default(), products.len());
    if options.is_mixed() {
        let modules = (1..).zip(products).map(|(number, product)| {
            let verb = if number == 1 { "is " } else { "" };
            format!("{number} {verb}a {} {}", product.name(), what_runs(*product))
        });
        let modules = modules.collect::<Vec<_>>().join(", ");
        return writeln!(out, "{count} virtual modules: {modules}. Ctrl-C ends them.");
    }
    let (article, plural, them) = if count == 1 { ("A".into(), "", "it") } else { (count.to_string(), "s", "them") };
    writeln!(out, "{article} virtual {}{plural} {}. Ctrl-C ends {them}.", first.name(), what_runs(first))
}

/// Prints where the modules can be reached, each link under the name of its option. How is for a host of their
/// firmware.
pub(crate) fn links(links: &Links, options: &Options, out: &mut impl Write) -> io::Result<()> {
    let count = options.product.len();
    let tmcl = options.firmware() == FirmwareOption::Tmcl;
    if let Some(pty) = &links.serial {
        let path = head(out, "serial", pty)?;
        let first = remark(options, 1);
        writeln!(out, "    tmcl send {path} \"{}\"{first}", request(tmcl))?;
        if tmcl {
            writeln!(out, "    ConnectionManager(\"--interface usb_tmcl --port {path}\"){first}")?;
            writeln!(out, "    ConnectionManager(\"--interface serial_tmcl --port {path} --data-rate 9600\"){first}")?;
        }
    }
    if let Some(server) = &links.tcp {
        let to = server.reachable();
        let first = remark(options, 1);
        writeln!(out, "tcp: {}", server.address())?;
        writeln!(out, "    tmcl send tcp:{to} \"{}\"{first}", request(tmcl))?;
        if tmcl && to.is_ipv4() {
            writeln!(out, "    ConnectionManager(\"--interface socket_serial_tmcl --port {to}\"){first}")?;
        }
    }
    if let Some(pty) = &links.rs485 {
        let path = head(out, "rs485", pty)?;
        let python = format!("--interface serial_tmcl --port {path} --data-rate 9600");
        addressed(out, &path, &python, options)?;
    }
    if let Some(pty) = &links.slcan {
        let path = head(out, "slcan", pty)?;
        if tmcl { adapter(out, &path, &path, options)? } else { master(out, &path, count)? }
    }
    if let Some(server) = &links.slcan_tcp {
        let to = server.reachable();
        writeln!(out, "slcan-tcp: {}", server.address())?;
        let url = format!("socket://{to}");
        if tmcl { adapter(out, &format!("tcp:{to}"), &url, options)? } else { master(out, &url, count)? }
    }
    if let Some(server) = &links.control {
        writeln!(out, "control: {}", server.address())?;
        writeln!(out, "    tmcl world {} state", server.reachable())?;
    }
    Ok(())
}

/// Warns of ports to which other computers may be able to connect.
pub(crate) fn warn(links: &Links, say: fn(&str)) {
    let open = links.open_to_others();
    let (are, them) = if open.len() == 1 { ("is", "it") } else { ("are", "them") };
    if !open.is_empty() {
        let open = open.join(", ");
        say(&format!(
            "{open} {are} open to other computers: whoever reaches this one moves the motors, without a password"
        ));
        say(&format!(
            "listen on 127.0.0.1 in place of that, unless it is meant and a firewall keeps others from {them}"
        ));
    }
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

/// A comment behind a line that reaches one module, in shell and Python alike: what that module is, where others are
/// something else.
fn remark(options: &Options, module: usize) -> String {
    match options.product.get(module - 1) {
        Some(product) if options.is_mixed() => format!("  # module {module}, a {}", product.name()),
        _ => String::new(),
    }
}

/// Prints the lines that reach the modules over a bus: those of module 1, or of the first module of each product.
/// `link` is the bus for `tmcl`, `python` for PyTrinamic.
fn addressed(out: &mut impl Write, link: &str, python: &str, options: &Options) -> io::Result<()> {
    for (index, product) in options.product.iter().enumerate() {
        if options.product.iter().take(index).all(|other| other != product) {
            let number = index + 1;
            let which = remark(options, number);
            writeln!(out, "    tmcl send {link} --address {number} \"GAP 1, 0\"{which}")?;
            writeln!(out, "    ConnectionManager(\"{python} --module-id {number}\"){which}")?;
        }
    }
    Ok(())
}

/// Prints the lines with which python-canopen reaches `count` nodes over a CAN adapter; `url` is its name for pySerial.
fn master(out: &mut impl Write, url: &str, count: usize) -> io::Result<()> {
    writeln!(out, "    network = canopen.Network()")?;
    writeln!(out, "    network.connect(interface=\"slcan\", channel=\"{url}\")")?;
    (1..=count).try_for_each(|node| writeln!(out, "    network.add_node({node}, \"docs/tmcm1140-canopen.eds\")"))
}

/// Prints the lines for a CAN adapter: `device` is its name for `tmcl`, `url` its name for pySerial.
fn adapter(out: &mut impl Write, device: &str, url: &str, options: &Options) -> io::Result<()> {
    addressed(out, &format!("slcan:{device}"), &format!("--interface slcan_tmcl --port {url}"), options)?;
    writeln!(out, "    can.Bus(interface=\"slcan\", channel=\"{url}\", bitrate=1000000)")
}
