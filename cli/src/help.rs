//! The help of the program: which products there are, and what there is on which operating system.

use clap::builder::{Resettable, StyledStr};
use tmcl_server::pty;
use tmcl_tools::product;

/// Texts of the help where serial ports have paths and `tmcl sim` makes such ports, and the texts in its place on
/// Windows.
const ON_WINDOWS: [(&str, &str); 16] = [
    (
        "Without any of --serial, --rs485, --tcp, --slcan and --slcan-tcp it makes a serial port and a TCP port, or",
        "Without --tcp and --slcan-tcp it makes a TCP port, or",
    ),
    (
        " (Ctrl-C, SIGTERM or SIGHUP); then its symbolic links are removed.",
        " (Ctrl-C, Ctrl-Break, or its window is closed).",
    ),
    ("at --slcan or --slcan-tcp;", "at --slcan-tcp;"),
    ("--serial and --tcp belong to module 1.", "--tcp belongs to module 1."),
    ("the ports of --serial and --tcp stay;", "the port of --tcp stays;"),
    ("connections end, and the path of --serial is gone until `usb on`.", "connections end."),
    (
        "--serial and --tcp are one USB cable, on which hosts take turns.",
        "--tcp is one USB cable, on which hosts take turns.",
    ),
    ("are addresses to connect to, `serial` is a path to open; a link", "are addresses to connect to; a link"),
    (
        "      a module on a serial port and a TCP port; prints how to connect\n  \
         tmcl sim --serial /tmp/tmcm1140 --control 127.0.0.1:4141\n      \
         a serial port under a name of your own; then, say: tmcl world 127.0.0.1:4141 'press left'\n  \
         tmcl sim --modules 3 --slcan /tmp/can --rs485 /tmp/rs485\n      \
         three modules with addresses 1 to 3 on a CAN bus and an RS485 bus\n",
        "      a module on a TCP port; prints how to connect\n  \
         tmcl sim --tcp 127.0.0.1:4140 --control 127.0.0.1:4141\n      \
         a control port as well; then, say: tmcl world 127.0.0.1:4141 \"press left\"\n",
    ),
    ("--product 1140,3212,6110 --slcan /tmp/can\n", "--product 1140,3212,6110 --slcan-tcp 127.0.0.1:4142\n"),
    (
        "On USB (/dev/ttyACM*), at the port of `tmcl sim --serial` and for LINK sim that is taken anyway; elsewhere a reply",
        "For LINK sim that is taken anyway; elsewhere, also on USB, a reply",
    ),
    (
        "The path of a serial device (USB, an RS485 adapter, the serial port of `tmcl sim`),",
        "A COM port (USB, an RS485 adapter),",
    ),
    ("a serial device, tcp:HOST:PORT", "a COM port, tcp:HOST:PORT"),
    ("/dev/ttyACM0", "COM3"),
    ("/dev/ttyUSB0", "COM4"),
    ("target/thumbv7em-none-eabi/release/", r"target\thumbv7em-none-eabi\release\"),
];

/// Options of `tmcl sim` for ports that are pseudo terminals.
const PSEUDO_TERMINALS: [&str; 3] = ["serial", "rs485", "slcan"];

/// The same command, whose help has the products in the places that [`product::told`] knows, and nothing that this
/// operating system does not have.
pub fn told(command: clap::Command) -> clap::Command {
    if pty::EXIST { texts(command, &product::told) } else { on_windows(command) }
}

/// The command with the help that it has on Windows.
fn on_windows(command: clap::Command) -> clap::Command {
    let hidden = command.mut_subcommand("sim", |sim| {
        PSEUDO_TERMINALS.iter().fold(sim, |sim, name| sim.mut_arg(name, |option| option.hide(true)))
    });
    texts(hidden, &|text| {
        let told = product::told(text);
        ON_WINDOWS.iter().fold(told, |told, (elsewhere, here)| told.replace(elsewhere, here))
    })
}

/// The same command, with its texts, and those of its subcommands, as `told` tells them.
fn texts(mut command: clap::Command, told: &dyn Fn(&str) -> String) -> clap::Command {
    let of =
        |text: Option<&StyledStr>| Resettable::from(text.map(|text| StyledStr::from(told(&text.ansi().to_string()))));
    let (about, long) = (of(command.get_about()), of(command.get_long_about()));
    let examples = of(command.get_after_long_help());
    command = command.about(about).long_about(long).after_long_help(examples);
    let command = command.mut_args(|argument| {
        let (help, long) = (of(argument.get_help()), of(argument.get_long_help()));
        argument.help(help).long_help(long)
    });
    command.mut_subcommands(|command| texts(command, told))
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser, Subcommand};

    use super::*;
    use crate::{debug, dump, load, monitor, params, scan, send, shell, tune};

    /// The commands that talk of ports.
    #[derive(Parser)]
    #[command(name = "tmcl")]
    struct Arguments {
        #[command(subcommand)]
        _command: Command,
    }

    #[derive(Subcommand)]
    enum Command {
        Sim(tmcl_server::options::Options),
        Send(send::Options),
        Shell(shell::Options),
        Scan(scan::Options),
        Monitor(monitor::Options),
        Params(params::Options),
        Tune(tune::Options),
        Load(load::Options),
        Dump(dump::Options),
        Debug(debug::Options),
    }

    /// All that the help of a command and its subcommands says.
    fn all(command: &clap::Command) -> String {
        let shown = command.get_arguments().filter(|argument| !argument.is_hide_set());
        let of_arguments = shown.flat_map(|argument| [argument.get_help(), argument.get_long_help()]);
        let own = [command.get_about(), command.get_long_about(), command.get_after_long_help()];
        let texts = own.into_iter().chain(of_arguments).flatten().map(|text| format!("{text}\n"));
        texts.chain(command.get_subcommands().map(all)).collect()
    }

    #[test]
    fn help_on_windows_shows_nothing_that_is_not_there() {
        let told = all(&on_windows(Arguments::command()));
        for absent in ["/dev/", "/tmp/", "--serial", "--rs485", "--slcan ", "pseudo", "symbolic", "SIGTERM"] {
            let place = told.lines().find(|line| line.contains(absent));
            assert_eq!(place, None, "{absent}");
        }
        assert!(told.contains("COM3") && told.contains("--slcan-tcp"), "{told}");
        let elsewhere = all(&texts(Arguments::command(), &product::told));
        for (phrase, _) in ON_WINDOWS {
            assert!(elsewhere.contains(phrase), "{phrase}");
        }
    }
}
