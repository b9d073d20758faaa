//! The image for the TMCM-1140 as a node of CANopen. `cargo fw-canopen` builds it, `cargo fw-canopen-run` brings it to
//! a module.

#![cfg_attr(target_os = "none", no_std, no_main)]
#![deny(unsafe_code)]

tmcm::image! {
    firmware: tmcm::board::Canopen<tmcm::product::Tmcm1140Canopen>,
    build: "cargo fw-canopen",
    simulate: "cargo sim --firmware canopen",
}
