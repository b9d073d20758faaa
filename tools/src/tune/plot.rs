//! The curves as an SVG image: a diagram for each speed, one below the other.

use std::fmt::Write;

use super::coolstep::{AtSpeed, Row};
use super::stallguard::Curve;
use super::stats::Stats;
use crate::svg::colour::{BLACK, BLUE, GREY, ORANGE, SHADE};
use crate::svg::{Area, Image, Scale, grouped, stroke};

const WIDTH: f64 = 800.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 24.0;
/// Height of the title, in pixels like all sizes here.
const TITLE: f64 = 44.0;
/// Height of the name above a diagram.
const NAME: f64 = 24.0;
const HEIGHT: f64 = 220.0;
const GAP: f64 = 16.0;
/// The largest load value, and the largest current.
const MOST_LOAD: f64 = 1023.0;
const MOST_CURRENT: f64 = 31.0;

/// A curve: its name, its colour, and its points with the spread of each.
struct Line {
    name: &'static str,
    colour: &'static str,
    points: Vec<(i32, Stats)>,
}

/// A diagram.
struct Diagram {
    name: String,
    /// The quantity on the axis from left to right.
    across: &'static str,
    most: f64,
    lines: [Line; 2],
    /// A range that is shaded.
    window: Option<(i32, i32)>,
}

/// The image of load values over the threshold; the thresholds that tell a stall are shaded.
pub(super) fn curves(title: &str, curves: &[Curve]) -> String {
    let diagrams = curves.iter().map(|curve| {
        let side = |side: fn(&super::stallguard::Row) -> Option<Stats>| {
            curve.rows.iter().filter_map(|(threshold, row)| Some((*threshold, side(row)?))).collect()
        };
        Diagram {
            name: format!("stallGuard2 value (parameter 206) at {}", curve.cruise.name),
            across: "threshold (parameter 174)",
            most: MOST_LOAD,
            lines: [
                Line { name: "without load", colour: BLUE, points: side(|row| row.free) },
                Line { name: "with load", colour: ORANGE, points: side(|row| row.loaded) },
            ],
            window: curve.window(),
        }
    });
    draw(title, &diagrams.collect::<Vec<_>>())
}

/// The image of currents over the lower threshold of coolStep.
pub(super) fn speeds_tried(title: &str, speeds_tried: &[AtSpeed]) -> String {
    let diagrams = speeds_tried.iter().map(|at_speed| {
        let side = |side: fn(&Row) -> Option<Stats>| {
            let rows = [(0, &at_speed.off)].into_iter();
            let rows = rows.chain(at_speed.starts.iter().filter_map(|row| Some((row.setting?.1, row))));
            rows.filter_map(|(value, row)| Some((value, side(row)?))).collect()
        };
        Diagram {
            name: format!("current in 1/32 (parameter 180) at {}", at_speed.cruise.name),
            across: "smartEnergy hysteresis start (parameter 172); 0 is coolStep off",
            most: MOST_CURRENT,
            lines: [
                Line { name: "without load", colour: BLUE, points: side(|row| Some(row.free.current)) },
                Line { name: "with load", colour: ORANGE, points: side(|row| Some(row.loaded?.current)) },
            ],
            window: None,
        }
    });
    draw(title, &diagrams.collect::<Vec<_>>())
}

fn draw(title: &str, diagrams: &[Diagram]) -> String {
    let each = NAME + HEIGHT + Image::BELOW + GAP;
    let mut image = Image::new(title, WIDTH, TITLE + each * diagrams.len() as f64);
    image.text(LEFT, 28.0, "font-size=\"16\"", title);
    for (number, diagram) in diagrams.iter().enumerate() {
        let top = TITLE + each * number as f64 + NAME;
        diagram.draw(&mut image, &Area { left: LEFT, top, width: WIDTH - LEFT - RIGHT, height: HEIGHT });
    }
    image.finish()
}

impl Diagram {
    fn draw(&self, image: &mut Image, area: &Area) {
        let all = || self.lines.iter().flat_map(|line| line.points.iter().map(|(x, _)| f64::from(*x)));
        let (first, last) = all().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
        let (across, up) = (Scale::over(first.min(last), last.max(first), 12), Scale::over(0.0, self.most, 4));
        let x = |value: f64| area.x(across.fraction(value));
        let y = |value: f64| area.y(up.fraction(value));
        if let Some((low, high)) = self.window {
            let (left, right) = (x(f64::from(low) - 0.5), x(f64::from(high) + 0.5));
            let shade = format!("M{left:.1} {:.1}H{right:.1}V{:.1}H{left:.1}z", area.top, area.bottom());
            image.path(&shade, &format!("fill=\"{SHADE}\""));
        }
        let ticks: Vec<(f64, String)> = across.ticks.iter().map(|tick| (x(*tick), grouped(*tick))).collect();
        image.frame(area, &ticks, self.across);
        image.levels(area, &up);
        image.text(area.left, area.top - 8.0, &format!("fill=\"{BLACK}\""), &self.name);
        for (number, line) in self.lines.iter().enumerate() {
            let (mut path, mut spreads) = (String::new(), String::new());
            for (value, stats) in &line.points {
                let at = x(f64::from(*value));
                let pen = if path.is_empty() { 'M' } else { 'L' };
                // Writing to a string cannot fail.
                let _ = write!(path, "{pen}{at:.1} {:.1}", y(f64::from(stats.mean())));
                let _ = write!(spreads, "M{at:.1} {:.1}V{:.1}", y(f64::from(stats.low)), y(f64::from(stats.high)));
            }
            image.path(&path, &stroke(line.colour, ""));
            image.path(&spreads, &format!("stroke=\"{}\" stroke-width=\"3\" opacity=\"0.5\"", line.colour));
            let attributes = format!("text-anchor=\"end\" fill=\"{}\"", line.colour);
            image.text(area.right() - 110.0 * number as f64, area.top - 8.0, &attributes, line.name);
        }
        image.path(&format!("M{:.1} {:.1}H{:.1}", area.left, area.bottom(), area.right()), &stroke(GREY, ""));
    }
}
