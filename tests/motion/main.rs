//! The motor and what moves, drives and supervises it: ramps, driver stage, encoders, the axis at the limits of its
//! rules, and heartbeats, supply and faults.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod axis;
mod driver;
mod encoders;
mod lost_answers;
mod moves;
mod ramps;
mod rotation_ends;
mod several_axes;
mod six_point;
mod soak;
mod supervision;
mod torque;
