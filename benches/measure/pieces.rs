//! How long the owner of the module is at work between two looks at the links: the TMCM-6110 beside the TMCM-1140.

use std::collections::HashMap;

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::mcu::{Act, Step};

use super::host::{Failure, Host, Link, command};
use super::load::OWNER;
use super::parallel;
use super::report::{Report, progress};
use super::statistics::{grouped, microseconds};
use super::symbols::Symbols;

/// The exceptions in which the owner runs: of TIM3, and of received CAN frames.
const OWNERS: [u16; 2] = [OWNER, 16 + 20];
/// The functions that look at the links: whether there is a request on RS485, and whether an interrupt of the owner's
/// is pending.
const LOOKS: [&str; 2] = ["stm32f4::rs485::request", "runtime::owner::Owner::wanted"];

/// Time for each command that is sent while the owner is watched.
const EACH: Nanos = 2 * MILLISECOND;

/// The work of the owner. In the commands an axis' number stands for the #.
struct Work {
    name: &'static str,
    world: &'static str,
    /// The commands that are sent before.
    before: &'static [&'static str],
    /// The program that runs.
    program: &'static [&'static str],
    /// The requests over CAN, for as long as the owner is watched.
    asked: &'static [&'static str],
    /// How long it is watched after that.
    span: Nanos,
}

const IDLE: Work = Work { name: "at rest", world: "", before: &[], program: &[], asked: &[], span: 100 * MILLISECOND };

/// The last two are for several axes.
const WORKS: [Work; 9] = [
    IDLE,
    Work { name: "all axes moving", before: &["ROR #, 1000"], ..IDLE },
    Work {
        name: "a search of all axes, from beginning to end",
        world: "stage.left = -2000\nstage.home = [1000, 1200]\nstage.right = 3000",
        before: &["SAP 193, #, 7", "RFS START, #"],
        span: 1_500 * MILLISECOND,
        ..IDLE
    },
    Work {
        name: "all axes stopped by their switches",
        world: "stage.right = 3000",
        before: &["SAP 12, #, 0", "ROR #, 1000"],
        span: 600 * MILLISECOND,
        ..IDLE
    },
    Work {
        name: "a program that reads positions",
        before: &["ROR #, 1000"],
        program: &["GAP 1, 0", "CALC ADD, 1", "JA 0"],
        ..IDLE
    },
    Work {
        name: "a command over CAN",
        asked: &[
            "ROR #, 1000",
            "MVP ABS, #, 5000",
            "MVP ABS, #, 9000",
            "MST #",
            "SAP 4, #, 700",
            "SAP 140, #, 4",
            "SAP 154, #, 4",
            "SAP 1, #, 0",
            "RFS START, #",
            "RFS STOP, #",
            "GAP 1, #",
            "SCO 1, #, 5000",
            "SGP 79, 0, 1",
            "STAP 4, #",
        ],
        ..IDLE
    },
    Work {
        name: "a command over CAN while all axes move",
        before: &["ROR #, 1000"],
        asked: &["GAP 1, #", "MVP ABS, #, 90000", "SAP 4, #, 700", "STAP 4, #", "ROL #, 900", "MST #"],
        ..IDLE
    },
    Work {
        name: "MVP COORD of all axes at once",
        before: &["SCO 1, #, 5000"],
        asked: &["MVP COORD, 255, 1"],
        span: 5 * MILLISECOND,
        ..IDLE
    },
    Work {
        name: "MVP COORD of three axes on a straight line",
        before: &["SCO 1, #, 5000"],
        asked: &["MVP COORD, 71, 1"],
        span: 200 * MILLISECOND,
        ..IDLE
    },
];
/// How many of them the budget is about.
const BUDGETED: usize = 7;

/// Watches the owner.
struct Watch<'s> {
    symbols: &'s Symbols<'s>,
    /// Places of the program that are known, and whether each is a look at the links.
    looks: HashMap<u32, bool>,
    /// The cycle of the last look; `None` while the owner is not at work.
    since: Option<u64>,
    longest: u64,
}

/// Measures the longest pieces of two images. Gives how much longer that of the second one is, in thousandths, in the
/// work in which it is so most.
pub(crate) fn measure(one: &[u8], six: &[u8], report: &mut Report) -> Result<u64, Failure> {
    let images = parallel::map(&[one, six], |elf| longest(elf))?;
    let mut most = 0;
    let rows: Vec<[String; 5]> = WORKS
        .iter()
        .enumerate()
        .map(|(index, work)| {
            let [one, six] = [0, 1].map(|image: usize| images.get(image).and_then(|all| all.get(index)).copied());
            let [one, six] = [one, six].map(Option::unwrap_or_default);
            let times = six * 1_000 / one.max(1);
            let is_budgeted = index < BUDGETED;
            if is_budgeted {
                most = most.max(times);
            }
            let (one, times) = if is_budgeted {
                (grouped(one), format!("{:.2}", times as f64 / 1e3))
            } else {
                ("-".into(), "-".into())
            };
            [work.name.into(), one, grouped(six), microseconds(six), times]
        })
        .collect();
    report.title("TMCM-6110: between two looks at the links");
    report.text(
        "The longest piece of work of the owner after which it looks whether there is a request. All axes do the same, and \
         each its own piece.",
    );
    report.table(["longest piece, cycles", "TMCM-1140", "TMCM-6110", "us", "times"], &rows);
    Ok(most)
}

/// The longest piece in each work.
fn longest(elf: &[u8]) -> Result<Vec<u64>, Failure> {
    let symbols = Symbols::read(elf)?;
    let one = |work: &Work| {
        progress(&format!("pieces: {}", work.name));
        let mut host = Host::in_world(elf, work.world)?;
        if !work.program.is_empty() {
            host.run_program(Link::Can, work.program)?;
        }
        for line in work.before {
            host.tell_each(Link::Can, line)?;
        }
        let mut watch = Watch { symbols: &symbols, looks: HashMap::new(), since: None, longest: 0 };
        for line in work.asked {
            for line in host.lines(line) {
                host.send(Link::Can, command(&line)?);
                host.watch(EACH, &mut |step| watch.add(&step))?;
            }
        }
        host.watch(work.span, &mut |step| watch.add(&step))?;
        if !watch.looks.values().any(|looks| *looks) {
            return Err(format!("pieces: the owner of this image calls none of {}", LOOKS.join(" and ")).into());
        }
        Ok(watch.longest)
    };
    WORKS.iter().map(one).collect()
}

impl Watch<'_> {
    fn add(&mut self, step: &Step) {
        match step.act {
            Act::Entry(exception) if OWNERS.contains(&exception) => self.since = Some(step.at + step.cycles),
            Act::Entry(_) => {}
            _ if step.exception == 0 => self.end(step.at),
            _ if OWNERS.contains(&step.exception) && self.is_look(step.pc) => {
                self.end(step.at);
                self.since = Some(step.at + step.cycles);
            }
            _ => {}
        }
    }

    /// A piece ends, if there is one.
    fn end(&mut self, at: u64) {
        if let Some(since) = self.since.take() {
            self.longest = self.longest.max(at.saturating_sub(since));
        }
    }

    fn is_look(&mut self, pc: u32) -> bool {
        let symbols = self.symbols;
        *self.looks.entry(pc).or_insert_with(|| symbols.is_in(pc, &LOOKS))
    }
}
