//! The TMCM-3212 through its front door: what its manual shows, and in what it differs from its sisters besides its
//! motion controllers.

mod driver;
mod faults;
mod interrupts;
mod lacks;
mod manual;
mod moves;
mod ports;
mod registers;

use common::Bench;
use tmcm_sim::Product;

/// A TMCM-3212 in the default world, with a fresh EEPROM.
fn bench() -> Bench {
    Bench::of(Product::Tmcm3212)
}

/// A TMCM-3212 in a world in which every axis has surroundings of its own: a table of the world file.
fn in_world(axis: impl Fn(u8) -> String) -> Bench {
    let world: String = (0..3).map(|number| format!("[[axis]]\n{}\n", axis(number))).collect();
    Bench::of_in_world(Product::Tmcm3212, &world)
}
