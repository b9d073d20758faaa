//! The image for the TMCM-1140. `cargo fw` builds it, `cargo fw-run` brings it to a module.

#![cfg_attr(target_os = "none", no_std, no_main)]
#![deny(unsafe_code)]

tmcm::image! {
    firmware: tmcm::board::Tmcl<tmcm::product::Tmcm1140>,
    build: "cargo fw",
    simulate: "cargo sim",
}
