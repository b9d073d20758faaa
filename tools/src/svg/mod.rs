//! SVG images of curves, which web browsers show: the image itself with text, paths and the frame of a diagram, scales
//! with round numbers, and the colours. All sizes are in pixels.

mod area;
pub mod colour;
mod image;
mod scale;
mod text;

pub use area::Area;
pub use image::{Image, stroke};
pub use scale::{Scale, grouped, round_step};
pub use text::{CHARACTER, shortened};
