//! Plans that `tmcl tune` makes before anything moves: how far the motor has to go.

use super::harness::Sim;
use super::pty::Terminal;

/// The way that a measurement at 50 000 pps asks for, in microsteps, with these settings of a module with ramps of six
/// points.
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

/// The slowest phase of a ramp counts: A1 and D1 (15, 18) if there is a V1 (16), AMAX and DMAX (5, 17) in any case. Up
/// to 50 000 pps and down again, at 100 pps/s, are 50 000^2 / 100 = 25 million microsteps. Where the ramps are short,
/// what is left is the way at constant speed, which grows with the time that the computer takes for a reading.
#[test]
fn the_slowest_phase_of_a_ramp_counts() {
    const FAR: u32 = 20_000_000;
    let quick = ["SAP 5, 0, 500000", "SAP 17, 0, 500000", "SAP 15, 0, 500000", "SAP 18, 0, 500000"];
    let with = |more: &[&str]| way(&[&quick[..], more].concat());
    assert!(with(&["SAP 15, 0, 100", "SAP 18, 0, 100"]) < FAR, "without V1 there are no A1 and D1");
    for slow in ["SAP 15, 0, 100", "SAP 18, 0, 100", "SAP 5, 0, 100", "SAP 17, 0, 100"] {
        assert!(with(&["SAP 16, 0, 20000", slow]) > FAR, "{slow}");
    }
}
