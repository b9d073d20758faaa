//! `tmcl calc`: speeds, accelerations, times and currents in all units of a product, and the way and time of moves.

mod axis;
mod course;
mod current;
mod exact;
mod live;
mod ramp;
mod scale;
mod table;
mod time;
mod value;

use std::io::Write;

use clap::Args;
use tmcm::param::AxisParameter;

use self::axis::{Axis, MOST_DIVIDED, Made};
use self::exact::Exact;
pub(crate) use self::live::{Live, Settings};
use self::scale::{Generator, Quantity, Scale, Unit};
use self::table::Line;
use self::value::{Meaning, Value};
use crate::conversation::{Conversation, LinkOptions, Reach};
use crate::failure::Failure;
use crate::link::LinkTarget;
use crate::product::Product;
use crate::tell;

/// Convert speeds, accelerations, times and currents between the units of a product; tell how long a move takes
///
/// The numbers of a product with a TMC429 are internal units of this motion controller (int), which mean what pulse
/// and ramp divisor make of them; those of a TMCM-3212 are microsteps per second (pps), which it makes units
/// of its chip (chip). What a motor does is in full steps per second, turns per second (rps) and per minute (rpm).
/// Accelerations are in pps2, full steps/s2, rps/s and rpm/s, and again in int and chip. With --lead there are mm/s and mm/s2,
/// of what a lead screw or a belt moves. Times are in us, ms, s, min, and in what a product has them in, such as x10 ms.
/// Currents are in A and mA, RMS as in the products' data sheets.
///
/// For each value there is a table. The column "wanted" has the value in each unit. Numbers in a module are whole, so
/// it has something next to that, which is in the column "gets".
///
/// "move DISTANCE at SPEED with ACCELERATION" tells how far and how long the motor speeds up, goes at full speed and slows
/// down; distances are in microsteps, full steps, turns or mm. "stop from SPEED with ACCELERATION" tells how far a motor goes
/// on that turns at a speed. The ramp of a TMCM-3212 may have more points: vstart SPEED, a1 ACCELERATION, v1 SPEED, dmax
/// ACCELERATION, d1 ACCELERATION and vstop SPEED, its parameters 19, 15, 16, 17, 18 and 20; without dmax it slows down as
/// it speeds up.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// Values with their units, for example 60 rpm; or a move, or a stop
    #[arg(value_name = "VALUE", required = true)]
    pub values: Vec<String>,

    /// Take product, divisors and microsteps from the module at this link: an axis of it as it is set now
    #[arg(long, value_name = "LINK", value_parser = LinkTarget::parse)]
    pub link: Option<LinkTarget>,

    /// The axis of that module
    #[arg(long, value_name = "N", default_value_t = 0, requires = "link")]
    pub axis: u8,

    /// How the module is talked to; without one, --product says what the values are for, a TMCM-1140 without it
    #[command(flatten)]
    pub link_options: LinkOptions,

    /// The pulse divisor, axis parameter 154 of products that have it; without it that of the module, or of a new one
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=i64::from(MOST_DIVIDED)))]
    pub pulse_divisor: Option<u8>,

    /// The ramp divisor, axis parameter 153 of products that have it; without it that of the module, or of a new one
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=i64::from(MOST_DIVIDED)))]
    pub ramp_divisor: Option<u8>,

    /// Microsteps per full step: 1, 2, 4, 8, 16, 32, 64, 128 or 256; without it those of the module, or 256
    #[arg(long, value_name = "N", value_parser = microsteps)]
    pub microsteps: Option<u16>,

    /// Full steps per turn of the motor
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(1..))]
    pub steps: u16,

    /// Millimetres that a turn of the motor moves the stage: the lead of its screw, or what a turn of its pulley is
    #[arg(long, value_name = "MM", value_parser = lead)]
    pub lead: Option<Lead>,
}

/// Millimetres in a turn, above 0.
#[derive(Clone, Copy, Debug)]
pub struct Lead(Exact);

const EXAMPLES: &str = "\
Examples:
  tmcl calc 60 rpm                                   which number turns the motor of a TMCM-1140 so fast
  tmcl calc --product 6110 --pulse-divisor 5 1000 int
      what a number means, as a speed and as an acceleration
  tmcl calc --microsteps 16 --steps 400 2.5 rps 10 rps/s
      with another motor at another resolution
  tmcl calc --product 3212 60 rpm 60 rpm/s           speed and acceleration of a module with pps
  tmcl calc --lead 4 2.5 mm/s                        with a screw that moves a stage by 4 mm in a turn
  tmcl calc 1.2 A                                    which number is that current
  tmcl calc --link tcp:127.0.0.1:4140 60 rpm         with divisors and microsteps of a module
  tmcl calc 1.5 s                                    which numbers are that time
  tmcl calc move 51200 microsteps at 60 rpm with 500 rpm/s
      how long a turn takes
  tmcl calc stop from 60 rpm with 100 rpm/s          how far the motor goes on
  tmcl calc --product 3212 move 9 turns at 5 rps with 9 rps/s v1 1 rps a1 3 rps/s d1 3 rps/s
      with a ramp of six points
  tmcl calc -500 int                                 a speed to the left";

/// Reads a number of microsteps per full step.
fn microsteps(text: &str) -> Result<u16, String> {
    let number = text.parse().ok().filter(|number: &u16| number.is_power_of_two() && *number <= 256);
    number.ok_or_else(|| "give 1, 2, 4, 8, 16, 32, 64, 128 or 256".into())
}

/// Reads a lead.
fn lead(text: &str) -> Result<Lead, String> {
    let lead = Exact::parse(text).filter(|lead| !lead.is_negative() && !lead.is_zero());
    lead.map(Lead).ok_or_else(|| "give millimetres above 0, with at most 15 digits, such as 4 or 1.27".into())
}

/// Prints a table for each value.
pub fn run(options: &Options) -> Result<(), Failure> {
    let (product, settings) = module(options)?;
    let axis = axis(options, product, settings).map_err(Failure::Arguments)?;
    let mut text = Vec::new();
    if course::is_asked(&options.values) {
        course::write(&mut text, axis, &options.values).map_err(Failure::Arguments)?;
    } else {
        for value in value::read(product.spec(), &options.values).map_err(Failure::Arguments)? {
            write_value(&mut text, product, axis, &value)?;
        }
    }
    let mut out = tell::out();
    out.write_all(&text)?;
    Ok(out.flush()?)
}

/// The speed that a ramp generator's register has, as a number of a product's parameters, rounded.
pub(crate) fn in_usual_unit(product: Product, register: i32) -> i32 {
    let spec = product.spec();
    // What the divisors and the motor are makes no difference between a register and its parameter.
    let generator = Generator::of(spec, (0, 0));
    let axis = Axis { spec, scale: Scale { generator, microsteps: 1, steps: 1, lead: None } };
    let (own, usual, speed) = (generator.own_unit(), axis.usual_unit(), Quantity::Speed);
    let pulses = axis.scale.pulses(speed, own, Exact::whole(register));
    let number = pulses.and_then(|pulses| axis.scale.number(speed, usual, pulses)).map(Exact::rounded);
    number.and_then(|number| i32::try_from(number).ok()).unwrap_or(register)
}

/// The product, and the settings of the module that the options name.
fn module(options: &Options) -> Result<(Product, Option<Settings>), Failure> {
    let Options { link: Some(link), axis, link_options, steps, .. } = options else {
        return Ok((options.link_options.product.unwrap_or_default(), None));
    };
    let mut module = Conversation::open(&Reach { link: link.clone(), link_options: link_options.clone() })?;
    if let Some(message) = module.no_such_axis(*axis)? {
        return Err(Failure::Failed(message));
    }
    let settings = Settings::read(&mut module, *axis, *steps)?;
    Ok((module.known_product()?, Some(settings)))
}

/// The axis that the options describe, of a module with these settings.
fn axis(options: &Options, product: Product, settings: Option<Settings>) -> Result<Axis, String> {
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
    let pulse_divisor = divisor(AxisParameter::PulseDivisor, options.pulse_divisor, pulse, "pulse-divisor")?;
    let ramp_divisor = divisor(AxisParameter::RampDivisor, options.ramp_divisor, ramp, "ramp-divisor")?;
    let generator = Generator::of(spec, (pulse_divisor, ramp_divisor));
    let microsteps = options.microsteps.or(settings.map(|settings| settings.microsteps)).unwrap_or(256);
    let scale = Scale { generator, microsteps, steps: options.steps, lead: options.lead.map(|Lead(lead)| lead) };
    Ok(Axis { spec, scale })
}

/// Writes what a value is, in each of its meanings that the product can have.
fn write_value(out: &mut Vec<u8>, product: Product, axis: Axis, value: &Value) -> Result<(), Failure> {
    let mut refused = Vec::new();
    for meaning in &value.meanings {
        match *meaning {
            Meaning::Time(seconds) => write_time(out, axis, value, seconds)?,
            Meaning::Current(amperes) => {
                current::write(out, product, &value.text, value.number * amperes).map_err(Failure::Arguments)??;
            }
            Meaning::Motion(quantity, unit) => match axis.make(value, quantity, unit) {
                Ok(made) => write_motion(out, axis, value, quantity, made)?,
                Err(why) => refused.push(why),
            },
        }
    }
    // Of a unit of speeds and accelerations it is enough that one of them is possible.
    if refused.len() < value.meanings.len() {
        return Ok(());
    }
    Err(Failure::Arguments(refused.into_iter().next().unwrap_or_default()))
}

/// Writes a speed or an acceleration.
fn write_motion(out: &mut Vec<u8>, axis: Axis, value: &Value, quantity: Quantity, made: Made) -> Result<(), Failure> {
    let Scale { generator, microsteps, steps, .. } = axis.scale;
    let divisors = axis.divisors(quantity);
    writeln!(
        out,
        "{} as {} of a {}: {divisors}{microsteps} microsteps per full step, {steps} full steps per turn",
        value.text,
        quantity.name(),
        axis.spec.usb
    )?;
    let (whole, written) = made.written;
    let own = generator.own_unit();
    let remark = |unit| match axis.unit_mode() {
        Some(mode) if unit == own => format!("write {} while AP {mode} is 0", made.own),
        _ if unit == written => format!("write {whole}"),
        _ => String::new(),
    };
    let line = |unit: Unit| {
        let number = |pulses| axis.scale.number(quantity, unit, pulses).map_or_else(String::new, Exact::shown);
        Line {
            unit: unit.name(quantity).into(),
            numbers: vec![number(made.wanted), number(made.actual)],
            remark: remark(unit),
        }
    };
    let lines: Vec<Line> = axis.scale.units().map(line).collect();
    table::write(out, &["wanted", "gets"], &lines)?;
    Ok(())
}

/// Writes a time, of which one unit is so many seconds.
fn write_time(out: &mut Vec<u8>, axis: Axis, value: &Value, seconds: Exact) -> Result<(), Failure> {
    let wanted = value.number * seconds;
    if wanted.is_negative() {
        return Err(Failure::Arguments(format!("{}: a time is not negative", value.text)));
    }
    writeln!(out, "{} as a time of a {}", value.text, axis.spec.usb)?;
    let mut lines = vec![Line { unit: "s".into(), numbers: vec![wanted.shown()], remark: String::new() }];
    for tick in time::ticks(axis.spec, wanted) {
        let number = wanted * tick.seconds.inverse();
        let numbers = [Some(number.shown()), tick.number.map(|number| number.to_string())];
        let numbers = numbers.into_iter().flatten().collect();
        lines.push(Line { unit: tick.name.into(), numbers, remark: tick.takers.join(", ") });
    }
    table::write(out, &["wanted", "gets"], &lines)?;
    Ok(())
}
