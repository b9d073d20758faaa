//! Tests that take both the firmware and the toolchain in one process: programs from their sources, scenarios from
//! their files, and the EDS. The tests of the firmware alone are those of the workspace's own package, which do not
//! wait for this one.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod examples;
mod object_docs;
mod object_notes;
mod scenarios;
mod skipping;
