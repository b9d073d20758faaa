//! The progress of `tmcl tune` on a terminal: a bar that counts readings, and makes room for what is asked.

use super::pty::Terminal;
use super::tune::example;

/// The output of `tmcl tune` on a terminal, in the world of the example.
fn shown(what: &[&str]) -> String {
    let world = example("toml");
    let mut terminal = Terminal::start(&[&["tune", what[0], "sim", "--world", &world], &what[1..]].concat());
    let (status, text) = terminal.end();
    assert!(status.success(), "{text}");
    text
}

/// The percentages that a bar had, one after the other.
fn percentages(text: &str, bar: &str) -> Vec<usize> {
    let bars = text.split('\r').filter(|part| part.starts_with(bar));
    bars.map(|part| part.rsplit_once(" %").unwrap().0.rsplit(' ').next().unwrap().parse().unwrap()).collect()
}

/// How a bar of so many steps grows, up to one of them.
fn growing(steps: usize, total: usize) -> Vec<usize> {
    (0..=steps).map(|step| step * 100 / total).collect()
}

/// Makes room for a line where the bar was.
const ROOM: &str = "\r\x1b[K";

/// In this world each value of parameter 172 is tried with load, so all readings are made that there can be. For each
/// speed there are one with coolStep off and 15 with it, without load and with it, and 5 with a hysteresis and one with
/// a quarter. The bar makes room twice, when the motor is loaded and when it is not any more, and at the end.
#[test]
fn the_bar_of_coolstep_is_full_in_the_end() {
    let text = shown(&["coolstep", "--speeds", "800,1200", "--threshold", "2"]);
    assert_eq!(percentages(&text, "measuring coolStep ["), growing(76, 76));
    assert_eq!(text.matches(ROOM).count(), 3, "{text}");
}

/// How many readings stallGuard2 takes depends on the motor: some 35 without load, and 30 with it.
#[test]
fn the_bar_of_stallguard_counts_the_rows() {
    let text = shown(&["stallguard", "--speeds", "800"]);
    // Behind each threshold a row has three numbers without load and three with it, or else dashes.
    let rows = text.lines().filter_map(|line| {
        let cells: Vec<&str> = line.split_whitespace().take(7).collect();
        cells.first()?.parse::<i32>().ok().filter(|threshold| (-64..=63).contains(threshold) && cells.len() == 7)?;
        Some(usize::from(cells[1] != "-") + usize::from(cells[4] != "-"))
    });
    let readings: usize = rows.sum();
    assert!((50..=65).contains(&readings), "{text}");
    assert_eq!(percentages(&text, "measuring stallGuard2 ["), growing(readings, 35 + 30));
    assert_eq!(text.matches(ROOM).count(), 3, "{text}");
}
