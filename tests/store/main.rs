//! The EEPROM: what survives power-off and power cuts, and what becomes of memory that is damaged or somebody else's.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;
mod eeprom;
mod eeprom_images;
mod pages;
mod power_cuts;
mod program_power_cuts;
mod reset_power_cuts;
mod silent_eeprom;
mod storage;
