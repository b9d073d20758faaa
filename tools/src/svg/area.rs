//! The part of an image that a diagram fills.

/// A rectangle of the image that a curve or axis fills, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// X coordinate of the left edge.
    pub left: f64,
    /// Y coordinate of the upper edge.
    pub top: f64,
    /// From left to right.
    pub width: f64,
    /// From top to bottom.
    pub height: f64,
}

impl Area {
    /// Y coordinate of the lower edge.
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// X coordinate of the right edge.
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// X coordinate at a fraction of the width, from 0.0 at the left edge to 1.0 at the right one.
    pub fn x(&self, fraction: f64) -> f64 {
        self.left + fraction * self.width
    }

    /// Y coordinate at a fraction of the height, from 0.0 at the lower edge to 1.0 at the upper one.
    pub fn y(&self, fraction: f64) -> f64 {
        self.bottom() - fraction * self.height
    }
}
