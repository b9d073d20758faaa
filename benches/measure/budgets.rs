//! The budgets of the design, and whether they are kept.

use super::memory::Memory;
use super::replies::Replies;
use super::report::Report;
use super::statistics::grouped;
use super::waits::Waits;

/// What has been measured.
#[derive(Debug)]
pub(crate) struct Figures {
    pub(crate) memory: Memory,
    /// Share of the core that the poll takes, in millionths.
    pub(crate) poll: u64,
    pub(crate) replies: Replies,
    pub(crate) waits: Waits,
    /// Cycles of a command of a program.
    pub(crate) command: u64,
}

/// What a figure counts.
#[derive(Clone, Copy, Debug)]
enum Unit {
    Cycles,
    Datagrams,
    Bytes,
    /// Shown in percent.
    Millionths,
}
use Unit::{Bytes, Cycles, Datagrams, Millionths};

/// A budget.
struct Budget {
    name: &'static str,
    unit: Unit,
    /// What may not be exceeded, and what it should be.
    limits: [u64; 2],
    /// A miss that is known: it may not become worse.
    known: Option<u64>,
    /// None where the run was too short to tell.
    figure: fn(&Figures) -> Option<u64>,
}

const BUDGETS: [Budget; 14] = [
    row("reply without chip access, RS485 at 115 200: median", Cycles, [1_000, 600], Some(1_400), |f| {
        Some(f.replies.rs485.plain)
    }),
    row("reply without chip access, CAN: median", Cycles, [1_000, 600], None, |f| Some(f.replies.can.plain)),
    row("GAP 1, RS485 at 115 200: CPU share, median", Cycles, [1_500, 900], Some(1_750), |f| {
        Some(f.replies.rs485.register)
    }),
    row("GAP 1, CAN: CPU share, median", Cycles, [1_500, 900], None, |f| Some(f.replies.can.register)),
    row("MVP ABS, RS485 at 115 200: CPU share, median", Cycles, [2_500, 1_500], None, |f| Some(f.replies.rs485.target)),
    row("MVP ABS, CAN: CPU share, median", Cycles, [2_500, 1_500], None, |f| Some(f.replies.can.target)),
    row("MVP ABS", Datagrams, [2, 1], None, |f| Some(f.replies.rs485.datagrams.max(f.replies.can.datagrams))),
    row("extra wait behind other work: 99 %", Cycles, [10_000, 6_000], Some(17_000), |f| f.waits.p99),
    row("extra wait behind other work: most", Cycles, [30_000, 15_000], None, |f| Some(f.waits.max)),
    row("arithmetic or branch command of a program", Cycles, [140, 85], Some(280), |f| Some(f.command)),
    row("poll with one moving axis, with SPI waits", Millionths, [120_000, 70_000], None, |f| Some(f.poll)),
    row("flash", Bytes, [128 * 1024, 96 * 1024], None, |f| Some(f.memory.flash)),
    row("static RAM", Bytes, [48 * 1024, 32 * 1024], None, |f| Some(f.memory.statics)),
    row("stack, most in use", Bytes, [8 * 1024, 4 * 1024], None, |f| Some(f.memory.stack[1])),
];

const fn row(
    name: &'static str,
    unit: Unit,
    limits: [u64; 2],
    known: Option<u64>,
    figure: fn(&Figures) -> Option<u64>,
) -> Budget {
    Budget { name, unit, limits, known, figure }
}

impl Unit {
    fn show(self, figure: u64) -> String {
        match self {
            Cycles => format!("{} cycles", grouped(figure)),
            Datagrams => format!("{figure} datagrams"),
            Bytes => format!("{} bytes", grouped(figure)),
            Millionths => format!("{:.2} %", figure as f64 / 10_000.0),
        }
    }
}

/// Prints the budgets; true if none is missed but those that are known to be.
pub(crate) fn check(figures: &Figures, report: &mut Report) -> bool {
    report.title("Budgets");
    let mut rows = Vec::new();
    let mut kept = true;
    for Budget { name, unit, limits: [most, aim], known, figure } in BUDGETS {
        let Some(measured) = figure(figures) else { continue };
        let verdict = match known {
            _ if measured <= aim => "aim reached",
            _ if measured <= most => "kept",
            Some(known) if measured <= known => "missed, as known",
            _ => "**missed**",
        };
        rows.push([name.into(), unit.show(most), unit.show(aim), unit.show(measured), verdict.into()]);
        if measured > most.max(known.unwrap_or_default()) {
            kept = false;
            let limit = known.map_or(String::new(), |known| format!(", and it was known to miss it by {known}"));
            eprintln!("measure: {name}: {}, the budget is {}{limit}", unit.show(measured), unit.show(most));
        } else if known.is_some() && measured <= most {
            eprintln!("measure: {name}: within its budget now; benches/measure/budgets.rs still knows it as missed");
        }
    }
    report.table(["", "at most", "aim", "measured", ""], &rows);
    kept
}
