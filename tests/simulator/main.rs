//! The virtual modules as programs around them see them: in whose hand time is, and what they leave out to be fast.
//! Other tests are about the traffic on their links, and about the library as somebody else's project has it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod examples;
mod outside;
mod skipping;
mod time;
mod wire;
