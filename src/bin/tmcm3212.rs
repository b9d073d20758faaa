//! The image for the TMCM-3212, on a board of this project. `cargo fw-3212` builds it, `cargo fw-3212-run` brings it
//! there.

#![cfg_attr(target_os = "none", no_std, no_main)]
#![deny(unsafe_code)]

tmcm::image! {
    firmware: tmcm::board::Tmcl<tmcm::product::Tmcm3212>,
    build: "cargo fw-3212",
    simulate: "cargo sim --product 3212",
}
