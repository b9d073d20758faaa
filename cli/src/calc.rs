//! `tmcl calc`: speeds, accelerations, times and currents in all units of a product, and the way and time of moves.

use std::io::Write;

use clap::Args;
use tmcl_tools::calc::{self, Given, Lead, MOST_DIVIDED, Settings};
use tmcl_tools::product::Product;

use crate::failure::Failure;
use crate::link::LinkTarget;
use crate::reach::{LinkOptions, Reach};
use crate::tell;

/// Convert speeds, accelerations, times and currents between the units of a product; tell how long a move takes
///
/// The numbers of a product with a TMC429 are internal units of this motion controller (int), which mean what pulse and
/// ramp divisor make of them. Those of a TMCM-3212 are microsteps per second (pps), which it makes units of its chip
/// (chip). What a motor does is in full steps per second, turns per second (rps) and per minute (rpm). Accelerations
/// are in pps2, full steps/s2, rps/s and rpm/s, and again in int and chip. With --lead there are mm/s and mm/s2, of
/// what a lead screw or a belt moves. Times are in us, ms, s, min, and in what a product has them in, such as x10 ms.
/// Currents are in A and mA, RMS as in the products' data sheets.
///
/// For each value there is a table. The column "wanted" has the value in each unit. Numbers in a module are whole, so
/// it has something next to that, which is in the column "gets".
///
/// "move DISTANCE at SPEED with ACCELERATION" tells how far and how long the motor speeds up, goes at full speed and
/// slows down. Distances are in microsteps, full steps, turns or mm. "stop from SPEED with ACCELERATION" tells how far
/// a motor goes on that turns at a speed. The ramp of a TMCM-3212 may have more points: vstart SPEED, a1 ACCELERATION,
/// v1 SPEED, dmax ACCELERATION, d1 ACCELERATION and vstop SPEED. They are its parameters 19, 15, 16, 17, 18 and 20.
/// Without dmax it slows down as it speeds up.
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
    #[arg(long, value_name = "MM", value_parser = Lead::parse)]
    pub lead: Option<Lead>,
}

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

/// Prints a table for each value.
pub fn run(options: &Options) -> Result<(), Failure> {
    let (product, settings) = module(options)?;
    let Options { pulse_divisor, ramp_divisor, microsteps, steps, lead, .. } = *options;
    let given = Given { pulse_divisor, ramp_divisor, microsteps, steps, lead };
    let text = calc::text(product, settings, &given, &options.values).map_err(Failure::Arguments)?;
    let mut out = tell::out();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// The product, and the settings of the module that the options name.
fn module(options: &Options) -> Result<(Product, Option<Settings>), Failure> {
    let Options { link: Some(link), axis, link_options, steps, .. } = options else {
        return Ok((options.link_options.product.unwrap_or_default(), None));
    };
    let mut module = Reach { link: link.clone(), link_options: link_options.clone() }.open()?;
    if let Some(message) = module.no_such_axis(*axis)? {
        return Err(Failure::Failed(message));
    }
    let settings = Settings::read(&mut module, *axis, *steps)?;
    Ok((module.known_product()?, Some(settings)))
}
