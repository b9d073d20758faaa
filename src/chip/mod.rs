//! The drivers, one per part, generic over embedded-hal: registers and datagrams, in the units of the chips, and
//! nothing about axes or TMCL. How an axis uses them is in [`crate::motion`]; the EEPROM is used by [`crate::store`].

pub mod at25;
pub mod encoder;
pub mod error;
pub mod tmc262;
pub mod tmc429;
pub mod tmc5160;

/// How often a datagram of a motion controller or a driver is repeated at once if its answer is lost: a disturbance of
/// the bus is shorter. This holds where the datagram sets a register to a value, or reads one without any other effect.
/// The datagram itself may have arrived, so what would do something else when it comes twice is not repeated.
const REPEATS: u8 = 2;
