//! From the options to modules that run.

use std::time::{Duration, Instant};

use tmcl_tools::desk::{ControllerId, Inquiries, Timekeeper};
use tmcm::canopen;
use tmcm::module::Spec;
use tmcm_sim::fleet::Fleet;
use tmcm_sim::{Product, VirtualModule};

use crate::console::Console;
use crate::eeprom::EepromFile;
use crate::ending::Ending;
use crate::factory::Factory;
use crate::failure::Failure;
use crate::image::Image;
use crate::links::Links;
use crate::options::{FirmwareOption, Options};
use crate::simulator::Simulator;
use crate::{SEED, introduce, ready, worlds};

/// Longest sleep while the modules have nothing to do for a host.
const NAP: Duration = Duration::from_millis(5);
/// The same for CANopen nodes, which send by themselves: heartbeats, and PDOs by their timers.
const SHORT_NAP: Duration = Duration::from_millis(1);

/// Runs the virtual modules until a signal asks for the end, or the end of standard input with --exit-with-stdin.
///
/// # Errors
/// The options contradict each other, something that they name cannot be used, a module stops, or `console` cannot
/// print.
pub fn run(options: &Options, console: Console) -> Result<(), Failure> {
    let image = options.image.as_deref().map(Image::read).transpose()?;
    let options = &options.checked(image.as_ref().and_then(|image| image.model))?;
    let stop = Ending::watch(options.exit_with_stdin)?;
    let worlds = worlds::of_all(options)?;
    let eeproms = match &options.eeprom {
        Some(path) => EepromFile::open_all(path, &options.product, console.say)?,
        None => Vec::new(),
    };
    let members = options.models().zip(worlds).collect();
    if let Some(image) = image {
        let what_runs =
            format!("that run{} {}", if options.product.len() == 1 { "s" } else { "" }, image.path.display());
        let factory = Factory { members, make: Box::new(|members| image.start(options, members)) };
        serve(options, console, stop, factory, eeproms, |_| what_runs.clone())
    } else {
        let factory = Factory { members, make: Box::new(|members| Ok(Fleet::mixed(members, SEED))) };
        serve(options, console, stop, factory, eeproms, |product| what_runs(product, options.firmware()))
    }
}

/// The firmware that a module runs without an image, as [`serve`] has it.
fn what_runs(product: Product, firmware: FirmwareOption) -> String {
    let Spec { major, minor, .. } = product.spec();
    match firmware {
        FirmwareOption::Tmcl => format!("with firmware version {major}.{minor:02}"),
        FirmwareOption::Canopen => format!("with CANopen firmware version {}", canopen::VERSION),
    }
}

/// Opens the links, prints where they are, and runs the modules until `stop` says so. `what_runs` tells what runs in a
/// module of a product, as the end of a sentence: "A virtual TMCM-1140 ...".
fn serve<M: VirtualModule>(
    options: &Options,
    console: Console,
    stop: Ending,
    factory: Factory<'_, M>,
    eeproms: Vec<EepromFile>,
    what_runs: impl Fn(Product) -> String,
) -> Result<(), Failure> {
    let telegrams = options.log_telegrams.as_deref().map(console.log).transpose()?;
    let mut fleet = factory.first(eeproms)?;
    if telegrams.is_some() {
        fleet.log_telegrams();
    }
    let links = Links::open(options)?;
    introduce::warn(&links, console.say);
    let mut out = (console.out)();
    if options.ready_json {
        ready::line(&links, options, &mut out)?;
    } else {
        introduce::modules(options, what_runs, &mut out)?;
        introduce::links(&links, options, &mut out)?;
        writeln!(out, "ready")?;
    }
    out.flush()?;
    drop(out);
    let timekeeper = Timekeeper::new(options.speed, options.paused, Duration::ZERO, fleet.now());
    let kinds = options.product.iter().map(|product| product.kind()).collect();
    let nap = if options.firmware() == FirmwareOption::Canopen { SHORT_NAP } else { NAP };
    let (inquiries, last_controller) = (Inquiries::default(), ControllerId(0));
    let (say, begun) = (console.say, Instant::now());
    Simulator { stop, factory, fleet, kinds, links, timekeeper, inquiries, nap, telegrams, say, begun, last_controller }
        .run()
}
