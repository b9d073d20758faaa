//! What `tmcl tune` plans before anything moves: how far the motor has to go.

use super::harness::Sim;
use super::pty::Terminal;

/// The way that a measurement at 50 000 pps asks for, in microsteps, with these settings of a module with ramps of six points.
fn way(settings: &[&str]) -> u32 {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--product", "3212"]);
    let mut host = sim.tcp();
    settings.iter().for_each(|line| _ = host.ok(line));
    let link = format!("tcp:{}", sim.told("tcp"));
    let mut terminal = Terminal::start(&["tune", "stallguard", &link, "--speeds", "50000"]);
    let told = terminal.expect("[y/N]");
    terminal.keys("n\r");
    assert_eq!(terminal.end().0.code(), Some(1));
    let (_, ends) = told.split_once("between ").unwrap();
    let (from, to) = ends.split_once(" and ").unwrap();
    let (from, to) = (from.trim(), to.split(',').next().unwrap().trim());
    let end = |text: &str| text.parse::<i32>().unwrap_or_else(|_| panic!("{told}"));
    end(from).abs_diff(end(to))
}

/// The slowest phase of a ramp counts: A1 and D1 (15, 18) if there is a V1 (16), AMAX and DMAX (5, 17) in any case.
#[test]
fn the_slowest_phase_of_a_ramp_counts() {
    let quick = ["SAP 5, 0, 500000", "SAP 17, 0, 500000", "SAP 15, 0, 500000", "SAP 18, 0, 500000"];
    let with = |more: &[&str]| way(&[&quick[..], more].concat());
    let base = with(&[]);
    assert_eq!(with(&["SAP 15, 0, 5000"]), base, "without V1 there is no A1");
    for slow in ["SAP 15, 0, 5000", "SAP 18, 0, 5000", "SAP 5, 0, 5000", "SAP 17, 0, 5000"] {
        // Both ramps are reckoned at the slowest acceleration, so that each of the four asks for the same way.
        let longer = with(&["SAP 16, 0, 20000", slow]);
        assert!(longer > base + 400_000, "{slow}: {longer} in place of {base}");
    }
}
