//! Open firmware for TMCM-1140 class stepper motor modules: TMC429 motion controller, TMC262 driver,
//! AT25128 EEPROM, driven by TMCL (Trinamic Motion Control Language).
//!
//! The modules in dependency order; each knows only those above it (`tests/layers.rs` keeps it so):
//!
//! * [`units`] - microseconds, internal velocity, current scale
//! * [`can`] - a frame of the CAN bus
//! * [`tmcl`] - the language: instruction table, commands, replies, the binary, ASCII and CAN codecs, text
//! * [`param`] - the parameter tables
//! * [`chip`] - one driver per part, on embedded-hal
//! * [`motion`] - what an axis does
//! * [`store`] - what survives power-off
//! * [`vm`] - TMCL programs: registers, program counter, interrupts
//! * [`module`] - the device: `execute(command)`, `poll(now)`
//! * `board` - the microcontroller, compiled for bare metal only, and only with the feature of that name
//!
//! The core has no clock, no executor and no heap: time is passed in, a call returns what to do next.

#![cfg_attr(not(test), no_std)]
#![deny(unsafe_code)]

pub mod units;

pub mod can;

pub mod tmcl;

pub mod param;

pub mod chip;

pub mod motion;

pub mod store;

pub mod vm;

pub mod module;

#[cfg(all(target_os = "none", feature = "board"))]
#[allow(unsafe_code)]
pub mod board;
