//! `tmcl params`: a module's settings one by one, as a table, and in files of TMCL commands.

mod diff;
mod one;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use diff::Side;
use tmcl_link::EndSignal;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::params::{Assignment, Saved, Settings, Wanted, Where, check, list, restore, save};
use tmcm::param::GlobalParameter;

use crate::failure::Failure;
use crate::files::{name, read_named};
use crate::link::LinkTarget;
use crate::output::Output;
use crate::progress;
use crate::reach::{LinkOptions, Reach};
use crate::tell;

/// Read and change a module's settings, save them in a file, restore and compare them
///
/// A file holds one TMCL command a line, such as `SAP 4, 0, 1000 // maximum positioning speed`, and may be edited.
/// Every line can be sent by hand with `tmcl send`, lines can be left out, and what follows // is a comment. Parameters
/// are named as in programs (`tmcl asm --names`), or by their numbers.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module: a serial device, tcp:HOST:PORT, slcan:DEVICE, or sim; all but `diff` need it
    #[arg(value_name = "LINK", value_parser = LinkTarget::parse)]
    pub link: Option<LinkTarget>,

    /// How it is talked to
    #[command(flatten)]
    pub link_options: LinkOptions,

    /// The action
    #[command(subcommand)]
    pub action: Action,
}

/// An action on the settings.
#[derive(Subcommand, Debug)]
pub enum Action {
    /// Read parameters and print them as lines of a file of settings
    Get {
        /// The parameters: names as in programs, or numbers, also as an expression
        #[arg(value_name = "NAME", required = true)]
        names: Vec<String>,

        /// The axis or the bank of the parameters
        #[command(flatten)]
        place: Place,

        /// Print the values alone, one a line
        #[arg(long)]
        value: bool,
    },
    /// Write parameters
    ///
    /// A value may be an expression with the names of `tmcl asm --names`. Nothing is written unless all of them make
    /// sense; the exit code is 1 if the module refuses one.
    Set {
        /// The parameters with their values, such as APMaxCurrent=100 or 4=3*500
        #[arg(value_name = "NAME=VALUE", required = true, value_parser = Assignment::parse)]
        assignments: Vec<Assignment>,

        /// The axis or the bank of the parameters
        #[command(flatten)]
        place: Place,

        /// Also store them in the module's EEPROM; global parameters of bank 0 always are
        #[arg(long)]
        store: bool,
    },
    /// Print all parameters with their values, units, ranges and defaults
    ///
    /// A star stands behind a value that can be kept in the EEPROM and is not the default. Parameter 207 is not read,
    /// because reading clears it.
    List {
        /// Only parameters with all these words in their names
        #[arg(value_name = "WORD")]
        words: Vec<String>,

        /// The axis or the bank of the parameters; all of them without it
        #[command(flatten)]
        place: Place,
    },
    /// Compare the settings of two files or modules
    ///
    /// Prints what is different, lines of A behind a minus and those of B behind a plus. Of a module only those
    /// settings are compared that the file has; of two modules all that `save` saves. The exit code is 0 if nothing is
    /// different, and 1 otherwise.
    Diff {
        /// A file of settings, - for standard input, or a LINK
        #[arg(value_name = "A", value_parser = Side::parse)]
        first: Side,

        /// The file or LINK that A is compared with
        #[arg(value_name = "B", value_parser = Side::parse)]
        second: Side,
    },
    /// Read all settings of a module and write them to a file
    ///
    /// Saved are, as they are at this moment, the axis parameters that can be stored, of every axis, and the global
    /// parameters that are stored (bank 0). So are the user variables that can be stored (0 to 55 of bank 2), and the
    /// coordinates 1 to 20 of every axis. Not saved are live values such as positions and speeds, and coordinate 0,
    /// which a module forgets as it does its position. Nor is global parameter 81, because taking code protection away
    /// erases the program.
    Save {
        /// The file to write, - for standard output; one that exists is replaced
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
    /// Write the settings of a file to a module
    ///
    /// A file that `save` has written is restored to the same product only; its first line names it. Only what differs
    /// is written. Global parameters of bank 0 are stored at once by the module; the others last
    /// until power is switched off, unless --store is given. All motors have to stand still.
    Restore {
        /// The file to read, - for standard input
        #[arg(value_name = "FILE")]
        file: PathBuf,

        /// Also store axis parameters, user variables and coordinates in the module's EEPROM
        #[arg(long)]
        store: bool,

        /// Also restore the settings of the interfaces: addresses, identifiers, bit rates, ASCII mode
        ///
        /// Global parameters 65, 66, 67, 69, 70, 71, 75, 76, 83 and 87. With those of another module on the same bus
        /// two modules would have the same address, and with another bit rate this one is no longer heard.
        #[arg(long)]
        interface: bool,
    },
}

/// Where parameters are that are named by numbers, or that every axis has.
#[derive(Args, Clone, Copy, Debug)]
pub struct Place {
    /// Parameters of this axis; without it those of axis 0
    #[arg(long, value_name = "N")]
    pub axis: Option<u8>,

    /// Global parameters of this bank: 0 settings of the module, 2 user variables, 3 interrupts
    ///
    /// The names of global parameters (GP...) and interrupts (TI_...) tell their bank; numbers do not.
    #[arg(long, value_name = "N", conflicts_with = "axis")]
    pub bank: Option<u8>,
}

impl From<Place> for Where {
    fn from(Place { axis, bank }: Place) -> Self {
        Where { axis, bank }
    }
}

const EXAMPLES: &str = "\
Examples:
  tmcl params sim get APMaxCurrent GPSerialAddress      two settings by name
  tmcl params sim set APMaxPositioningSpeed=3*500       a new value, until power is switched off
  tmcl params sim list current                          all about currents
  tmcl params sim list --axis 0                         all of axis 0
  tmcl params sim save axis.tmcl                        all settings into a file
  tmcl params diff axis.tmcl sim                        what is different there
  tmcl params /dev/ttyACM0 restore axis.tmcl --store    into another module, to stay there
  tmcl params /dev/ttyUSB0 --address 3 save three.tmcl  of module 3 on an RS485 bus
The exit code is 1 if the module refused a setting.";

/// Does what is to be done with the settings.
pub fn run(options: &Options) -> Result<(), Failure> {
    let reach = || match &options.link {
        Some(link) => Ok(Reach { link: link.clone(), link_options: options.link_options.clone() }),
        None => Err(Failure::Arguments("which module? Give its LINK before what to do: tmcl params LINK list".into())),
    };
    let open = || reach()?.open();
    let open_at = |place: Place| {
        let mut module = open()?;
        match place.axis.map(|axis| module.no_such_axis(axis)).transpose()?.flatten() {
            Some(message) => Err(Failure::Failed(message)),
            None => Ok(module),
        }
    };
    match &options.action {
        Action::Get { names, place, value } => one::get(&mut open_at(*place)?, names, (*place).into(), *value),
        Action::Set { assignments, place, store } => {
            one::set(&mut open_at(*place)?, assignments, (*place).into(), *store)
        }
        Action::List { words, place } => show(&mut open_at(*place)?, words, (*place).into()),
        Action::Diff { .. } if options.link.is_some() => {
            Err(Failure::Arguments("diff has two sides and no other LINK: tmcl params diff A B".into()))
        }
        Action::Diff { first, second } => diff::diff(first, second, &options.link_options),
        Action::Save { file } => save_in(&mut open()?, file),
        Action::Restore { file, store, interface } => {
            let address = match &options.link {
                Some(LinkTarget::Slcan(_)) => GlobalParameter::CanId,
                _ => GlobalParameter::SerialAddress,
            };
            let reach = reach()?;
            let settings = read(file)?;
            let mut module = reach.open()?;
            check(&mut module, &settings, &file.display().to_string())?;
            // Until here a signal ends the program by itself.
            let (signal, wanted) = (EndSignal::watch()?, Wanted { store: *store, interface: *interface, address });
            let restored = restore(&mut module, settings.list, wanted, &signal, &mut progress::bar())?;
            write!(tell::out(), "{}", restored.text())?;
            if restored.refused.is_empty() { Ok(()) } else { Err(Failure::Reported) }
        }
    }
}

/// Prints tables of a module's parameters.
fn show(module: &mut Conversation, words: &[String], at: Where) -> Result<(), Failure> {
    let (mut out, mut told) = (tell::out(), Ok(()));
    list(module, words, at, &EndSignal::watch()?, &mut |table| {
        told = write!(out, "{table}");
        told.is_ok()
    })?;
    Ok(told?)
}

/// Reads a file of settings, or standard input.
fn read(path: &Path) -> Result<Settings, Failure> {
    let shown = name(path);
    let bytes = read_named(path)?;
    let text = String::from_utf8(bytes).map_err(|_| Failure::Failed(format!("{shown} is no text (UTF-8)")))?;
    Settings::parse(&shown, &text).map_err(Failure::Failed)
}

/// Saves a module's settings in a file, or prints them. The file is written only after all settings have been read.
fn save_in(module: &mut Conversation, path: &Path) -> Result<(), Failure> {
    let signal = EndSignal::watch()?;
    let mut output = Output::open("", path)?;
    let Saved { text, saved, missing } = save(module, &signal, &mut progress::bar())?;
    let missing = match missing {
        0 => String::new(),
        missing => format!("; {missing} more are unknown to this module"),
    };
    output.write_all(text.as_bytes())?;
    let name = (!output.is_standard()).then(|| output.name().to_owned());
    output.finish()?;
    match name {
        Some(name) => Ok(writeln!(tell::out(), "{saved} settings saved in {name}{missing}")?),
        None => {
            // A closed standard error does not end the program.
            let _ = writeln!(tell::err(), "tmcl: {saved} settings{missing}");
            Ok(())
        }
    }
}
