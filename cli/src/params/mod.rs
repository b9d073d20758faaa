//! `tmcl params`: saves a module's settings as a file of TMCL commands, and restores them.

mod file;
mod restore;
mod save;

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::conversation::{Conversation, Reach};
use crate::failure::Failure;

/// Save a module's settings in a file, and restore them
///
/// The file holds one TMCL command a line, such as `SAP 4, 0, 1000 // maximum positioning speed`, and may be edited:
/// every line can be sent by hand with `tmcl send`, lines can be left out, and what follows // is a comment.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// What to do
    #[command(subcommand)]
    pub action: Action,
}

/// What to do with the settings.
#[derive(Subcommand, Debug)]
pub enum Action {
    /// Read all settings of a module and write them to a file
    ///
    /// Saved are, as they are at this moment: the axis parameters that can be stored, of every axis; the global
    /// parameters that are stored (bank 0); the user variables that can be stored (0 to 55 of bank 2); the coordinates
    /// 1 to 20. Not saved are live values such as positions and speeds, and global parameter 81: taking code
    /// protection away erases the program.
    Save {
        /// The file to write; one that exists is replaced
        #[arg(value_name = "FILE")]
        file: PathBuf,
    },
    /// Write the settings of a file to a module
    ///
    /// A file that `save` has written is restored to the same product only; its first line names it. Only what differs
    /// is written. Global parameters of bank 0 are stored at once by the module; the others last
    /// until power is switched off, unless --store is given. All motors have to stand still.
    Restore {
        /// The file to read
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

const EXAMPLES: &str = "\
Examples:
  tmcl params /dev/ttyACM0 save axis.tmcl               all settings into a file
  tmcl params /dev/ttyACM0 restore axis.tmcl --store    into another module, to stay there
  tmcl params /dev/ttyUSB0 --address 3 save three.tmcl  of module 3 on an RS485 bus
The exit code is 1 if the module refused a setting.";

/// Saves or restores the settings.
pub fn run(options: &Options) -> Result<(), Failure> {
    match &options.action {
        Action::Save { file } => save::save(&mut Conversation::open(&options.reach)?, file),
        Action::Restore { file, store, interface } => {
            let settings = file::read(file)?;
            let mut module = Conversation::open(&options.reach)?;
            restore::check(&mut module, &settings, file)?;
            restore::restore(&mut module, &options.reach, settings.list, *store, *interface)
        }
    }
}
