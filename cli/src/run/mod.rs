//! `tmcl run`: a program on a virtual module, in virtual time, with report, trace and plot.

use std::cell::RefCell;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use hal_sim::clock::Nanos;
use hal_sim::world::config::WorldConfig;
use tmcl_link::EndSignal;
use tmcl_server::worlds::read_world;
use tmcl_tools::asm::Settings;
use tmcl_tools::product::{self, Product};
use tmcl_tools::run::{End, Event, Recording, Report, Session, Trace, draw, in_order, ran, time, variables};
use tmcm_sim::NativeModule;

use crate::failure::{Ended, Failure};
use crate::files::{STANDARD, is_standard};
use crate::output::Output;
use crate::program::read_program;
use crate::progress;
use crate::tell;

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
    #[arg(long, value_name = "TIME", default_value = "10 s", allow_hyphen_values = true, value_parser = time::parse)]
    pub until: Nanos,

    /// Show every command that is executed: when and where, and what is in the registers after it
    ///
    /// It goes to the file TRACE, or to standard output if no file is named (then this option comes after FILE).
    #[arg(long, value_name = "TRACE", num_args = 0..=1, default_missing_value = STANDARD)]
    pub trace: Option<PathBuf>,

    /// Draw position, speed, load, current, outputs and switches over time into an SVG file, which web browsers show
    ///
    /// Of a module with several axes those that move are drawn, one below the other. The stallGuard value is there if
    /// it says something while a motor turns, the rotor while it is not where the counter says. Inputs, outputs and
    /// switches are there if they change. The name ends in .svg; - is standard output, and the report goes to standard
    /// error then.
    #[arg(long, value_name = "OUT.svg")]
    pub plot: Option<PathBuf>,

    /// Describe the motor, its stage, switches, encoder and supply; as for `tmcl sim`
    ///
    /// Without it there is a free 200-step motor on 24 V and nothing at the inputs.
    #[arg(long, value_name = "FILE.toml")]
    pub world: Option<PathBuf>,

    /// At a time after the start, change the world or send a command as a host; may be given many times
    ///
    /// The world: press|release left|right|home, input N 0|1, analog N VALUE, supply VOLTS, temperature DEGC, load X,
    /// slip STEPS, fault NAME on|off, power off|on. X is a torque, 0 to 1: 1 is the motor's at full current, and with
    /// less current less stalls it. The number of an axis may stand behind press, release, load, slip and fault: `load
    /// 0.5 1`; without one it is axis 0. Commands to the module are written in capitals, as for `tmcl send`, or as four
    /// numbers: "129, 1, 0, 5" starts the routine at address 5.
    #[arg(long, value_name = "TIME: WHAT", allow_hyphen_values = true, value_parser = Event::parse)]
    pub at: Vec<Event>,

    /// Take the assembler's warnings for errors, and end with 1 when a command was refused, a division was one by zero,
    /// or the return stack was full or empty
    #[arg(long)]
    pub strict: bool,

    /// Write the report as an object of JSON in one line
    ///
    /// Among its fields are end (in words), running, time_s and commands. The fields refused, divisions_by_zero,
    /// stack_full and stack_empty each have count and the place of the first one. Each of axes has position, target,
    /// velocity and lost_steps. The others are outputs, accumulator, x, error_flags, user_variables, events, plot.
    #[arg(long)]
    pub json: bool,

    /// The virtual module's product: {numbers}
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
  tmcl run stage.tmc --strict --json
      for a script: is anything wrong, and where is the motor?
The exit code is 0 however the program ends, and 1 if it cannot be run, or with --strict if anything went wrong in it.";

/// Real time after which a progress bar is shown.
const PATIENCE: Duration = Duration::from_secs(1);
/// Seed of the module's random numbers.
const SEED: u32 = 1;

/// Runs a program and shows what it does.
pub fn run(options: &Options) -> Result<(), Failure> {
    check_outputs(options)?;
    let kind = options.product.kind();
    options.at.iter().try_for_each(|event| event.check(kind)).map_err(Failure::Arguments)?;
    let settings = Settings { product: Some(options.product), strict: options.strict, ..Settings::default() };
    let program = read_program(&options.program, settings)?;
    let world = options.world.as_deref().map(|path| read_world(path, options.product));
    let world = world.transpose()?.unwrap_or_else(WorldConfig::default);
    let signal = EndSignal::watch()?;
    let mut plot = options.plot.as_deref().map(|path| Output::svg("--plot", path)).transpose()?;
    let trace = RefCell::new(options.trace.as_deref().map(|path| Output::stream("--trace", path)).transpose()?);
    let unwritten = RefCell::new(None);
    let mut write = |text: &str| {
        let written = trace.borrow_mut().as_mut().map_or(Ok(()), |out| out.write_all(text.as_bytes()));
        written.map_err(|error| unwritten.replace(Some(error))).is_ok()
    };
    let recording = plot.is_some().then(|| Recording::new(options.product));
    let module = NativeModule::of(options.product, &world, None, SEED);
    let told = trace.borrow().is_some().then(|| Trace::begin(&mut write, &program));
    let mut session = Session::new(module, &program, in_order(&options.at), told, recording)?;
    let before = variables(&mut session.module);
    let end = session.run(options.until, &signal, &mut progress::bar_after(PATIENCE));
    if let Some(error) = unwritten.take() {
        return Err(error.into());
    }
    let end = end?;
    trace.take().map_or(Ok(()), Output::finish)?;
    let mut report = Report::of(&mut session, end, options.until, &program, &before);
    if let Some((plot, recording)) = plot.as_mut().zip(session.recording.as_ref()) {
        let name = match options.program.file_name().map(|name| name.to_string_lossy()) {
            Some(name) if !is_standard(&options.program) => name,
            _ => "standard input".into(),
        };
        plot.write_all(draw(&name, ran(&session, end), recording, &program).as_bytes())?;
        report.plot = Some(plot.name().into());
    }
    let beside = plot.as_ref().is_some_and(Output::is_standard);
    plot.map_or(Ok(()), Output::finish)?;
    show(options, &report, beside)?;
    if end == End::Signal {
        // The report has told that it was interrupted.
        return Err(signal.failure(""));
    }
    match report.wrong().filter(|_| options.strict) {
        Some(wrong) => Err(Failure::Failed(format!("--strict: {wrong}"))),
        None => Ok(()),
    }
}

/// Prints the report: on standard error if the plot is on standard output.
fn show(options: &Options, report: &Report, beside: bool) -> Result<(), Failure> {
    let text = if options.json {
        serde_json::to_string(report).map_err(std::io::Error::from)? + "\n"
    } else {
        report.to_string()
    };
    if beside {
        // A closed standard error must not end the program.
        let _ = tell::err().write_all(text.as_bytes());
        return Ok(());
    }
    let mut out = tell::out();
    if options.trace.as_deref().is_some_and(is_standard) {
        writeln!(out)?;
    }
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// Fails if two results would go to one place, or one would replace what is read.
fn check_outputs(options: &Options) -> Result<(), Failure> {
    let Options { trace, plot, program, world, json, .. } = options;
    let outputs = [("--trace", trace.as_deref()), ("--plot", plot.as_deref())];
    let inputs = [("the program", Some(program.as_path())), ("the world", world.as_deref())];
    for (option, output) in outputs {
        for (what, input) in inputs {
            if output.zip(input).is_some_and(|(output, input)| is_same(output, input)) {
                return Err(Failure::Failed(format!("{option} would replace {what}; give another file")));
            }
        }
    }
    if trace.as_deref().zip(plot.as_deref()).is_some_and(|(trace, plot)| trace == plot || is_same(trace, plot)) {
        return Err(Failure::Arguments("--trace and --plot cannot have the same file".into()));
    }
    let standard = outputs.into_iter().find(|(_, output)| output.is_some_and(is_standard));
    match standard.filter(|_| *json) {
        Some((option, _)) => Err(Failure::Arguments(format!(
            "--json and {option} cannot both have standard output; give {option} the name of a file"
        ))),
        None => Ok(()),
    }
}

/// True for two names of one file that exists.
fn is_same(a: &Path, b: &Path) -> bool {
    a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b))
}
