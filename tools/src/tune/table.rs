//! Tables of what was measured, for terminals of any width.

use std::fmt::{self, Write};

use super::coolstep::{self, AtSpeed};
use super::proposal::wrapped;
use super::stallguard::Curve;
use super::stats::Stats;

/// Most columns of a bar.
const BAR: usize = 40;
/// The highest load value.
const MOST: usize = 1023;
/// Below this number of columns there are no bars.
const ROOMY: usize = 60;

/// A line of text, in as many lines as the terminal needs.
pub(super) fn text(out: &mut impl Write, text: &str, columns: usize) -> fmt::Result {
    for line in wrapped(text, columns) {
        writeln!(out, "{line}")?;
    }
    Ok(())
}

/// The load values over the threshold: mean, lowest and highest, without and with load.
pub(super) fn curve(out: &mut impl Write, curve: &Curve, columns: usize) -> fmt::Result {
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
pub(super) fn at_speed(out: &mut impl Write, at_speed: &AtSpeed, columns: usize) -> fmt::Result {
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
    for row in [&at_speed.off].into_iter().chain(&at_speed.starts).chain(&at_speed.others) {
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::coolstep::Row as Setting;
    use super::super::plan::Cruise;
    use super::super::stallguard::Row;
    use super::super::stats::Reading;
    use super::*;

    /// Samples whose mean is in the middle of these two.
    fn stats(low: i32, high: i32) -> Stats {
        let mut stats = Stats::default();
        [low, high].into_iter().for_each(|sample| stats.take(sample));
        stats
    }

    fn cruise() -> Cruise {
        Cruise { speed: 800, name: "800 pps".into(), pulses: 800.0, full_step: Duration::from_millis(1) }
    }

    fn lines(write: impl FnOnce(&mut String) -> fmt::Result) -> Vec<String> {
        let mut out = String::new();
        write(&mut out).unwrap();
        out.lines().map(String::from).collect()
    }

    /// Numbers take 37 columns and two are free, so with 60 columns 21 are left for a bar. Of these a load value of 512
    /// takes 512 * 21 / 1023 = 10.5, and 341 takes 7. A bar has 40 columns at most.
    #[test]
    fn bars_have_the_columns_that_are_left() {
        let row = |free, loaded| Row { free, loaded };
        let rows = [
            (-5, row(Some(stats(500, 524)), None)),
            (-4, row(Some(stats(500, 524)), Some(stats(340, 342)))),
            (3, row(Some(stats(1023, 1023)), Some(stats(0, 0)))),
            (63, row(None, Some(stats(1023, 1023)))),
        ];
        let found = Curve { cruise: cruise(), rows: rows.into() };
        let shown = |columns| lines(|out| curve(out, &found, columns));
        let numbers = [
            " 174  free  low high loaded  low high",
            "  -5   512  500  524      -    -    -",
            "  -4   512  500  524    341  340  342",
            "   3  1023 1023 1023      0    0    0",
            "  63     -    -    -   1023 1023 1023",
        ];
        assert_eq!(shown(59), numbers);
        let with_bars = |bars: [String; 4]| {
            let mut lines = vec![numbers[0].to_owned()];
            lines.extend(numbers[1..].iter().zip(bars).map(|(numbers, bar)| format!("{numbers}  {bar}")));
            lines.push("                         = free, # loaded".into());
            lines
        };
        let bar = |loaded, free| "#".repeat(loaded) + &"=".repeat(free);
        assert_eq!(shown(60), with_bars([bar(0, 10), bar(7, 3), bar(0, 21), bar(21, 0)]));
        // 78 would leave 39, and from 79 on there are 40: 512 * 40 / 1023 is 20, and 341 takes 13.
        assert_eq!(shown(78), with_bars([bar(0, 19), bar(13, 6), bar(0, 39), bar(39, 0)]));
        for columns in [79, 80, 200] {
            assert_eq!(shown(columns), with_bars([bar(0, 20), bar(13, 7), bar(0, 40), bar(40, 0)]), "{columns}");
        }
    }

    #[test]
    fn ranges_have_a_short_form() {
        let reading = |load, current| Reading { load, current };
        let free = reading(stats(215, 225), stats(16, 16));
        let off = Setting { setting: None, free, loaded: Some(reading(stats(0, 0), stats(14, 16))) };
        let starts = vec![Setting { setting: Some((172, 12)), free, loaded: None }];
        let others = vec![Setting { setting: Some((168, 1)), free: reading(stats(9, 9), stats(4, 8)), loaded: None }];
        let found = AtSpeed { cruise: cruise(), off, starts, others };
        let shown = |columns| lines(|out| at_speed(out, &found, columns));
        assert_eq!(
            shown(59),
            [
                "          180 free    loaded    206 free",
                "off       16 16-16  15 14-16 220 215-225",
                "172 = 12  16 16-16         - 220 215-225",
                "168 = 1      6 4-8         -       9 9-9",
            ]
        );
        assert_eq!(
            shown(60),
            [
                "                180 free          loaded           206 free",
                "off        16 (16 to 16)   15 (14 to 16)   220 (215 to 225)",
                "172 = 12   16 (16 to 16)               -   220 (215 to 225)",
                "168 = 1       6 (4 to 8)               -         9 (9 to 9)",
            ]
        );
    }
}
