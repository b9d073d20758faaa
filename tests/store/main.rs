//! The EEPROM: what survives power-off and power cuts, and what becomes of memory that is damaged or somebody else's.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod eeprom;
mod eeprom_images;
mod pages;
mod power_cuts;
mod products;
mod program_power_cuts;
mod reset_power_cuts;
mod silent_eeprom;
mod storage;
