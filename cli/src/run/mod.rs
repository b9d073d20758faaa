//! `tmcl run`: a program on a virtual module, in virtual time, with report, trace and plot.

mod host;
mod plot;
mod recording;
mod report;
mod script;
mod session;
mod time;
mod trace;

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use hal_sim::clock::Nanos;
use hal_sim::world::config::WorldConfig;

use crate::failure::Failure;
use crate::files::STANDARD;
use crate::product::{self, Product};
use crate::program::read_program;
use crate::signal::EndSignal;
use crate::sim::read_world;
use recording::Recording;
pub use script::{Action, Event};
use session::{End, Session};
use tmcm_sim::NativeModule;
use trace::Trace;

/// Run a TMCL program on a virtual module and show what it does
///
/// FILE is a program as text, which is assembled first, or an assembled one whose name ends in .bin. It is loaded into
/// a virtual module of its own, with a motor, and started. Time is virtual: ten seconds pass in a fraction of one, and
/// every run of a program is the same. The run is over when the program is, or at the time --until; then a report
/// tells how it ended and what it has brought about.
///
/// What happens around the module is said by --world and --at: a stage with switches and ends, a load, a host that
/// sends commands.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// The program
    #[arg(value_name = "FILE")]
    pub program: PathBuf,

    /// Let the program run no longer than TIME, which has a unit: us, ms, s, min or h
    #[arg(long, value_name = "TIME", default_value = "10 s", value_parser = time::parse)]
    pub until: Nanos,

    /// Show every command that is executed: when and where, and what is in the registers after it
    ///
    /// It goes to the file TRACE, or to standard output if no file is named (then this option comes after FILE).
    #[arg(long, value_name = "TRACE", num_args = 0..=1, default_missing_value = STANDARD)]
    pub trace: Option<PathBuf>,

    /// Draw position, speed, load, current, outputs and switches over time into an SVG file, which web browsers show
    ///
    /// Of a module with several axes those that move are drawn, one below the other.
    #[arg(long, value_name = "OUT.svg")]
    pub plot: Option<PathBuf>,

    /// Describe the motor, its stage, switches, encoder and supply; as for `tmcl sim`
    ///
    /// Without it there is a free 200-step motor on 24 V and nothing at the inputs.
    #[arg(long, value_name = "FILE.toml")]
    pub world: Option<PathBuf>,

    /// At a time after the start, change the world or send a command as a host; may be given many times
    ///
    /// The world: press|release left|right|home, input N 0|1, analog N VALUE, supply VOLTS, temperature DEGC, load X (a
    /// torque, 0 to 1: 1 is the motor's at full current, and with less current less stalls it), slip STEPS, fault NAME on|off, power off|on. The number of an axis may stand behind press,
    /// release, load, slip and fault: `load 0.5 1`; without one it is axis 0. Commands to the module are written in
    /// capitals, as for `tmcl send`, or as four numbers: "129, 1, 0, 5" starts the routine at address 5.
    #[arg(long, value_name = "TIME: WHAT", value_parser = Event::parse)]
    pub at: Vec<Event>,

    /// What the virtual module is: 1140, 3110, 3212 or 6110
    #[arg(long, value_name = "NAME", default_value = product::USUAL, value_parser = product::named)]
    pub product: Product,
}

const EXAMPLES: &str = "\
Examples:
  tmcl run stage.tmc
      ten seconds of the program in stage.tmc, and a report
  tmcl run stage.tmc --until \"2 min\" --plot stage.svg
      two minutes, drawn
  tmcl run stage.tmc --trace | less
      every command that is executed
  tmcl run stage.tmc --world stage.toml --at \"1500 ms: press left\" --at \"2 s: release left\"
      on a stage that stage.toml describes, with a hand at the left switch
  tmcl run stage.tmc --at \"1 s: SGP 0, 2, 500\" --at \"3 s: SGP 0, 2, 0\"
      with a host that sets user variable 0
  tmcl run stage.tmc --product 6110 --at \"1 s: press home 5\"
      on a module with six axes
The exit code is 0 however the program ends, and 1 if it cannot be run.";

/// Seed of the module's random numbers.
const SEED: u32 = 1;

/// Runs a program and shows what it does.
pub fn run(options: &Options) -> Result<(), Failure> {
    for (option, output) in [("--trace", &options.trace), ("--plot", &options.plot)] {
        spare(option, output.as_deref(), &options.program)?;
    }
    let kind = options.product.kind();
    options.at.iter().try_for_each(|event| event.check(kind)).map_err(Failure::Arguments)?;
    let program = read_program(&options.program, Some(options.product))?;
    let world = options.world.as_deref().map(|path| read_world(path, options.product));
    let world = world.transpose()?.unwrap_or_else(WorldConfig::default);
    let signal = EndSignal::watch()?;
    let trace = options.trace.as_deref().map(|path| Trace::begin(path, &program)).transpose()?;
    let recording = options.plot.is_some().then(|| Recording::new(options.product));
    let module = NativeModule::of(options.product, &world, None, SEED);
    let mut session = Session::new(module, &program, script::in_order(&options.at), trace, recording)?;
    let before = report::variables(&mut session.module);
    let end = session.run(options.until, &signal)?;
    let report = report::report(&mut session, end, options.until, &program, &before);
    let mut out = std::io::stdout().lock();
    if options.trace.as_deref() == Some(Path::new(STANDARD)) {
        writeln!(out)?;
    }
    write!(out, "{report}")?;
    if let Some((path, recording)) = options.plot.as_deref().zip(session.recording.as_ref()) {
        let name = options.program.file_name().unwrap_or_default().to_string_lossy();
        let shown = path.display();
        let drawn = std::fs::write(path, plot::draw(&name, report::time(&session, end), recording, &program));
        drawn.map_err(|error| Failure::Failed(format!("--plot: cannot write {shown}: {error}")))?;
        writeln!(out, "{:<18}{shown}", "plot")?;
    }
    if end == End::Signal {
        // The report has told that it was interrupted.
        return Err(signal.failure(""));
    }
    Ok(())
}

/// Fails if an output file is the program's own file.
fn spare(option: &str, output: Option<&Path>, program: &Path) -> Result<(), Failure> {
    let same =
        output.is_some_and(|output| output.canonicalize().is_ok_and(|o| program.canonicalize().is_ok_and(|p| o == p)));
    if same { Err(Failure::Failed(format!("{option} would replace the program; give another file"))) } else { Ok(()) }
}
