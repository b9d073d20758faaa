//! Stands in for the hardware of a TMCM-1140 class module.
//!
//! Nothing in here knows the firmware: the models are written from the datasheets, with their own constants, so that
//! firmware and model cannot share a mistake. A chip model is driven at its pins (select, byte, deselect) and by
//! [`clock::Nanos`] of virtual time. The [`board`] wires the chips to the [`world`] (motor, stage, switches, supply)
//! and hands out embedded-hal devices. With the feature `mcu` there is an emulated microcontroller as well, which runs
//! a flash image on the same board.

pub mod board;
pub mod chip;
pub mod clock;
pub mod control;
pub mod fault;
#[cfg(feature = "mcu")]
pub mod mcu;
mod random;
pub mod world;
