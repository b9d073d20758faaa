//! How busy the core is.

use std::collections::HashMap;

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::mcu::{Act, Machine, Step};

use super::host::{Failure, Host, Link};
use super::parallel;
use super::report::{Report, progress};
use super::statistics::{grouped, percent};

/// The exception of TIM3, in which the owner of the module runs.
pub(crate) const OWNER: u16 = 16 + 29;
/// The exceptions in which a node of CANopen runs: those of TIM3, free mailboxes and both receive queues.
pub(crate) const OWNERS: [u16; 4] = [OWNER, 16 + 19, 16 + 20, 16 + 21];

/// The work of the core, the program that makes it do so, and the commands that are sent before. Those with a # are
/// sent to each axis, with its number in the place of the #.
type Row = (&'static str, &'static [&'static str], &'static [&'static str]);

pub(crate) const ROWS: [Row; 6] = [
    ("at rest", &[], &[]),
    ("ROR", &[], &["ROR #, 1000"]),
    ("MVP on its way", &[], &["MVP ABS, #, 10000000"]),
    ("a search on its way", &[], &["RFS START, #"]),
    (
        "ROR, a program of arithmetic on its full fuel",
        &["CALC ADD, 1", "CALCX SWAP", "COMP 7", "JC EQ, 0", "JA 0"],
        &["ROR #, 1000"],
    ),
    ("ROR, a program of GAP 1 on its full fuel", &["GAP 1, 0", "JA 0"], &["ROR #, 1000"]),
];

/// The same for six axes, and two straight lines of three axes each.
pub(crate) const SIX_AXES: [Row; 7] = {
    let [rest, ror, mvp, search, arithmetic, reading] = ROWS;
    let told: &[&str] = &[
        "SCO 1, 0, 9000000",
        "SCO 1, 1, 7000000",
        "SCO 1, 2, 800000",
        "SCO 1, 3, -900000",
        "SCO 1, 4, 9000000",
        "SCO 1, 5, 5000000",
        "MVP COORD, 71, 1",
        "MVP COORD, 120, 1",
    ];
    [rest, ror, mvp, search, arithmetic, reading, ("two straight lines of three axes each", &[], told)]
};

/// The same for three axes, and a straight line of them. Their speeds are in pps.
pub(crate) const THREE_AXES: [Row; 7] = {
    let [rest, _, mvp, search, _, _] = ROWS;
    let [_, _, _, _, (_, arithmetic, _), (_, reading, _)] = ROWS;
    let told: &[&str] = &["SCO 1, 0, 9000000", "SCO 1, 1, 7000000", "SCO 1, 2, 800000", "MVP COORD, 71, 1"];
    let ror: &[&str] = &["ROR #, 51200"];
    [
        rest,
        ("ROR", &[], ror),
        mvp,
        search,
        ("ROR, a program of arithmetic on its full fuel", arithmetic, ror),
        ("ROR, a program of GAP 1 on its full fuel", reading, ror),
        ("a straight line of three axes", &[], told),
    ]
};

/// Places of the rows that the budgets are about: at rest, with all axes moving, with all of them searching, and on
/// lines.
const BUDGETED: [usize; 4] = [0, 1, 3, 6];

/// Cycles and instructions.
#[derive(Clone, Copy, Debug, Default)]
struct Use {
    cycles: u64,
    /// Cycles on the wire of the motion bus.
    wire: u64,
    instructions: u64,
}

/// The observed use of the core.
#[derive(Debug, Default)]
pub(crate) struct Load {
    cycles: u64,
    asleep: u64,
    /// By exception; 0 is thread mode.
    by: HashMap<u16, Use>,
    datagrams: u64,
}

/// The figures that the budgets are about.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Budgeted {
    /// The share of the core that the owner takes, in parts of a million; and the same less the SPI wire.
    pub(crate) owner: u64,
    pub(crate) less_wire: u64,
    /// Datagrams in a second.
    pub(crate) datagrams: u64,
}

/// Measures the load of each row for `span`. Gives what the budgets are about; of a row that is not there, nothing.
pub(crate) fn measure(
    elf: &[u8],
    rows: &[Row],
    span: Nanos,
    title: &str,
    report: &mut Report,
) -> Result<[Budgeted; 4], Failure> {
    let loads = parallel::map(rows, |(name, program, told)| {
        progress(&format!("{title}: {name}"));
        observe(elf, program, told, span)
    })?;
    report.title(title);
    report.text(
        "The owner of the module is the handler of TIM3: the polls, the program, and what RS485 and USB ask. What comes over \
         CAN runs in the handler of CAN1_RX0; here nothing does. Waiting for the wire of SPI1 is part of its time.",
    );
    table(rows.iter().map(|(name, ..)| *name).zip(&loads), &[OWNER], span, report);
    Ok(BUDGETED.map(|index| loads.get(index).map_or(Budgeted::default(), |load| load.budgeted(span))))
}

/// Prints loads that were watched for `span`, with their names. The owner runs in these exceptions.
pub(crate) fn table<'a>(
    loads: impl Iterator<Item = (&'a str, &'a Load)>,
    owners: &[u16],
    span: Nanos,
    report: &mut Report,
) {
    let milliseconds = span / MILLISECOND;
    let row = |(name, load): (&str, &Load)| {
        let owner = load.by_any(owners);
        let wire: u64 = load.by.values().map(|one| one.wire).sum();
        [
            name.into(),
            percent(load.cycles - load.asleep, load.cycles),
            percent(owner.cycles, load.cycles),
            percent(owner.cycles.saturating_sub(owner.wire), load.cycles),
            percent(wire, load.cycles),
            grouped(owner.cycles / milliseconds),
            grouped(owner.instructions / milliseconds),
            format!("{:.2}", load.datagrams as f64 / milliseconds as f64),
        ]
    };
    let rows: Vec<[String; 8]> = loads.map(row).collect();
    report.table(
        ["", "awake", "owner", "less the wire", "SPI wire", "owner, cycles/ms", "instr./ms", "datagrams/ms"],
        &rows,
    );
}

fn observe(elf: &[u8], program: &[&str], told: &[&str], span: Nanos) -> Result<Load, Failure> {
    let mut host = Host::start(elf)?;
    if !program.is_empty() {
        host.run_program(Link::Can, program)?;
    }
    for line in told {
        host.tell_each(Link::Can, line)?;
    }
    // Out of the ramp.
    host.run(500 * MILLISECOND)?;
    let before = datagrams(&mut host.machine);
    let mut load = Load::default();
    host.watch(span, &mut |step| load.add(&step))?;
    load.count_datagrams(before, &mut host.machine);
    Ok(load)
}

/// Datagrams to the motion chips since the module was switched on.
pub(crate) fn datagrams(machine: &mut Machine) -> u64 {
    let board = machine.board();
    board.kind().motion_bus().map(|chip| board.datagrams(chip)).sum()
}

impl Load {
    /// Sums up what these exceptions have done.
    fn by_any(&self, exceptions: &[u16]) -> Use {
        let uses = exceptions.iter().filter_map(|exception| self.by.get(exception));
        uses.fold(Use::default(), |sum, one| Use {
            cycles: sum.cycles + one.cycles,
            wire: sum.wire + one.wire,
            instructions: sum.instructions + one.instructions,
        })
    }

    /// The share of the core that these exceptions take less the SPI wire, in parts of a million.
    pub(crate) fn share_of(&self, exceptions: &[u16]) -> u64 {
        let one = self.by_any(exceptions);
        one.cycles.saturating_sub(one.wire) * 1_000_000 / self.cycles.max(1)
    }

    fn budgeted(&self, span: Nanos) -> Budgeted {
        Budgeted {
            owner: self.by_any(&[OWNER]).cycles * 1_000_000 / self.cycles.max(1),
            less_wire: self.share_of(&[OWNER]),
            datagrams: self.datagrams * SECOND / span,
        }
    }

    /// Takes over how many datagrams there have been since there were so many.
    pub(crate) fn count_datagrams(&mut self, before: u64, machine: &mut Machine) {
        self.datagrams = datagrams(machine) - before;
    }

    /// Adds a step.
    pub(crate) fn add(&mut self, step: &Step) {
        self.cycles += step.cycles;
        let instructions = match step.act {
            Act::Sleep => {
                self.asleep += step.cycles;
                return;
            }
            Act::Instruction => 1,
            Act::Wait { instructions } => instructions,
            Act::Entry(_) => 0,
        };
        let one = self.by.entry(step.exception).or_default();
        one.cycles += step.cycles;
        one.wire += if step.clocked { step.cycles } else { 0 };
        one.instructions += instructions;
    }
}
