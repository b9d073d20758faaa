//! The boards: one file each, with every pin. What the boards have in common is in `parts`, `signals`, and one file for
//! each kind of motion chips.

pub(super) mod parts;
mod signals;
#[cfg(any(feature = "tmcm1140", feature = "tmcm6110"))]
mod tmc429_tmc262;
#[cfg(feature = "tmcm3212")]
mod tmc5160;
#[cfg(feature = "tmcm1140")]
pub(super) mod tmcm1140;
#[cfg(feature = "tmcm3212")]
pub(super) mod tmcm3212;
#[cfg(feature = "tmcm6110")]
pub(super) mod tmcm6110;

// The board of this image. Another one is another file, and another line here and above.
#[cfg(feature = "tmcm1140")]
pub(super) use tmcm1140 as chosen;
#[cfg(all(feature = "tmcm3212", not(any(feature = "tmcm1140", feature = "tmcm6110"))))]
pub(super) use tmcm3212 as chosen;
#[cfg(all(feature = "tmcm6110", not(feature = "tmcm1140")))]
pub(super) use tmcm6110 as chosen;

#[cfg(any(
    all(feature = "tmcm1140", feature = "tmcm6110"),
    all(feature = "tmcm1140", feature = "tmcm3212"),
    all(feature = "tmcm6110", feature = "tmcm3212")
))]
compile_error!("an image is for one board: give the feature of that one alone");
