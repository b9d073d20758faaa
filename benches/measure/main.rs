//! Figures of the flash images, from the emulated microcontroller: `cargo measure`.
//!
//! | file | figures |
//! |---|---|
//! | `memory` | flash, statics, stack |
//! | `load` | how busy the core is |
//! | `replies`, `waits` | how soon requests are answered, alone and behind other work |
//! | `commands` | what commands of a program cost |
//! | `interrupts` | how long interrupts wait, and are masked |
//! | `pieces` | how long the owner works between two looks at the links |
//! | `canopen` | how soon the CANopen image answers, what cyclic masters cost it, whether it loses frames |
//! | `budgets` | what the design allows |
//! | `profile` | where the cycles of one reply go |
//!
//! `arguments` reads what is asked for; `host` talks to the module, and `master` to a node of CANopen; `symbols` names
//! addresses; `statistics` and `report` make tables; `parallel` runs several machines at a time.
//! `tests/image/measure.rs` tests how it is used.

pub(crate) mod arguments;
mod budgets;
pub(crate) mod canopen;
mod commands;
pub(crate) mod host;
pub(crate) mod interrupts;
mod load;
mod master;
mod memory;
mod parallel;
mod pieces;
mod profile;
mod replies;
mod report;
mod statistics;
mod symbols;
mod waits;

use std::process::ExitCode;

use hal_sim::clock::{MILLISECOND, Nanos};

use arguments::{Order, Subject, USAGE};
use budgets::{Figures, Sister};
use host::Failure;
use report::{Report, progress};
use symbols::Symbols;

/// The page with the figures, in the workspace.
const PAGE: &str = "docs/figures.md";

/// How much is measured.
struct Extent {
    /// Samples of each command on each link.
    replies: usize,
    /// Samples behind each kind of work.
    waits: usize,
    /// How long a load is watched.
    load: Nanos,
    /// How long a program runs, and of how many kinds of commands there is one.
    program: Nanos,
    kinds: usize,
    /// How long interrupts are watched.
    interrupts: Nanos,
}

const FULL: Extent = Extent {
    replies: 101,
    waits: 300,
    load: 300 * MILLISECOND,
    program: 100 * MILLISECOND,
    kinds: commands::KINDS.len(),
    interrupts: 300 * MILLISECOND,
};
const SHORT: Extent = Extent {
    replies: 15,
    waits: 40,
    load: 50 * MILLISECOND,
    program: 100 * MILLISECOND,
    kinds: commands::BUDGETED,
    interrupts: 50 * MILLISECOND,
};

fn main() -> ExitCode {
    // Cargo says that this is a benchmark, and people may put a `--` of their own.
    let arguments: Vec<String> =
        std::env::args().skip(1).filter(|argument| argument != "--bench" && argument != "--").collect();
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("measure: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Does what is asked for. True if all is well.
pub(crate) fn run(arguments: &[String]) -> Result<bool, Failure> {
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (extent, updates) = match arguments::read(&arguments)? {
        Order::Help => {
            println!("{USAGE}");
            return Ok(true);
        }
        Order::Measure { short, updates } => (if short { SHORT } else { FULL }, updates),
        Order::Profile(Subject::Node(frame)) => return profile(&image(xtask::CANOPEN)?, Subject::Node(frame)),
        Order::Profile(subject) => return profile(&image(xtask::TMCL)?, subject),
        Order::Sister(name, subject) => return profile(&image(name)?, subject),
    };
    let images = Images {
        tmcl: image(xtask::TMCL)?,
        node: image(xtask::CANOPEN)?,
        six: image("tmcm6110")?,
        three: image("tmcm3212")?,
    };
    let mut report = Report::default();
    let kept = measure(&images, &extent, &mut report)?;
    if updates {
        report.write(&xtask::workspace()?.join(PAGE))?;
    }
    Ok(kept)
}

/// Builds an image by its name.
fn image(name: &str) -> Result<Vec<u8>, Failure> {
    progress(&format!("building {name}"));
    Ok(std::fs::read(common::image::try_built(name)?.path)?)
}

fn profile(elf: &[u8], subject: Subject<'_>) -> Result<bool, Failure> {
    profile::run(elf, &Symbols::read(elf)?, subject)?;
    Ok(true)
}

/// The images: of the TMCM-1140, with its two firmwares, of the TMCM-6110, and of the TMCM-3212.
struct Images {
    tmcl: Vec<u8>,
    node: Vec<u8>,
    six: Vec<u8>,
    three: Vec<u8>,
}

fn measure(images: &Images, extent: &Extent, report: &mut Report) -> Result<bool, Failure> {
    let Images { tmcl: elf, node, six, three } = images;
    let symbols = Symbols::read(elf)?;
    progress("memory");
    let mut figures = Figures {
        memory: memory::measure(elf, "Memory", report)?,
        load: load::measure(elf, &load::ROWS, extent.load, "Load of the core", report)?,
        replies: replies::measure(elf, extent.replies, report)?,
        waits: waits::measure(elf, extent.waits, report)?,
        commands: commands::measure(elf, extent.kinds, extent.program, "Commands of a running program", report)?,
        ..Figures::default()
    };
    interrupts::measure(elf, &symbols, extent.interrupts, report)?;
    progress("CANopen: memory");
    figures.node_memory = memory::measure_canopen(node, report)?;
    figures.node = canopen::measure(node, extent.replies, extent.load, report)?;
    figures.six = Sister {
        memory: memory::measure(six, "TMCM-6110: memory", report)?,
        load: load::measure(six, &load::SIX_AXES, extent.load, "TMCM-6110: load of the core", report)?,
        replies: replies::measure_briefly(six, extent.replies, "TMCM-6110: replies", report)?,
        ..Sister::default()
    };
    figures.piece = pieces::measure(elf, six, report)?;
    figures.three = Sister {
        memory: memory::measure(three, "TMCM-3212: memory", report)?,
        load: load::measure(three, &load::THREE_AXES, extent.load, "TMCM-3212: load of the core", report)?,
        replies: replies::measure_briefly(three, extent.replies, "TMCM-3212: replies", report)?,
        commands: commands::measure(
            three,
            extent.kinds,
            extent.program,
            "TMCM-3212: commands of a running program",
            report,
        )?,
    };
    Ok(budgets::check(&figures, report))
}
