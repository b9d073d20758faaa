//! coolStep: the current that it sets (parameter 180) over its settings (168 to 172), without and with load. The result
//! is the settings with which the current falls without load and is whole under load.

use std::time::Duration;

use tmcm::param::AxisParameter as P;

use super::measurement::Measurement;
use super::plan::Cruise;
use super::proposal::Proposal;
use super::stats::{Reading, Stats};
use super::watch::Method;
use crate::failure::Failure;

/// The values of parameter 172 that switch coolStep on.
const STARTS: std::ops::RangeInclusive<i32> = 1..=15;
/// The values of parameter 170 that are tried.
const HYSTERESES: [i32; 5] = [1, 2, 4, 8, 15];
/// Distance of two thresholds of the load value (manual chapter 4, parameters 170 and 172).
const THRESHOLD: i32 = 32;
/// Measurements for a step down, and steps up for a measurement, by the values of parameters 169 and 171.
const DOWN: [i32; 4] = [32, 8, 2, 1];
const UP: [i32; 4] = [1, 2, 4, 8];
/// Full steps of a measurement with the filter.
const MEASUREMENT: u32 = 4;
/// The time in which the current should be whole again, and that in which it may fall.
const SOON: Duration = Duration::from_millis(100);
const LATER: Duration = Duration::from_secs(2);
/// coolStep is proposed from this part of the slowest speed on, in percent.
const FROM_PERCENT: i32 = 80;
/// Number of readings that are made of a speed at most: without load, and with it.
pub(super) const READINGS: (u32, u32) = (22, 16);

/// A measurement takes four full steps; in one of them the current goes down by one step at most.
pub(super) fn method(current: i32) -> Method {
    Method { settle: 4 * scale(current) + 16, apart: MEASUREMENT as i32 }
}

/// The current scale of a current in 1/255 (manual chapter 4, parameter 6).
fn scale(current: i32) -> i32 {
    current.clamp(0, 255) / 8
}

/// Settings, and what was measured with them.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// The parameter that differs, and its value; `None` while coolStep is off.
    pub(super) setting: Option<(u8, i32)>,
    /// Without load.
    pub(super) free: Reading,
    /// With load, where that was tried.
    pub(super) loaded: Option<Reading>,
}

/// The values that were measured at a speed.
#[derive(Clone, Debug)]
pub(super) struct AtSpeed {
    /// The speed.
    pub(super) cruise: Cruise,
    /// With coolStep off.
    pub(super) off: Row,
    /// With each value of parameter 172.
    pub(super) starts: Vec<Row>,
    /// With values of 170 and 168, and the chosen one of 172.
    pub(super) others: Vec<Row>,
}

/// The values that were chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Choice {
    /// Parameter 172.
    pub(super) start: i32,
    /// Parameter 170.
    pub(super) hysteresis: i32,
    /// Parameter 168.
    pub(super) minimum: i32,
}

/// Measures at all speeds, with `current` in parameter 6, and chooses.
pub(super) fn measure(
    measurement: &mut Measurement<'_, '_>,
    threshold: Option<i32>,
    current: i32,
) -> Result<(Vec<AtSpeed>, Choice), Failure> {
    let method = method(current);
    let drive = &mut measurement.drive;
    let first = [
        (P::SmartEnergyHysteresisStart, 0),
        (P::StopOnStall, 0),
        (P::SmartEnergyThresholdSpeed, 0),
        (P::StallGuardFilter, 1),
        (P::SmartEnergyCurrentMinimum, 0),
        (P::SmartEnergyHysteresis, 0),
        // As fast as can be, so that the current is soon where it stays.
        (P::SmartEnergyDownStep, 3),
        (P::SmartEnergyUpStep, 3),
    ];
    for (parameter, value) in first.into_iter().chain(threshold.map(|threshold| (P::StallGuardThreshold, threshold))) {
        drive.bench.set(parameter, value)?;
    }
    let number = drive.bench.number(P::SmartEnergyHysteresisStart);
    let mut speeds_tried = Vec::new();
    for cruise in measurement.cruises.clone() {
        measurement.begin(&cruise)?;
        let off = Row { setting: None, free: measurement.read(method)?, loaded: None };
        let mut starts = Vec::new();
        for start in STARTS {
            afresh(measurement, start)?;
            starts.push(Row { setting: Some((number, start)), free: measurement.read(method)?, loaded: None });
        }
        measurement.drive.bench.set(P::SmartEnergyHysteresisStart, 0)?;
        speeds_tried.push(AtSpeed { cruise, off, starts, others: Vec::new() });
    }
    measurement.hold()?;
    for at_speed in &mut speeds_tried {
        measurement.begin(&at_speed.cruise)?;
        let off = measurement.read(method)?;
        at_speed.off.loaded = Some(off);
        for (start, row) in STARTS.zip(&mut at_speed.starts) {
            if gives_more(&off.load, start) {
                afresh(measurement, start)?;
                row.loaded = Some(measurement.read(method)?);
            }
        }
        measurement.drive.bench.set(P::SmartEnergyHysteresisStart, 0)?;
    }
    measurement.release()?;
    let start = choose_start(&speeds_tried).map_err(Failure::Failed)?;
    let (hysteresis, minimum) = (P::SmartEnergyHysteresis, P::SmartEnergyCurrentMinimum);
    for at_speed in &mut speeds_tried {
        measurement.begin(&at_speed.cruise)?;
        for (parameter, value) in HYSTERESES.map(|value| (hysteresis, value)).into_iter().chain([(minimum, 1)]) {
            measurement.drive.bench.set(parameter, value)?;
            afresh(measurement, start)?;
            let setting = Some((measurement.drive.bench.number(parameter), value));
            at_speed.others.push(Row { setting, free: measurement.read(method)?, loaded: None });
            measurement.drive.bench.set(parameter, 0)?;
        }
    }
    let choice = Choice {
        start,
        hysteresis: choose_hysteresis(&speeds_tried, start),
        minimum: choose_minimum(&speeds_tried, start),
    };
    Ok((speeds_tried, choice))
}

/// Whether coolStep gives a loaded motor more current all the time: above the lower threshold it would not give one
/// that can hardly turn more, but less.
fn gives_more(load: &Stats, start: i32) -> bool {
    load.high < start * THRESHOLD
}

/// Switches coolStep on with a lower threshold, from the whole current on: what it is before a threshold is reached
/// depends on what it was.
fn afresh(measurement: &mut Measurement<'_, '_>, start: i32) -> Result<(), Failure> {
    measurement.drive.bench.set(P::SmartEnergyHysteresisStart, 0)?;
    measurement.drive.bench.set(P::SmartEnergyHysteresisStart, start)
}

/// The middle of the values of 172 with which the current is whole under load and as low as can be without: it has most
/// to spare on both sides.
fn choose_start(speeds_tried: &[AtSpeed]) -> Result<i32, String> {
    let mut found: Vec<(i32, i32)> = Vec::new();
    for (index, start) in STARTS.enumerate() {
        let rows = || speeds_tried.iter().filter_map(|at_speed| Some((at_speed, at_speed.starts.get(index)?)));
        let whole = |(at_speed, row): (&AtSpeed, &Row)| {
            row.loaded.is_some_and(|loaded| loaded.current.low >= at_speed.off.free.current.high)
        };
        if rows().all(whole) {
            found.push((rows().map(|(_, row)| row.free.current.mean()).sum(), start));
        }
    }
    let lowest = found.iter().map(|(current, _)| *current).min();
    let best: Vec<(i32, i32)> = found.into_iter().filter(|(current, _)| Some(*current) == lowest).collect();
    let best = best.get(best.len() / 2).copied();
    let full: i32 = speeds_tried.iter().map(|at_speed| at_speed.off.free.current.mean()).sum();
    let wanting = speeds_tried.iter().find(|at_speed| at_speed.off.free.load.low == 0);
    match (best, wanting) {
        (Some((current, start)), None) if current < full => Ok(start),
        (_, Some(at_speed)) => Err(format!(
            "at {} the load value is 0 without load, too, with this stallGuard2 threshold: find one with tmcl tune \
             stallguard, and give it with --threshold",
            at_speed.cruise.name
        )),
        (Some(_), None) => Err("coolStep saves no current here: without load the load value is too low. Try a higher \
                                stallGuard2 threshold with --threshold"
            .into()),
        (None, None) => Err("under load the load value is so high that coolStep would take current away: try a lower \
                             stallGuard2 threshold with --threshold, or load the motor more"
            .into()),
    }
}

/// The current without load with a setting, at all speeds, and without one that with the chosen value of 172 alone.
fn current(speeds_tried: &[AtSpeed], setting: Option<(usize, i32)>, start: i32) -> Option<(i32, i32)> {
    let rows = speeds_tried.iter().map(|at_speed| match setting {
        Some((index, _)) => at_speed.others.get(index),
        None => at_speed.starts.iter().find(|row| row.setting.is_some_and(|(_, value)| value == start)),
    });
    let stats: Option<Vec<Stats>> = rows.map(|row| row.map(|row| row.free.current)).collect();
    stats.map(|stats| (stats.iter().map(Stats::mean).sum(), stats.iter().map(Stats::spread).max().unwrap_or_default()))
}

/// The smallest value of 170 with which the current is steady, if it saves as much as without.
fn choose_hysteresis(speeds_tried: &[AtSpeed], start: i32) -> i32 {
    let Some((lowest, spread)) = current(speeds_tried, None, start) else { return 0 };
    let steady = |index: usize, value: i32| {
        let found = current(speeds_tried, Some((index, value)), start);
        found.is_some_and(|(current, spread)| spread <= 1 && current <= lowest + speeds_tried.len() as i32)
    };
    if spread <= 1 {
        return 0;
    }
    HYSTERESES.into_iter().enumerate().find(|(index, value)| steady(*index, *value)).map_or(0, |(_, value)| value)
}

/// 1 for parameter 168, if that saves more than 0 does.
fn choose_minimum(speeds_tried: &[AtSpeed], start: i32) -> i32 {
    let half = current(speeds_tried, None, start);
    let quarter = current(speeds_tried, Some((HYSTERESES.len(), 1)), start);
    let less = half.zip(quarter).is_some_and(|((half, _), (quarter, _))| quarter + speeds_tried.len() as i32 <= half);
    i32::from(less)
}

/// Proposes settings. `current` is parameter 6.
pub(super) fn propose(
    speeds_tried: &[AtSpeed],
    choice: Choice,
    threshold: Option<i32>,
    current: i32,
    axis: u8,
    unit: &str,
    number: impl Fn(P) -> Option<u8>,
) -> Vec<Proposal> {
    let Choice { start, hysteresis, minimum } = choice;
    let mut proposals = Vec::new();
    let mut add = |parameter, value, reason: String| {
        if let Some(parameter) = number(parameter) {
            proposals.push(Proposal { parameter, axis, value, reason });
        }
    };
    let Some(slowest) = speeds_tried.iter().min_by_key(|at_speed| at_speed.cruise.speed) else { return Vec::new() };
    let chosen = slowest.starts.iter().find(|row| row.setting.is_some_and(|(_, value)| value == start));
    let free = chosen.map_or(0, |row| row.free.current.mean());
    let full = slowest.off.free.current.mean();
    if let Some(threshold) = threshold {
        add(P::StallGuardThreshold, threshold, "the threshold with which all this was measured".into());
    }
    add(P::StallGuardFilter, 1, "with the filter the load value is steadier, and so is the current".into());
    let low = start * THRESHOLD;
    add(
        P::SmartEnergyHysteresisStart,
        start,
        format!(
            "below a load value of {low} the current rises: it is {free} of {full} without load, and whole with it"
        ),
    );
    let high = (start + hysteresis + 1) * THRESHOLD;
    let steadily = if hysteresis > 0 { "; less of it lets the current swing" } else { "; more of it is not needed" };
    add(P::SmartEnergyHysteresis, hysteresis, format!("from a load value of {high} on the current falls{steadily}"));
    add(
        P::SmartEnergyCurrentMinimum,
        minimum,
        match minimum {
            0 => "down to a half: a quarter saves no more here".into(),
            _ => "down to a quarter, which saves more than a half".into(),
        },
    );
    let steps = (full - free).max(1);
    let measurement = slowest.cruise.full_step * MEASUREMENT;
    let falls = DOWN.map(|by| measurement * (by * steps).unsigned_abs());
    let rises = UP.map(|by| measurement * ((steps + by - 1) / by).unsigned_abs());
    let ((slow, down), (fast, up)) = (quick_enough(falls, LATER), quick_enough(rises, SOON));
    add(P::SmartEnergyDownStep, slow as i32, format!("without load the current is down after {} ms", down.as_millis()));
    add(P::SmartEnergyUpStep, fast as i32, format!("under load it is whole again after {} ms", up.as_millis()));
    let speed = slowest.cruise.speed;
    let from = i64::from(speed) * i64::from(FROM_PERCENT) / 100;
    add(
        P::SmartEnergyThresholdSpeed,
        i32::try_from(from).unwrap_or(speed),
        format!("coolStep from {FROM_PERCENT} % of {speed} {unit} on, the slowest speed that was measured"),
    );
    add(P::SmartEnergySlowRunCurrent, current, "below that speed the current of parameter 6".into());
    proposals
}

/// The first of these times, ever shorter ones, that is within a limit, or else the last, with its number.
fn quick_enough(times: [Duration; 4], limit: Duration) -> (usize, Duration) {
    let is_last = |number: usize| number + 1 == times.len();
    let found = times.into_iter().enumerate().find(|(number, time)| *time <= limit || is_last(*number));
    found.unwrap_or_default()
}

#[cfg(test)]
mod tests;
