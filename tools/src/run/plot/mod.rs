//! The plot: panels over a common axis of time, as an SVG image.

mod curve;
mod span;

use std::fmt::Write;

use hal_sim::board::Input;
use hal_sim::clock::Nanos;

use super::recording::{Channel, Mark, Quantity, Range, Recording, joined};
use super::time;
use crate::product::speed_words;
use crate::program::Program;
use crate::svg::colour::{BLACK, BLUE, GREEN, GREY, GRID, ORANGE, PURPLE, SHADE};
use crate::svg::{Area, CHARACTER, Image, Scale, shortened, stroke};
use curve::{bars, path};
use span::TimeAxis;

const WIDTH: f64 = 1000.0;
const LEFT: f64 = 110.0;
const RIGHT: f64 = 24.0;
/// Height of the title, in pixels like all sizes here.
const TITLE: f64 = 58.0;
/// Height of the name above a panel.
const NAME: f64 = 20.0;
const GAP: f64 = 14.0;
const LANE: f64 = 20.0;

/// A curve in a panel.
struct Line {
    quantity: Quantity,
    name: &'static str,
    colour: &'static str,
    dash: &'static str,
}

/// A panel: a diagram with one or more lines on the same scale.
struct Panel {
    /// The name of what is drawn, with `{speed}` for the unit of speeds.
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
            Line { quantity: Quantity::Rotor, name: "rotor, steps lost", colour: PURPLE, dash: "" },
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

/// Switches, which are drawn as lanes below the panels.
const SWITCHES: [(&str, Quantity); 3] =
    [("left switch", Quantity::Left), ("right switch", Quantity::Right), ("home switch", Quantity::Home)];

/// The SVG image of a recording.
pub fn draw(name: &str, time: Nanos, recording: &Recording, program: &Program) -> String {
    let layout = Layout { recording, program };
    let (panels, lanes) = (layout.panels(), layout.lanes());
    let below = TITLE + panels.iter().map(|panel| NAME + panel.height + GAP).sum::<f64>();
    let bottom = below + lanes.len() as f64 * LANE;
    let image = Image::new(name, WIDTH, bottom + Image::BELOW);
    let mut plot = Plot { image, recording, span: recording.interval * recording.len() as u64 };
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
    plot.image.finish()
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

/// The recording that is to be drawn, with its program.
struct Layout<'a> {
    recording: &'a Recording,
    program: &'a Program,
}

impl Layout<'_> {
    /// The panels: of a module with several axes those of each axis that moves, as far as anything happens in them; or
    /// of axis 0 if none does.
    fn panels(&self) -> Vec<AxisPanel> {
        let several = self.recording.axes > 1;
        let panels_of = |axis: usize| {
            PANELS.iter().map(move |panel| {
                let name = panel.name.replace("{speed}", speed_words(self.recording.product));
                match several {
                    false => AxisPanel { axis, panel, name, height: panel.height },
                    true => AxisPanel { axis, panel, name: format!("axis {axis}: {name}"), height: panel.small },
                }
            })
        };
        let moving: Vec<usize> = (0..self.recording.axes).filter(|axis| self.moves(*axis)).collect();
        let all_that_happens = several && !moving.is_empty();
        let axes = if all_that_happens { moving } else { vec![0] };
        let panels = axes.into_iter().flat_map(panels_of);
        panels.filter(|AxisPanel { axis, panel, .. }| self.says_something(*axis, panel, !all_that_happens)).collect()
    }

    /// True if a panel shows more than its name; `always` is for panels in which nothing has to happen.
    fn says_something(&self, axis: usize, panel: &Panel, always: bool) -> bool {
        panel.lines.iter().any(|line| match line.quantity {
            // A load value that is 0 whenever the motor turns is that of a threshold that nobody has set.
            Quantity::Load => self.range(axis, Quantity::Load).is_some_and(|(_, high)| high > 0),
            quantity => always || self.varies(Channel::Of(axis, quantity)),
        })
    }

    fn moves(&self, axis: usize) -> bool {
        let quantities = [Quantity::Velocity, Quantity::Position, Quantity::Rotor];
        quantities.into_iter().any(|quantity| self.varies(Channel::Of(axis, quantity)))
    }

    fn range(&self, axis: usize, quantity: Quantity) -> Range {
        self.recording.range(Channel::Of(axis, quantity))
    }

    fn varies(&self, channel: Channel) -> bool {
        self.recording.range(channel).is_some_and(|(low, high)| low < high)
    }

    /// The lanes of those outputs, inputs and switches that change.
    fn levels(&self) -> Vec<Lane> {
        let several = self.recording.axes > 1;
        let outputs = (0..self.recording.outputs).map(|number| (format!("OUT{number}"), Channel::Output(number)));
        // The inputs to which switches are connected are there as switches.
        let inputs = self.recording.product.kind().inputs.iter().enumerate();
        let inputs = inputs.filter(|(_, input)| !matches!(input, Input::Switch(..)));
        let inputs = inputs.map(|(number, _)| (format!("IN{number}"), Channel::Input(number)));
        let switches = (0..self.recording.axes).flat_map(|axis| {
            SWITCHES.map(|(name, quantity)| {
                let name = if several { format!("{name} {axis}") } else { name.into() };
                (name, Channel::Of(axis, quantity))
            })
        });
        let enable = [("ENABLE".to_owned(), Channel::Enable)];
        let all = outputs.chain(inputs).chain(enable).chain(switches).filter(|(_, channel)| self.varies(*channel));
        all.map(|(name, channel)| Lane { name, content: Content::Level(channel) }).collect()
    }

    fn lanes(&self) -> Vec<Lane> {
        let marks = self.recording.kinds.iter().map(|mark| {
            let name = match mark {
                Mark::Handler(address) => match self.program.label(*address) {
                    Some(label) => shortened(label, 14),
                    None => format!("handler {address}"),
                },
                Mark::Refused => "no effect".into(),
                Mark::Stop => "STOP".into(),
                Mark::OutOfStep(axis) if self.recording.axes > 1 => format!("out of step {axis}"),
                Mark::OutOfStep(_) => "out of step".into(),
            };
            Lane { name, content: Content::Marks(*mark) }
        });
        let notes = (!self.recording.notes.is_empty()).then(|| Lane { name: "events".into(), content: Content::Notes });
        self.levels().into_iter().chain(marks).chain(notes).collect()
    }
}

/// The image while it is being drawn.
struct Plot<'a> {
    image: Image,
    recording: &'a Recording,
    span: u64,
}

impl Plot<'_> {
    /// The part of the image between two heights that has the curves.
    fn area(&self, top: f64, height: f64) -> Area {
        Area { left: LEFT, top, width: WIDTH - LEFT - RIGHT, height }
    }

    fn x(&self, at: u64) -> f64 {
        self.area(0.0, 0.0).x(at as f64 / self.span.max(1) as f64)
    }

    fn title(&mut self, name: &str, time: Nanos) {
        self.image.text(LEFT, 28.0, "font-size=\"17\" font-weight=\"bold\"", name);
        let length = format!("{} of virtual time", time::show(time));
        self.image.text(WIDTH - RIGHT, 28.0, &format!("text-anchor=\"end\" fill=\"{GREY}\""), &length);
        let legend = WIDTH - RIGHT - 150.0;
        self.image.path(&format!("M{legend} 39h22v12h-22z"), &format!("fill=\"{SHADE}\" stroke=\"{GRID}\""));
        self.image.text(legend + 29.0, 49.0, &format!("fill=\"{GREY}\""), "program in a WAIT");
    }

    /// Draws the shades behind WAITs, the vertical grid lines, and the times at the bottom.
    fn time_axis(&mut self, top: f64, bottom: f64) {
        let area = self.area(top, bottom - top);
        let [waiting, _] = bars(self.recording, Channel::Waiting, &area);
        self.image.path(&waiting, &format!("fill=\"{SHADE}\""));
        let axis = TimeAxis::over(self.span);
        let ticks: Vec<(f64, String)> = axis.ticks.into_iter().map(|(at, text)| (self.x(at), text)).collect();
        self.image.frame(&area, &ticks, &format!("time in {}", axis.unit));
    }

    fn panel(&mut self, AxisPanel { axis, panel, name, height }: &AxisPanel, top: f64) {
        let area = self.area(top, *height);
        let ranges = panel.lines.iter().map(|line| self.recording.range(Channel::Of(*axis, line.quantity)));
        let (low, high) = ranges.fold(panel.least, joined).unwrap_or((0, 1));
        let scale = Scale::over(low.into(), high.into(), (height / 24.0) as usize);
        self.image.text(LEFT, top - 7.0, "font-weight=\"bold\"", name);
        let mut x = LEFT + 220.0;
        let channel = |line: &Line| Channel::Of(*axis, line.quantity);
        let drawn = panel.lines.iter().filter(|line| self.recording.range(channel(line)).is_some());
        for line in drawn.filter(|line| !line.name.is_empty()) {
            self.image.path(&format!("M{x} {:.1}h24", top - 11.0), &stroke(line.colour, line.dash));
            self.image.text(x + 30.0, top - 7.0, "", line.name);
            x += 100.0;
        }
        self.image.levels(&area, &scale);
        for line in panel.lines {
            self.image.path(
                &path(self.recording, Channel::Of(*axis, line.quantity), &area, &scale),
                &stroke(line.colour, line.dash),
            );
        }
    }

    fn lane(&mut self, lane: &Lane, top: f64) {
        self.image.text(LEFT - 8.0, top + LANE - 6.0, "text-anchor=\"end\"", &lane.name);
        let area = self.area(top + 4.0, LANE - 8.0);
        let base = format!("M{:.1} {:.1}H{:.1}", area.left, area.bottom(), area.right());
        self.image.path(&base, &format!("stroke=\"{GRID}\" fill=\"none\""));
        match lane.content {
            Content::Level(channel) => {
                let [on, sometimes] = bars(self.recording, channel, &area);
                self.image.path(&on, &format!("fill=\"{BLUE}\""));
                self.image.path(&sometimes, &format!("fill=\"{BLUE}\" fill-opacity=\"0.45\""));
            }
            Content::Marks(mark) => {
                let colour = if matches!(mark, Mark::Handler(_)) { GREEN } else { ORANGE };
                let times = self.recording.marked(mark).map(|slice| slice as u64 * self.recording.interval);
                let ticks = self.ticks(times.collect(), &area);
                self.image.path(&ticks, &format!("stroke=\"{colour}\" stroke-width=\"1.5\" fill=\"none\""));
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
        self.image.path(&ticks, &format!("stroke=\"{BLACK}\" stroke-width=\"1.5\" fill=\"none\""));
        let ends = notes.iter().skip(1).map(|(at, _)| self.x(*at)).chain([area.right()]).collect::<Vec<_>>();
        for ((at, text), end) in notes.iter().zip(ends) {
            let x = self.x(*at) + 5.0;
            let room = ((end - x) / CHARACTER) as usize;
            if room >= 4 {
                self.image.text(x, area.bottom() - 1.0, "font-size=\"11\"", &shortened(text, room));
            }
        }
    }
}
