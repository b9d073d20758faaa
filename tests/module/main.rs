//! The module as its hosts see it: telegrams, frames and text on its links, and the commands of direct mode.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod ascii;
mod bad_input;
mod can;
mod commands;
mod doors;
mod events;
mod frozen;
mod hosts;
mod inputs_outputs;
mod restart;
mod rs485;
mod telegrams;
mod tmcm3212;
mod user_functions;
