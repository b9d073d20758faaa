//! `tmcl scan`: the modules on a link.

use std::io::Write;
use std::ops::RangeInclusive;
use std::time::Duration;

use clap::Args;
use tmcl_link::EndSignal;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::product::Product;
use tmcl_tools::scan::{Event, Found, Medium, Search, search};
use tmcm::param::BAUD_RATES;

use crate::failure::Failure;
use crate::link::{Link, LinkTarget, LogFile, Surroundings};
use crate::progress::Bar;
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
    /// Modules may be set to pause for up to 255 milliseconds before they reply (global parameter 75). Without it 50;
    /// over TCP, where a module is mostly alone and the way to it may be long, the first question has 2000.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=600_000))]
    pub timeout: Option<u64>,

    /// Print each module as a line of JSON
    ///
    /// Its fields are address (on CAN identifier), baud (on a serial device), alone, secondary_of, product, firmware,
    /// version. The field alone tells that the link leads to one module, whatever the address. The field secondary_of
    /// is the own address of a module that has answered at its secondary one. What is not known is left out.
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
/// Reads `FIRST-LAST`, or one address.
fn addresses(text: &str) -> Result<RangeInclusive<u16>, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) if 1 <= first && first <= last && last <= 2047 => Ok(first..=last),
        _ => Err("give addresses from 1 to 255, on CAN to 2047, for example 1-16".into()),
    }
}

impl Options {
    /// The search that the options ask for.
    fn search(&self) -> Search {
        let medium = match self.link {
            LinkTarget::Serial(_) => Medium::Serial(self.baud.map_or_else(|| BAUD_RATES.into(), |baud| vec![baud])),
            LinkTarget::Slcan(_) => Medium::Can,
            LinkTarget::Tcp(_) | LinkTarget::Simulated => Medium::Bytes,
        };
        let timeout = self.timeout.map_or(TIMEOUT, Duration::from_millis);
        let is_far = matches!(self.link, LinkTarget::Tcp(_)) && self.timeout.is_none();
        let first_timeout = if is_far { FIRST_TIMEOUT } else { timeout };
        Search { medium, addresses: self.addresses.clone(), timeout, first_timeout }
    }

    /// Opens the link, at a bit rate if it has one.
    fn open(&self, baud: Option<u32>) -> Result<Conversation, Failure> {
        let baud = baud.unwrap_or_default();
        let mut link = Link::open(&self.link, baud, CONNECTION, Product::default(), &Surroundings::default())?;
        // Whoever answers is found, at whatever address.
        link.take_any();
        if let Some(file) = &self.log_telegrams {
            link.log_to(file, None)?;
        }
        Ok(Conversation::new(link.wire(), 0, None, note))
    }

    /// Prints a module that has been found.
    fn print(&self, found: &Found) -> Result<(), Failure> {
        let mut out = tell::out();
        match self.json {
            true => writeln!(out, "{}", serde_json::to_string(found).map_err(std::io::Error::from)?)?,
            false => writeln!(out, "{found}")?,
        }
        Ok(out.flush()?)
    }
}

/// Looks for modules and prints them.
pub fn run(options: &Options) -> Result<(), Failure> {
    let signal = EndSignal::watch()?;
    let mut bar = Bar::default();
    search(
        &options.search(),
        |baud| options.open(baud),
        &signal,
        |event| {
            if !matches!(event, Event::Progress(_)) {
                bar.pause();
            }
            match event {
                Event::Progress(told) => bar.tell(told),
                Event::Found(found) => options.print(found)?,
                Event::Unavailable(failure) => tell::warning(failure)?,
            }
            Ok(())
        },
    )
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
