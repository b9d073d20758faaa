//! The command line of `tmcl sim`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hal_sim::clock::Nanos;
use hal_sim::control::time;
use hal_sim::mcu::Stop;
use serde::Serialize;
use tmcl_tools::product;
use tmcm_sim::protocol::Speed;
use tmcm_sim::{FirmwareKind, Model, Product};

use crate::failure::Failure;

/// Most modules: as many as a CANopen network has node IDs.
const MOST_MODULES: u8 = 127;

/// Run a virtual {names}, or several on a bus, that host software drives like real ones
///
/// The module's own firmware runs against models of its chips, and for each axis a motor and a stage. What runs is the
/// firmware's core as it is compiled for this computer, or with --image the very flash image. Host software connects to
/// the ports that are printed, and needs no change. Without any of --serial, --rs485, --tcp, --slcan and --slcan-tcp it
/// makes a serial port and a TCP port, or with --firmware canopen a CAN adapter on a TCP port. It prints `ready` on a
/// line of its own when the module can be used. It runs until it is interrupted (Ctrl-C, SIGTERM or SIGHUP); then its
/// symbolic links are removed.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module's product: {numbers}; or that of each of several, with commas between the names
    ///
    /// The TMCM-1110 and the TMCM-1140 have one axis. The TMCM-3110 has three, with an ABN encoder each, and the
    /// TMCM-3212, too, with another kind of ramp generator. The TMCM-6110 has six. One name holds for all modules of
    /// --modules. Of several names the first is that of module 1, and there are as many modules as names. `TMCM-6110`
    /// is the same as 6110. Without it the product is that of --image, or else 1140.
    #[arg(long, value_name = "NAME[,NAME...]", value_delimiter = ',', value_parser = product::named)]
    pub product: Vec<Product>,

    /// The firmware in the module: `tmcl` speaks TMCL on all links; `canopen` is a node on the CAN bus
    ///
    /// The TMCM-1140 is sold with either, the others speak TMCL. A CANopen node is driven by a CANopen master (a PLC,
    /// ROS, python-canopen) at --slcan or --slcan-tcp; docs/tmcm1140-canopen.eds describes its objects to the master.
    /// At its USB link it tells its version (TMCL command 136) and nothing else, and its RS485 port is off.
    ///
    /// Without it the firmware is that of --image, or else tmcl.
    #[arg(long, value_name = "NAME", value_enum)]
    pub firmware: Option<FirmwareOption>,

    /// Offer the module's USB link as a serial port: a pseudo terminal with a symbolic link to it at PATH
    ///
    /// A symbolic link to a terminal that is left from an earlier run is replaced; any other file, and the link of a
    /// simulator that runs, is left alone.
    #[arg(long, value_name = "PATH")]
    pub serial: Option<PathBuf>,

    /// Offer the module's USB link on a TCP port, to up to 16 clients at once
    ///
    /// Further connections are refused, and one that begins like HTTP or TLS is closed, so that no web page reaches the
    /// module. Port 0 takes a free port and prints it.
    ///
    /// There is no password: with another address than 127.0.0.1 or ::1, who reaches this computer moves the motor.
    #[arg(long, value_name = "ADDR:PORT", value_parser = address)]
    pub tcp: Option<String>,

    /// Offer the RS485 bus of all modules as a serial port, made as that of --serial
    ///
    /// All modules hear what the host and other modules send, and those addressed answer, global parameter 75 and the
    /// time on the wire later. The speed that the host gives the port does not matter, so a wrong one is not noticed
    /// here. Its bytes are on the bus at once, and with --image at the module's rate (global parameter 65).
    #[arg(long, value_name = "PATH")]
    pub rs485: Option<PathBuf>,

    /// Offer the CAN bus of all modules as a serial CAN adapter (SLCAN) on a port made as that of --serial
    ///
    /// The adapter speaks the protocol of LAWICEL adapters; the bit rate that a host sets has no effect. Nor has the
    /// bit rate of the modules: they hear each other, and the host, at any.
    #[arg(long, value_name = "PATH")]
    pub slcan: Option<PathBuf>,

    /// Offer the CAN bus on a TCP port, as --tcp the USB link; each client has an adapter of its own
    #[arg(long, value_name = "ADDR:PORT", value_parser = address)]
    pub slcan_tcp: Option<String>,

    /// Number of modules, up to 127; without it as many as --product names, or 1
    ///
    /// A fresh module K has serial address and CAN identifier K, or with --firmware canopen node ID K. As in the
    /// factory, all TMCL modules reply to address and identifier 2. --serial and --tcp belong to module 1. A factory
    /// reset takes a module back to address 1.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=i64::from(MOST_MODULES)))]
    pub modules: Option<u8>,

    /// Take commands for the world around the module on a TCP port: one line of text in, one line of JSON out
    ///
    /// Commands: press|release left|right|home, input N 0|1, analog N VALUE, supply VOLTS, temperature DEGC, load X,
    /// slip STEPS, fault NAME on|off, can passive|off|on, power off|on, usb off [--hangup]|on, state. The X of load is
    /// a torque, 0 to 1: 1 is the motor's at full current, and with less current less stalls it. With `module K` before
    /// it a command is for another module than 1. The number of an axis may stand behind press, release, load, slip and
    /// fault: `press left 2`; without one it is axis 0. Port 0 takes a free one and prints it. `tmcl world` sends
    /// commands from a shell, and docs/control.md explains all of this and every field of `state`.
    ///
    /// For time and firmware: `pause [TIME]`, `resume`, `speed X|max`, `step TIME`, `run-until CONDITION max TIME`,
    /// `interrupt`, `at TIME COMMAND`, `restart`, `watch INTERVAL NAME...`, `unwatch`, `send COMMAND`. A TIME is a
    /// number and a unit, us, ms, s, min or h: `20 ms`. The COMMAND of `send` is one of TMCL: `send MVP ABS, 0, 1000`.
    ///
    /// NAME of a fault: eeprom, spi, spi-low, tmc429, tmc262, tmc5160, chip-supply, short-a, short-b, open-a, open-b,
    /// overtemperature, encoder. The first three are those of the whole board. Replies on their way to hosts have
    /// faults of their own: `fault reply-delay TIME`, `fault reply-drop N`, `fault reply-corrupt N`.
    ///
    /// Axes, inputs and analog inputs are those of the module's product. Inputs are 0 to 3, or 0 to 7 of a TMCM-3110
    /// and TMCM-6110. Analog inputs are 0, on these two also 4, and 0 to 3 of a TMCM-3212. On a TMCM-1140 inputs 1 to 3
    /// are the switches; the others' switches and encoders have pins of their own, and input 10 of a TMCM-3212 is
    /// ENABLE. `fault tmc429` is one of the controller that moves the axis, three axes each. On a TMCM-3212 it is
    /// `fault tmc5160`, and `fault chip-supply` is one of the supply of an axis' chip alone. `state` tells of axis 0
    /// among the fields of the module, and of each axis in its list `axes`.
    ///
    /// `can passive` and `can off` are what disturbances on the bus lead to. Until `can on` the CAN controller of the
    /// module does not tell others of errors any more, or takes no part in the bus. While the USB cable is out, the
    /// ports of --serial and --tcp stay; what is sent into them is lost, and nothing comes. After `usb off --hangup`
    /// connections end, and the path of --serial is gone until `usb on`.
    ///
    /// A connection that begins like HTTP or TLS is closed, as at --tcp. Commands of a client that does not read its
    /// answers wait until it does. At 16 connections a new one takes the place of the one that has been idle longest.
    #[arg(long, value_name = "ADDR:PORT", value_parser = address)]
    pub control: Option<String>,

    /// Keep the contents of the module's EEPROM (settings, programs) in FILE, which is made if there is none
    ///
    /// As many bytes as the chip has: 16384 in a TMCM-1110 or TMCM-1140, 65536 in a TMCM-3212, 32768 in the others. Of
    /// several modules the second has FILE.2, the third FILE.3. What the module has acknowledged as stored is in the
    /// file. While the file cannot be written, the module answers stores with status 5, and a CANopen node with abort
    /// code 06060000h. A file has one simulator at a time. Either firmware of a product, and another product with an
    /// EEPROM of this size, takes the file. That firmware finds its own defaults there, and what the other has stored
    /// is there until this one stores something. Then the other one has its defaults.
    #[arg(long, value_name = "FILE")]
    pub eeprom: Option<PathBuf>,

    /// Describe the motor, its stage, switches, encoder and supply
    ///
    /// Without it there is a free 200-step motor at each axis, 24 V, and nothing at the inputs. The tables of FILE hold
    /// for each axis; the n-th `[[axis]]` has what is different at axis n - 1, such as `motor.load = 0.2`. Each module
    /// has this world for itself, and what its product lacks, such as a fourth axis, is refused.
    /// hal-sim/worlds/stage.toml shows all entries, and gantry.toml three axes.
    #[arg(long, value_name = "FILE.toml")]
    pub world: Option<PathBuf>,

    /// Let time pass FACTOR times as fast, 0.001 to 1000, or with `max` as fast as can be
    ///
    /// Where the computer cannot keep up, time passes as fast as it can; `state` on the control port tells how fast as
    /// speed_factor.
    #[arg(long, value_name = "FACTOR", default_value_t = Speed::Factor(1.0), value_parser = Speed::parse)]
    pub speed: Speed,

    /// Let time stand still, but for what requests need for their replies, and TIME after each reply
    ///
    /// Equal runs of a host then end alike, to the microsecond, however busy the computer is. The host lets time pass
    /// by `step` and `run-until` on the control port. Or, with TIME (such as --paused=10ms), time passes by the number
    /// of its requests alone, so that a script that asks and sleeps needs no change. `resume` lets time go by the
    /// clock.
    #[arg(long, value_name = "TIME", num_args = 0..=1, require_equals = true, default_missing_value = "0 ms", value_parser = time::span)]
    pub paused: Option<Nanos>,

    /// Write a line for each telegram and frame on the links to FILE: virtual time, link, direction, bytes and what
    /// they say
    ///
    /// A file that exists is emptied; - is standard output. What a fault of replies keeps from a host is marked as
    /// lost, and a telegram that has come in part as torn.
    #[arg(long, value_name = "FILE")]
    pub log_telegrams: Option<PathBuf>,

    /// Run the firmware's flash image on an emulated microcontroller, in place of its core
    ///
    /// ELF is the file that is flashed; `cargo fw` builds it: target/thumbv7em-none-eabi/release/tmcm1140. That of the
    /// CANopen firmware is built by `cargo fw-canopen`: tmcm1140-canopen. Those of the TMCM-3212 and the TMCM-6110 are
    /// built by `cargo fw-3212` and `cargo fw-6110`: tmcm3212, tmcm6110. A symbol in it tells which one it is; for an
    /// image without this symbol --product and --firmware do. Board, world and links are the same. A start takes the
    /// module its time, and bytes and frames take theirs. --serial and --tcp are one USB cable, on which hosts take
    /// turns. One that has made the module leave the mode of global parameter 67 loses its connection when another has
    /// something to say.
    ///
    /// Virtual time lags while the firmware has more to do than the computer can follow; it is said how far. Typically
    /// it goes at 0.3 to 1 times the clock's pace, which `state` on the control port tells as speed_factor; the
    /// time-outs of hosts have to allow for that.
    #[arg(long, value_name = "ELF")]
    pub image: Option<PathBuf>,

    /// End when standard input ends
    ///
    /// For programs that start the simulator with a pipe: the simulator ends when they end, in whatever way. Other
    /// input is ignored.
    #[arg(long)]
    pub exit_with_stdin: bool,

    /// Print one line of JSON in place of the introduction and `ready`: version, product, pid, and all ports
    ///
    /// For programs that start the simulator: `tcp` and `control` are addresses to connect to, `serial` is a path to
    /// open; a link that is not offered is null.
    #[arg(long)]
    pub ready_json: bool,

    /// Print the image's log: time since its start in seconds, level and text, on standard error
    ///
    /// Warnings and errors are printed without it, too.
    #[arg(long, requires = "image")]
    pub log: bool,
}

/// The firmware of a virtual module, as the command line has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum FirmwareOption {
    /// The firmware that speaks TMCL
    Tmcl,
    /// The firmware that is a CANopen node
    Canopen,
}

impl From<FirmwareKind> for FirmwareOption {
    fn from(firmware: FirmwareKind) -> Self {
        match firmware {
            FirmwareKind::Tmcl => FirmwareOption::Tmcl,
            FirmwareKind::Canopen => FirmwareOption::Canopen,
        }
    }
}

impl From<FirmwareOption> for FirmwareKind {
    fn from(firmware: FirmwareOption) -> Self {
        match firmware {
            FirmwareOption::Tmcl => FirmwareKind::Tmcl,
            FirmwareOption::Canopen => FirmwareKind::Canopen,
        }
    }
}

impl Options {
    /// The options with the product of each module, and the firmware, both as the image has them if it tells. Refuses
    /// options that contradict each other, or the image, in a way that the parser cannot see.
    pub(crate) fn checked(&self, told: Option<Model>) -> Result<Self, Failure> {
        let refused = |why: &str| Err(Failure::Arguments(why.into()));
        let product = self.products(told.map(Model::product))?;
        if self.firmware == Some(FirmwareOption::Canopen)
            && let Some(product) = product.iter().find(|product| **product != Product::Tmcm1140)
        {
            let (name, only) = (product.name(), Product::Tmcm1140.name());
            let source = if told.is_some() { ", for which the image is," } else { "" };
            return Err(Failure::Arguments(format!(
                "--firmware canopen: the {name}{source} has no such firmware, only the {only} has. Leave out --firmware, or \
                 run the {only}"
            )));
        }
        let told = told.map(|model| FirmwareOption::from(model.firmware()));
        if let (Some(asked), Some(told)) = (self.firmware, told)
            && asked != told
        {
            return refused(match told {
                FirmwareOption::Tmcl => {
                    "--firmware canopen: the image has the TMCL firmware. Leave out --firmware, or give the image that \
                     `cargo fw-canopen` builds"
                }
                FirmwareOption::Canopen => {
                    "--firmware tmcl: the image has the CANopen firmware. Leave out --firmware, or give the image that \
                     `cargo fw` builds"
                }
            });
        }
        let options = Options { product, firmware: told.or(self.firmware), ..self.clone() };
        if options.firmware() == FirmwareOption::Canopen && self.rs485.is_some() {
            return refused(
                "--rs485: the CANopen firmware leaves the module's RS485 port off, so nobody would answer there. Drive \
                 the module over CAN, with --slcan or --slcan-tcp",
            );
        }
        Ok(options)
    }

    /// The product of each module. `told` is the product for which the image is, if it tells.
    fn products(&self, told: Option<Product>) -> Result<Vec<Product>, Failure> {
        let named = &self.product;
        let refused = |why: String| {
            let numbers: Vec<&str> = named.iter().map(|named| product::short(*named)).collect();
            Err(Failure::Arguments(format!("--product {}: {why}", numbers.join(","))))
        };
        if let Some(told) = told
            && named.iter().any(|product| *product != told)
        {
            return refused(format!(
                "the image is one for the {}. Leave out --product, or give the image of another product",
                told.name()
            ));
        }
        let first = named.first().copied().or(told).unwrap_or_default();
        if self.image.is_some() && named.iter().any(|product| *product != first) {
            return refused("all modules run the image, which is for one product. Give its name alone".into());
        }
        if named.len() > usize::from(MOST_MODULES) {
            return refused(format!("these are {} modules, and {MOST_MODULES} are the most", named.len()));
        }
        match self.modules {
            Some(count) if named.len() > 1 && named.len() != usize::from(count) => refused(format!(
                "these are {} modules, and --modules says {count}. Give one name for all of them, or leave out --modules",
                named.len()
            )),
            Some(count) if named.len() < 2 => Ok(vec![first; count.into()]),
            None if named.is_empty() => Ok(vec![first]),
            _ => Ok(named.clone()),
        }
    }

    /// True if the modules are not all of one product.
    pub(crate) fn is_mixed(&self) -> bool {
        self.product.iter().any(|product| Some(product) != self.product.first())
    }

    /// The model of each module.
    pub(crate) fn models(&self) -> impl Iterator<Item = Model> {
        self.product.iter().map(|product| match self.firmware() {
            FirmwareOption::Tmcl => Model::Tmcl(*product),
            FirmwareOption::Canopen => Model::Canopen,
        })
    }

    /// The firmware in the module.
    pub(crate) fn firmware(&self) -> FirmwareOption {
        self.firmware.unwrap_or(FirmwareOption::Tmcl)
    }

    /// True if the options ask for no link, so that the default links are opened.
    fn names_no_link(&self) -> bool {
        !self.has_usb_link() && self.rs485.is_none() && self.slcan.is_none() && self.slcan_tcp.is_none()
    }

    /// True if a host can be at the USB connector of module 1.
    pub(crate) fn needs_usb(&self) -> bool {
        self.has_usb_link() || self.default_usb()
    }

    /// True if the links of USB are opened although none is named.
    pub(crate) fn default_usb(&self) -> bool {
        self.names_no_link() && self.firmware() == FirmwareOption::Tmcl
    }

    /// True if a CAN adapter is offered although none is named.
    pub(crate) fn default_can(&self) -> bool {
        self.names_no_link() && self.firmware() == FirmwareOption::Canopen
    }

    fn has_usb_link(&self) -> bool {
        self.serial.is_some() || self.tcp.is_some()
    }
}

/// How the images are built, for whoever gives a file that is none.
pub(crate) const IMAGES: &str = "\
     `cargo fw` builds the image of the TMCM-1140, `cargo fw-canopen` that of its CANopen firmware, \
     `cargo fw-3212` that of the TMCM-3212, and `cargo fw-6110` that of the TMCM-6110";

/// Advice for whoever gives an image that does not start.
pub(crate) fn advice(stop: &Stop) -> &'static str {
    match stop {
        Stop::Pin(_) => {
            "The image is for another board than `--product` says, or for one of your own, whose pins the emulator has to \
             know as well: docs/porting.md"
        }
        _ => IMAGES,
    }
}

const EXAMPLES: &str = "\
Examples:
  tmcl sim
      a module on a serial port and a TCP port; prints how to connect
  tmcl sim --serial /tmp/tmcm1140 --control 127.0.0.1:4141
      a serial port under a name of your own; then, say: tmcl world 127.0.0.1:4141 'press left'
  tmcl sim --modules 3 --slcan /tmp/can --rs485 /tmp/rs485
      three modules with addresses 1 to 3 on a CAN bus and an RS485 bus
  tmcl sim --product 6110 --tcp 127.0.0.1:4140 --world hal-sim/worlds/gantry.toml
      a module with six axes, of which three move a gantry
  tmcl sim --product 1140,3212,6110 --slcan /tmp/can
      three modules of different products on a CAN bus, with identifiers 1 to 3
  tmcl sim --firmware canopen --modules 2
      two CANopen nodes, 1 and 2, on a CAN adapter at a TCP port; prints how python-canopen gets there
  tmcl sim --tcp 127.0.0.1:0 --eeprom module.bin --world stage.toml --speed 10
      settings survive, there is a stage with switches, and ten seconds pass in one
  tmcl sim --tcp 127.0.0.1:0 --control 127.0.0.1:0 --paused --ready-json
      for a test: time stands still until the test steps on, and where the ports are can be read by a program
  tmcl sim --image target/thumbv7em-none-eabi/release/tmcm1140 --log
      the flash image itself runs, and what it logs is printed
  tmcl sim --image target/thumbv7em-none-eabi/release/tmcm1140-canopen
      that of the CANopen firmware, which is told by the file, as the product is";

/// Checks the form of an address to listen on. Whether the address can be used shows when the port is opened.
pub fn address(text: &str) -> Result<String, String> {
    let parts = text.rsplit_once(':').filter(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
    match parts {
        Some(_) => Ok(text.into()),
        None => Err("give an address and a port (0..65535), for example 127.0.0.1:4140".into()),
    }
}

#[cfg(test)]
mod tests {
    use hal_sim::mcu::Misfit;

    use super::*;

    #[test]
    fn addresses_need_a_port() {
        assert_eq!(address("127.0.0.1:0"), Ok("127.0.0.1:0".into()));
        assert_eq!(address("[::1]:4140"), Ok("[::1]:4140".into()));
        assert!(["4140", ":4140", "localhost", "localhost:70000", ""].iter().all(|text| address(text).is_err()));
    }

    #[test]
    fn whose_pins_are_others_is_not_told_how_to_build() {
        let pin = Misfit { pin: (3, 10), firmware: "drives it", board: "TMCM-1140", part: "nothing" };
        assert!(advice(&Stop::Pin(pin)).ends_with("docs/porting.md"));
        assert!(advice(&Stop::Image("no ELF file".into())).contains("`cargo fw`"));
    }
}
