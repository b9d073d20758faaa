//! The plot: panels over a common axis of time, as an SVG image.

mod curve;
mod scale;

use std::fmt::Write;

use hal_sim::clock::Nanos;

use curve::{Area, bars, path};
use scale::{Scale, TimeAxis, grouped};

use super::recording::{Channel, Mark, Quantity, Recording, joined};
use super::time;
use crate::product::speed_words;
use crate::program::Program;

const WIDTH: f64 = 1000.0;
const LEFT: f64 = 110.0;
const RIGHT: f64 = 24.0;
/// Height of the title, in pixels like all sizes here.
const TITLE: f64 = 58.0;
/// Height of the name above a panel.
const NAME: f64 = 20.0;
const GAP: f64 = 14.0;
const LANE: f64 = 20.0;
/// Height of the time axis.
const AXIS: f64 = 44.0;

/// Colours that people with colour-blindness can tell apart (Okabe and Ito).
const BLUE: &str = "#0072b2";
const ORANGE: &str = "#d55e00";
const GREEN: &str = "#009e73";
const PURPLE: &str = "#aa4499";
const BLACK: &str = "#222";
const GREY: &str = "#666";
/// The background while the program is in a WAIT.
const SHADE: &str = "#eef1f4";
const GRID: &str = "#d9dde1";

/// A curve in a panel.
struct Line {
    quantity: Quantity,
    name: &'static str,
    colour: &'static str,
    dash: &'static str,
}

/// A panel: a diagram with one or more lines on the same scale.
struct Panel {
    /// What is drawn, with `{speed}` for the unit of speeds.
    name: &'static str,
    height: f64,
    /// The height where there are panels for several axes.
    small: f64,
    /// A range that the scale covers at least.
    least: Option<(i32, i32)>,
    lines: &'static [Line],
}

const PANELS: [Panel; 4] = [
    Panel {
        name: "position in microsteps",
        height: 170.0,
        small: 110.0,
        least: None,
        lines: &[
            Line { quantity: Quantity::Target, name: "target", colour: ORANGE, dash: "5 3" },
            Line { quantity: Quantity::Position, name: "actual", colour: BLUE, dash: "" },
        ],
    },
    Panel {
        name: "velocity in {speed}",
        height: 120.0,
        small: 80.0,
        least: Some((0, 1)),
        lines: &[Line { quantity: Quantity::Velocity, name: "", colour: BLUE, dash: "" }],
    },
    Panel {
        name: "stallGuard2 value (parameter 206): 0 is a stall",
        height: 90.0,
        small: 56.0,
        least: Some((0, 100)),
        lines: &[Line { quantity: Quantity::Load, name: "", colour: GREEN, dash: "" }],
    },
    Panel {
        name: "motor current in 1/32 of full scale",
        height: 60.0,
        small: 50.0,
        least: Some((0, 32)),
        lines: &[Line { quantity: Quantity::Current, name: "", colour: PURPLE, dash: "" }],
    },
];

/// Switches, which are drawn as lanes below the panels. The home switch has a lane only if it is ever closed.
const SWITCHES: [(&str, Quantity); 3] =
    [("left switch", Quantity::Left), ("right switch", Quantity::Right), ("home switch", Quantity::Home)];

/// The SVG image of a recording.
pub(super) fn draw(name: &str, time: Nanos, recording: &Recording, program: &Program) -> String {
    let mut plot = Plot { svg: String::new(), recording, span: recording.interval * recording.len() as u64 };
    let panels = plot.panels();
    let below = TITLE + panels.iter().map(|panel| NAME + panel.height + GAP).sum::<f64>();
    let lanes = plot.lanes(program);
    let bottom = below + lanes.len() as f64 * LANE;
    let height = bottom + AXIS;
    // Writing to a string cannot fail, here and below.
    let _ = writeln!(
        plot.svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
         font-family=\"DejaVu Sans, Verdana, Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"{BLACK}\">\n\
         <title>{name}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>",
        name = escaped(name)
    );
    plot.title(name, time);
    plot.time_axis(TITLE + NAME, bottom);
    let mut top = TITLE;
    for panel in &panels {
        plot.panel(panel, top + NAME);
        top += NAME + panel.height + GAP;
    }
    for lane in &lanes {
        plot.lane(lane, top);
        top += LANE;
    }
    plot.svg += "</svg>\n";
    plot.svg
}

/// A panel of an axis in its place.
struct AxisPanel {
    axis: usize,
    panel: &'static Panel,
    name: String,
    height: f64,
}

/// A lane: a row below the panels that shows when a channel is on or an event occurs.
struct Lane {
    name: String,
    content: Content,
}

enum Content {
    Level(Channel),
    Marks(Mark),
    Notes,
}

struct Plot<'a> {
    svg: String,
    recording: &'a Recording,
    span: u64,
}

impl Plot<'_> {
    /// The panels: of a module with several axes those of each axis that moves, as far as anything happens in them; or
    /// of axis 0 if none does.
    fn panels(&self) -> Vec<AxisPanel> {
        let panels_of = |axis: usize| {
            PANELS.iter().map(move |panel| {
                let name = panel.name.replace("{speed}", speed_words(self.recording.product));
                match self.recording.axes {
                    1 => AxisPanel { axis, panel, name, height: panel.height },
                    _ => AxisPanel { axis, panel, name: format!("axis {axis}: {name}"), height: panel.small },
                }
            })
        };
        let moving: Vec<usize> = (0..self.recording.axes).filter(|axis| self.moves(*axis)).collect();
        if self.recording.axes == 1 || moving.is_empty() {
            return panels_of(0).collect();
        }
        let panels = moving.into_iter().flat_map(panels_of);
        panels
            .filter(|AxisPanel { axis, panel, .. }| panel.lines.iter().any(|line| self.varies(*axis, line.quantity)))
            .collect()
    }

    fn moves(&self, axis: usize) -> bool {
        self.varies(axis, Quantity::Velocity) || self.varies(axis, Quantity::Position)
    }

    fn varies(&self, axis: usize, quantity: Quantity) -> bool {
        self.recording.range(Channel::Of(axis, quantity)).is_some_and(|(low, high)| low < high)
    }

    /// The lanes of outputs and switches: of a module with several axes those that are ever on.
    fn levels(&self) -> Vec<Lane> {
        let several = self.recording.axes > 1;
        let outputs =
            (0..self.recording.outputs).map(|number| (format!("OUT{number}"), Channel::Output(number), several));
        let switches = (0..self.recording.axes).flat_map(|axis| {
            SWITCHES.map(|(name, quantity)| {
                let name = if several { format!("{name} {axis}") } else { name.into() };
                (name, Channel::Of(axis, quantity), several || quantity == Quantity::Home)
            })
        });
        let seen = |channel| self.recording.range(channel).is_some_and(|(_, high)| high > 0);
        let wanted = outputs.chain(switches).filter(|(_, channel, only_if_seen)| !only_if_seen || seen(*channel));
        wanted.map(|(name, channel, _)| Lane { name, content: Content::Level(channel) }).collect()
    }

    fn lanes(&self, program: &Program) -> Vec<Lane> {
        let marks = self.recording.kinds.iter().map(|mark| {
            let name = match mark {
                Mark::Handler(address) => match program.label(*address) {
                    Some(label) => shortened(label, 14),
                    None => format!("handler {address}"),
                },
                Mark::Refused => "no effect".into(),
                Mark::Stop => "STOP".into(),
            };
            Lane { name, content: Content::Marks(*mark) }
        });
        let notes = (!self.recording.notes.is_empty()).then(|| Lane { name: "events".into(), content: Content::Notes });
        self.levels().into_iter().chain(marks).chain(notes).collect()
    }

    fn x(&self, at: u64) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * at as f64 / self.span.max(1) as f64
    }

    fn text(&mut self, x: f64, y: f64, attributes: &str, text: &str) {
        let _ = writeln!(self.svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" {attributes}>{}</text>", escaped(text));
    }

    fn draw_path(&mut self, path: &str, attributes: &str) {
        if !path.is_empty() {
            let _ = writeln!(self.svg, "<path d=\"{path}\" {attributes}/>");
        }
    }

    fn title(&mut self, name: &str, time: Nanos) {
        self.text(LEFT, 28.0, "font-size=\"17\" font-weight=\"bold\"", name);
        let length = format!("{} of virtual time", time::show(time));
        self.text(WIDTH - RIGHT, 28.0, &format!("text-anchor=\"end\" fill=\"{GREY}\""), &length);
        let legend = WIDTH - RIGHT - 150.0;
        let _ = writeln!(
            self.svg,
            "<rect x=\"{legend}\" y=\"39\" width=\"22\" height=\"12\" fill=\"{SHADE}\" stroke=\"{GRID}\"/>"
        );
        self.text(legend + 29.0, 49.0, &format!("fill=\"{GREY}\""), "program in a WAIT");
    }

    /// Draws the shades behind WAITs, the vertical grid lines, and the times at the bottom.
    fn time_axis(&mut self, top: f64, bottom: f64) {
        let area = Area { left: LEFT, top, width: WIDTH - LEFT - RIGHT, height: bottom - top };
        let [waiting, _] = bars(self.recording, Channel::Waiting, &area);
        self.draw_path(&waiting, &format!("fill=\"{SHADE}\""));
        let axis = TimeAxis::over(self.span);
        let mut lines = String::new();
        for (at, text) in &axis.ticks {
            let x = self.x(*at);
            let _ = write!(lines, "M{x:.1} {top:.1}V{:.1}", bottom + 5.0);
            self.text(x, bottom + 19.0, "text-anchor=\"middle\"", text);
        }
        self.draw_path(&lines, &format!("stroke=\"{GRID}\" fill=\"none\""));
        let middle = area.left + area.width / 2.0;
        self.text(
            middle,
            bottom + 36.0,
            &format!("text-anchor=\"middle\" fill=\"{GREY}\""),
            &format!("time in {}", axis.unit),
        );
    }

    fn panel(&mut self, AxisPanel { axis, panel, name, height }: &AxisPanel, top: f64) {
        let area = Area { left: LEFT, top, width: WIDTH - LEFT - RIGHT, height: *height };
        let ranges = panel.lines.iter().map(|line| self.recording.range(Channel::Of(*axis, line.quantity)));
        let (low, high) = ranges.fold(panel.least, joined).unwrap_or((0, 1));
        let scale = Scale::over(low.into(), high.into(), (height / 24.0) as usize);
        self.text(LEFT, top - 7.0, "font-weight=\"bold\"", name);
        let mut x = LEFT + 220.0;
        for line in panel.lines.iter().filter(|line| !line.name.is_empty()) {
            self.draw_path(&format!("M{x} {:.1}h24", top - 11.0), &stroke(line));
            self.text(x + 30.0, top - 7.0, "", line.name);
            x += 100.0;
        }
        let mut grid = String::new();
        for tick in &scale.ticks {
            let y = area.bottom() - scale.fraction(*tick) * area.height;
            let _ = write!(grid, "M{:.1} {y:.1}H{:.1}", area.left, area.right());
            self.text(LEFT - 8.0, y + 4.0, "text-anchor=\"end\"", &grouped(*tick));
        }
        self.draw_path(&grid, &format!("stroke=\"{GRID}\" fill=\"none\""));
        for line in panel.lines {
            self.draw_path(&path(self.recording, Channel::Of(*axis, line.quantity), &area, &scale), &stroke(line));
        }
    }

    fn lane(&mut self, lane: &Lane, top: f64) {
        self.text(LEFT - 8.0, top + LANE - 6.0, "text-anchor=\"end\"", &lane.name);
        let area = Area { left: LEFT, top: top + 4.0, width: WIDTH - LEFT - RIGHT, height: LANE - 8.0 };
        let base = format!("M{:.1} {:.1}H{:.1}", area.left, area.bottom(), area.right());
        self.draw_path(&base, &format!("stroke=\"{GRID}\" fill=\"none\""));
        match lane.content {
            Content::Level(channel) => {
                let [on, sometimes] = bars(self.recording, channel, &area);
                self.draw_path(&on, &format!("fill=\"{BLUE}\""));
                self.draw_path(&sometimes, &format!("fill=\"{BLUE}\" fill-opacity=\"0.45\""));
            }
            Content::Marks(mark) => {
                let colour = if matches!(mark, Mark::Handler(_)) { GREEN } else { ORANGE };
                let times = self.recording.marked(mark).map(|slice| slice as u64 * self.recording.interval);
                let ticks = self.ticks(times.collect(), &area);
                self.draw_path(&ticks, &format!("stroke=\"{colour}\" stroke-width=\"1.5\" fill=\"none\""));
            }
            Content::Notes => self.notes(&area),
        }
    }

    /// Small vertical lines at these times, at most one per pixel.
    fn ticks(&self, times: Vec<u64>, area: &Area) -> String {
        let mut ticks = String::new();
        let mut last = f64::NEG_INFINITY;
        for x in times.into_iter().map(|at| self.x(at)).filter(|x| *x <= area.right()) {
            if x >= last + 1.0 {
                let _ = write!(ticks, "M{x:.1} {:.1}v{:.1}", area.top, area.height);
                last = x;
            }
        }
        ticks
    }

    /// Draws the texts of the events of option `--at`, cut to the room there is.
    fn notes(&mut self, area: &Area) {
        // Texts of events at the same time are joined.
        let mut notes: Vec<(Nanos, String)> = Vec::new();
        for (at, text) in &self.recording.notes {
            match notes.last_mut() {
                Some((last, so_far)) if last == at => *so_far += &format!("; {text}"),
                _ => notes.push((*at, text.clone())),
            }
        }
        let ticks = self.ticks(notes.iter().map(|(at, _)| *at).collect(), area);
        self.draw_path(&ticks, &format!("stroke=\"{BLACK}\" stroke-width=\"1.5\" fill=\"none\""));
        let ends = notes.iter().skip(1).map(|(at, _)| self.x(*at)).chain([area.right()]).collect::<Vec<_>>();
        for ((at, text), end) in notes.iter().zip(ends) {
            let x = self.x(*at) + 5.0;
            // A character of this font size is about 6.6 pixels wide.
            let room = ((end - x) / 6.6) as usize;
            if room >= 4 {
                self.text(x, area.bottom() - 1.0, "font-size=\"11\"", &shortened(text, room));
            }
        }
    }
}

fn stroke(line: &Line) -> String {
    let Line { colour, dash, .. } = line;
    let dash = if dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dash}\"") };
    format!("stroke=\"{colour}\" stroke-width=\"1.5\" stroke-linejoin=\"round\" fill=\"none\"{dash}")
}

/// The text, cut to `room` characters.
fn shortened(text: &str, room: usize) -> String {
    if text.chars().count() <= room {
        return text.into();
    }
    text.chars().take(room.saturating_sub(1)).chain(['\u{2026}']).collect()
}

/// A text with XML's special characters escaped and without control characters, which XML does not allow.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            c if c.is_control() => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_the_image() {
        assert_eq!(escaped("a<b>&\"\u{1b}"), "a&lt;b&gt;&amp;&quot;\u{fffd}");
        assert_eq!((shortened("Timer0Irq", 9), shortened("Timer0Irq", 6)), ("Timer0Irq".into(), "Timer…".into()));
    }
}
