//! The settings that `tmcl tune` tries, one after the other, and how it puts them back.

use super::harness::{complaint, run};
use super::tune::example;

/// Settings in the order in which they are written: parameters and values.
type Steps = Vec<(u8, i32)>;

/// The settings that were written in a measurement in the world of the example.
fn written(what: &[&str]) -> Steps {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("telegrams.log");
    let world = example("toml");
    let options = ["sim", "--world", &world, "--log-telegrams", log.to_str().unwrap()];
    let output = run(&[&["tune", what[0]], &options[..], &what[1..]].concat());
    assert!(output.status.success(), "{}", complaint(&output));
    let text = std::fs::read_to_string(log).unwrap();
    let requests = text.lines().filter_map(|line| line.split_once("to 1: SAP "));
    requests
        .map(|(_, setting)| {
            let mut numbers = setting.split(", ");
            (numbers.next().unwrap().parse().unwrap(), numbers.nth(1).unwrap().parse().unwrap())
        })
        .collect()
}

/// The steps must be these, and then the settings that were changed get back what a new module has, the last one first.
fn assert_steps(found: &Steps, expected: &Steps, back: &[(u8, i32)]) {
    let expected: Steps = expected.iter().chain(back).copied().collect();
    let different = found.iter().zip(&expected).position(|(found, expected)| found != expected);
    assert!(found == &expected, "from step {different:?} on, or one is longer: {found:?}");
}

/// coolStep is switched off before each value of 172, so that the current is whole at first. Without load and with it
/// all of them are tried, and then others with the chosen one, 2, which are off again afterwards.
#[test]
fn coolstep_begins_afresh_with_each_setting() {
    let found = written(&["coolstep", "--speeds", "800,1200", "--threshold", "2"]);
    let mut expected: Steps =
        vec![(172, 0), (181, 0), (182, 0), (173, 1), (168, 0), (170, 0), (169, 3), (171, 3), (174, 2)];
    let starts = || (1..=15).flat_map(|start| [(172, 0), (172, start)]).chain([(172, 0)]);
    for _load in ["without", "with"] {
        for speed in [800, 1200] {
            expected.push((4, speed));
            expected.extend(starts());
        }
    }
    for speed in [800, 1200] {
        expected.push((4, speed));
        for (parameter, value) in [(170, 1), (170, 2), (170, 4), (170, 8), (170, 15), (168, 1)] {
            expected.extend([(parameter, value), (172, 0), (172, 2), (parameter, 0)]);
        }
    }
    let back = [(4, 1000), (174, 5), (171, 0), (169, 0), (170, 0), (168, 0), (173, 1), (182, 0), (181, 0), (172, 0)];
    assert_steps(&found, &expected, &back);
}

/// Each eighth threshold at first, then those between where the value begins to be seen. With the free motor this is
/// from -1 on, which is between -8 and 0, and with the loaded one from 5 on, which is between 0 and 8. At last those
/// around both that are missing: from -2 to 5.
#[test]
fn stallguard_looks_closer_where_the_edges_are() {
    let found = written(&["stallguard", "--speeds", "800"]);
    let coarse = || (0..16).map(|step| -64 + 8 * step).chain([63]);
    let thresholds = |range: std::ops::RangeInclusive<i32>| range.map(|threshold| (174, threshold));
    let mut expected: Steps = vec![(172, 0), (181, 0), (173, 0), (4, 800)];
    expected.extend(coarse().map(|threshold| (174, threshold)));
    expected.extend(thresholds(-7..=-1));
    // Without load, and then with it.
    expected.push((4, 800));
    expected.extend(coarse().map(|threshold| (174, threshold)));
    expected.extend(thresholds(1..=7));
    expected.extend(thresholds(-2..=-1));
    // Without it again.
    expected.push((4, 800));
    expected.extend(thresholds(1..=5));
    assert_steps(&found, &expected, &[(174, 5), (4, 1000), (173, 1), (181, 0), (172, 0)]);
}
