//! Measures what stallGuard2 and coolStep make of a motor, and proposes their settings.
//!
//! The motor goes to and fro at constant speed, without and with load, while one setting after the other is tried. In
//! the end it is brought back to where it was, and all settings are as before.
//!
//! * `order` - what is to be measured
//! * `bench` - the axis, and what is put back in the end
//! * `track`, `plan` - where the motor goes, at which speeds, and for how long
//! * `drive`, `watch`, `stats` - samples at constant speed
//! * `brake` - what loads the motor
//! * `stallguard`, `coolstep` - the two measurements, and what is proposed
//! * `measurement` - what both measurements have in common
//! * `found`, `table`, `proposal`, `plot` - what is shown

mod bench;
mod brake;
mod coolstep;
mod drive;
mod found;
mod measurement;
mod order;
mod plan;
mod plot;
mod proposal;
mod stallguard;
mod stats;
mod table;
mod track;
mod tuning;
mod watch;

pub use brake::{Brake, World, careful, in_words};
pub use drive::Drive;
pub use found::Found;
pub use order::{Order, Way, What};
pub use proposal::{Proposal, wrapped};
pub use tuning::Tuning;
