//! The colours of images: those of lines can be told apart by people with colour-blindness (Okabe and Ito).

/// The first line of a diagram.
pub const BLUE: &str = "#0072b2";
/// The second line of a diagram.
pub const ORANGE: &str = "#d55e00";
/// The third line of a diagram.
pub const GREEN: &str = "#009e73";
/// The fourth line of a diagram.
pub const PURPLE: &str = "#aa4499";
/// Text and the frame of a diagram.
pub const BLACK: &str = "#222";
/// Of text that is less important.
pub const GREY: &str = "#666";
/// Of an area behind curves.
pub const SHADE: &str = "#eef1f4";
/// Of grid lines.
pub const GRID: &str = "#d9dde1";
