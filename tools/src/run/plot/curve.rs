//! A channel over time as an SVG path. Where there are more slices than pixels, a pixel shows the lowest and the
//! highest value of its slices.

use std::fmt::Write;

use crate::run::recording::{Channel, Range, Recording, joined};
use crate::svg::{Area, Scale};

/// A column of the image, as wide as a pixel or a slice, whichever is wider: its X coordinate and the range of its
/// values.
type Column = (f64, Range);

/// The columns of a channel.
pub(super) fn columns(recording: &Recording, channel: Channel, area: &Area) -> Vec<Column> {
    let count = recording.len().max(1);
    let width = area.width / count as f64;
    let mut columns: Vec<Column> = Vec::new();
    for (index, slice) in recording.ranges(channel).enumerate() {
        let x = area.left + index as f64 * width;
        match columns.last_mut() {
            Some((left, range)) if x < *left + 1.0 => *range = joined(*range, slice),
            _ => columns.push((x, slice)),
        }
    }
    columns
}

/// The SVG path of a line through the values. Each value is held until the next one, so that a jump is drawn as a
/// vertical line at its time.
pub(super) fn path(recording: &Recording, channel: Channel, area: &Area, scale: &Scale) -> String {
    let mut path = String::new();
    // The position of the pen: the X coordinate up to which the line is drawn, and its present height.
    let mut pen: Option<(f64, f64)> = None;
    for (x, range) in columns(recording, channel, area) {
        let Some((low, high)) = range else {
            end(&mut path, pen.take(), x);
            continue;
        };
        let [low, high] = [low, high].map(|value| area.y(scale.fraction(value.into())));
        // Writing to a string cannot fail.
        match pen {
            None => {
                let _ = write!(path, "M{x:.1} {low:.1}");
                if (low - high).abs() > 0.05 {
                    let _ = write!(path, "V{high:.1}");
                }
                pen = Some((x, high));
            }
            Some((_, y)) if (y - low).abs() < 0.05 && (y - high).abs() < 0.05 => {}
            Some((_, y)) => {
                // The line first goes to the nearer end of the range and then crosses the range.
                let (near, far) = if (y - low).abs() < (y - high).abs() { (low, high) } else { (high, low) };
                let _ = write!(path, "H{x:.1}V{near:.1}");
                if (far - near).abs() > 0.05 {
                    let _ = write!(path, "V{far:.1}");
                }
                pen = Some((x, far));
            }
        }
    }
    end(&mut path, pen, area.right());
    path
}

fn end(path: &mut String, pen: Option<(f64, f64)>, x: f64) {
    if pen.is_some() {
        // Writing to a string cannot fail.
        let _ = write!(path, "H{x:.1}");
    }
}

/// The SVG paths of boxes over the columns in which a channel is 1 all the time (first path) or part of the time
/// (second).
pub(super) fn bars(recording: &Recording, channel: Channel, area: &Area) -> [String; 2] {
    let mut paths = [String::new(), String::new()];
    let columns = columns(recording, channel, area);
    let mut runs: Vec<(f64, usize)> = Vec::new();
    const OFF: usize = 2;
    for (x, range) in columns {
        let kind = match range {
            Some((1.., _)) => 0,
            Some((_, 1..)) => 1,
            _ => OFF,
        };
        if runs.last().is_none_or(|(_, last)| *last != kind) {
            runs.push((x, kind));
        }
    }
    let ends = runs.iter().skip(1).map(|(x, _)| *x).chain([area.right()]).collect::<Vec<_>>();
    for ((x, kind), to) in runs.iter().zip(ends) {
        if let Some(path) = paths.get_mut(*kind) {
            let (width, height) = (to - x, area.height);
            // Writing to a string cannot fail.
            let _ = write!(path, "M{x:.1} {:.1}h{width:.1}v{height:.1}h-{width:.1}z", area.top);
        }
    }
    paths
}
