//! The colours of images: those of lines can be told apart by people with colour-blindness (Okabe and Ito).

pub(crate) const BLUE: &str = "#0072b2";
pub(crate) const ORANGE: &str = "#d55e00";
pub(crate) const GREEN: &str = "#009e73";
pub(crate) const PURPLE: &str = "#aa4499";
pub(crate) const BLACK: &str = "#222";
/// Of text that is less important.
pub(crate) const GREY: &str = "#666";
/// Of an area behind curves.
pub(crate) const SHADE: &str = "#eef1f4";
/// Of grid lines.
pub(crate) const GRID: &str = "#d9dde1";
