//! The command-line options that name a module and the link to it, and the conversation over it.

use std::ops::Deref;
use std::time::Duration;

use clap::Args;
use tmcl_tools::conversation::{Conversation, Identity};
use tmcl_tools::number;
use tmcl_tools::product::{self, Product};

use crate::failure::Failure;
use crate::link::{Link, LinkTarget, LogFile, Surroundings};
use crate::tell;

/// The link to a module, its address and the time-out: options of every command that talks to a module.
#[derive(Args, Clone, Debug)]
pub struct Reach {
    /// Where the module is: a serial device, tcp:HOST:PORT, slcan:DEVICE, or sim
    ///
    /// The path of a serial device (USB, an RS485 adapter, the serial port of `tmcl sim`), tcp:HOST:PORT (the TCP port
    /// of `tmcl sim`), slcan:DEVICE or slcan:tcp:HOST:PORT (a serial CAN adapter). The word sim stands for a virtual
    /// module that lives only as long as this program.
    #[arg(value_name = "LINK", value_parser = LinkTarget::parse)]
    pub link: LinkTarget,

    /// How it is talked to
    #[command(flatten)]
    pub link_options: LinkOptions,
}

/// The address of a module on its link, the link's speed and the time-out: options for whatever link it is.
#[derive(Args, Clone, Debug)]
pub struct LinkOptions {
    /// The module's address on an RS485 bus, or its CAN identifier, up to 2047
    #[arg(
        long, value_name = "N", default_value_t = 1, global = true,
        value_parser = number::within(0..=2047u16)
    )]
    pub address: u16,

    /// Take the reply of any module, whatever address is in it
    ///
    /// A module puts its own address into its reply, also where it was asked by its secondary one (global parameter
    /// 87), or over a link to it alone. On USB (/dev/ttyACM*), at the port of `tmcl sim --serial` and for LINK sim that
    /// is taken anyway; elsewhere a reply from another address than --address is passed over.
    #[arg(long, global = true)]
    pub any_address: bool,

    /// Speed of a serial device, for RS485; USB ignores it
    #[arg(
        long, value_name = "N", default_value_t = 9600, global = true,
        value_parser = number::within(1..=u32::MAX)
    )]
    pub baud: u32,

    /// How long to wait for each reply, in milliseconds
    #[arg(
        long, value_name = "MS", default_value_t = 1000, global = true,
        value_parser = number::within(1..=600_000u64)
    )]
    pub timeout: u64,

    /// The module's product: {numbers}; without it the module is asked where that matters
    ///
    /// Which parameters there are, their names, and the names in programs depend on it. The module tells it by command
    /// 136, which is not sent if this is given. For LINK sim it says what the virtual module is, a TMCM-1140 without
    /// it.
    #[arg(long, value_name = "NAME", global = true, value_parser = product::named)]
    pub product: Option<Product>,

    /// Write a line for each telegram or frame on the link: time, direction, bytes and what they say
    ///
    /// The time is in seconds since the link was opened; of LINK sim it is the virtual time. A file that exists is
    /// emptied; - is standard output. Values have names and units as soon as it is known what the module is: by
    /// --product, or when it has told it.
    #[arg(long, value_name = "FILE", global = true, value_parser = LogFile::named)]
    pub log_telegrams: Option<LogFile>,

    /// The surroundings of the virtual module of LINK sim
    #[command(flatten)]
    pub surroundings: Surroundings,
}

impl Deref for Reach {
    type Target = LinkOptions;

    fn deref(&self) -> &LinkOptions {
        &self.link_options
    }
}

impl LinkOptions {
    /// Longest wait for each reply.
    pub fn patience(&self) -> Duration {
        Duration::from_millis(self.timeout)
    }
}

impl Reach {
    /// Opens the link to the module.
    ///
    /// # Errors
    /// The link cannot be opened, or the log of it cannot be written.
    pub fn open(&self) -> Result<Conversation, Failure> {
        let product = self.product.unwrap_or_default();
        let mut link = Link::open(&self.link, self.baud, self.patience(), product, &self.surroundings)?;
        if self.any_address {
            link.take_any();
        }
        if let Some(file) = &self.log_telegrams {
            let simulated = (self.link == LinkTarget::Simulated).then_some(product);
            let known = self.product.or(simulated);
            link.log_to(file, known)?;
        }
        Ok(Conversation::new(link.wire(), self.address, self.product.map(Identity::from), note))
    }
}

/// Tells the user something about a module.
pub(crate) fn note(text: &str) {
    // A closed standard error does not end the program.
    let _ = tell::line(&format!("tmcl: {text}"));
}
