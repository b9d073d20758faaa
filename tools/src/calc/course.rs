//! `tmcl calc move` and `tmcl calc stop`: how far and how long.

use tmcm::motion::tmc429::ramp::braking;
use tmcm::param::AxisParameter;
use tmcm_sim::suggest::suggestion;

use super::axis::{Axis, Made, NO_LEAD};
use super::exact::Exact;
use super::ramp::{Leg, Move, Side, travel};
use super::scale::{Generator, MotionUnit, Quantity};
use super::table::{self, Line};
use super::value::{self, Meaning};

/// How each form is written, for messages.
const MOVE: &str = "tmcl calc move 51200 microsteps at 60 rpm with 500 rpm/s";
const STOP: &str = "tmcl calc stop from 60 rpm with 500 rpm/s";

/// The words that begin a part of the line, each with the parameter that it is for and with what it is one of. Those
/// from VSTART on are the points of a ramp that not every product has.
const PARTS: [(&str, AxisParameter, Quantity); 9] = [
    ("at", AxisParameter::MaximumSpeed, Quantity::Speed),
    ("from", AxisParameter::TargetSpeed, Quantity::Speed),
    ("with", AxisParameter::MaximumAcceleration, Quantity::Acceleration),
    ("vstart", AxisParameter::StartVelocity, Quantity::Speed),
    ("a1", AxisParameter::FirstAcceleration, Quantity::Acceleration),
    ("v1", AxisParameter::FirstVelocity, Quantity::Speed),
    ("dmax", AxisParameter::MaximumDeceleration, Quantity::Acceleration),
    ("d1", AxisParameter::LastDeceleration, Quantity::Acceleration),
    ("vstop", AxisParameter::StopVelocity, Quantity::Speed),
];

/// Units of a way, each with its names without spaces.
const WAYS: [(DistanceUnit, &[&str]); 4] = [
    (DistanceUnit::Microsteps, &["microsteps", "microstep", "usteps", "ustep"]),
    (DistanceUnit::FullSteps, &["fullsteps", "fullstep", "fs"]),
    (DistanceUnit::Turns, &["turns", "turn"]),
    (DistanceUnit::Millimetres, &["mm", "millimetres", "millimetre"]),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DistanceUnit {
    Microsteps,
    FullSteps,
    Turns,
    Millimetres,
}

/// A part of the line: the word it begins with, and the value behind it.
struct Part {
    word: &'static str,
    text: String,
    parameter: AxisParameter,
    made: Made,
}

/// True if the arguments ask for a move or a stop.
pub(super) fn is_asked(words: &[String]) -> bool {
    words.iter().flat_map(|word| word.split_whitespace()).next().is_some_and(|word| matches!(word, "move" | "stop"))
}

/// How far and how long a move or a stop goes.
///
/// # Errors
/// What is wrong with the arguments, with an example.
pub(super) fn text(axis: Axis, words: &[String]) -> Result<String, String> {
    let words: Vec<String> = words.iter().flat_map(|word| word.split_whitespace()).map(str::to_owned).collect();
    let (asked, words) = words.split_first().ok_or(MOVE)?;
    let is_move = asked == "move";
    let begins = |word: &String| PARTS.iter().any(|(name, ..)| word == name);
    let first = words.iter().position(begins).unwrap_or(words.len());
    let (way, rest) = words.split_at(first);
    let parts = parts(axis, rest)?;
    let needed = |word: &str, form: &str| {
        let part = parts.iter().find(|part| part.word == word);
        part.ok_or_else(|| format!("'{word}' and a value are missing; write for example: {form}"))
    };
    let told = if is_move {
        let way = distance(axis, way)?;
        let (at, with) = (needed("at", MOVE)?, needed("with", MOVE)?);
        refuse(&parts, "from", "a move begins from standstill; its speed stands behind 'at'")?;
        let (up, down) = sides(axis, &parts, at, with)?;
        let speed = at.made.actual.approximate();
        MoveReport { parts: &parts, course: travel(&up, &down, way, speed), braked: Some(braked(axis, at, with)) }
    } else {
        if let Some(word) = way.first() {
            return Err(format!("'{word}': a stop has no way of its own; write for example: {STOP}"));
        }
        let (from, with) = (needed("from", STOP)?, needed("with", STOP)?);
        for word in PARTS.iter().map(|(word, ..)| *word).filter(|word| !matches!(*word, "from" | "with")) {
            refuse(&parts, word, "a motor that turns at a speed stops with one deceleration, that behind 'with'")?;
        }
        let top = from.made.actual.approximate();
        let down = Side::plain(with.made.actual.approximate()).leg(top);
        MoveReport { parts: &parts, course: Move { top, legs: [Leg::default(), Leg::default(), down] }, braked: None }
    };
    Ok(told.text(axis, is_move))
}

/// The parts of the line, each with what the module makes of its value.
fn parts(axis: Axis, mut words: &[String]) -> Result<Vec<Part>, String> {
    let mut parts: Vec<Part> = Vec::new();
    while let Some((word, rest)) = words.split_first() {
        let found = PARTS.iter().find(|(name, ..)| word == name);
        let Some((word, parameter, quantity)) = found else { break };
        let end = rest.iter().position(|word| PARTS.iter().any(|(name, ..)| word == name)).unwrap_or(rest.len());
        let (value, behind) = rest.split_at(end);
        words = behind;
        if axis.spec.axis.row(*parameter).is_none() {
            return Err(format!("'{word}': the ramp of a {} has no such point", axis.spec.usb));
        }
        if parts.iter().any(|part| part.word == *word) {
            return Err(format!("'{word}' can be given only once"));
        }
        let made = made(axis, word, value, *quantity)?;
        parts.push(Part { word, text: value.join(" "), parameter: *parameter, made });
    }
    Ok(parts)
}

/// Finds what the module makes of the value behind a word, which is not below 0, nor 0 unless it may be.
fn made(axis: Axis, word: &str, value: &[String], quantity: Quantity) -> Result<Made, String> {
    let example = if quantity == Quantity::Speed { "60 rpm" } else { "500 rpm/s" };
    let values = value::read(axis.spec, value).map_err(|error| format!("behind '{word}': {error}"))?;
    let [value] = values.as_slice() else {
        return Err(format!("behind '{word}' one value is needed, for example {word} {example}"));
    };
    let unit = value.meanings.iter().find_map(|meaning| match meaning {
        Meaning::Motion(kind, unit) if *kind == quantity => Some(*unit),
        _ => None,
    });
    let kind = quantity.name();
    let unit = unit.ok_or_else(|| format!("{}: behind '{word}' {kind} is needed, such as {example}", value.text))?;
    let made = axis.make(value, quantity, unit)?;
    // Ramps may begin and end at standstill, and may do without the points in between.
    let may_be_none = !matches!(word, "at" | "from" | "with");
    if value.number.is_negative() || made.own == 0 && !may_be_none {
        return Err(format!("{}: behind '{word}' {kind} above 0 is needed", value.text));
    }
    Ok(made)
}

fn refuse(parts: &[Part], word: &str, why: &str) -> Result<(), String> {
    if parts.iter().any(|part| part.word == word) { Err(format!("'{word}': {why}")) } else { Ok(()) }
}

/// The way of a move in microsteps. Its sign makes no difference.
fn distance(axis: Axis, words: &[String]) -> Result<f64, String> {
    let missing = || format!("a move needs a distance, for example: {MOVE}");
    let text = words.concat();
    let digits = text.bytes().take_while(|byte| byte.is_ascii_digit() || b"+-.".contains(byte)).count();
    let (number, unit) = text.split_at(digits);
    if number.is_empty() {
        return Err(missing());
    }
    let way = Exact::parse(number).ok_or_else(|| format!("'{number}' is no number of at most 15 digits"))?;
    let unit = unit.to_lowercase();
    let found = WAYS.iter().find(|(_, names)| names.contains(&unit.as_str())).map(|(way, _)| *way);
    let names = ["microsteps", "full steps", "turns", "mm"];
    if unit.is_empty() {
        return Err(format!("'{number}' has no unit. Write one behind it: {}", names.join(", ")));
    }
    let Some(found) = found else {
        let suggestion = suggestion(&unit, names.into_iter());
        return Err(format!("'{unit}' is no unit of a way; there are {}{suggestion}", names.join(", ")));
    };
    let (microsteps, steps) = (i128::from(axis.scale.microsteps), i128::from(axis.scale.steps));
    let microsteps = match found {
        DistanceUnit::Microsteps => Exact::whole(1),
        DistanceUnit::FullSteps => Exact::whole(microsteps),
        DistanceUnit::Turns => Exact::whole(microsteps * steps),
        DistanceUnit::Millimetres => {
            axis.scale.millimetre().ok_or_else(|| format!("{}: {NO_LEAD}", words.join(" ")))?
        }
    };
    // A module has whole microsteps, and positions of 32 bits.
    let way = (way * microsteps).rounded().abs();
    match way {
        0 => Err(format!("{}: that is no way at all", words.join(" "))),
        _ if way > i128::from(u32::MAX) => {
            Err(format!("{}: no position is {} microsteps away from another one", words.join(" "), way))
        }
        _ => Ok(way as f64),
    }
}

/// How the ramp of a move begins and ends.
fn sides(axis: Axis, parts: &[Part], at: &Part, with: &Part) -> Result<(Side, Side), String> {
    let main = with.made.actual.approximate();
    if let Generator::Tmc429 { .. } = axis.scale.generator {
        let braked = braked(axis, at, with);
        return Ok((Side::plain(braked.up), Side::plain(braked.down)));
    }
    let point = |word: &str| parts.iter().find(|part| part.word == word).map(|part| part.made.actual.approximate());
    let knee = point("v1").unwrap_or_default();
    for (word, other) in [("a1", "v1"), ("d1", "v1"), ("v1", "a1"), ("v1", "d1")] {
        if point(word).is_some() && point(other).is_none_or(|value| value == 0.0) {
            return Err(format!("'{word}' has an effect with '{other}' alone; give v1, a1 and d1 together"));
        }
    }
    let side = |edge: &str, first: &str, main: f64| Side {
        edge: point(edge).unwrap_or_default(),
        first: point(first).unwrap_or_default(),
        knee,
        main,
    };
    let down = point("dmax").filter(|dmax| *dmax > 0.0).unwrap_or(main);
    Ok((side("vstart", "a1", main), side("vstop", "d1", down)))
}

/// With what a move of a TMC429 speeds up and slows down, in pps2, and the acceleration that its chip gets.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Braked {
    own: i128,
    up: f64,
    down: f64,
}

/// For a positioning a TMC429 needs a pair of PMUL and PDIV that goes with the acceleration, and slows down by them.
/// With the distance d to the target the speed is sqrt(2048 * p * d) of its units, where p is PMUL / 2^(3 + PDIV)
/// (datasheet, section 8.1.10.2). That is a deceleration of 1024 * p of its units of speed squared.
fn braked(axis: Axis, at: &Part, with: &Part) -> Braked {
    let as_it_is =
        Braked { own: with.made.own, up: with.made.actual.approximate(), down: with.made.actual.approximate() };
    let Generator::Tmc429 { pulse_divisor, ramp_divisor } = axis.scale.generator else { return as_it_is };
    let [acceleration, speed] = [with, at].map(|part| i32::try_from(part.made.own).unwrap_or(i32::MAX));
    let Some(found) = braking(acceleration, ramp_divisor, pulse_divisor, speed) else { return as_it_is };
    let own = i128::from(found.acceleration);
    let pulses = |quantity, number: i128| {
        axis.scale.pulses(quantity, MotionUnit::Internal, Exact::whole(number)).map_or(0.0, Exact::approximate)
    };
    let unit = pulses(Quantity::Speed, 1);
    let p = f64::from(found.pmul) / f64::from(3 + i32::from(found.pdiv)).exp2();
    Braked { own, up: pulses(Quantity::Acceleration, own), down: unit * unit * 1024.0 * p }
}

/// The report of a move or a stop.
struct MoveReport<'a> {
    parts: &'a [Part],
    course: Move,
    braked: Option<Braked>,
}

impl MoveReport<'_> {
    fn text(&self, axis: Axis, is_move: bool) -> String {
        let (microsteps, steps) = (f64::from(axis.scale.microsteps), f64::from(axis.scale.steps));
        let what = if is_move { "move" } else { "stop" };
        let mut text = format!(
            "{what} of a {}: {}{} microsteps per full step, {} full steps per turn\n",
            axis.spec.usb,
            axis.divisors(Quantity::Acceleration),
            axis.scale.microsteps,
            axis.scale.steps
        );
        for Part { word, text: written, parameter, made } in self.parts {
            let number = axis.spec.axis.row(*parameter).map_or(0, |row| row.number);
            let quantity = if matches!(*word, "with" | "a1" | "dmax" | "d1") { "pps2" } else { "pps" };
            let write = if *word == "from" {
                format!("ROR 0, {}", made.written.0)
            } else {
                format!("AP {number} = {}", made.written.0)
            };
            let mode = axis.unit_mode().filter(|_| made.written.1 != axis.usual_unit());
            let mode = mode.map_or_else(String::new, |number| format!(" while AP {number} is 0"));
            let more = match self.braked.filter(|_| *word == "with") {
                Some(braked) if braked.own != made.own => {
                    format!("; a positioning gets {} in its place, {:.3} pps2", braked.own, braked.up)
                }
                _ => String::new(),
            };
            text += &format!("  {word} {written}: {} {quantity} by {write}{mode}{more}\n", made.actual.shown());
        }
        let line = |name: &str, leg: Leg| Line {
            unit: name.into(),
            numbers: [
                Some(format!("{:.0}", leg.way)),
                Some(format!("{:.2}", leg.way / microsteps)),
                Some(format!("{:.4}", leg.way / microsteps / steps)),
                axis.scale.millimetre().map(|one| format!("{:.4}", leg.way / one.approximate())),
                Some(format!("{:.4}", leg.time)),
            ]
            .into_iter()
            .flatten()
            .collect(),
            remark: String::new(),
        };
        let [up, full, down] = self.course.legs;
        let columns: &[&str] = match axis.scale.lead {
            Some(_) => &["microsteps", "full steps", "turns", "mm", "seconds"],
            None => &["microsteps", "full steps", "turns", "seconds"],
        };
        if !is_move {
            return text + &table::text(columns, &[line("until it stands", down)]);
        }
        let lines = [
            line("speeding up", up),
            line("at full speed", full),
            line("slowing down", down),
            line("the whole move", self.course.whole()),
        ];
        text += &table::text(columns, &lines);
        let limit = self.parts.iter().find(|part| part.word == "at");
        if let Some(limit) = limit.filter(|limit| self.course.top < limit.made.actual.approximate()) {
            let top = self.course.top;
            let rpm = top / microsteps / steps * 60.0;
            text += &format!("It gets to {top:.0} pps, {rpm:.3} rpm: the way is too short for {}.\n", limit.text);
        }
        text
    }
}
