//! Tables of what was measured, for terminals of any width.

use std::io::Write;

use super::coolstep::{self, Course};
use super::proposal::wrapped;
use super::stallguard::Curve;
use super::stats::Stats;
use crate::failure::Failure;

/// Most columns of a bar.
const BAR: usize = 40;
/// The highest load value.
const MOST: usize = 1023;
/// Below this number of columns there are no bars.
const ROOMY: usize = 60;

/// A line of text, in as many lines as the terminal needs.
pub(super) fn text(out: &mut impl Write, text: &str, columns: usize) -> Result<(), Failure> {
    for line in wrapped(text, columns) {
        writeln!(out, "{line}")?;
    }
    Ok(())
}

/// The load values over the threshold: mean, lowest and highest, without and with load.
pub(super) fn curve(out: &mut impl Write, curve: &Curve, columns: usize) -> Result<(), Failure> {
    writeln!(out, "{:>4} {:>5} {:>4} {:>4} {:>6} {:>4} {:>4}", "174", "free", "low", "high", "loaded", "low", "high")?;
    for (threshold, row) in &curve.rows {
        let [free, low, high] = numbers(row.free);
        let [loaded, lowest, highest] = numbers(row.loaded);
        let line = format!("{threshold:>4} {free:>5} {low:>4} {high:>4} {loaded:>6} {lowest:>4} {highest:>4}");
        let bar = match columns {
            ROOMY.. => format!("  {}", bar(row.free, row.loaded, (columns - line.len() - 2).min(BAR))),
            _ => String::new(),
        };
        writeln!(out, "{}", format!("{line}{bar}").trim_end())?;
    }
    if columns >= ROOMY {
        writeln!(out, "{:>41}", "= free, # loaded")?;
    }
    Ok(())
}

/// The currents over the settings of coolStep: without load, with it, and the load value without.
pub(super) fn course(out: &mut impl Write, course: &Course, columns: usize) -> Result<(), Failure> {
    let wide = columns >= ROOMY;
    let cell = |stats: Option<Stats>| match (stats, wide) {
        (None, _) => "-".into(),
        (Some(stats), false) => format!("{} {}-{}", stats.mean(), stats.low, stats.high),
        (Some(stats), true) => format!("{} ({} to {})", stats.mean(), stats.low, stats.high),
    };
    let name = |row: &coolstep::Row| match row.setting {
        Some((number, value)) => format!("{number} = {value}"),
        None => "off".into(),
    };
    let (setting, current, load) = (8, if wide { 15 } else { 9 }, if wide { 18 } else { 11 });
    writeln!(out, "{:<setting$} {:>current$} {:>current$} {:>load$}", "", "180 free", "loaded", "206 free")?;
    for row in [&course.off].into_iter().chain(&course.starts).chain(&course.others) {
        let loaded = cell(row.loaded.map(|loaded| loaded.current));
        let (free, value) = (cell(Some(row.free.current)), cell(Some(row.free.load)));
        writeln!(out, "{:<setting$} {free:>current$} {loaded:>current$} {value:>load$}", name(row))?;
    }
    Ok(())
}

fn numbers(stats: Option<Stats>) -> [String; 3] {
    stats.map_or_else(
        || ["-"; 3].map(String::from),
        |stats| [stats.mean(), stats.low, stats.high].map(|n| n.to_string()),
    )
}

/// Both means as one bar: what is loaded covers what is free.
fn bar(free: Option<Stats>, loaded: Option<Stats>, width: usize) -> String {
    let length = |stats: Option<Stats>| {
        let mean = stats.map_or(0, |stats| usize::try_from(stats.mean()).unwrap_or_default());
        mean.min(MOST) * width / MOST
    };
    let (free, loaded) = (length(free), length(loaded));
    format!("{}{}", "#".repeat(loaded), "=".repeat(free.saturating_sub(loaded)))
}
