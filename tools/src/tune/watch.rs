//! Observations of the motor look by look: whether its speed is constant, where it turns round, and when it may be
//! sampled.

use std::time::Duration;

use super::track::Track;

/// Full steps at constant speed after which a measurement has been made wholly with the settings of now: two
/// measurements with the filter, of which one has begun and ended.
pub(super) const FRESH: i32 = 8;
/// Number of times the motor may go along its track without a sample.
const PATIENCE: u32 = 20;
/// Number of looks after which a motor that should turn is taken for one that is held up.
const HELD_UP: u32 = 100;
/// Shortest and longest wait for a sample: a motor that is waited for longer is at the end of its track meanwhile.
const SHORTEST: Duration = Duration::from_millis(1);
const LONGEST: Duration = Duration::from_millis(50);

/// How a reading is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Method {
    /// Full steps at constant speed before the first sample.
    pub(super) settle: i32,
    /// Full steps between two samples: those of one measurement.
    pub(super) apart: i32,
}

/// The result of a look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seen {
    /// The motor turns at the speed that it is to have.
    Constant,
    /// The speed of the motor changes.
    Changing,
    /// The motor stands and has nowhere to go: it is to be sent to this position.
    Idle(i32),
    /// The motor does not get on to this position.
    HeldUp(i32),
}

/// Where the way to the next sample begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mark {
    /// Where the motor was first seen at constant speed, on this way and in this reading.
    Constant(i32),
    /// Where it was sampled last.
    Sample(i32),
}

/// The observations of the motor on its track.
#[derive(Debug, Default)]
pub(super) struct Watch {
    track: Track,
    /// Microsteps of a full step.
    full_step: i32,
    /// The speed that the motor is to have, as a number of its parameters; 0 before the first.
    speed: i32,
    /// The time of a full step at this speed.
    full_step_time: Duration,
    /// Where the motor is sent to.
    target: Option<i32>,
    mark: Option<Mark>,
    /// Number of looks at which it stood before its target.
    stood: u32,
    /// Number of ways without a sample.
    idle: u32,
}

impl Watch {
    /// A motor that stands at the home of its track. A full step has so many microsteps.
    pub(super) fn new(track: Track, full_step: i32) -> Self {
        Watch { track, full_step, ..Watch::default() }
    }

    /// From now on the motor is to have this speed, at which a full step takes so long.
    pub(super) fn cruise(&mut self, speed: i32, full_step_time: Duration) {
        (self.speed, self.full_step_time) = (speed, full_step_time);
    }

    /// A reading begins; what has been seen before, with other settings, does not count for it.
    pub(super) fn begin(&mut self) {
        self.mark = None;
        self.idle = 0;
    }

    /// Tells what a speed and a position mean with which the motor was seen.
    pub(super) fn see(&mut self, speed: i32, position: i32) -> Seen {
        if self.is_constant(speed) {
            self.stood = 0;
            self.mark.get_or_insert(Mark::Constant(position));
            return Seen::Constant;
        }
        self.mark = None;
        match self.target {
            _ if speed != 0 => {
                self.stood = 0;
                Seen::Changing
            }
            Some(target) if target != position => {
                self.stood += 1;
                if self.stood > HELD_UP { Seen::HeldUp(target) } else { Seen::Changing }
            }
            _ => {
                let target = self.track.farther(position);
                self.target = Some(target);
                self.idle += 1;
                Seen::Idle(target)
            }
        }
    }

    /// How long the motor, which was seen at constant speed at this position, takes until it may be sampled; `None` if
    /// it may be now.
    pub(super) fn wait(&self, position: i32, method: Method) -> Option<Duration> {
        let (from, full_steps) = match self.mark {
            Some(Mark::Sample(from)) => (from, method.apart),
            Some(Mark::Constant(from)) => (from, method.settle),
            None => (position, method.settle),
        };
        let missing = i64::from(full_steps) * i64::from(self.full_step) - i64::from(position.abs_diff(from));
        let time = |missing: i64| self.full_step_time.mul_f64(missing as f64 / f64::from(self.full_step));
        (missing > 0).then(|| time(missing).clamp(SHORTEST, LONGEST))
    }

    /// The motor was sampled at this position.
    pub(super) fn sampled(&mut self, position: i32) {
        self.mark = Some(Mark::Sample(position));
        self.idle = 0;
    }

    /// The motor has gone along its track so often without a sample that there will be none.
    pub(super) fn is_futile(&self) -> bool {
        self.idle > PATIENCE
    }

    fn is_constant(&self, speed: i32) -> bool {
        // A TMC5160 has the nearest speed that its units can express, so it is off by some of them.
        let wanted = self.speed.unsigned_abs();
        speed.unsigned_abs().abs_diff(wanted) <= wanted / 500
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRACK: Track = Track { low: 0, high: 10_000, home: 0 };
    const METHOD: Method = Method { settle: 8, apart: 1 };

    /// A motor with 16 microsteps per full step, of which one takes 2 ms.
    fn watch(speed: i32) -> Watch {
        let mut watch = Watch::new(TRACK, 16);
        watch.cruise(speed, Duration::from_millis(2));
        watch.begin();
        watch
    }

    /// A five hundredth, rounded down: 2 of 1000 and none of 499.
    #[test]
    fn a_speed_may_be_off_a_little() {
        let constant = |wanted, speed| watch(wanted).see(speed, 0) == Seen::Constant;
        for speed in [998, 1000, 1002, -998, -1002] {
            assert!(constant(1000, speed), "{speed}");
        }
        for speed in [0, 1, 997, 1003, -997, -1003] {
            assert!(!constant(1000, speed), "{speed}");
        }
        assert_eq!([498, 499, 500].map(|speed| constant(499, speed)), [false, true, false]);
        assert!(!constant(1, 0));
    }

    #[test]
    fn the_motor_turns_round_where_it_stands_at_its_target() {
        let mut watch = watch(1000);
        assert_eq!(watch.see(0, 0), Seen::Idle(10_000));
        assert_eq!(watch.see(0, 0), Seen::Changing, "it has not set off yet");
        assert_eq!(watch.see(1, 1), Seen::Changing);
        assert_eq!(watch.see(-1, 10_000), Seen::Changing, "it is there, but does not stand");
        assert_eq!(watch.see(0, 10_000), Seen::Idle(0));
        assert_eq!(watch.see(0, 10_000), Seen::Changing);
        assert_eq!(watch.see(0, 0), Seen::Idle(10_000));
    }

    /// A hundred looks at a motor that stands before its target are borne, one more is not; each at which it turns, at
    /// whatever speed, begins the count anew.
    #[test]
    fn a_motor_is_held_up_after_a_hundred_looks() {
        let mut watch = watch(1000);
        watch.see(0, 0);
        for turns in [1, 1000] {
            for look in 0..100 {
                assert_eq!(watch.see(0, 5), Seen::Changing, "{turns} {look}");
            }
            watch.see(turns, 5);
        }
        for look in 0..100 {
            assert_eq!(watch.see(0, 5), Seen::Changing, "{look}");
        }
        assert_eq!(watch.see(0, 5), Seen::HeldUp(10_000));
    }

    /// 8 full steps of 16 microsteps from where the speed was first constant, and one from each sample to the next.
    #[test]
    fn samples_are_apart_on_the_way() {
        let mut watch = watch(1000);
        let waits = |watch: &mut Watch, position| {
            assert_eq!(watch.see(1000, position), Seen::Constant);
            watch.wait(position, METHOD)
        };
        let ms = |milliseconds| Some(Duration::from_millis(milliseconds));
        assert_eq!(waits(&mut watch, 100), ms(16));
        assert_eq!(waits(&mut watch, 164), ms(8));
        // A quarter of a full step, half a millisecond, is not worth a wait of its own.
        assert_eq!(waits(&mut watch, 224), ms(1));
        assert_eq!(waits(&mut watch, 227), ms(1));
        assert_eq!(waits(&mut watch, 228), None);
        watch.sampled(228);
        assert_eq!(waits(&mut watch, 228), ms(2));
        assert_eq!(waits(&mut watch, 244), None);
        // To the left it is as far.
        assert_eq!((waits(&mut watch, 213), waits(&mut watch, 212)), (ms(1), None));
        // On the next way, and in the next reading, it begins anew.
        assert_eq!(watch.see(999, 300), Seen::Constant);
        assert_eq!(watch.see(500, 300), Seen::Changing);
        assert_eq!(watch.wait(300, METHOD), ms(16));
        assert_eq!(waits(&mut watch, 300), ms(16));
        watch.sampled(428);
        watch.begin();
        assert_eq!(waits(&mut watch, 500), ms(16));
    }

    /// 100 full steps of 2 ms are 200 ms, of which 50 are waited at a time.
    #[test]
    fn nobody_waits_past_the_end_of_the_track() {
        let mut watch = watch(1000);
        watch.see(1000, 0);
        assert_eq!(watch.wait(0, Method { settle: 100, apart: 1 }), Some(Duration::from_millis(50)));
        assert_eq!(watch.wait(0, Method { settle: 25, apart: 1 }), Some(Duration::from_millis(50)));
        assert_eq!(watch.wait(0, Method { settle: 24, apart: 1 }), Some(Duration::from_millis(48)));
    }

    /// Twenty ways without a sample are borne, one more is not; a sample, and a reading that begins, start the count
    /// anew.
    #[test]
    fn ways_without_a_sample_are_futile_in_the_end() {
        let mut watch = watch(1000);
        let mut ends = [0, 10_000].into_iter().cycle();
        let mut go = |watch: &mut Watch, ways| (0..ways).for_each(|_| _ = watch.see(0, ends.next().unwrap()));
        go(&mut watch, 20);
        assert!(!watch.is_futile());
        watch.sampled(0);
        go(&mut watch, 20);
        assert!(!watch.is_futile());
        watch.begin();
        go(&mut watch, 20);
        assert!(!watch.is_futile());
        go(&mut watch, 1);
        assert!(watch.is_futile());
    }
}
