//! The CANopen firmware (manual 001 of the CANopen firmware, V3.20): a [device](crate::device::Device) with one axis,
//! the communication of CiA 301, and the drive of CiA 402.
//!
//! Frames come in by [`Node::receive`] and go out by [`Node::next_frame`]; time and inputs come in by [`Node::poll`].
//! After each `receive` and `poll` the caller takes frames until there is none: so a PDO that a frame has caused leaves
//! before the reply to a later one. The objects are rows of one table ([`ROWS`]), in which stands what reading and
//! writing each of them does; what is special about one stands in `read.rs` and `write.rs`.
//!
//! Each part owns what it notes, and is lent what it needs of the others for a call. `cia301` has the services, `drive`
//! the drive, `settings.rs` the values of objects, `live.rs` what was measured. `errors.rs` has what is wrong,
//! `lost.rs` what the EEPROM has lost, `address.rs` who the node is, `tunnel.rs` TMCL mode. `node.rs` puts them
//! together, and `frames.rs` has the frames that come in and go out.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod address;
mod bus;
mod cia301;
mod drive;
mod entry;
mod errors;
mod frames;
mod live;
mod lost;
mod node;
mod object;
mod parts;
mod read;
mod row;
mod settings;
mod store;
mod switches;
mod tunnel;
pub mod usb;
mod values;
mod write;

pub use address::Address;
pub use bus::{Bus, BusState, Filter, Filters, Overflow};
pub use cia301::abort::Abort;
pub use cia301::nmt::Nmt;
pub use cia301::record::{Direction, Field};
pub use cia301::{Access, Mapping};
pub use entry::Entry;
pub use errors::{Emergency, Reaction};
pub use node::Node;
pub use object::{Computed, Object, ROWS, Row, Special, VERSION, Writing};
pub use row::{ANY, Form, Initial, Kind, Storage, Type, When};

pub(crate) use store::{DEFAULTS, UNUSED};

/// Identifier of the commands of the master.
pub const COMMAND: u16 = 0x000;
/// Identifier of SDO replies, without the node ID.
pub const SDO_REPLY: u16 = 0x580;
/// Identifier of SDO requests, without the node ID.
pub const SDO_REQUEST: u16 = 0x600;
/// Identifier of boot-up, heartbeat and guarding, without the node ID.
pub const CONTROL: u16 = 0x700;
