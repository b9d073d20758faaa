//! The plan of what is going to be done: the speeds, the track, and how long it takes.

use std::time::Duration;

use tmcm::param::AxisParameter as P;

use super::bench::Bench;
use super::drive::SAMPLES;
use super::track::Need;
use super::watch::Method;
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
    /// The meaning of its numbers.
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
        // What a product does not have is 0, which stands for none.
        let mut known = |parameter| if bench.has(parameter) { bench.get(parameter) } else { Ok(0) };
        let main = [known(P::MaximumAcceleration)?, known(P::MaximumDeceleration)?];
        let outer = [known(P::FirstAcceleration)?, known(P::LastDeceleration)?];
        let least = least_acceleration(main, known(P::FirstVelocity)?, outer);
        let maximum = known(P::MaximumSpeed)?;
        let live = Live::new(bench.product, settings);
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

    /// Finds what a measurement at these speeds needs of a track, if a sample takes `latency`: the way of a whole
    /// reading, or at least that of a few samples.
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

/// The smallest acceleration of a ramp, of those that are not 0. The accelerations are those of its main phase and, if
/// there is a velocity up to which others count, these outer ones.
fn least_acceleration(main: [i32; 2], first_velocity: i32, outer: [i32; 2]) -> i32 {
    let outer = if first_velocity > 0 { outer } else { [0; 2] };
    main.into_iter().chain(outer).filter(|acceleration| *acceleration != 0).min().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use crate::calc::Settings;
    use crate::product::Product;

    use super::*;

    /// An axis whose speeds are in pps, or else in units of 16e6 / (2^5 * 65536) = 7.629 pps.
    fn setup(product: Product, microsteps: u16) -> Setup {
        let settings = Settings { divisors: (5, 7), microsteps, steps: 200, in_chip: false };
        let live = Live::new(product, settings);
        Setup { live, microsteps: i32::from(microsteps), acceleration: 1600.0, maximum: 801 }
    }

    fn cruise(speed: i32) -> Cruise {
        setup(Product::Tmcm3212, 16).cruise(speed)
    }

    #[test]
    fn the_slowest_phase_of_a_ramp_counts() {
        assert_eq!(least_acceleration([500, 300], 0, [7, 8]), 300);
        assert_eq!(least_acceleration([300, 500], 1, [700, 800]), 300);
        assert_eq!(least_acceleration([500, 300], 1, [200, 100]), 100);
        assert_eq!(least_acceleration([500, 0], 1, [0, 400]), 400);
        assert_eq!(least_acceleration([500, 1], 0, [0, 0]), 1);
        assert_eq!(least_acceleration([0, 0], 0, [7, 8]), 0);
    }

    /// 800 * 7.629 pps = 6103.5 pps; a full step of 256 microsteps takes 41.943 ms with them.
    #[test]
    fn speeds_have_a_name_and_a_time() {
        let found = setup(Product::Tmcm1140, 256).cruise(800);
        assert_eq!((found.speed, found.name.as_str(), found.pulses), (800, "800 int (6104 pps)", 6_103.515_625));
        assert_eq!(found.full_step, Duration::from_nanos(41_943_040));
        let found = cruise(800);
        assert_eq!((found.speed, found.name.as_str(), found.pulses), (800, "800 pps", 800.0));
        assert_eq!(found.full_step, Duration::from_millis(20));
        // Slower than one microstep per second is taken for that, and a full step for a minute at most.
        assert_eq!((cruise(1).full_step, cruise(0).full_step), (Duration::from_secs(16), Duration::from_secs(16)));
        assert_eq!(setup(Product::Tmcm3212, 256).cruise(1).full_step, Duration::from_secs(60));
    }

    #[test]
    fn the_speeds_are_those_that_are_named_or_two() {
        let setup = setup(Product::Tmcm3212, 16);
        let speeds = |named: &[&str]| {
            let named: Vec<String> = named.iter().map(ToString::to_string).collect();
            let cruises = setup.cruises(&named);
            cruises.map(|cruises| cruises.iter().map(|cruise| cruise.speed).collect::<Vec<_>>())
        };
        let why = |named: &[&str]| match speeds(named) {
            Err(Failure::Arguments(why)) => why,
            other => panic!("{other:?}"),
        };
        assert_eq!(speeds(&[]).unwrap(), [400, 801]);
        // A turn of 3200 microsteps in two seconds is 1600 pps.
        assert_eq!(speeds(&["900", "30 rpm", "1", "900"]).unwrap(), [1, 900, 1600]);
        assert_eq!(why(&["900", "0"]), "--speeds: a speed is above 0; --room has the direction");
        assert_eq!(why(&["-900"]), "--speeds: a speed is above 0; --room has the direction");
        assert!(why(&["60 s"]).starts_with("--speeds: 60 s: that is no speed"));
        for maximum in [0, 1] {
            let told = Setup { maximum, ..setup }.cruises(&[]);
            let Err(Failure::Arguments(why)) = told else { panic!("{told:?}") };
            assert_eq!(why, "the maximum positioning speed (parameter 4) is 0; name speeds with --speeds");
        }
    }

    /// 8 full steps and 12 samples of 2 are 32 of 16 microsteps, and 800 pps make 96 more in 12 times 10 ms: 608,
    /// twice. 4 samples need 16 full steps, 256 microsteps, and 32.
    #[test]
    fn a_track_has_the_way_of_two_readings_and_of_a_second() {
        let setup = setup(Product::Tmcm3212, 16);
        let method = Method { settle: 8, apart: 2 };
        let need = |speeds: &[i32]| {
            let cruises: Vec<Cruise> = speeds.iter().map(|speed| cruise(*speed)).collect();
            setup.need(&cruises, method, Duration::from_millis(10))
        };
        let found = Need { speed: 800.0, acceleration: 1600.0, constant: 1216.0, enough: 288.0 };
        assert_eq!((need(&[400, 800]), need(&[800, 400])), (found, found));
        // Two readings are 2 * (512 + 960) microsteps, and a second is more.
        assert_eq!(need(&[8000]), Need { speed: 8000.0, acceleration: 1600.0, constant: 8000.0, enough: 576.0 });
    }

    /// A reading is 8 full steps of 20 ms and 12 samples of 40: 640 ms. On 1000 microsteps the motor is at 800 pps for
    /// 600 of them, 0.75 s, and in its ramps for 1 s. So five readings take 3200 ms * 1.75 / 0.75.
    #[test]
    fn the_ramps_take_their_time() {
        let setup = setup(Product::Tmcm3212, 16);
        let method = Method { settle: 8, apart: 2 };
        let time = |way, latency| setup.time(&cruise(800), method, 5, way, Duration::from_millis(latency)).as_millis();
        assert_eq!(time(1000.0, 10), 7466);
        // A sample takes as long as its telegrams: 160 ms and 12 times 100.
        assert_eq!(time(1000.0, 100), 15_866);
        // A motor that never gets to its speed would be measured for ever, which nobody has to be told.
        assert_eq!(time(400.0, 10), 320_000);
    }
}
