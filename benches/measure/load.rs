//! How busy the core is.

use std::collections::HashMap;

use hal_sim::board::Chip;
use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::mcu::{Act, Step};

use super::host::{Failure, Host, Link};
use super::parallel;
use super::report::{Report, progress};
use super::statistics::{grouped, percent};

/// The exception of TIM3, in which the owner of the module runs.
pub(crate) const OWNER: u16 = 16 + 29;

/// What the core does, and what makes it do so.
const ROWS: [(&str, &[&str], Option<&str>); 5] = [
    ("at rest", &[], None),
    ("ROR", &[], Some("ROR 0, 1000")),
    ("MVP on its way", &[], Some("MVP ABS, 0, 10000000")),
    (
        "ROR, a program of arithmetic on its full fuel",
        &["CALC ADD, 1", "CALCX SWAP", "COMP 7", "JC EQ, 0", "JA 0"],
        Some("ROR 0, 1000"),
    ),
    ("ROR, a program of GAP 1 on its full fuel", &["GAP 1, 0", "JA 0"], Some("ROR 0, 1000")),
];
/// Places of the rows that the budgets are about.
const BUDGETED: [usize; 2] = [0, 1];

/// Cycles and instructions.
#[derive(Clone, Copy, Debug, Default)]
struct Use {
    cycles: u64,
    instructions: u64,
}

/// What has been seen of the core.
#[derive(Debug, Default)]
struct Load {
    cycles: u64,
    asleep: u64,
    /// On the wire of the motion bus.
    wire: u64,
    /// Those of them in the handler of TIM3.
    owners_wire: u64,
    /// By exception; 0 is thread mode.
    by: HashMap<u16, Use>,
    datagrams: [u64; 2],
}

/// Measures the load for `span` each. Gives the share of the core that the owner takes less the SPI wire, in parts of a
/// million: at rest, and with one axis moving.
pub(crate) fn measure(elf: &[u8], span: Nanos, report: &mut Report) -> Result<[u64; 2], Failure> {
    let loads = parallel::map(&ROWS, |(name, program, line)| {
        progress(&format!("load: {name}"));
        observe(elf, program, *line, span)
    })?;
    let mut rows = Vec::new();
    let budgeted = BUDGETED.map(|index| loads.get(index).map_or(0, Load::own_share));
    for ((name, ..), load) in ROWS.into_iter().zip(loads) {
        let owner = load.owner();
        let milliseconds = span / MILLISECOND;
        let [tmc429, tmc262] = load.datagrams;
        rows.push([
            name.into(),
            percent(load.cycles - load.asleep, load.cycles),
            percent(owner.cycles, load.cycles),
            percent(owner.cycles.saturating_sub(load.owners_wire), load.cycles),
            percent(load.wire, load.cycles),
            grouped(owner.cycles / milliseconds),
            grouped(owner.instructions / milliseconds),
            format!("{:.2}", (tmc429 + tmc262) as f64 / milliseconds as f64),
        ]);
    }
    report.title("Load of the core");
    report.text(
        "The owner of the module is the handler of TIM3: the polls, the program, and what RS485 and USB ask. What comes over \
         CAN runs in the handler of CAN1_RX0; here nothing does. Waiting for the wire of SPI1 is part of its time.",
    );
    report.table(
        ["", "awake", "owner", "less the wire", "SPI wire", "owner, cycles/ms", "instr./ms", "datagrams/ms"],
        &rows,
    );
    Ok(budgeted)
}

fn observe(elf: &[u8], program: &[&str], line: Option<&str>, span: Nanos) -> Result<Load, Failure> {
    let mut host = Host::start(elf)?;
    if !program.is_empty() {
        let program: Vec<String> = program.iter().map(|&line| line.into()).collect();
        host.load(Link::Can, &program)?;
        host.tell(Link::Can, "129, 0, 0, 0")?;
    }
    if let Some(line) = line {
        host.tell(Link::Can, line)?;
    }
    // Out of the ramp.
    host.run(500 * MILLISECOND)?;
    let chips = [Chip::Tmc429(0), Chip::Tmc262(0)];
    let before = chips.map(|chip| host.machine.board().datagrams(chip));
    let mut load = Load::default();
    host.watch(span, &mut |step| load.add(&step))?;
    let after = chips.map(|chip| host.machine.board().datagrams(chip));
    load.datagrams = std::array::from_fn(|chip| after[chip] - before[chip]);
    Ok(load)
}

impl Load {
    fn owner(&self) -> Use {
        self.by.get(&OWNER).copied().unwrap_or_default()
    }

    /// The share of the core that the owner takes less the SPI wire, in parts of a million.
    fn own_share(&self) -> u64 {
        self.owner().cycles.saturating_sub(self.owners_wire) * 1_000_000 / self.cycles.max(1)
    }

    fn add(&mut self, step: &Step) {
        self.cycles += step.cycles;
        if step.clocked {
            self.wire += step.cycles;
            self.owners_wire += if step.exception == OWNER { step.cycles } else { 0 };
        }
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
        one.instructions += instructions;
    }
}
