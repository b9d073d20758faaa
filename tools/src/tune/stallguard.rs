//! stallGuard2: its value (parameter 206) over its threshold (174), without and with load, and the threshold that tells
//! a stall from a motor that turns freely.

use std::collections::BTreeMap;

use tmcm::param::AxisParameter as P;

use super::measurement::Measurement;
use super::plan::Cruise;
use super::proposal::Proposal;
use super::stats::Stats;
use super::watch::{FRESH, Method};
use crate::failure::Failure;

/// The thresholds that there are.
const LOWEST: i32 = -64;
const HIGHEST: i32 = 63;
/// Distance of the thresholds that are looked at first.
const COARSE: usize = 8;
/// Thresholds that are looked at after them, at most.
const MOST_FINE: i32 = 24;
/// Stop on stall is proposed from this part of the slowest speed on, in percent.
const FROM_PERCENT: i32 = 80;
/// Number of readings that are made about, of one speed: without load, and with it.
pub(super) const READINGS: (u32, u32) = (35, 30);

/// The method: a measurement is a full step without the filter.
pub(super) const METHOD: Method = Method { settle: FRESH, apart: 1 };

/// The values that were measured with a threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Row {
    /// The value without load.
    pub(super) free: Option<Stats>,
    /// The value with load.
    pub(super) loaded: Option<Stats>,
}

/// The values that were measured at a speed.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    /// The speed.
    pub(super) cruise: Cruise,
    /// The values that were measured, by threshold.
    pub(super) rows: BTreeMap<i32, Row>,
}

/// The sides of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Free,
    Loaded,
}

impl Row {
    fn side(&mut self, side: Side) -> &mut Option<Stats> {
        match side {
            Side::Free => &mut self.free,
            Side::Loaded => &mut self.loaded,
        }
    }
}

impl Curve {
    /// The lowest threshold from which on the value of the free motor is never 0.
    pub(super) fn free_from(&self) -> Option<i32> {
        let measured = self.rows.iter().rev().filter_map(|(threshold, row)| Some((*threshold, row.free?)));
        measured.take_while(|(_, value)| value.low > 0).last().map(|(threshold, _)| threshold)
    }

    /// The highest threshold up to which the value of the loaded motor is always 0.
    pub(super) fn stalls_to(&self) -> Option<i32> {
        let measured = self.rows.iter().filter_map(|(threshold, row)| Some((*threshold, row.loaded?)));
        measured.take_while(|(_, value)| value.high == 0).last().map(|(threshold, _)| threshold)
    }

    /// The thresholds that tell load from none.
    pub(super) fn window(&self) -> Option<(i32, i32)> {
        Some((self.free_from()?, self.stalls_to()?)).filter(|(low, high)| low <= high)
    }
}

/// Measures the curves of all speeds.
pub(super) fn measure(measurement: &mut Measurement<'_, '_>) -> Result<Vec<Curve>, Failure> {
    // coolStep would change the current while it is measured, and stop on stall would stop the motor.
    let drive = &mut measurement.drive;
    for (parameter, value) in [(P::SmartEnergyHysteresisStart, 0), (P::StopOnStall, 0), (P::StallGuardFilter, 0)] {
        drive.bench.set(parameter, value)?;
    }
    let coarse: Vec<i32> = (LOWEST..HIGHEST).step_by(COARSE).chain([HIGHEST]).collect();
    let curve = |cruise: &Cruise| Curve { cruise: cruise.clone(), rows: BTreeMap::new() };
    let mut curves: Vec<Curve> = measurement.cruises.iter().map(curve).collect();
    for curve in &mut curves {
        measurement.begin(&curve.cruise)?;
        sweep(measurement, curve, Side::Free, &coarse)?;
        let fine = between(curve.free_from().map(|from| from - COARSE as i32), curve.free_from());
        sweep(measurement, curve, Side::Free, &fine)?;
    }
    measurement.hold()?;
    for curve in &mut curves {
        measurement.begin(&curve.cruise)?;
        sweep(measurement, curve, Side::Loaded, &coarse)?;
        let edge = curve.stalls_to();
        let fine = between(edge, edge.map(|edge| edge + COARSE as i32));
        sweep(measurement, curve, Side::Loaded, &fine)?;
        sweep(measurement, curve, Side::Loaded, &around(curve))?;
    }
    measurement.release()?;
    for curve in &mut curves {
        measurement.begin(&curve.cruise)?;
        sweep(measurement, curve, Side::Free, &around(curve))?;
    }
    Ok(curves)
}

/// Measures with each of the thresholds that has not been measured with.
fn sweep(
    measurement: &mut Measurement<'_, '_>,
    curve: &mut Curve,
    side: Side,
    thresholds: &[i32],
) -> Result<(), Failure> {
    for &threshold in thresholds {
        let row = curve.rows.entry(threshold).or_default();
        if row.side(side).is_none() {
            measurement.drive.bench.set(P::StallGuardThreshold, threshold)?;
            *row.side(side) = Some(measurement.read(METHOD)?.load);
        }
    }
    Ok(())
}

/// The thresholds between two that were looked at.
fn between(low: Option<i32>, high: Option<i32>) -> Vec<i32> {
    let (Some(low), Some(high)) = (low, high) else { return Vec::new() };
    ((low + 1).max(LOWEST)..high.min(HIGHEST)).collect()
}

/// The thresholds from the one below where the free motor can be seen to the one above where the loaded one can.
fn around(curve: &Curve) -> Vec<i32> {
    let (Some(free), Some(loaded)) = (curve.free_from(), curve.stalls_to()) else { return Vec::new() };
    let (low, high) = ((free.min(loaded) - 1).max(LOWEST), (free.max(loaded) + 1).min(HIGHEST));
    let step = (high - low) / MOST_FINE + 1;
    (low..=high).step_by(step.unsigned_abs() as usize).collect()
}

/// Proposes settings, or tells why nothing can be proposed.
pub(super) fn propose(
    curves: &[Curve],
    axis: u8,
    unit: &str,
    number: impl Fn(P) -> u8,
) -> Result<Vec<Proposal>, String> {
    // The fastest speeds first: the slower a motor, the less stallGuard2 can see of its load.
    let mut fastest_first: Vec<&Curve> = curves.iter().collect();
    fastest_first.sort_by_key(|curve| -curve.cruise.speed);
    let mut common: Option<(i32, i32, &Curve)> = None;
    for curve in fastest_first {
        let Some((low, high)) = curve.window() else { continue };
        common = match common {
            None => Some((low, high, curve)),
            Some((lowest, highest, _)) if low.max(lowest) <= high.min(highest) => {
                Some((low.max(lowest), high.min(highest), curve))
            }
            // A slower speed that needs a threshold of its own cannot be served, too.
            Some(_) => break,
        };
    }
    let Some((low, high, slowest)) = common else { return Err(why_not(curves)) };
    // A blocked motor jumps to and fro and shows some value now and then. So the threshold is nearer to the lower end,
    // where more of the load counts as a stall (TMC5160 datasheet, section 13.3).
    let threshold = low + (high - low + 2) / 3;
    let speed = slowest.cruise.speed;
    let from = i64::from(speed) * i64::from(FROM_PERCENT) / 100;
    let proposal = |parameter, value, reason: String| Proposal { parameter: number(parameter), axis, value, reason };
    Ok(vec![
        proposal(
            P::StallGuardThreshold,
            threshold,
            match low == high {
                true => format!("alone tells a stall from a free motor, at {speed} {unit}: there is little to spare"),
                false => {
                    format!("within {low} to {high}, which all tell a stall from a free motor from {speed} {unit} on")
                }
            },
        ),
        proposal(
            P::StallGuardFilter,
            0,
            "no filter: a stall shows after one full step, not four; all this was measured without".into(),
        ),
        proposal(
            P::StopOnStall,
            i32::try_from(from).unwrap_or(speed),
            format!(
                "a stall stops the motor above {FROM_PERCENT} % of {speed} {unit}; set it only when the motor has that speed"
            ),
        ),
    ])
}

/// Why no threshold can be proposed.
fn why_not(curves: &[Curve]) -> String {
    let Some(curve) = curves.iter().max_by_key(|curve| curve.cruise.speed) else { return String::new() };
    let name = &curve.cruise.name;
    match (curve.free_from(), curve.stalls_to()) {
        (None, _) => format!(
            "at {name} the value is 0 with every threshold, also without load: stallGuard2 measures nothing there. Try a \
             higher speed"
        ),
        (_, None) => format!(
            "at {name} the value is never 0 under load, whatever the threshold: load the motor more, nearly as much as it \
             can bear"
        ),
        (Some(free), Some(loaded)) => format!(
            "at {name} no threshold tells load from none: under load the value is always 0 only up to {loaded}, and without \
             load never 0 only from {free} on. Try a higher speed, or load the motor more"
        ),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// A curve whose value is above 0 from a threshold on without load, and up to another one 0 with it.
    fn curve(speed: i32, free_from: i32, stalls_to: i32) -> Curve {
        let cruise = Cruise { speed, name: format!("{speed} int"), pulses: 1.0, full_step: Duration::from_millis(10) };
        let stats = |value| {
            let mut stats = Stats::default();
            stats.take(value);
            Some(stats)
        };
        let row = |threshold| {
            let (free, loaded) = (i32::from(threshold >= free_from), i32::from(threshold > stalls_to));
            (threshold, Row { free: stats(free), loaded: stats(loaded) })
        };
        Curve { cruise, rows: (LOWEST..=HIGHEST).map(row).collect() }
    }

    fn threshold(curves: &[Curve]) -> Result<(i32, i32), String> {
        let proposals = propose(curves, 0, "int", |parameter| match parameter {
            P::StallGuardThreshold => 174,
            P::StopOnStall => 181,
            _ => 173,
        })?;
        let value = |number| proposals.iter().find(|found| found.parameter == number).map(|found| found.value);
        Ok((value(174).expect("174"), value(181).expect("181")))
    }

    /// A third of the way up, rounded up: 7 + 5 / 3 and 7 + 4 / 3.
    #[test]
    fn the_threshold_is_nearer_to_the_lower_end() {
        assert_eq!(threshold(&[curve(800, 7, 12)]), Ok((9, 640)));
        assert_eq!(threshold(&[curve(800, 7, 11)]), Ok((9, 640)));
        assert_eq!(threshold(&[curve(800, 12, 12)]), Ok((12, 640)));
        assert_eq!(threshold(&[curve(800, -64, 63)]), Ok((-21, 640)));
    }

    /// Speeds that share a threshold are served together; a slow one that needs its own is left out, and so is one at
    /// which nothing can be told.
    #[test]
    fn several_speeds() {
        assert_eq!(threshold(&[curve(500, 9, 14), curve(1000, 7, 12)]), Ok((10, 400)));
        assert_eq!(threshold(&[curve(500, 20, 30), curve(1000, 7, 12)]), Ok((9, 800)));
        assert_eq!(threshold(&[curve(500, 20, 10), curve(1000, 7, 12)]), Ok((9, 800)));
    }

    /// A single threshold in common is enough, and so is a single one at a speed alone.
    #[test]
    fn speeds_share_what_they_have_in_common() {
        assert_eq!(threshold(&[curve(500, 12, 20), curve(1000, 7, 12)]), Ok((12, 400)));
        assert_eq!(threshold(&[curve(500, 7, 12), curve(1000, 12, 20)]), Ok((12, 400)));
        assert_eq!(threshold(&[curve(500, 13, 20), curve(1000, 7, 12)]), Ok((9, 800)));
        assert_eq!(threshold(&[curve(500, 1, 6), curve(1000, 7, 12)]), Ok((9, 800)));
        // Once a slower one is left out, one that is slower still is not asked.
        assert_eq!(threshold(&[curve(300, 7, 12), curve(500, 13, 20), curve(1000, 7, 12)]), Ok((9, 800)));
        // The narrower of two within each other counts.
        assert_eq!(threshold(&[curve(500, 1, 30), curve(1000, 7, 12)]), Ok((9, 400)));
    }

    #[test]
    fn reasons_have_the_range_and_the_speed() {
        let reasons = |curve: Curve| {
            let proposals = propose(&[curve], 2, "pps", |_| 1).unwrap();
            assert!(proposals.iter().all(|proposal| proposal.axis == 2));
            let [threshold, filter, stop] = proposals.as_slice() else { panic!("{proposals:?}") };
            assert_eq!((filter.value, filter.reason.starts_with("no filter: ")), (0, true));
            assert_eq!(
                stop.reason,
                "a stall stops the motor above 80 % of 800 pps; set it only when the motor has that speed"
            );
            threshold.reason.clone()
        };
        assert_eq!(
            reasons(curve(800, 7, 12)),
            "within 7 to 12, which all tell a stall from a free motor from 800 pps on"
        );
        assert_eq!(
            reasons(curve(800, 7, 7)),
            "alone tells a stall from a free motor, at 800 pps: there is little to spare"
        );
    }

    /// Only what has been measured counts, without gaps: up to the lowest threshold from which on all values are above
    /// 0.
    #[test]
    fn edges_are_those_of_what_was_measured() {
        let mut found = curve(800, 7, 12);
        assert_eq!((found.free_from(), found.stalls_to(), found.window()), (Some(7), Some(12), Some((7, 12))));
        found.rows.retain(|threshold, _| threshold % 8 == 0);
        assert_eq!((found.free_from(), found.stalls_to(), found.window()), (Some(8), Some(8), Some((8, 8))));
        found.rows.get_mut(&8).unwrap().free = None;
        assert_eq!((found.free_from(), found.window()), (Some(16), None));
        // A 0 among higher values is one, and so is a higher value among zeros.
        let mut found = curve(800, 7, 12);
        found.rows.get_mut(&40).unwrap().free.as_mut().unwrap().take(0);
        found.rows.get_mut(&-40).unwrap().loaded.as_mut().unwrap().take(1);
        assert_eq!((found.free_from(), found.stalls_to()), (Some(41), Some(-41)));
    }

    /// The ends have been measured already, and there is none outside of -64 to 63.
    #[test]
    fn thresholds_between_two() {
        assert_eq!(between(Some(8), Some(12)), [9, 10, 11]);
        assert_eq!(between(Some(-66), Some(-62)), [-64, -63]);
        assert_eq!(between(Some(60), Some(68)), [61, 62]);
        assert!(between(Some(-72), Some(-64)).is_empty() && between(Some(63), Some(71)).is_empty());
        assert!(between(None, Some(1)).is_empty() && between(Some(1), None).is_empty());
    }

    /// From one below the lower edge to one above the upper edge, whichever of them that is: 24 of them at most, or
    /// every second, third and so on.
    #[test]
    fn thresholds_around_both_edges() {
        let range = |low: i32, high: i32, step| (low..=high).step_by(step).collect::<Vec<_>>();
        let around = |free_from, stalls_to| around(&curve(800, free_from, stalls_to));
        assert_eq!((around(7, 12), around(12, 7)), (range(6, 13, 1), range(6, 13, 1)));
        assert_eq!((around(1, 22), around(1, 23)), (range(0, 23, 1), range(0, 24, 2)));
        assert_eq!((around(1, 46), around(1, 47)), (range(0, 47, 2), range(0, 48, 3)));
        assert_eq!((around(-64, -60), around(60, 63)), (range(-64, -59, 1), range(59, 63, 1)));
        assert_eq!(around(-64, 63), range(-64, 63, 6));
        assert!(around(64, 5).is_empty() && around(5, -65).is_empty());
    }

    /// The reason that is told is of the fastest speed.
    #[test]
    fn where_nothing_can_be_told_it_is_said_why() {
        let why = |free_from, stalls_to| threshold(&[curve(800, free_from, stalls_to)]).unwrap_err();
        assert!(why(64, 63).contains("at 800 int the value is 0 with every threshold"));
        assert!(why(0, -65).contains("never 0 under load"));
        assert!(why(10, 5).contains("always 0 only up to 5, and without load never 0 only from 10 on"));
        let why = threshold(&[curve(800, 10, 5), curve(1000, 64, 5), curve(500, 10, 5)]).unwrap_err();
        assert!(why.starts_with("at 1000 int the value is 0"), "{why}");
    }
}
