//! The TMCM-3212, whose motors run on TMC5160s: ramps of six points at the rotor, and goals that change on the way.
//! Other tests are about stalls and switches that the chip itself stops at, its encoder, its units, and a chip that has
//! been reset. Telegrams go in; telegrams and the rotor's trace come out.

mod changes;
mod encoder;
mod halts;
mod line;
mod lost;
mod profile;
mod ramps;
mod search;
mod units;

use common::Bench;
use tmcm_sim::Product;

/// A TMCM-3212 in the default world.
fn bench() -> Bench {
    Bench::of(Product::Tmcm3212)
}
