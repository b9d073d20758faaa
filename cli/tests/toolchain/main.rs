//! Tests that take both the firmware and the toolchain in one process: programs from their sources, scenarios from
//! their files, and the EDS. The tests of the firmware alone are those of the workspace's own package, which do not
//! wait for this one.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../../../tests/common/mod.rs"]
mod common;
mod examples;
mod object_docs;
mod object_notes;
#[path = "../../../tests/tables/pages.rs"]
mod pages;
#[path = "../../../tests/skipping/pair.rs"]
#[expect(dead_code, reason = "scenarios have hosts of their own")]
mod pair;
mod scenarios;
mod skipping;
