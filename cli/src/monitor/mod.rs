//! `tmcl monitor`: samples of the axes' positions, speeds, loads, flags and switches.

mod line;
mod sample;

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use clap::Args;
use tmcm::param::AxisParameter;

use crate::conversation::{Conversation, Error, Reach};
use crate::failure::Failure;
use crate::signal::EndSignal;
use line::{Shown, Speeds, line, status};
use sample::{headline, numbers, sample};

/// Watch the axes: position, speed, load, error flags and switches, as they change
///
/// On a terminal one line is refreshed; elsewhere each sample is a line of its own for each axis. Several axes share
/// the line of a terminal: "2      -51200  1000 l-h!" is axis 2 at -51200 with speed 1000, its left and its home switch
/// closed, and with errors. Where even that is too long, there are positions alone: "2!    -51200". Ctrl-C ends it.
/// Beware: the module forgets its extended error flags (axis parameter 207: a stall, a deviation of the encoder) when
/// they are read, so other host software may miss them while this runs. The line shows all that have been seen.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// The axes to watch, for example 0,2; without it all that the module has
    #[arg(long, value_name = "N[,N...]", value_delimiter = ',')]
    pub axis: Vec<u8>,

    /// Write comma separated values with a headline: time in seconds, then the parameters as numbers
    ///
    /// A value is left empty where the module does not know the parameter. Of several axes each has columns of its own,
    /// with its number: position_0, speed_0, ..., position_2.
    #[arg(long)]
    pub csv: bool,

    /// Time between two samples, in milliseconds; a slow link may need longer, and several axes take their time
    #[arg(long, value_name = "MS", default_value_t = 100)]
    pub interval: u64,

    /// End after so many samples
    #[arg(long, value_name = "N")]
    pub count: Option<u64>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl monitor /dev/ttyACM0                                     one line, refreshed ten times a second
  tmcl monitor tcp:127.0.0.1:4140 --csv --count 600 > run.csv   a minute for a plot
  tmcl monitor /dev/ttyUSB0 --address 3 --interval 500          module 3 on an RS485 bus
  tmcl monitor /dev/ttyACM0 --axis 0,2                          two axes of several";

/// Shows samples until a signal comes or the wanted number has been shown.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut module = Conversation::open(&options.reach)?;
    let axes = axes(&mut module, &options.axis)?;
    let speeds = speeds(&mut module, &axes)?;
    let signal = EndSignal::watch()?;
    let terminal = std::io::stdout().is_terminal();
    let mut out = std::io::stdout().lock();
    if options.csv {
        writeln!(out, "{}", headline(&axes))?;
    }
    let begun = Instant::now();
    let interval = Duration::from_millis(options.interval);
    let mut due = begun;
    let mut samples = 0;
    let mut end = Ok(());
    let mut all: Vec<Shown> = axes.iter().map(|&axis| Shown { axis, sample: Default::default(), seen: 0 }).collect();
    while options.count.is_none_or(|count| samples < count) {
        if signal.within(due.saturating_duration_since(Instant::now())) {
            end = Err(signal.failure(""));
            break;
        }
        for shown in &mut all {
            shown.sample = sample(&mut module, shown.axis)?;
            shown.seen |= shown.sample[4].unwrap_or_default();
        }
        if options.csv {
            let numbers: Vec<String> = all.iter().map(|shown| numbers(&shown.sample)).collect();
            writeln!(out, "{:.3},{}", begun.elapsed().as_secs_f64(), numbers.join(","))?;
        } else if terminal {
            let width = columns().saturating_sub(1);
            let line = if let [shown] = all.as_slice() { line(shown, &speeds) } else { status(&all, &speeds, width) };
            // The line is cut to the terminal's width, because a line that wraps around could not be overwritten.
            write!(out, "\r{line:.width$}\x1b[K")?;
        } else {
            for shown in &all {
                let axis = if all.len() == 1 { String::new() } else { format!("axis {}  ", shown.axis) };
                writeln!(out, "{axis}{}", line(shown, &speeds))?;
            }
        }
        out.flush()?;
        samples += 1;
        due = (due + interval).max(Instant::now());
    }
    if terminal && !options.csv {
        writeln!(out)?;
    }
    end
}

/// How speeds are shown: in the unit that the first axis has them in, as long as it watches.
fn speeds(module: &mut Conversation, axes: &[u8]) -> Result<Speeds, Error> {
    let in_chip = axes.first().map_or(Ok(false), |axis| module.is_in_chip_units(*axis))?;
    Ok(Speeds::of(module.product()?, in_chip))
}

/// The axes to watch: those that are wanted, or else all that there are.
fn axes(module: &mut Conversation, wanted: &[u8]) -> Result<Vec<u8>, Error> {
    if wanted.is_empty() {
        return Ok((0..module.axes()?).collect());
    }
    let mut axes: Vec<u8> = Vec::new();
    for &axis in wanted {
        // Without this check an axis that the module does not have would show as an axis without parameters.
        module.axis(axis, AxisParameter::ActualPosition)?;
        if !axes.contains(&axis) {
            axes.push(axis);
        }
    }
    Ok(axes)
}

/// Width of the terminal in characters.
fn columns() -> usize {
    let size = rustix::termios::tcgetwinsize(std::io::stdout());
    size.map(|size| size.ws_col.into()).ok().filter(|columns| *columns > 0).unwrap_or(80)
}
