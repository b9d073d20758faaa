//! The image for the TMCM-6110, on a board of this project. `cargo fw-6110` builds it, `cargo fw-6110-run` brings it
//! there.

#![cfg_attr(target_os = "none", no_std, no_main)]
#![deny(unsafe_code)]

tmcm::image! {
    firmware: tmcm::board::Tmcl<tmcm::product::Tmcm6110>,
    build: "cargo fw-6110",
    simulate: "cargo sim --product 6110",
}
