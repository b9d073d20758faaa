//! SVG images of curves, which web browsers show: the image itself with text, paths and the frame of a diagram, scales
//! with round numbers, and the colours. All sizes are in pixels.

mod area;
pub(crate) mod colour;
mod image;
mod scale;
mod text;

pub(crate) use area::Area;
pub(crate) use image::{Image, stroke};
pub(crate) use scale::{Scale, grouped, round_step};
pub(crate) use text::{CHARACTER, shortened};
