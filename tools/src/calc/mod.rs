//! Speeds, accelerations, times and currents in all units of a product, and the way and time of moves.

mod amperes;
mod axis;
mod course;
mod current;
mod exact;
mod live;
mod physical;
mod ramp;
mod scale;
mod table;
mod time;
mod value;

use tmcm::param::AxisParameter;

pub use self::amperes::Current;
pub use self::axis::MOST_DIVIDED;
use self::axis::{Axis, Made};
use self::exact::Exact;
pub use self::live::{Live, Settings};
pub use self::physical::{Length, Physical};
use self::scale::{Generator, MotionUnit, Quantity, Scale};
use self::table::Line;
use self::value::{Meaning, Value};
use crate::product::Product;

/// Facts that are known of an axis beside its product, and that go before what a module says of itself.
#[derive(Clone, Copy, Debug)]
pub struct Given {
    /// The pulse divisor, 0..=[`MOST_DIVIDED`]: axis parameter 154 of products that have it.
    pub pulse_divisor: Option<u8>,
    /// The ramp divisor, 0..=[`MOST_DIVIDED`]: axis parameter 153 of products that have it.
    pub ramp_divisor: Option<u8>,
    /// Microsteps per full step, a power of two up to 256.
    pub microsteps: Option<u16>,
    /// Full steps per turn of the motor, at least 1.
    pub steps: u16,
    /// How far a turn moves what the motor drives.
    pub lead: Option<Lead>,
}

/// Millimetres in a turn, above 0.
#[derive(Clone, Copy, Debug)]
pub struct Lead(Exact);

impl Lead {
    /// Reads a lead.
    ///
    /// # Errors
    /// A message that says what is one.
    pub fn parse(text: &str) -> Result<Self, String> {
        let lead = Exact::parse(text).filter(|lead| !lead.is_negative() && !lead.is_zero());
        lead.map(Lead).ok_or_else(|| "give millimetres above 0, with at most 15 digits, such as 4 or 1.27".into())
    }
}

/// A table for each of the values, which are as they are written on a command line: `60 rpm`; or the report of one move
/// or stop. `settings` are those of a module that is at hand.
///
/// # Errors
/// A message about what is no value of the product.
pub fn text(product: Product, settings: Option<Settings>, given: &Given, values: &[String]) -> Result<String, String> {
    let axis = axis(given, product, settings)?;
    if course::is_asked(values) {
        return course::text(axis, values);
    }
    value::read(product.spec(), values)?.iter().map(|value| value_text(product, axis, value)).collect()
}

/// The speed that a ramp generator's register has, as a number of a product's parameters, rounded.
pub fn in_usual_unit(product: Product, register: i32) -> i32 {
    let spec = product.spec();
    // What the divisors and the motor are makes no difference between a register and its parameter.
    let generator = Generator::of(spec, (0, 0));
    let axis = Axis { spec, scale: Scale { generator, microsteps: 1, steps: 1, lead: None } };
    let (own, usual, speed) = (generator.own_unit(), axis.usual_unit(), Quantity::Speed);
    let pulses = axis.scale.pulses(speed, own, Exact::whole(register));
    let number = pulses.and_then(|pulses| axis.scale.number(speed, usual, pulses)).map(Exact::rounded);
    number.and_then(|number| i32::try_from(number).ok()).unwrap_or(register)
}

/// The axis that is meant, of a module with these settings.
fn axis(given: &Given, product: Product, settings: Option<Settings>) -> Result<Axis, String> {
    let spec = product.spec();
    let divisor = |parameter, asked: Option<u8>, set: Option<u8>, name: &str| match (spec.axis.row(parameter), asked) {
        (None, Some(_)) => Err(format!("--{name}: a {} has no such divisor", spec.usb)),
        (row, None) => {
            let new = || row.and_then(|row| u8::try_from(row.default).ok());
            Ok(set.or_else(new).unwrap_or_default())
        }
        (Some(_), Some(asked)) => Ok(asked),
    };
    let (pulse, ramp) = settings.map(|settings| settings.divisors).unzip();
    let pulse_divisor = divisor(AxisParameter::PulseDivisor, given.pulse_divisor, pulse, "pulse-divisor")?;
    let ramp_divisor = divisor(AxisParameter::RampDivisor, given.ramp_divisor, ramp, "ramp-divisor")?;
    let generator = Generator::of(spec, (pulse_divisor, ramp_divisor));
    let microsteps = given.microsteps.or(settings.map(|settings| settings.microsteps)).unwrap_or(256);
    let scale = Scale { generator, microsteps, steps: given.steps, lead: given.lead.map(|Lead(lead)| lead) };
    Ok(Axis { spec, scale })
}

/// Tells what a value is, in each of its meanings that the product can have.
fn value_text(product: Product, axis: Axis, value: &Value) -> Result<String, String> {
    let mut text = String::new();
    let mut refused = Vec::new();
    for meaning in &value.meanings {
        match *meaning {
            Meaning::Time(seconds) => text += &time_text(axis, value, seconds)?,
            Meaning::Current(amperes) => text += &current::text(product, &value.text, value.number * amperes)?,
            Meaning::Motion(quantity, unit) => match axis.make(value, quantity, unit) {
                Ok(made) => text += &motion_text(axis, value, quantity, made),
                Err(why) => refused.push(why),
            },
        }
    }
    // Of a unit of speeds and accelerations it is enough that one of them is possible.
    if refused.len() < value.meanings.len() {
        return Ok(text);
    }
    Err(refused.into_iter().next().unwrap_or_default())
}

/// A speed or an acceleration.
fn motion_text(axis: Axis, value: &Value, quantity: Quantity, made: Made) -> String {
    let Scale { generator, microsteps, steps, .. } = axis.scale;
    let divisors = axis.divisors(quantity);
    let head = format!(
        "{} as {} of a {}: {divisors}{microsteps} microsteps per full step, {steps} full steps per turn\n",
        value.text,
        quantity.name(),
        axis.spec.usb
    );
    let (whole, written) = made.written;
    let own = generator.own_unit();
    let remark = |unit| match axis.unit_mode() {
        Some(mode) if unit == own => format!("write {} while AP {mode} is 0", made.own),
        _ if unit == written => format!("write {whole}"),
        _ => String::new(),
    };
    let line = |unit: MotionUnit| {
        let number = |pulses| axis.scale.number(quantity, unit, pulses).map_or_else(String::new, Exact::shown);
        Line {
            unit: unit.name(quantity).into(),
            numbers: vec![number(made.wanted), number(made.actual)],
            remark: remark(unit),
        }
    };
    let lines: Vec<Line> = axis.scale.units().map(line).collect();
    head + &table::text(&["wanted", "gets"], &lines)
}

/// A time, of which one unit is so many seconds.
fn time_text(axis: Axis, value: &Value, seconds: Exact) -> Result<String, String> {
    let wanted = value.number * seconds;
    if wanted.is_negative() {
        return Err(format!("{}: a time is not negative", value.text));
    }
    let head = format!("{} as a time of a {}\n", value.text, axis.spec.usb);
    let mut lines = vec![Line { unit: "s".into(), numbers: vec![wanted.shown()], remark: String::new() }];
    for tick in time::ticks(axis.spec, wanted) {
        let number = wanted * tick.seconds.inverse();
        let numbers = [Some(number.shown()), tick.number.map(|number| number.to_string())];
        let numbers = numbers.into_iter().flatten().collect();
        lines.push(Line { unit: tick.name.into(), numbers, remark: tick.takers.join(", ") });
    }
    Ok(head + &table::text(&["wanted", "gets"], &lines))
}
