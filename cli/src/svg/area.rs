//! The part of an image that a diagram fills.

/// A rectangle of the image that a curve or axis fills, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Area {
    /// X coordinate of the left edge.
    pub(crate) left: f64,
    /// Y coordinate of the upper edge.
    pub(crate) top: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Area {
    /// Y coordinate of the lower edge.
    pub(crate) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// X coordinate of the right edge.
    pub(crate) fn right(&self) -> f64 {
        self.left + self.width
    }

    /// X coordinate at a fraction of the width, from 0.0 at the left edge to 1.0 at the right one.
    pub(crate) fn x(&self, fraction: f64) -> f64 {
        self.left + fraction * self.width
    }

    /// Y coordinate at a fraction of the height, from 0.0 at the lower edge to 1.0 at the upper one.
    pub(crate) fn y(&self, fraction: f64) -> f64 {
        self.bottom() - fraction * self.height
    }
}
