//! The flash image: its size, what can panic in it, and what it does on the emulated microcontroller, links, faults and
//! restarts included. The first test that needs the image builds it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod boot;
mod faults;
mod firmware_faults;
mod links;
mod measure;
mod node;
mod node_faults;
mod node_number;
mod node_soak;
mod own_firmware;
mod panic_free;
mod pins;
mod replies;
mod restart;
mod sisters;
mod six_axes;
mod size;
mod steps;
mod straight_line;
mod three_axes;
mod timing;
mod usb;
mod words;
