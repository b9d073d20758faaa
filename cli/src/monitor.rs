//! `tmcl monitor`: samples of an axis's position, speed, load, flags and switches.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use clap::Args;
use signal_hook::consts::{SIGINT, SIGTERM};
use tmcm::param::AxisParameter;

use crate::conversation::{Conversation, Error, Reach};
use crate::failure::Failure;
use crate::signal::EndSignal;

/// Watch an axis: position, speed, load, error flags and switches, as they change
///
/// On a terminal one line is refreshed; elsewhere each sample is a line of its own. Ctrl-C ends it. Beware: the
/// module forgets its extended error flags (axis parameter 207: a stall, a deviation of the encoder) when they are
/// read, so other host software may miss them while this runs. The line shows all that have been seen.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The module to talk to
    #[command(flatten)]
    pub reach: Reach,

    /// The axis to watch, of a module with several
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub axis: u8,

    /// Write comma separated values with a headline: time in seconds, then the parameters as numbers
    ///
    /// A value is left empty where the module does not know the parameter.
    #[arg(long)]
    pub csv: bool,

    /// Time between two samples, in milliseconds; a slow link may need longer
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
  tmcl monitor /dev/ttyUSB0 --address 3 --interval 500          module 3 on an RS485 bus";

/// The parameters that are sampled, each with its name in the headline of the CSV form.
const COLUMNS: [(AxisParameter, &str); 8] = [
    (AxisParameter::ActualPosition, "position"),
    (AxisParameter::ActualSpeed, "speed"),
    (AxisParameter::ActualLoad, "load"),
    (AxisParameter::DriverErrorFlags, "driver_flags"),
    (AxisParameter::ExtendedErrorFlags, "extended_flags"),
    (AxisParameter::LeftSwitch, "left_switch"),
    (AxisParameter::RightSwitch, "right_switch"),
    (AxisParameter::HomeSwitch, "home_switch"),
];

/// Names of the driver's error flags (axis parameter 208), from bit 0 on.
const DRIVER_FLAGS: [&str; 8] = ["SG", "OT", "OTPW", "S2GA", "S2GB", "OLA", "OLB", "STST"];
/// Names of the extended error flags (axis parameter 207), from bit 0 on.
const EXTENDED_FLAGS: [&str; 2] = ["stall", "deviation"];

/// The values of all columns; `None` for a parameter that the module does not have.
type Sample = [Option<i32>; COLUMNS.len()];

/// Shows samples until a signal comes or the wanted number has been shown.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut module = Conversation::open(&options.reach)?;
    // Without this check an axis that the module does not have would show as an axis without parameters.
    module.axis(options.axis, AxisParameter::ActualPosition)?;
    let signal = EndSignal::watch(&[SIGINT, SIGTERM])?;
    let terminal = std::io::stdout().is_terminal();
    let mut out = std::io::stdout().lock();
    if options.csv {
        writeln!(out, "time_s,{}", COLUMNS.map(|(_, name)| name).join(","))?;
    }
    let begun = Instant::now();
    let interval = Duration::from_millis(options.interval);
    let mut due = begun;
    let mut samples = 0;
    let mut seen = 0;
    while options.count.is_none_or(|count| samples < count) {
        if signal.within(due.saturating_duration_since(Instant::now())) {
            break;
        }
        let sample = sample(&mut module, options.axis)?;
        if options.csv {
            writeln!(out, "{:.3},{}", begun.elapsed().as_secs_f64(), numbers(&sample))?;
        } else {
            seen |= sample[4].unwrap_or_default();
            let line = line(&sample, seen);
            if terminal {
                // The line is cut to the terminal's width, because a line that wraps around could not be overwritten.
                write!(out, "\r{line:.width$}\x1b[K", width = columns().saturating_sub(1))?;
            } else {
                writeln!(out, "{line}")?;
            }
        }
        out.flush()?;
        samples += 1;
        due = (due + interval).max(Instant::now());
    }
    if terminal && !options.csv {
        writeln!(out)?;
    }
    Ok(())
}

/// Width of the terminal in characters.
fn columns() -> usize {
    let size = rustix::termios::tcgetwinsize(std::io::stdout());
    size.map(|size| size.ws_col.into()).ok().filter(|columns| *columns > 0).unwrap_or(80)
}

fn sample(module: &mut Conversation, axis: u8) -> Result<Sample, Error> {
    let mut sample = Sample::default();
    for (value, (parameter, _)) in sample.iter_mut().zip(COLUMNS) {
        *value = match module.axis(axis, parameter) {
            Ok(value) => Some(value),
            Err(error) if error.is_refusal() => None,
            Err(error) => return Err(error),
        };
    }
    Ok(sample)
}

/// The values of a sample with commas in between.
fn numbers(sample: &Sample) -> String {
    sample.map(|value| value.map_or_else(String::new, |value| value.to_string())).join(",")
}

/// A sample as a line for people; `seen` has the extended error flags of all samples so far.
fn line(sample: &Sample, seen: i32) -> String {
    let [position, speed, load, driver, _, left, right, home] = *sample;
    let number = |value: Option<i32>| value.map_or_else(|| "-".into(), |value| value.to_string());
    let pressed = [(left, "left"), (right, "right"), (home, "home")];
    let pressed: Vec<&str> = pressed.into_iter().filter(|(value, _)| *value == Some(1)).map(|(_, name)| name).collect();
    format!(
        "position {:>11}  speed {:>5}  load {:>4}  switches {}  driver {}  errors {}",
        number(position),
        number(speed),
        number(load),
        listed(&pressed),
        listed(&flags(driver.unwrap_or_default(), &DRIVER_FLAGS)),
        listed(&flags(seen, &EXTENDED_FLAGS)),
    )
}

/// The names of the bits that are set.
fn flags(bits: i32, names: &[&'static str]) -> Vec<&'static str> {
    (0..).zip(names).filter(|(bit, _)| bits & (1 << bit) != 0).map(|(_, name)| *name).collect()
}

fn listed(names: &[&str]) -> String {
    if names.is_empty() { "-".into() } else { names.join(" ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_in_words_and_in_numbers() {
        let sample = [Some(-51_200), Some(1000), None, Some(0b1000_0001), Some(0), Some(1), Some(0), Some(1)];
        assert_eq!(
            line(&sample, 1),
            "position      -51200  speed  1000  load    -  switches left home  driver SG STST  errors stall"
        );
        assert_eq!(numbers(&sample), "-51200,1000,,129,0,1,0,1");
        assert!(line(&Sample::default(), 0).ends_with("switches -  driver -  errors -"));
    }
}
