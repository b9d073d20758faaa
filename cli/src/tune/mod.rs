//! `tmcl tune`: measures what stallGuard2 and coolStep make of a motor, and proposes their settings.
//!
//! * `ask` - questions to the user
//! * `hand`, `control` - what loads the motor: the user, or the control port of a virtual module
//! * `room` - the progress bar, which makes room for them

mod ask;
mod control;
mod hand;
mod room;

use std::cell::RefCell;
use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use control::ControlPort;
use hand::Hand;
use room::WithRoom;
use tmcl_link::EndSignal;
use tmcl_server::worlds::read_world;
use tmcl_tools::product::Product;
use tmcl_tools::tune::{self, Brake, Found, Order, Tuning, Way, World, wrapped};

use crate::failure::Failure;
use crate::link::LinkTarget;
use crate::output::Output;
use crate::progress::Bar;
use crate::reach::Reach;
use crate::tell;
use crate::terminal;
use crate::world;

/// Measure what stallGuard2 and coolStep make of a motor, and propose settings for them
///
/// The motor goes to and fro at constant speed, without and with load, while one setting after the other is tried.
/// Before anything moves, it is said how far and for how long, and asked. In the end the motor is brought back to where
/// it was, and all settings are as before, also after Ctrl-C: then the motor is stopped where it is. What is found is
/// proposed as commands that can be sent, or written into a program.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The measurement
    #[command(subcommand)]
    pub what: What,
}

/// A measurement.
#[derive(Subcommand, Debug)]
pub enum What {
    /// The threshold of stallGuard2 (axis parameter 174), with which a stall can be told from a motor that turns
    #[command(after_long_help = EXAMPLES)]
    Stallguard(Common),
    /// The settings of coolStep (axis parameters 168 to 172), with which the current (180) follows the load
    #[command(after_long_help = EXAMPLES)]
    Coolstep {
        /// How to measure
        #[command(flatten)]
        common: Common,

        /// The threshold of stallGuard2 (174) to measure with; without it that which the module has
        #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(i32).range(-64..=63))]
        threshold: Option<i32>,
    },
}

/// How to measure.
#[derive(Args, Debug)]
pub struct Common {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// The axis
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub axis: u8,

    /// Speeds to measure at: numbers of the product, or with a unit of `tmcl calc`, as in 800,"60 rpm"
    ///
    /// Without it they are the half and the whole of the maximum positioning speed (axis parameter 4).
    #[arg(long, value_name = "SPEED[,SPEED...]", value_delimiter = ',')]
    pub speeds: Vec<String>,

    /// The room that the motor has, in microsteps from where it is: to the right, or to the left if it is negative
    ///
    /// Without it the motor goes as far to the right as the measurement needs. On LINK sim the room is that of the
    /// world.
    #[arg(long, value_name = "MICROSTEPS", allow_negative_numbers = true)]
    pub room: Option<i32>,

    /// Full steps per turn of the motor, for speeds in turns
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(1..))]
    pub steps: u16,

    /// Load the motor of a virtual module by this port: that of `tmcl sim --control`
    ///
    /// On LINK sim the motor is loaded without it. Otherwise somebody has to hold the shaft when asked to.
    #[arg(long, value_name = "ADDR:PORT", value_parser = world::address)]
    pub control: Option<String>,

    /// Load a virtual motor with this part of its torque at full current, in place of one that it can just bear
    #[arg(long, value_name = "X", value_parser = fraction)]
    pub load: Option<f64>,

    /// Do not ask before the motor moves
    #[arg(long)]
    pub yes: bool,

    /// Draw the curves into an SVG file, which web browsers show
    #[arg(long, value_name = "OUT.svg")]
    pub plot: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl tune stallguard sim --world examples/stall_homing.toml --speeds 800
      a threshold for the stage of examples/stall_homing.tmc
  tmcl tune coolstep sim --world examples/stall_homing.toml --speeds 800 --threshold 10
      current by load, with this threshold of stallGuard2
  tmcl tune stallguard /dev/ttyACM0 --speeds \"60 rpm,90 rpm\" --room -100000 --plot stall.svg
      a motor on your table, which has room to the left; you hold the shaft when asked to
  tmcl tune stallguard tcp:127.0.0.1:4140 --control 127.0.0.1:4141 --yes
      a virtual module, whose motor is loaded by its control port";

/// Reads a fraction.
fn fraction(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| (0.0..=1.0).contains(number));
    number.ok_or_else(|| "give a number from 0 to 1, such as 0.4".into())
}

impl What {
    fn common(&self) -> &Common {
        match self {
            What::Stallguard(common) | What::Coolstep { common, .. } => common,
        }
    }

    /// The order to the library: the measurement of this product.
    fn order(&self, product: Product) -> Result<Order, Failure> {
        let common = self.common();
        let way = match (common.room, &common.reach.surroundings.world) {
            (Some(microsteps), _) => Way::Microsteps(microsteps),
            (None, Some(world)) => Way::World(Box::new(read_world(world, product)?)),
            (None, None) => Way::Any,
        };
        let what = match self {
            What::Stallguard(_) => tune::What::Stallguard,
            What::Coolstep { threshold, .. } => tune::What::Coolstep { threshold: *threshold },
        };
        Ok(Order { what, axis: common.axis, speeds: common.speeds.clone(), way, steps: common.steps })
    }
}

/// Measures and shows what was found.
pub fn run(options: &Options) -> Result<(), Failure> {
    let common = options.what.common();
    let is_simulated = common.reach.link == LinkTarget::Simulated;
    let asks = !is_simulated && !common.yes;
    if asks && !ask::can_ask() {
        return Err(Failure::Arguments(
            "the motor is going to move, and nobody can be asked without a terminal: if it may, give --yes".into(),
        ));
    }
    // From here on a signal leaves nothing behind, also not the beginning of an image.
    let signal = EndSignal::watch()?;
    let plot = common.plot.as_deref().map(|path| Output::svg("--plot", path)).transpose()?;
    let mut module = common.reach.open()?;
    let product = module.known_product()?;
    let order = options.what.order(product)?;
    let mut reopen = || common.reach.open().ok();
    let tuning = Tuning::prepare(module, product, &order, &mut reopen, &signal)?;
    let brake: Box<dyn Brake> = match (&common.control, is_simulated) {
        (Some(address), _) => Box::new(ControlPort::connect(address, common.axis, common.load)?),
        (None, true) => Box::new(World::new(common.load)),
        (None, false) => Box::new(Hand::open()?),
    };
    for line in wrapped(&tuning.announcement(), terminal::columns()) {
        // A closed standard error must not keep the motor from being measured.
        let _ = writeln!(tell::err(), "{line}");
    }
    if asks {
        ask::consent("May the motor move?", &signal)?;
    }
    let bar = RefCell::new(Bar::default());
    let mut brake = WithRoom { brake, bar: &bar };
    let found = tuning.measure(&mut brake, &mut |told| bar.borrow_mut().tell(told));
    drop(bar);
    show(&found?, plot)
}

/// Shows what was found on standard output, and draws it. Where the image goes to standard output, the rest goes to
/// standard error.
fn show(found: &Found, plot: Option<Output>) -> Result<(), Failure> {
    let text = found.text(terminal::columns());
    match plot.as_ref().is_some_and(Output::is_standard) {
        // A closed standard error does not keep the image from being drawn.
        true => tell::err().write_all(text.as_bytes()).unwrap_or_default(),
        false => tell::out().write_all(text.as_bytes()).and_then(|()| tell::out().flush())?,
    }
    if let Some(mut plot) = plot {
        plot.write_all(found.svg().as_bytes())?;
        plot.finish()?;
    }
    found.proposals().map(|_| ()).map_err(Failure::Failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_is_a_part_of_the_torque() {
        for (text, load) in [("0", 0.0), ("0.4", 0.4), ("1", 1.0), ("1e-3", 0.001)] {
            assert_eq!(fraction(text), Ok(load));
        }
        for text in ["-0.1", "1.01", "1.5", "inf", "NaN", "half", ""] {
            assert_eq!(fraction(text).unwrap_err(), "give a number from 0 to 1, such as 0.4", "{text}");
        }
    }
}
