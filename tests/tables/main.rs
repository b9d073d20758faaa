//! The parameters, one by one and as a whole: ranges, defaults and effects, and the page of `docs` that lists them.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;
mod live_values;
mod parameter_docs;
mod parameters;
mod rules;
