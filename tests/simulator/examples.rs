//! The example of docs/ci.md runs to its end; `ten_lines.rs` is in the documentation of the library, whose tests run
//! it.

#[path = "../../sim/examples/homing.rs"]
mod homing;

#[test]
fn the_example_for_ci_passes() {
    homing::main().unwrap();
}
