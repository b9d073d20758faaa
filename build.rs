//! Linker arguments of the images. On the host there is nothing to do: there the images are stand-ins.

use std::env::var;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    if var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    // link.x, of cortex-m-rt, includes memory.x.
    if let Ok(root) = var("CARGO_MANIFEST_DIR") {
        println!("cargo:rustc-link-search={root}");
    }
    // Said here rather than as rustflags in .cargo/config.toml, so that RUSTFLAGS in the environment does not
    // undo it. --nmagic: sections need not begin at a multiple of 64 KiB. --icf=all: functions that are alike to the last
    // byte, such as those of generic code, are there once, which saves 1.2 KiB.
    for argument in ["--nmagic", "--icf=all", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    // A symbol that takes no memory tells the tools what is in an image: product and firmware.
    let images = [
        ("tmcm1140", "TMCM_1140_tmcl"),
        ("tmcm1140-canopen", "TMCM_1140_canopen"),
        ("tmcm6110", "TMCM_6110_tmcl"),
        ("tmcm3212", "TMCM_3212_tmcl"),
    ];
    for (image, marker) in images {
        println!("cargo:rustc-link-arg-bin={image}=--defsym=_firmware_{marker}=0");
    }
}
