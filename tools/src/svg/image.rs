//! The image: text and paths, and the frame of a diagram made of them.

use std::fmt::Write;

use super::Area;
use super::colour::{BLACK, GREY, GRID};
use super::scale::{Scale, grouped};
use super::text::escaped;

/// An image that is being drawn. What comes later is on top.
#[derive(Clone, Debug)]
pub struct Image {
    svg: String,
}

impl Image {
    /// The height that the numbers and the name of [`frame`](Self::frame) take below a diagram.
    pub const BELOW: f64 = 44.0;

    /// A white image with a title, which browsers show as the name of its window.
    pub fn new(title: &str, width: f64, height: f64) -> Self {
        let title = escaped(title);
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
             font-family=\"DejaVu Sans, Verdana, Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"{BLACK}\">\n\
             <title>{title}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
        );
        Image { svg }
    }

    /// Writes a text with its base line at `y`.
    pub fn text(&mut self, x: f64, y: f64, attributes: &str, text: &str) {
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(self.svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" {attributes}>{}</text>", escaped(text));
    }

    /// Draws a path, unless it is empty.
    pub fn path(&mut self, path: &str, attributes: &str) {
        if !path.is_empty() {
            let _ = writeln!(self.svg, "<path d=\"{path}\" {attributes}/>");
        }
    }

    /// Draws vertical grid lines at these X coordinates, a number below each, and below them the name of the axis.
    pub fn frame(&mut self, area: &Area, ticks: &[(f64, String)], name: &str) {
        let mut lines = String::new();
        for (x, text) in ticks {
            let _ = write!(lines, "M{x:.1} {:.1}V{:.1}", area.top, area.bottom() + 5.0);
            self.text(*x, area.bottom() + 19.0, "text-anchor=\"middle\"", text);
        }
        self.path(&lines, &format!("stroke=\"{GRID}\" fill=\"none\""));
        let attributes = format!("text-anchor=\"middle\" fill=\"{GREY}\"");
        self.text(area.x(0.5), area.bottom() + 36.0, &attributes, name);
    }

    /// Draws horizontal grid lines at the ticks of a scale, and its numbers on the left.
    pub fn levels(&mut self, area: &Area, scale: &Scale) {
        let mut lines = String::new();
        for tick in &scale.ticks {
            let y = area.y(scale.fraction(*tick));
            let _ = write!(lines, "M{:.1} {y:.1}H{:.1}", area.left, area.right());
            self.text(area.left - 8.0, y + 4.0, "text-anchor=\"end\"", &grouped(*tick));
        }
        self.path(&lines, &format!("stroke=\"{GRID}\" fill=\"none\""));
    }

    /// The image as the text of a file.
    pub fn finish(self) -> String {
        self.svg + "</svg>\n"
    }
}

/// The attributes of a curve; `dash` is empty for a line without gaps.
pub fn stroke(colour: &str, dash: &str) -> String {
    let dash = if dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dash}\"") };
    format!("stroke=\"{colour}\" stroke-width=\"1.5\" stroke-linejoin=\"round\" fill=\"none\"{dash}")
}
