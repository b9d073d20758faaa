//! Arguments for the linker: the scripts that it is to follow, and that sections need not begin at a multiple of 64
//! KiB. The crates on which the firmware depends bring the scripts, `memory.x` among them.

fn main() {
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
