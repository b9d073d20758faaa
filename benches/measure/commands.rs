//! The cost of a command in a running program.
//!
//! A program is a loop: some commands of one kind, then the count of rounds. What a round takes of the core's time,
//! for two lengths of the loop, gives what one command takes.

use std::ops::Range;

use hal_sim::board::Chip;
use hal_sim::clock::{MILLISECOND, Nanos};

use super::host::{Failure, Host, Link};
use super::parallel;
use super::report::{Report, progress};
use super::statistics::grouped;

/// Lengths of the loop.
const SHORT: usize = 12;
const LONG: usize = 48;
/// Core cycles of a datagram on the wire. A datagram to the TMC429 has 32 bits at 84 MHz / 64, and one to the TMC262
/// has 24 bits at 84 MHz / 32. One to the TMC5160 has 40 bits at 84 MHz / 16.
const WIRE: [(Chip, u64); 3] = [(Chip::Tmc429(0), 32 * 128), (Chip::Tmc262(0), 24 * 64), (Chip::Tmc5160(0), 40 * 32)];

/// Kinds of commands; `@` stands for the address of the next command.
pub(crate) const KINDS: [(&str, &str); 12] = [
    ("CALC ADD", "CALC ADD, 3"),
    ("CALCX SWAP", "CALCX SWAP"),
    ("COMP", "COMP 5"),
    ("JC, not taken", "JC ETO, 0"),
    ("JC, taken", "JC NZ, @"),
    ("JA", "JA @"),
    ("GGP, user variable", "GGP 1, 2"),
    ("SGP, user variable", "SGP 1, 2, 7"),
    ("AGP, user variable", "AGP 1, 2"),
    ("GAP 5", "GAP 5, 0"),
    ("SIO", "SIO 0, 2, 1"),
    ("GAP 1, one register of a chip", "GAP 1, 0"),
];
/// The kinds of commands that the budgets are about: arithmetic and branches, user variables, and GAP 5.
const ARITHMETIC: Range<usize> = 0..6;
const VARIABLES: Range<usize> = 6..9;
const PLAIN: Range<usize> = 9..10;
/// How many of them the budgets are about.
pub(crate) const BUDGETED: usize = PLAIN.end;

/// Counts the rounds in user variable 0.
const COUNT: [&str; 4] = ["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "JA 0"];

/// The totals of all rounds of a loop, without what the core does when there is no program.
#[derive(Clone, Copy, Debug)]
struct Run {
    rounds: f64,
    cycles: f64,
    wire: f64,
    instructions: f64,
}

/// The figures that the budgets are about: the most cycles that a command takes.
#[derive(Debug, Default)]
pub(crate) struct Commands {
    /// Of arithmetic and branches.
    pub(crate) arithmetic: u64,
    /// Of those that read or write a user variable.
    pub(crate) variable: u64,
    /// GAP 5.
    pub(crate) plain: u64,
}

/// Measures the first `kinds` kinds of commands, each loop for `span`.
pub(crate) fn measure(
    elf: &[u8],
    kinds: usize,
    span: Nanos,
    title: &str,
    report: &mut Report,
) -> Result<Commands, Failure> {
    let idle = run(elf, &[], span)?;
    let kinds = KINDS.get(..kinds).unwrap_or(&KINDS);
    let runs = parallel::map(kinds, |(name, line)| {
        progress(&format!("{title}: {name}"));
        Ok((run(elf, &body(line, SHORT), span)?, run(elf, &body(line, LONG), span)?))
    })?;
    let mut rows = Vec::new();
    let mut all = Vec::new();
    for ((name, _), (short, long)) in kinds.iter().zip(runs) {
        let each = |what: &dyn Fn(&Run) -> f64| {
            let round = |run: &Run| (what(run) - what(&idle)) / run.rounds;
            (round(&long) - round(&short)) / (LONG - SHORT) as f64
        };
        let cycles = each(&|run| run.cycles);
        let share = each(&|run| run.cycles - run.wire);
        all.push(cycles.round() as u64);
        let cell = |number: f64| grouped(number.round().max(0.0) as u64);
        rows.push([(*name).into(), cell(cycles), cell(share), cell(each(&|run| run.instructions))]);
    }
    report.title(title);
    report.text(
        "Each, with its part of what the program's slices cost: the difference of two lengths of a loop. CPU share: less \
         the time on the SPI wire.",
    );
    report.table(["", "cycles", "CPU share", "instr."], &rows);
    let most = |kinds| all.get(kinds).and_then(|some: &[u64]| some.iter().copied().max()).unwrap_or_default();
    Ok(Commands { arithmetic: most(ARITHMETIC), variable: most(VARIABLES), plain: most(PLAIN) })
}

fn body(line: &str, length: usize) -> Vec<String> {
    let lines = (0..length).map(|index| line.replace('@', &(index + 1).to_string()));
    lines.chain(COUNT.map(str::to_owned)).collect()
}

/// Lets a program run for a while; with none, sees what the core does without.
fn run(elf: &[u8], program: &[String], span: Nanos) -> Result<Run, Failure> {
    let mut host = Host::start(elf)?;
    if !program.is_empty() {
        host.load(Link::Can, program)?;
        host.tell(Link::Can, "129, 0, 0, 0")?;
    }
    host.run(50 * MILLISECOND)?;
    let look = |host: &mut Host| {
        let counters = host.machine.counters();
        let wire: u64 = WIRE.iter().map(|(chip, cycles)| host.machine.board().datagrams(*chip) * cycles).sum();
        (counters, wire)
    };
    let rounds = host.tell(Link::Can, "GGP 0, 2")?;
    let (before, wire_before) = look(&mut host);
    host.run(span)?;
    let (after, wire_after) = look(&mut host);
    let rounds = host.tell(Link::Can, "GGP 0, 2")? - rounds;
    if !program.is_empty() && rounds == 0 {
        let line = program.first().map_or("", String::as_str);
        return Err(format!("the program of '{line}' does not run").into());
    }
    let awake = (after.cycles - after.asleep) - (before.cycles - before.asleep);
    Ok(Run {
        rounds: rounds.into(),
        cycles: awake as f64,
        wire: (wire_after - wire_before) as f64,
        instructions: (after.instructions - before.instructions) as f64,
    })
}
