//! `tmcl monitor`: samples of the axes' positions, speeds, loads, flags and switches.

mod display;

use std::time::Duration;

use clap::Args;
use display::{Display, Form};
use tmcl_link::EndSignal;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::monitor::{Column, Pace, columns, sample, speeds};
use tmcl_tools::number;
use tmcl_tools::stop::Stop;

use crate::failure::{Ended, Failure};
use crate::link::LinkTarget;
use crate::reach::Reach;

/// Watch the axes: position, speed, load, error flags and switches, as they change
///
/// On a terminal one line is refreshed; elsewhere each sample is a line of its own for each axis. Several axes share
/// the line of a terminal: "2      -51200  1000 l-h!" is axis 2 at -51200 with speed 1000, its left and its home switch
/// closed, and with errors. Where even that is too long, there are positions alone: "2!    -51200". Ctrl-C ends it.
/// Beware: the module forgets its extended error flags (axis parameter 207: a stall, a deviation of the encoder) when
/// they are read. So other host software may miss them while this runs. The line shows all that have been seen.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// The axes to watch, for example 0,2; without it all that the module has
    #[arg(long, value_name = "N[,N...]", value_delimiter = ',', value_parser = number::within(0..=u8::MAX))]
    pub axis: Vec<u8>,

    /// The axis parameters to watch by number, for example 1,3,206,180, in place of the usual ones
    #[arg(long, value_name = "N[,N...]", value_delimiter = ',', value_parser = number::within(0..=u8::MAX))]
    pub params: Vec<u8>,

    /// Write comma separated values with a headline: time in seconds, then the parameters as numbers
    ///
    /// The time is that at which the position was read, or what comes first in its place. A value is left empty where
    /// the module does not know the parameter. Of several axes each has columns of its own, with its number:
    /// position_0, speed_0, ..., position_2; their positions are read directly one after the other.
    #[arg(long, conflicts_with = "json")]
    pub csv: bool,

    /// Write an object of JSON for each axis and sample: time_s, axis, and the parameters as numbers
    #[arg(long)]
    pub json: bool,

    /// Time between two samples, in milliseconds; 0 is as often as possible
    ///
    /// A slow link may need longer, and several axes take their time: then it says how long a sample takes.
    #[arg(
        long, value_name = "MS", default_value_t = 100,
        value_parser = number::within(0..=LONGEST_INTERVAL)
    )]
    pub interval: u64,

    /// End after so many samples
    #[arg(long, value_name = "N")]
    pub count: Option<u64>,
}

/// Longest interval in milliseconds: a day.
const LONGEST_INTERVAL: u64 = 24 * 3600 * 1000;

const EXAMPLES: &str = "\
Examples:
  tmcl monitor /dev/ttyACM0                                     one line, refreshed ten times a second
  tmcl monitor tcp:127.0.0.1:4140 --csv --count 100 > run.csv   ten seconds for a plot
  tmcl monitor /dev/ttyUSB0 --address 3 --interval 500          module 3 on an RS485 bus
  tmcl monitor /dev/ttyACM0 --axis 0,2                          two axes of several
  tmcl monitor sim --params 1,3,206,180 --json --count 2        position, speed, load and current, for a program";

/// Shows samples until a signal comes or the wanted number has been shown.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut module = options.reach.open()?;
    let axes = axes(&mut module, &options.axis)?;
    let columns = columns(&mut module, &axes, &options.params)?;
    let speeds = speeds(&mut module, &axes)?;
    let form = options.csv.then_some(Form::Csv).or(options.json.then_some(Form::Json));
    let mut display = Display::new(form, axes.clone(), columns.clone(), speeds);
    let watched = watch(options, &mut module, (&axes, &columns), &mut display);
    // What has ended it is told on a line of its own.
    let ended = display.end_line();
    watched.and(ended)
}

fn watch(
    options: &Options,
    module: &mut Conversation,
    (axes, columns): (&[u8], &[Column]),
    display: &mut Display,
) -> Result<(), Failure> {
    let signal = EndSignal::watch()?;
    let interval = Duration::from_millis(options.interval);
    let too_short = |took: Duration| {
        format!(
            "--interval {}: a sample takes {} ms over this link, so there is one about every {} ms; fewer --params or \
             --axis take less",
            options.interval,
            took.as_millis(),
            took.as_millis()
        )
    };
    display.begin()?;
    let mut pace = Pace::new(interval);
    let begun = module.time();
    let mut due = begun;
    let mut samples = 0;
    while options.count.is_none_or(|count| samples < count) {
        let left = due.saturating_sub(module.time());
        // The time of a virtual module passes at once, and its user's does not.
        let simulated = options.reach.link == LinkTarget::Simulated;
        if module.pause(left, &signal) || simulated && signal.within(left) {
            return Err(signal.failure(""));
        }
        let start = module.time();
        display.show(&sample(module, axes, columns)?, begun)?;
        samples += 1;
        let now = module.time();
        if let Some(took) = pace.took(now.saturating_sub(start)) {
            display.say(&too_short(took))?;
        }
        due = (due + interval).max(now);
    }
    pace.at_the_end().map_or(Ok(()), |took| display.say(&too_short(took)))
}

/// The axes to watch: those that are wanted, or else all that there are.
fn axes(module: &mut Conversation, wanted: &[u8]) -> Result<Vec<u8>, Failure> {
    if wanted.is_empty() {
        return Ok((0..module.axes()?).collect());
    }
    let mut axes: Vec<u8> = Vec::new();
    for &axis in wanted {
        // Without this check an axis that the module does not have would show as an axis without parameters.
        if let Some(message) = module.no_such_axis(axis)? {
            return Err(Failure::Failed(format!("--{message}")));
        }
        if !axes.contains(&axis) {
            axes.push(axis);
        }
    }
    Ok(axes)
}
