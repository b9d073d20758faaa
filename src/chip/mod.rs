//! One driver per part, generic over embedded-hal: registers and datagrams, in the units of the chips, and nothing
//! about axes or TMCL. How an axis uses them is in [`crate::motion`]; the EEPROM is used by [`crate::store`].

pub mod at25;
pub mod encoder;
pub mod error;
pub mod tmc262;
pub mod tmc429;
pub mod tmc5160;
