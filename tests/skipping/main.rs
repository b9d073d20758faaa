//! A virtual module that leaves out polls of its firmware is the same as one that polls each millisecond. This holds
//! for what it replies and when, what its chips get and what its motors do.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;
mod pair;
mod programs;
mod ratios;
mod sessions;
mod turns;
