//! `tmcl scan`: the modules on a link.

mod found;

use std::io::Write;
use std::ops::RangeInclusive;
use std::time::Duration;

use clap::Args;
use found::Found;
use tmcl_link::EndSignal;
use tmcl_tools::conversation::{ASK_VERSION, Conversation, Error};
use tmcl_tools::product::Product;
use tmcl_tools::stop::Stop;
use tmcl_tools::wire::LinkError;
use tmcm::param::BAUD_RATES;
use tmcm::tmcl::binary::Received;
use tmcm::tmcl::{Command, Opcode};

use crate::failure::{Ended, Failure};
use crate::link::{Link, LinkTarget, LogFile, Surroundings};
use crate::progress::Progress;
use crate::reach::note;
use crate::tell;

/// Find the modules on a link: every address, and on a serial device every bit rate
///
/// Each address is asked for the state of its program, and who answers for its firmware version, which changes nothing
/// in a module. Whoever does not answer both in time does not count: a late reply may be one to an earlier question,
/// at another bit rate. A link that leads to one module whatever the address, such as USB, is noticed. A scan of all
/// 255 addresses at one bit rate takes 13 seconds with the default time-out, at all nine bit rates two minutes.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// Where to look: a serial device, tcp:HOST:PORT, slcan:DEVICE, or sim
    #[arg(value_name = "LINK", value_parser = LinkTarget::parse)]
    pub link: LinkTarget,

    /// The addresses on RS485, or the identifiers on CAN (up to 2047), to ask: FIRST-LAST or a single one
    #[arg(long, value_name = "RANGE", default_value = "1-255", value_parser = addresses)]
    pub addresses: RangeInclusive<u16>,

    /// Only this bit rate of a serial device, instead of all that modules know
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub baud: Option<u32>,

    /// How long to wait for each reply, in milliseconds
    ///
    /// Modules may be set to pause for up to 255 milliseconds before they reply (global parameter 75).
    /// Without it 50; over TCP, where a module is mostly alone and the way to it may be long, the first question has 2000.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=600_000))]
    pub timeout: Option<u64>,

    /// Print each module as a line of JSON
    ///
    /// Its fields are address (on CAN identifier), baud (on a serial device), alone (the link leads to one module,
    /// whatever the address), secondary_of (the own address of a module that has answered at its secondary one), product,
    /// firmware, version. What is not known is left out.
    #[arg(long)]
    pub json: bool,

    /// Write a line for each telegram or frame on the link: time, direction, bytes and what they say
    ///
    /// As for `tmcl send`. Behind the name of the link stands the number of the bit rate, from the second one on.
    #[arg(long, value_name = "FILE", value_parser = LogFile::named)]
    pub log_telegrams: Option<LogFile>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl scan /dev/ttyUSB0                                every address at every bit rate
  tmcl scan /dev/ttyUSB0 --baud 9600 --addresses 1-16   a few at one
  tmcl scan slcan:/dev/ttyACM0                          every identifier on a CAN bus, 1 to 255
  tmcl scan sim --json                                  for a program
The exit code is 1 if no module is found.";

/// Longest wait for a TCP connection.
const CONNECTION: Duration = Duration::from_secs(5);
/// How long a reply is waited for.
const TIMEOUT: Duration = Duration::from_millis(50);
/// How long the reply of a module that is alone on its link is waited for over TCP, once.
const FIRST_TIMEOUT: Duration = Duration::from_millis(2000);
/// An address that no module on a bus has. A module that answers a request to this address is alone on its link.
const UNUSED_ADDRESS: u16 = 0;
/// Longest wait for late replies: the longest telegram pause (global parameter 75) of a module.
const LATE: Duration = Duration::from_millis(255);
/// The first request to an address: command 135, because a module in download mode answers it, too, and does not store
/// it.
const ASK_STATE: Command = Command::new(Opcode::ApplicationStatus as u8, 0, 0, 0);

/// Reads `FIRST-LAST`, or one address.
fn addresses(text: &str) -> Result<RangeInclusive<u16>, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) if 1 <= first && first <= last && last <= 2047 => Ok(first..=last),
        _ => Err("give addresses from 1 to 255, on CAN to 2047, for example 1-16".into()),
    }
}

impl Options {
    /// How long a reply is waited for.
    fn timeout(&self) -> Duration {
        self.timeout.map_or(TIMEOUT, Duration::from_millis)
    }
}

/// Looks for modules and prints them.
pub fn run(options: &Options) -> Result<(), Failure> {
    let signal = EndSignal::watch()?;
    let rates = match (&options.link, &options.baud) {
        (_, Some(baud)) => std::slice::from_ref(baud),
        (LinkTarget::Serial(_), None) => &BAUD_RATES[..],
        (LinkTarget::Tcp(_) | LinkTarget::Slcan(_) | LinkTarget::Simulated, None) => &BAUD_RATES[..1],
    };
    let mut modules = 0;
    let mut heard = false;
    for (index, baud) in rates.iter().enumerate() {
        let mut scanner = match Scanner::open(options, *baud) {
            Ok(scanner) => scanner,
            // A serial adapter may not support all bit rates.
            Err(failure) if index > 0 => {
                tell::warning(failure)?;
                continue;
            }
            Err(failure) => return Err(failure),
        };
        if index > 0 {
            scanner.settle();
        }
        let end = scanner.scan(&signal)?;
        modules += scanner.modules;
        heard |= scanner.heard;
        let first = scanner.first.filter(|_| rates.len() > 1);
        // The serial device is closed before it is opened again at another bit rate.
        drop(scanner);
        match end {
            End::Complete => {}
            End::SingleModule => break,
            End::Interrupted => return Err(signal.failure("")),
        }
        if let Some(address) = first {
            let other = rates.iter().find(|other| *other != baud).copied().unwrap_or(*baud);
            let mut elsewhere = Scanner::open(options, other)?;
            elsewhere.settle();
            if elsewhere.find(address)?.is_some() {
                // The module answers at another bit rate, too: the link (a pseudo terminal, say) has no real bit rate,
                // and further bit rates would find the same modules.
                break;
            }
        }
    }
    match modules {
        0 if heard => Err(Failure::Failed(
            "no module answers, but something does: what came is not the reply of a module. Check what the link leads to, \
             its bit rate, and whether several modules have one address"
                .into(),
        )),
        0 => Err(Failure::Failed("no module answers; check power and wiring, and try a longer --timeout".into())),
        _ => Ok(()),
    }
}

/// How a scan ended.
enum End {
    /// All addresses have been asked.
    Complete,
    /// The link leads to one module, whatever the address.
    SingleModule,
    /// A signal has asked for the end.
    Interrupted,
}

/// The scan of a link at one bit rate.
struct Scanner<'a> {
    options: &'a Options,
    module: Conversation,
    /// The bit rate of a serial device in bit/s; `None` for a link without bit rate.
    baud: Option<u32>,
    /// Number of modules that have been found.
    modules: usize,
    /// Bytes have come that are no reply.
    heard: bool,
    /// Address of the first module that has been found.
    first: Option<u16>,
}

impl<'a> Scanner<'a> {
    fn open(options: &'a Options, baud: u32) -> Result<Self, Failure> {
        let mut link = Link::open(&options.link, baud, CONNECTION, Product::default(), &Surroundings::default())?;
        // Whoever answers is found, at whatever address.
        link.take_any();
        if let Some(file) = &options.log_telegrams {
            link.log_to(file, None)?;
        }
        let baud = match options.link {
            LinkTarget::Serial(_) => Some(baud),
            LinkTarget::Tcp(_) | LinkTarget::Slcan(_) | LinkTarget::Simulated => None,
        };
        let mut module = Conversation::new(link.wire(), UNUSED_ADDRESS, None, note);
        module.set_timeout(options.timeout());
        Ok(Scanner { options, module, baud, modules: 0, heard: false, first: None })
    }

    fn scan(&mut self, signal: &EndSignal) -> Result<End, Failure> {
        let can = matches!(self.options.link, LinkTarget::Slcan(_));
        if !can && let Some(reply) = self.alone()? {
            self.module.turn_to(reply.module.into());
            let found = Found { alone: true, address: Some(reply.module.into()), ..self.describe(reply.value)? };
            self.found(reply.module.into(), &found)?;
            return Ok(End::SingleModule);
        }
        let name = if can { "identifier" } else { "address" };
        let addresses = self.options.addresses.clone();
        let rate = self.baud.map_or_else(String::new, |baud| format!(" at {baud} baud"));
        let what = format!("asking {name} {} to {}{rate}", addresses.start(), addresses.end());
        let mut progress = Progress::new(what, addresses.len());
        for (done, address) in addresses.enumerate() {
            if signal.happened() {
                return Ok(End::Interrupted);
            }
            if let Some(reply) = self.find(address)? {
                // On CAN a reply carries only the low byte of the module's identifier.
                let [_, low] = address.to_be_bytes();
                let found = Found {
                    address: (!can).then_some(address),
                    identifier: can.then_some(address),
                    secondary_of: (reply.module != low).then_some(reply.module),
                    ..self.describe(reply.value)?
                };
                progress.pause();
                self.found(address, &found)?;
            }
            progress.reach(done + 1);
        }
        Ok(End::Complete)
    }

    /// The version reply of a module that answers whatever the address. For all that it is asked it has as long as for the
    /// first question.
    fn alone(&mut self) -> Result<Option<Received>, Failure> {
        let usual = self.options.timeout();
        let is_far = matches!(self.options.link, LinkTarget::Tcp(_)) && self.options.timeout.is_none();
        self.module.set_timeout(if is_far { FIRST_TIMEOUT } else { usual });
        let reply = self.find(UNUSED_ADDRESS)?;
        if reply.is_none() {
            self.module.set_timeout(usual);
        }
        Ok(reply)
    }

    /// Prints a module that has been found.
    fn found(&mut self, address: u16, found: &Found) -> Result<(), Failure> {
        self.modules += 1;
        self.first = self.first.or(Some(address));
        let mut out = tell::out();
        match self.options.json {
            true => writeln!(out, "{}", serde_json::to_string(found).map_err(std::io::Error::from)?)?,
            false => writeln!(out, "{found}")?,
        }
        Ok(out.flush()?)
    }

    /// The version reply of the module at an address; `None` if there is no module. Two requests are sent: the reply to
    /// the first may be a late reply to an earlier address, the reply to the second, with another command number,
    /// cannot.
    fn find(&mut self, address: u16) -> Result<Option<Received>, Failure> {
        if self.probe(address, ASK_STATE)?.is_none() {
            return Ok(None);
        }
        self.settle();
        let found = self.probe(address, ASK_VERSION)?;
        if found.is_none() {
            self.settle();
        }
        Ok(found)
    }

    /// Waits for late replies. The next request throws them away.
    fn settle(&self) {
        std::thread::sleep(self.options.timeout().min(LATE));
    }

    /// Sends a request to an address and returns its reply. Bytes that are no reply count as none: they are noise, or
    /// come from several modules that reply at once.
    fn probe(&mut self, address: u16, command: Command) -> Result<Option<Received>, Failure> {
        self.module.turn_to(address);
        match self.module.request(command) {
            Ok(reply) => Ok(Some(reply)),
            Err(Error::Link { error: LinkError::NoReply { bytes: 0 }, .. }) => Ok(None),
            Err(
                Error::Link { error: LinkError::NoReply { .. }, .. } | Error::Refused { .. } | Error::Strange { .. },
            ) => {
                self.heard = true;
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The module that has answered: what it is, and at which bit rate.
    fn describe(&mut self, version: i32) -> Result<Found, Failure> {
        let (product, firmware) = Found::told(version);
        let version = match self.module.version() {
            Ok(text) => Some(text),
            Err(Error::Link { error: error @ (LinkError::Closed | LinkError::Lost(_)), .. }) => {
                return Err(Failure::Failed(error.to_string()));
            }
            Err(_) => None,
        };
        let (address, identifier, secondary_of) = (None, None, None);
        Ok(Found { address, identifier, baud: self.baud, alone: false, secondary_of, product, firmware, version })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_addresses() {
        assert_eq!(addresses("1-255"), Ok(1..=255));
        assert_eq!(addresses("7"), Ok(7..=7));
        assert!(["0-3", "3-1", "1-2048", "", "-", "x"].iter().all(|text| addresses(text).is_err()));
    }
}
