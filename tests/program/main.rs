//! Programs in the module: their commands, control, memory, interrupts and waits, and the interpreter that runs them.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod adversities;
mod bursts;
mod commands;
mod control;
mod download;
mod ends;
mod events;
mod flow;
mod handlers;
mod interpreters;
mod interrupt_context;
mod interrupt_rules;
mod interrupts;
mod memory;
mod random_programs;
mod registers;
mod size;
mod speed;
mod waits;
