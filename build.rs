//! Linker arguments of the images. On the host there is nothing to do: there the images are stand-ins.

mod images;

use std::env::var;
use std::error::Error;
use std::fs;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    if var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return Ok(());
    }
    println!("cargo:rerun-if-changed=Cargo.toml");
    // link.x, of cortex-m-rt, includes memory.x.
    let root = var("CARGO_MANIFEST_DIR")?;
    println!("cargo:rustc-link-search={root}");
    // Said here rather than as rustflags in .cargo/config.toml, so that RUSTFLAGS in the environment does not undo it.
    // --nmagic: sections need not begin at a multiple of 64 KiB. --icf=all: functions that are alike to the last byte,
    // such as those of generic code, are there once, which saves 1.2 KiB.
    for argument in ["--nmagic", "--icf=all", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    // A symbol that takes no memory tells the tools what is in an image: product and firmware, such as
    // TMCM_1140_canopen. The name of the image has both, but for TMCL, the usual firmware.
    let manifest = fs::read_to_string(format!("{root}/Cargo.toml"))?;
    for (image, _) in images::images(&manifest) {
        let (product, firmware) = image.split_once('-').unwrap_or((image, "tmcl"));
        let product = product.replace("tmcm", "TMCM_");
        println!("cargo:rustc-link-arg-bin={image}=--defsym=_firmware_{product}_{firmware}=0");
    }
    Ok(())
}
