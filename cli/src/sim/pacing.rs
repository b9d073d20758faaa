//! Virtual time at the pace of a clock on the wall.

use std::time::{Duration, Instant};

use hal_sim::clock::Nanos;

/// The most that virtual time may lag behind the clock, measured on the clock. What is beyond that (the computer was
/// busy or asleep) is not made up for: the module never sees time rush.
const LONGEST_LAG: Duration = Duration::from_millis(20);
/// Over how long, at least, the achieved speed is measured.
const WINDOW: Duration = Duration::from_secs(1);
/// The least that is told of a lag, measured on the clock.
const WORTH_TELLING: Duration = Duration::from_secs(1);

/// Says how far virtual time may go.
#[derive(Debug)]
pub struct Pacer {
    speed: f64,
    /// When the goal was last moved.
    last: Instant,
    /// How far virtual time may go.
    goal: Nanos,
    /// How far it has gone.
    reached: Nanos,
    /// Where the present and the previous measurement of the achieved speed began.
    marks: [(Instant, Nanos); 2],
    /// How far it would have gone if it had never lagged.
    wanted: Nanos,
    /// The lag that is told next.
    telling: Duration,
}

impl Pacer {
    /// Virtual time is at `now` at the instant `at` and goes `speed` times as fast as the wall's from there.
    pub fn new(speed: f64, at: Instant, now: Nanos) -> Self {
        let marks = [(at, now); 2];
        Pacer { speed, last: at, goal: now, reached: now, marks, wanted: now, telling: WORTH_TELLING }
    }

    /// How fast virtual time shall go.
    pub fn wanted(&self) -> f64 {
        self.speed
    }

    /// How far virtual time may go by the instant `at`.
    pub fn advance(&mut self, at: Instant) -> Nanos {
        let [_, present] = self.marks;
        if self.last.saturating_duration_since(present.0) >= WINDOW {
            self.marks = [present, (self.last, self.reached)];
        }
        let span = at.saturating_duration_since(self.last);
        self.last = at;
        self.wanted += self.scaled(span);
        let goal = self.goal + self.scaled(span);
        self.goal = goal.min(self.reached + self.scaled(LONGEST_LAG));
        self.goal
    }

    /// How far virtual time has gone.
    pub fn reached(&self) -> Nanos {
        self.reached
    }

    /// Virtual time has gone as far as `to`.
    pub fn reach(&mut self, to: Nanos) {
        self.reached = to;
    }

    /// True while virtual time has not gone as far as it may.
    pub fn is_behind(&self) -> bool {
        self.reached < self.goal
    }

    /// When virtual time may be at `due`.
    pub fn when(&self, due: Nanos) -> Instant {
        let ahead = due.saturating_sub(self.goal) as f64 / self.speed;
        self.last + Duration::from_nanos(ahead.ceil() as u64)
    }

    /// How fast virtual time really went in the last one or two seconds.
    pub fn achieved(&self) -> f64 {
        let [(begun, from), _] = self.marks;
        let span = self.last.saturating_duration_since(begun).as_nanos();
        if span == 0 { self.speed } else { self.reached.saturating_sub(from) as f64 / span as f64 }
    }

    /// How far virtual time is behind, if that is worth telling: once it is a second of the clock, and each time that
    /// it has doubled.
    pub fn lag(&mut self) -> Option<Nanos> {
        let lag = self.wanted.saturating_sub(self.reached);
        if lag < self.scaled(self.telling) {
            return None;
        }
        while lag >= self.scaled(self.telling) {
            self.telling *= 2;
        }
        Some(lag)
    }

    fn scaled(&self, span: Duration) -> Nanos {
        (span.as_nanos() as f64 * self.speed).round() as Nanos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Lets virtual time go as far as it may.
    fn go(pacer: &mut Pacer, at: Instant) -> Nanos {
        let goal = pacer.advance(at);
        pacer.reach(goal);
        goal
    }

    #[test]
    fn time_goes_by_the_factor() {
        let start = Instant::now();
        let mut pacer = Pacer::new(2.5, start, 0);
        assert_eq!(go(&mut pacer, start + 4 * MS), 10_000_000);
        assert_eq!(pacer.when(15_000_000), start + 6 * MS);
        assert_eq!(pacer.when(5_000_000), start + 4 * MS);
        assert_eq!(pacer.achieved(), 2.5);
    }

    #[test]
    fn a_long_pause_is_not_made_up_for() {
        let start = Instant::now();
        let mut pacer = Pacer::new(1.0, start, 0);
        assert_eq!(go(&mut pacer, start + 500 * MS), 20_000_000);
        assert_eq!(go(&mut pacer, start + 510 * MS), 30_000_000);
        assert!(pacer.achieved() < 0.1);
    }

    #[test]
    fn where_the_computer_is_too_slow_time_lags() {
        let start = Instant::now();
        let mut pacer = Pacer::new(2.0, start, 0);
        for n in 1..=100 {
            pacer.advance(start + n * 10 * MS);
            pacer.reach(pacer.reached() + 5_000_000);
            assert!(pacer.is_behind());
        }
        assert_eq!(pacer.achieved(), 0.5);
        // Then it is fast enough again: no more than the longest lag is made up for.
        assert!(go(&mut pacer, start + 1001 * MS) <= 500_000_000 + 40_000_000);
        assert!(!pacer.is_behind());
    }

    #[test]
    fn a_lag_is_told_each_time_it_has_doubled() {
        let start = Instant::now();
        let mut pacer = Pacer::new(2.0, start, 7_000_000);
        assert_eq!(pacer.reached(), 7_000_000);
        let told: Vec<Nanos> = (1..=1000)
            .filter_map(|n| {
                pacer.advance(start + n * 10 * MS);
                pacer.reach(pacer.reached() + 5_000_000);
                pacer.lag()
            })
            .collect();
        // Of 20 ms in 10 ms of the clock 15 ms are lost.
        assert_eq!(told, [2_010_000_000, 4_005_000_000, 8_010_000_000]);
    }

    #[test]
    fn the_achieved_speed_forgets_the_past() {
        let start = Instant::now();
        let mut pacer = Pacer::new(1.0, start, 0);
        go(&mut pacer, start + 1000 * MS);
        for n in 1..=200 {
            go(&mut pacer, start + (1000 + 10 * n) * MS);
        }
        assert!(pacer.achieved() > 0.99);
    }
}
