//! `tmcl sim`: virtual modules in real time, or in time that a host controls, with links that host software opens.

pub mod answer;
pub mod control;
mod desk;
pub mod eeprom;
mod ending;
pub mod endpoint;
mod factory;
mod greeting;
mod inquiries;
mod introduce;
pub mod links;
mod options;
pub mod pacing;
pub mod pty;
mod ready;
mod simulator;
pub mod slcan;
pub mod stream;
pub mod tcp;
mod timekeeper;
pub mod watch;
mod worlds;

use std::fmt::Display;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

use tmcl_link::wording::words;
use tmcm::canopen;
use tmcm::module::Spec;
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::{Fleet, Member};
use tmcm_sim::image::{self, ImageModule, Setup};
use tmcm_sim::{Model, Product};

use crate::failure::Failure;
use crate::files;
use crate::output::Output;
use crate::tell;
use control::ControllerId;
use eeprom::EepromFile;
use ending::Ending;
use factory::Factory;
use inquiries::Inquiries;
use links::Links;
pub(crate) use options::address;
pub use options::{Firmware, Options};
use simulator::Simulator;
use timekeeper::Timekeeper;
pub(crate) use worlds::read_world;

/// Seed of the modules' random numbers; the world's random numbers have a seed in the world file.
const SEED: u32 = 1;
/// Longest sleep while the modules have nothing to do for a host.
const NAP: Duration = Duration::from_millis(5);
/// The same for CANopen nodes, which send by themselves: heartbeats, and PDOs by their timers.
const SHORT_NAP: Duration = Duration::from_millis(1);
/// Largest size of an image file in bytes: far above that of any image with debug information.
const LARGEST_IMAGE: u64 = 1 << 28;

/// Runs the virtual modules until a signal ends the program, or the end of standard input with --exit-with-stdin.
pub fn run(options: &Options) -> Result<(), Failure> {
    let image = options.image.as_deref().map(Image::read).transpose()?;
    let options = &options.checked(image.as_ref().and_then(|image| image.model))?;
    let stop = Ending::watch(options.exit_with_stdin)?;
    let worlds = worlds::of_all(options)?;
    let eeproms = match &options.eeprom {
        Some(path) => EepromFile::open_all(path, &options.product)?,
        None => Vec::new(),
    };
    let members = options.models().zip(worlds).collect();
    if let Some(image) = image {
        let what_runs =
            format!("that run{} {}", if options.product.len() == 1 { "s" } else { "" }, image.path.display());
        let factory = Factory { members, make: Box::new(|members| image.start(options, members)) };
        serve(options, stop, factory, eeproms, |_| what_runs.clone())
    } else {
        let factory = Factory { members, make: Box::new(|members| Ok(Fleet::mixed(members, SEED))) };
        serve(options, stop, factory, eeproms, |product| what_runs(product, options.firmware()))
    }
}

/// What a module runs without an image, as [`serve`] has it.
fn what_runs(product: Product, firmware: Firmware) -> String {
    let Spec { major, minor, .. } = product.spec();
    match firmware {
        Firmware::Tmcl => format!("with firmware version {major}.{minor:02}"),
        Firmware::Canopen => format!("with CANopen firmware version {}", canopen::VERSION),
    }
}

/// The image of option --image.
pub(crate) struct Image<'a> {
    path: &'a Path,
    pub(crate) elf: Vec<u8>,
    /// Product and firmware, if it tells.
    pub(crate) model: Option<Model>,
}

impl<'a> Image<'a> {
    pub(crate) fn read(path: &'a Path) -> Result<Self, Failure> {
        let elf = files::read_file(path, LARGEST_IMAGE);
        let none = |error: &dyn Display| Self::failed(path, error, options::IMAGES);
        let elf = elf.map_err(|error| none(&format!("cannot be read: {}", words(error))))?;
        let model = image::model(&elf).map_err(|error| none(&error))?;
        Ok(Image { path, elf, model })
    }

    fn failed(path: &Path, error: &dyn Display, advice: &str) -> Failure {
        let shown = path.display();
        Failure::Failed(format!("--image: {shown}: {error}. {advice}"))
    }

    /// The modules that run it.
    fn start(&self, options: &Options, members: &[Member<'_>]) -> Result<Fleet<ImageModule>, Failure> {
        // Only module 1 has hosts at its USB connector.
        let mut usb = options.needs_usb();
        Fleet::start(members, SEED, |Member { model, world, eeprom }, seed| {
            let setup = Setup { usb: std::mem::take(&mut usb), log: options.log };
            let module = ImageModule::of(model.product(), &self.elf, world, eeprom, seed, setup);
            module.map_err(|stop| Self::failed(self.path, &stop, options::advice(&stop)))
        })
    }
}

/// Opens the links, prints where they are, and runs the modules until `stop` says so. `what_runs` tells what runs in a
/// module of a product, as the end of a sentence: "A virtual TMCM-1140 ...".
fn serve<M: VirtualModule>(
    options: &Options,
    stop: Ending,
    factory: Factory<'_, M>,
    eeproms: Vec<EepromFile>,
    what_runs: impl Fn(Product) -> String,
) -> Result<(), Failure> {
    let telegrams = options.log_telegrams.as_deref().map(|path| Output::stream("--log-telegrams", path)).transpose()?;
    let mut fleet = factory.first(eeproms)?;
    if telegrams.is_some() {
        fleet.log_telegrams();
    }
    let links = Links::open(options)?;
    introduce::warn(&links);
    let mut out = tell::out();
    if options.ready_json {
        ready::line(&links, options, &mut out)?;
    } else {
        introduce::modules(options, what_runs, &mut out)?;
        introduce::links(&links, options, &mut out)?;
        writeln!(out, "ready")?;
    }
    out.flush()?;
    drop(out);
    let timekeeper = Timekeeper::new(options.speed, options.paused, fleet.now());
    let kinds = options.product.iter().map(|product| product.kind()).collect();
    let nap = if options.firmware() == Firmware::Canopen { SHORT_NAP } else { NAP };
    let (inquiries, last_controller) = (Inquiries::default(), ControllerId(0));
    Simulator { stop, factory, fleet, kinds, links, timekeeper, inquiries, nap, telegrams, last_controller }.run()
}

/// Prints a message for a person on standard error.
fn say(message: &str) {
    // A closed standard error must not end the simulator.
    let _ = writeln!(tell::err(), "tmcl sim: {message}");
}
