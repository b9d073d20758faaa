//! `tmcl tune`: measures what stallGuard2 and coolStep make of a motor, and proposes their settings.
//!
//! * `bench` - the axis, and what is put back in the end
//! * `track`, `plan` - where the motor goes, at which speeds, and for how long
//! * `drive`, `watch`, `stats` - samples at constant speed
//! * `brake`, `ask` - what loads the motor, and the user
//! * `stallguard`, `coolstep` - the two measurements, and what is proposed
//! * `measurement` - what both measurements have in common
//! * `found`, `table`, `proposal`, `plot` - what is shown

mod ask;
mod bench;
mod brake;
mod coolstep;
mod drive;
mod found;
mod measurement;
mod plan;
mod plot;
mod proposal;
mod stallguard;
mod stats;
mod table;
mod track;
mod watch;

use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

use bench::Bench;
use brake::Brake;
use clap::{Args, Subcommand};
use drive::Drive;
use found::{Found, Subject};
use measurement::Measurement;
use plan::{Cruise, Setup};
use tmcl_link::EndSignal;
use tmcl_server::worlds::read_world;
use tmcm::param::AxisParameter as P;
use tmcm::tmcl::{Command, Opcode};
use tmcm::vm::ProgramState;
use track::{Room, Track};
use watch::Method;

use crate::failure::Failure;
use crate::link::LinkTarget;
use crate::output::Output;
use crate::progress::Progress;
use crate::reach::Reach;
use crate::tell;
use crate::terminal;
use crate::world;

/// Measure what stallGuard2 and coolStep make of a motor, and propose settings for them
///
/// The motor goes to and fro at constant speed, without and with load, while one setting after the other is tried. Before
/// anything moves, it is said how far and for how long, and asked. In the end the motor is brought back to where it was,
/// and all settings are as before, also after Ctrl-C: then the motor is stopped where it is. What is found is
/// proposed as commands that can be sent, or written into a program.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// What to measure
    #[command(subcommand)]
    pub what: What,
}

/// What is measured.
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
    /// Without it the motor goes as far to the right as the measurement needs. On LINK sim the room is that of the world.
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

    fn name(&self) -> &'static str {
        match self {
            What::Stallguard(_) => "stallGuard2",
            What::Coolstep { .. } => "coolStep",
        }
    }
}

/// Measures and shows what was found.
pub fn run(options: &Options) -> Result<(), Failure> {
    let what = &options.what;
    let common = what.common();
    let is_simulated = common.reach.link == LinkTarget::Simulated;
    if !is_simulated && !common.yes && !ask::can_ask() {
        return Err(Failure::Arguments(
            "the motor is going to move, and nobody can be asked without a terminal: if it may, give --yes".into(),
        ));
    }
    // From here on a signal leaves nothing behind, also not the beginning of an image.
    let mut signal = EndSignal::watch()?;
    let plot = common.plot.as_deref().map(|path| Output::svg("--plot", path)).transpose()?;
    let mut module = common.reach.open()?;
    let product = module.known_product()?;
    let mut bench = Bench::new(module, &common.reach, &mut signal, product, common.axis);
    check(&mut bench)?;
    let setup = Setup::read(&mut bench, common.steps)?;
    let cruises = setup.cruises(&common.speeds)?;
    let current = bench.get(P::MaximumCurrent)?;
    let method = match what {
        What::Stallguard(_) => stallguard::METHOD,
        What::Coolstep { .. } => coolstep::method(current),
    };
    let latency = latency(&mut bench)?;
    let track = track(&mut bench, common, &setup, &cruises, method, latency)?;
    let brake = match (&common.control, is_simulated) {
        (Some(address), _) => Brake::control(address, common.axis, common.load)?,
        (None, true) => Brake::World { load: common.load, before: 0.0 },
        (None, false) => Brake::Hand(ask::Lines::default()),
    };
    let readings = match what {
        What::Stallguard(_) => stallguard::READINGS,
        What::Coolstep { .. } => coolstep::READINGS,
    };
    let each = readings.0 + readings.1;
    let time = cruises.iter().map(|cruise| setup.time(cruise, method, each, track.way(), latency)).sum();
    announce(what, &track, &setup, time, common)?;
    if !is_simulated && !common.yes {
        ask::consent("May the motor move?", bench.signal)?;
    }

    let progress = Progress::new(format!("measuring {}", what.name()), each as usize * cruises.len());
    let drive = Drive::new(&mut bench, track, setup.microsteps);
    let mut measurement = Measurement::new(drive, cruises, brake, progress);
    let found = match what {
        What::Stallguard(_) => stallguard::measure(&mut measurement).map(Found::Stallguard),
        What::Coolstep { threshold, .. } => coolstep::measure(&mut measurement, *threshold, current)
            .map(|(speeds_tried, choice)| Found::Coolstep { speeds_tried, choice, threshold: *threshold, current }),
    };
    let (mut brake, load) = measurement.end();
    if found.is_err() {
        brake.let_go(common.axis);
    }
    let found = match found {
        Ok(found) => bench.bring_back(track.home).map(|()| found),
        Err(failure @ Failure::Failed(_)) if bench.answers() => {
            // Why the measurement has failed counts, and not why the motor does not come back: where it stands is told.
            let _ = bench.bring_back(track.home);
            Err(failure)
        }
        Err(failure) => Err(failure),
    };
    let found = put_back(&mut bench, &track, found)?;
    found.show(&Subject { product, axis: common.axis, load, unit: setup.live.unit() }, plot)
}

/// Fails if the motor turns, or a program could move it.
fn check(bench: &mut Bench<'_>) -> Result<(), Failure> {
    let axis = bench.axis;
    if let Some(message) = bench.module.no_such_axis(axis)? {
        return Err(Failure::Failed(message));
    }
    if bench.get(P::ActualSpeed)? != 0 {
        return Err(Failure::Failed(format!("motor {axis} turns; stop it first, for example with \"MST {axis}\"")));
    }
    let ask = Command::new(Opcode::ApplicationStatus as u8, 0, 0, 0);
    match bench.module.value(ask) {
        Ok(status) if status.to_be_bytes().first() == Some(&(ProgramState::Run as u8)) => Err(Failure::Failed(
            "a program runs in the module and could move the motor; stop it first, for example with 128, 0, 0, 0"
                .into(),
        )),
        Err(error) if !error.is_refusal() => Err(error.into()),
        _ => Ok(()),
    }
}

/// How long a sample takes: it is made of so many requests.
fn latency(bench: &mut Bench<'_>) -> Result<Duration, Failure> {
    const REQUESTS: u32 = 4;
    let begun = bench.module.time();
    for _ in 0..REQUESTS {
        bench.get(P::ActualSpeed)?;
    }
    Ok(bench.module.time().saturating_sub(begun))
}

/// The track on which the motor is measured.
fn track(
    bench: &mut Bench<'_>,
    common: &Common,
    setup: &Setup,
    cruises: &[Cruise],
    method: Method,
    latency: Duration,
) -> Result<Track, Failure> {
    let need = setup.need(cruises, method, latency);
    let room = match (common.room, &common.reach.surroundings.world) {
        (Some(microsteps), _) => Room::named(microsteps),
        (None, Some(world)) => {
            let world = read_world(world, bench.product)?;
            Room::of_world(&world, usize::from(bench.axis), f64::from(setup.microsteps))
        }
        (None, None) => Room::default(),
    };
    let track = room.track(bench.get(P::ActualPosition)?, &need);
    if !track.is_enough(&need) {
        return Err(Failure::Failed(format!(
            "the motor needs {:.0} microsteps to reach its speed, be measured and stop, and has room for {:.0}: give it more \
             with --room, or measure at lower speeds",
            need.least().ceil(),
            track.way()
        )));
    }
    Ok(track)
}

/// Says what is going to happen.
fn announce(what: &What, track: &Track, setup: &Setup, time: Duration, common: &Common) -> Result<(), Failure> {
    let turns = track.way() / f64::from(setup.microsteps) / f64::from(common.steps);
    let Track { low, high, home } = track;
    let text = format!(
        "To measure {}, motor {} goes to and fro between {low} and {high}, which are {turns:.1} turns, for {}; it is at {home} \
         now and comes back.",
        what.name(),
        common.axis,
        track::about(time)
    );
    let mut told = Vec::new();
    table::text(&mut told, &text, terminal::columns())?;
    // A closed standard error must not keep the motor from being measured.
    let _ = tell::err().write_all(&told);
    Ok(())
}

/// Stops the motor and puts everything back. A failure is told with what the user has to know besides.
fn put_back<T>(bench: &mut Bench<'_>, track: &Track, found: Result<T, Failure>) -> Result<T, Failure> {
    let left = bench.restore();
    let also = if !left.is_empty() {
        let left: Vec<String> = left.iter().map(ToString::to_string).collect();
        format!(
            "the module could not be told to go back to how it was; when it answers again, send {}",
            left.join("; ")
        )
    } else {
        match bench.whereabouts() {
            Some(here) if here != track.home && !bench.is_simulated() => {
                let (axis, home) = (bench.axis, track.home);
                format!(
                    "all settings are as before, and the motor stands at {here}; MVP ABS, {axis}, {home} brings it back"
                )
            }
            _ => "all settings are as before".into(),
        }
    };
    match (found, left.is_empty()) {
        (Ok(found), true) => Ok(found),
        (Ok(_), false) => Err(Failure::Failed(also)),
        (Err(Failure::Failed(message)), _) => Err(Failure::Failed(format!("{message}; {also}"))),
        (Err(Failure::Interrupted { signal, .. }), _) => Err(Failure::Interrupted { signal, message: also }),
        (Err(failure), true) => Err(failure),
        (Err(_), false) => Err(Failure::Failed(also)),
    }
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
