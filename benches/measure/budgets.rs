//! The budgets of the design, and whether they are kept.

use super::report::Report;
use super::statistics::grouped;

/// A budget.
pub(crate) struct Budget {
    pub(crate) name: &'static str,
    /// What may not be exceeded.
    pub(crate) most: u64,
    /// What it should be.
    pub(crate) aim: u64,
    /// Parts of the unit in which it is shown: a figure in parts of a million is shown in percent.
    pub(crate) unit: Unit,
    /// A miss that is known: it may not become worse.
    pub(crate) known: Option<u64>,
    pub(crate) measured: u64,
}

/// What a figure counts.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Unit {
    Cycles,
    Datagrams,
    Bytes,
    /// Shown in percent.
    Millionths,
}

impl Unit {
    fn show(self, figure: u64) -> String {
        match self {
            Self::Cycles | Self::Datagrams => grouped(figure),
            Self::Bytes => grouped(figure),
            Self::Millionths => format!("{:.2} %", figure as f64 / 10_000.0),
        }
    }
}

impl Budget {
    fn verdict(&self) -> &'static str {
        match self.known {
            _ if self.measured <= self.aim => "aim reached",
            _ if self.measured <= self.most => "kept",
            Some(known) if self.measured <= known => "**missed**, as known",
            Some(_) => "**MISSED, worse than known**",
            None => "**MISSED**",
        }
    }

    fn fails(&self) -> bool {
        self.measured > self.most.max(self.known.unwrap_or_default())
    }
}

/// Prints the budgets; true if none is newly missed.
pub(crate) fn check(budgets: &[Budget], report: &mut Report) -> bool {
    report.title("Budgets");
    let rows: Vec<[String; 5]> = budgets
        .iter()
        .map(|budget| {
            let show = |figure| budget.unit.show(figure);
            [budget.name.into(), show(budget.most), show(budget.aim), show(budget.measured), budget.verdict().into()]
        })
        .collect();
    report.table(["", "at most", "aim", "measured", ""], &rows);
    for budget in budgets {
        if budget.fails() {
            eprintln!("measure: {}: {}, the budget is {}", budget.name, budget.measured, budget.most);
        }
        if budget.known.is_some() && budget.measured <= budget.most {
            eprintln!("measure: {}: no longer missed; benches/measure/main.rs need not know it as missed", budget.name);
        }
    }
    !budgets.iter().any(Budget::fails)
}
