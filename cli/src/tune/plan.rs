//! What is going to be done: the speeds, the track, and how long it takes.

use std::time::Duration;

use tmcm::param::AxisParameter as P;

use super::bench::Bench;
use super::drive::{Method, SAMPLES};
use super::track::Need;
use crate::calc::{Live, Settings};
use crate::failure::Failure;

/// A speed at which the motor is measured.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cruise {
    /// As a number of the axis' parameters.
    pub(super) speed: i32,
    /// With its unit, and in pps.
    pub(super) name: String,
    /// In microsteps per second.
    pub(super) pulses: f64,
    /// Time of a full step.
    pub(super) full_step: Duration,
}

/// The axis as it is set up now.
pub(super) struct Setup {
    /// What its numbers mean.
    pub(super) live: Live,
    /// Microsteps per full step.
    pub(super) microsteps: i32,
    /// The smallest of its accelerations, in microsteps per second, per second.
    acceleration: f64,
    /// The highest speed of a move to a position.
    maximum: i32,
}

impl Setup {
    /// Reads the settings of an axis whose motor has so many full steps per turn.
    pub(super) fn read(bench: &mut Bench<'_>, steps: u16) -> Result<Self, Failure> {
        let settings = Settings::read(&mut bench.module, bench.axis, steps)?;
        let mut known = |parameter, otherwise| match bench.has(parameter) {
            true => bench.get(parameter),
            false => Ok(otherwise),
        };
        let mut accelerations = vec![known(P::MaximumAcceleration, 0)?];
        // The other phases of a ramp with six points, of which those count that are not 0.
        if known(P::FirstVelocity, 0)? > 0 {
            accelerations.extend([known(P::FirstAcceleration, 0)?, known(P::LastDeceleration, 0)?]);
        }
        accelerations.push(known(P::MaximumDeceleration, 0)?);
        let maximum = known(P::MaximumSpeed, 0)?;
        let live = Live::new(bench.product, settings);
        let least = accelerations.into_iter().filter(|acceleration| *acceleration > 0).min().unwrap_or_default();
        let acceleration = live.acceleration_in_pulses(least);
        Ok(Setup { live, microsteps: i32::from(settings.microsteps), acceleration, maximum })
    }

    /// The speeds that the user has named, or else the half and the whole of the maximum positioning speed.
    pub(super) fn cruises(&self, named: &[String]) -> Result<Vec<Cruise>, Failure> {
        let mut speeds: Vec<i32> = match named {
            [] => vec![self.maximum / 2, self.maximum],
            named => {
                let read =
                    |text: &String| self.live.speed(text).map_err(|why| Failure::Arguments(format!("--speeds: {why}")));
                named.iter().map(read).collect::<Result<_, _>>()?
            }
        };
        if speeds.iter().any(|speed| *speed <= 0) {
            return Err(Failure::Arguments(match named {
                [] => "the maximum positioning speed (parameter 4) is 0; name speeds with --speeds".into(),
                _ => "--speeds: a speed is above 0; --room has the direction".into(),
            }));
        }
        speeds.sort_unstable();
        speeds.dedup();
        Ok(speeds.into_iter().map(|speed| self.cruise(speed)).collect())
    }

    fn cruise(&self, speed: i32) -> Cruise {
        let pulses = self.live.speed_in_pulses(speed);
        let name = match self.live.unit() {
            "pps" => format!("{speed} pps"),
            unit => format!("{speed} {unit} ({pulses:.0} pps)"),
        };
        let full_step = Duration::from_secs_f64((f64::from(self.microsteps) / pulses.max(1.0)).min(60.0));
        Cruise { speed, name, pulses, full_step }
    }

    /// What a measurement at these speeds needs of a track, if a sample takes `latency`: the way of a whole reading, or at
    /// least that of a few samples.
    pub(super) fn need(&self, cruises: &[Cruise], method: Method, latency: Duration) -> Need {
        let speed = cruises.iter().map(|cruise| cruise.pulses).fold(0.0, f64::max);
        let way = |samples: u32| {
            let full_steps = f64::from(method.settle) + f64::from(method.apart) * f64::from(samples);
            full_steps * f64::from(self.microsteps) + speed * latency.as_secs_f64() * f64::from(samples)
        };
        // A way of a second at least: what asks the module may be held up for a moment.
        let constant = (2.0 * way(SAMPLES)).max(speed);
        Need { speed, acceleration: self.acceleration, constant, enough: way(SAMPLES / 3) }
    }

    /// How long so many readings take at a speed, on a track of so many microsteps, if a sample takes `latency`.
    pub(super) fn time(&self, cruise: &Cruise, method: Method, readings: u32, way: f64, latency: Duration) -> Duration {
        let sample = (cruise.full_step * method.apart.unsigned_abs()).max(latency);
        let reading = cruise.full_step * method.settle.unsigned_abs() + sample * SAMPLES;
        let need = Need { speed: cruise.pulses, acceleration: self.acceleration, constant: 0.0, enough: 0.0 };
        let share = need.share(cruise.pulses, way).max(0.01);
        (reading * readings).div_f64(share)
    }
}
