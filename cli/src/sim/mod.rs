//! `tmcl sim`: virtual modules in real time, with links that host software opens.
//!
//! One thread runs everything. Each turn of its loop sleeps until bytes arrive or a module has something to do, lets
//! virtual time pass up to the present, takes the bytes that have arrived, and writes the replies that are due.

pub mod control;
pub mod eeprom;
mod ending;
pub mod endpoint;
mod introduce;
pub mod links;
mod options;
pub mod pacing;
pub mod pty;
pub mod slcan;
pub mod stream;
pub mod tcp;
mod worlds;

pub(crate) use options::address;
pub use options::{Firmware, Options};
pub(crate) use worlds::read_world;

use std::fmt::Display;
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use rustix::event::{PollFd, PollFlags, Timespec};
use tmcm::canopen;
use tmcm::module::Spec;

use crate::failure::Failure;
use crate::files;
use crate::wording::words;
use eeprom::EepromFile;
use ending::Ending;
use links::Links;
use pacing::Pacer;
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::{Fleet, Member};
use tmcm_sim::image::{self, ImageModule, Setup};
use tmcm_sim::{Model, Product};

/// Seed of the modules' random numbers; the world's random numbers have a seed in the world file.
const SEED: u32 = 1;
/// Longest sleep while the modules have nothing to do for a host.
const NAP: Duration = Duration::from_millis(5);
/// The same for CANopen nodes, which send by themselves: heartbeats, and PDOs by their timers.
const SHORT_NAP: Duration = Duration::from_millis(1);
/// Longest real time spent on virtual time before the links are served again.
const LONGEST_TURN: Duration = Duration::from_millis(2);
/// Span of virtual time that is simulated between two looks at the clock, in nanoseconds.
const PORTION: Nanos = MILLISECOND;

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
    let contents = eeproms.iter().map(EepromFile::contents).chain(std::iter::repeat(None));
    let members: Vec<Member<'_>> = (options.models().zip(&worlds).zip(contents))
        .map(|((model, world), eeprom)| Member { model, world, eeprom })
        .collect();
    if let Some(image) = image {
        let fleet = image.start(options, &members)?;
        let what_runs = format!("that run{} {}", if members.len() == 1 { "s" } else { "" }, image.path.display());
        serve(options, stop, fleet, eeproms, |_| what_runs.clone())
    } else {
        let fleet = Fleet::mixed(&members, SEED);
        serve(options, stop, fleet, eeproms, |product| what_runs(product, options.firmware()))
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
struct Image<'a> {
    path: &'a Path,
    elf: Vec<u8>,
    /// Product and firmware, if it tells.
    model: Option<Model>,
}

impl<'a> Image<'a> {
    fn read(path: &'a Path) -> Result<Self, Failure> {
        let elf = files::read_file(path, LARGEST_IMAGE);
        let elf = elf.map_err(|error| Self::failed(path, &format!("cannot be read: {}", words(error))))?;
        let model = image::model(&elf).map_err(|error| Self::failed(path, &error))?;
        Ok(Image { path, elf, model })
    }

    fn failed(path: &Path, error: &dyn Display) -> Failure {
        let how = "`cargo fw` builds the image of the TMCM-1140, `cargo fw-canopen` that of its CANopen firmware, \
                   `cargo fw-3212` that of the TMCM-3212, and `cargo fw-6110` that of the TMCM-6110";
        let shown = path.display();
        Failure::Failed(format!("--image: {shown}: {error}. {how}"))
    }

    /// The modules that run it.
    fn start(&self, options: &Options, members: &[Member<'_>]) -> Result<Fleet<ImageModule>, Failure> {
        // Only module 1 has hosts at its USB connector.
        let mut usb = options.needs_usb();
        Fleet::start(members, SEED, |Member { model, world, eeprom }, seed| {
            let setup = Setup { usb: std::mem::take(&mut usb), log: options.log };
            let module = ImageModule::of(model.product(), &self.elf, world, eeprom, seed, setup);
            module.map_err(|stop| Self::failed(self.path, &stop))
        })
    }
}

/// Opens the links, prints where they are, and runs the modules until `stop` says so. `what_runs` tells what runs in a
/// module of a product, as the end of a sentence: "A virtual TMCM-1140 ...".
fn serve<M: VirtualModule>(
    options: &Options,
    stop: Ending,
    mut fleet: Fleet<M>,
    eeproms: Vec<EepromFile>,
    what_runs: impl Fn(Product) -> String,
) -> Result<(), Failure> {
    fleet.await_silences();
    for (mut file, module) in eeproms.into_iter().zip(fleet.modules_mut()) {
        let mut board = module.board_mut();
        // The file is written at once, because a user should learn now, not at the first store, that it cannot be.
        file.save(board.at25().contents())?;
        board.at25_mut().keep_in(Box::new(file));
    }
    let links = Links::open(options)?;
    let mut out = std::io::stdout().lock();
    introduce::modules(options, what_runs, &mut out)?;
    introduce::links(&links, options, &mut out)?;
    writeln!(out, "ready")?;
    out.flush()?;
    let pacer = Pacer::new(options.speed, Instant::now(), fleet.now());
    let nap = if options.firmware() == Firmware::Canopen { SHORT_NAP } else { NAP };
    Simulator { stop, fleet, links, pacer, nap }.run()
}

/// The state of the running simulator.
struct Simulator<M> {
    stop: Ending,
    fleet: Fleet<M>,
    links: Links,
    pacer: Pacer,
    /// Longest sleep while the modules have nothing to do for a host.
    nap: Duration,
}

impl<M: VirtualModule> Simulator<M> {
    fn run(mut self) -> Result<(), Failure> {
        while !self.sleep()? {
            self.let_time_pass();
            self.take_requests();
            self.hand_out_replies();
            self.report_messages();
            self.check()?;
        }
        Ok(())
    }

    /// Sleeps until bytes arrive or an event of the modules is due. True if the program is to end.
    fn sleep(&mut self) -> Result<bool, Failure> {
        let nap = if self.pacer.is_behind() { Duration::ZERO } else { self.nap };
        let mut wake = self.pacer.when(self.pacer.reached()) + nap;
        if self.fleet.is_busy() {
            wake = self.fleet.next_event().map_or(wake, |due| wake.min(self.pacer.when(due)));
        }
        wake = self.links.silence_ends().map_or(wake, |end| wake.min(end));
        if self.links.has_lines() {
            wake = Instant::now();
        }
        let left = wake.saturating_duration_since(Instant::now());
        let timeout = Timespec { tv_sec: left.as_secs() as i64, tv_nsec: left.subsec_nanos().into() };

        let interests = self.links.interests();
        let mut polled: Vec<PollFd<'_>> =
            self.stop.signs().map(|sign| PollFd::from_borrowed_fd(sign, PollFlags::IN)).collect();
        let signs = polled.len();
        polled.extend(interests.into_iter().map(|(fd, flags)| PollFd::from_borrowed_fd(fd, flags)));
        match rustix::event::poll(&mut polled, Some(&timeout)) {
            Ok(_) => Ok(polled.iter().take(signs).any(|sign| !sign.revents().is_empty()) && self.stop.has_come()),
            Err(rustix::io::Errno::INTR) => Ok(false),
            Err(error) => Err(Failure::Failed(format!("cannot wait for the links: {}", words(error)))),
        }
    }

    /// Lets virtual time pass up to the present, or as far as [`LONGEST_TURN`] of real time suffices.
    fn let_time_pass(&mut self) {
        let begun = Instant::now();
        let goal = self.pacer.advance(begun);
        while self.pacer.is_behind() && begun.elapsed() < LONGEST_TURN {
            let to = goal.min(self.pacer.reached() + PORTION);
            self.fleet.run_until(to);
            self.pacer.reach(to);
        }
    }

    fn take_requests(&mut self) {
        self.links.receive(&mut self.fleet).iter().for_each(|message| say(message));
        // The control port is taken out of `links`, because its commands change the other links meanwhile.
        let mut control = self.links.control.take();
        if let Some(server) = &mut control {
            server.accept(control::Controller::new).iter().for_each(|message| say(message));
            for controller in &mut server.clients {
                controller.receive(|line| {
                    let answer = control::execute(line, &mut self.fleet, &self.pacer);
                    // Lost bytes are removed before the answer is sent, because a host may send new bytes after the
                    // answer.
                    self.links.lose(self.fleet.take_lost());
                    answer
                });
            }
        }
        self.links.control = control;
    }

    fn hand_out_replies(&mut self) {
        self.links.send(&mut self.fleet);
        self.links.tidy(&mut self.fleet);
    }

    fn report_messages(&mut self) {
        let several = self.fleet.modules().len() > 1;
        for (number, module) in (1..).zip(self.fleet.modules_mut()) {
            for message in module.take_log() {
                say(&if several { format!("module {number}: {message}") } else { message });
            }
        }
        if let Some(lag) = self.pacer.lag() {
            let (seconds, achieved) = (lag as f64 / SECOND as f64, self.pacer.achieved());
            say(&format!(
                "virtual time lags, it is {seconds:.1} s behind and goes at {achieved:.2} times the clock's pace"
            ));
        }
    }

    /// Ends the program if a module cannot go on.
    fn check(&self) -> Result<(), Failure> {
        let stopped = |(number, module): (usize, &M)| Some(format!("module {number} stopped: {}", module.stopped()?));
        (1..).zip(self.fleet.modules()).find_map(stopped).map_or(Ok(()), |why| Err(Failure::Failed(why)))
    }
}

/// Prints a message for a person on standard error.
fn say(message: &str) {
    // A closed standard error must not end the simulator.
    let _ = writeln!(std::io::stderr(), "tmcl sim: {message}");
}
