//! Virtual modules in real time, or in time that a host controls, with links that host software opens: what `tmcl sim`
//! does.
//!
//! * [`options`] - its command line
//! * [`run()`] - runs the modules until a signal comes
//! * [`console`] - the program that runs them, as far as something is printed
//! * [`failure`] - why they cannot run
//! * [`eeprom`], [`worlds`], [`image`] - the files that options name
//! * [`files`] - files that are read up to a size, and take the place of others
//! * [`links`] - the USB link of module 1, the buses and the control port; [`pty`], [`tcp`], [`slcan`], [`endpoint`]
//!   and [`stream`] are what they are made of
//! * [`control`] - the control port, whose desk is that of [`tmcl_tools::desk`]

pub mod console;
pub mod control;
pub mod eeprom;
mod ending;
pub mod endpoint;
mod factory;
pub mod failure;
pub mod files;
mod greeting;
mod held;
pub mod image;
mod introduce;
pub mod links;
pub mod options;
pub mod pty;
mod ready;
mod run;
mod simulator;
pub mod slcan;
pub mod stream;
pub mod tcp;
pub mod worlds;

pub use run::run;

/// Seed of the modules' random numbers; the world's random numbers have a seed in the world file.
const SEED: u32 = 1;
