//! The CANopen node, by the frames that it takes and gives, in virtual time on the simulated board.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod cyclic;
mod driving;
mod emergencies;
mod exchange;
mod faults;
mod flood;
mod following;
mod homing;
mod inputs_outputs;
mod limits;
mod lost_settings;
mod mapping;
mod master;
mod meanwhile;
mod moves;
mod network;
mod number;
mod parameters;
mod pdos;
mod power_cuts;
mod random_drive;
mod random_frames;
mod regained;
mod rig;
mod saving;
mod sdo;
mod states;
mod table;
mod three_nodes;
mod tunnel;
mod units;
mod velocities;
