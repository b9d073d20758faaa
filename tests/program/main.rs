//! Programs in the module: their commands, control, memory, interrupts and waits, and the interpreter that runs them.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod adversities;
mod commands;
#[path = "../common/mod.rs"]
mod common;
mod control;
mod ends;
mod events;
mod examples;
mod interpreters;
mod interrupt_rules;
mod interrupts;
mod memory;
mod programs;
mod random_programs;
mod speed;
mod waits;
