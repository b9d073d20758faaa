//! Builds the page of the studio, which is the package `tmcl-studio` compiled for browsers and the files of
//! `studio/page/`, and serves it to the browsers of this computer. It needs nothing but Rust.
//!
//! [`make::page`] makes the folder, of the same bytes wherever the checkout is. [`server::Server`] has a copy of the
//! files in memory and knows of no others, so that no request reaches anything else. The [`answer::Answer`] to a
//! [`request::Request`] is told without a connection.

#![deny(unsafe_code)]

pub mod answer;
pub mod compiler;
pub mod example;
pub mod files;
pub mod make;
pub mod maker;
pub mod opener;
pub mod policy;
pub mod request;
pub mod server;
