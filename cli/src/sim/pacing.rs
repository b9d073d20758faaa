//! The pace of virtual time, measured against the computer's clock.

use std::time::{Duration, Instant};

use hal_sim::clock::Nanos;

/// Longest lag of virtual time that is made up for, measured on the clock. After a longer interruption (the computer
/// was busy or asleep) virtual time goes on with a lag, because hosts would see it rush otherwise.
const LONGEST_LAG: Duration = Duration::from_millis(20);
/// Shortest time over which the achieved speed is measured.
const WINDOW: Duration = Duration::from_secs(1);
/// Shortest lag that is reported, measured on the clock.
const SHORTEST_REPORT: Duration = Duration::from_secs(1);

/// Keeps track of how far virtual time has gone and may go. All `Nanos` are virtual time.
#[derive(Debug)]
pub struct Pacer {
    /// Wanted speed: seconds of virtual time per second of the clock.
    speed: f64,
    /// When the goal was last moved.
    last: Instant,
    /// How far virtual time may go.
    goal: Nanos,
    /// How far virtual time has gone.
    reached: Nanos,
    /// Where the previous and the present measurement of the achieved speed began.
    marks: [(Instant, Nanos); 2],
    /// How far virtual time would have gone without any lag.
    ideal: Nanos,
    /// The lag to be reported next, measured on the clock.
    next_report: Duration,
}

impl Pacer {
    /// A pacer for virtual time that is at `now` at the instant `at`, and is to go `speed` times as fast as the clock.
    pub fn new(speed: f64, at: Instant, now: Nanos) -> Self {
        let marks = [(at, now); 2];
        Pacer { speed, last: at, goal: now, reached: now, marks, ideal: now, next_report: SHORTEST_REPORT }
    }

    /// Wanted speed of virtual time, as a multiple of the clock's.
    pub fn wanted(&self) -> f64 {
        self.speed
    }

    /// Moves the goal to how far virtual time may go by the instant `at`, and returns the goal.
    pub fn advance(&mut self, at: Instant) -> Nanos {
        let [_, present] = self.marks;
        if self.last.saturating_duration_since(present.0) >= WINDOW {
            self.marks = [present, (self.last, self.reached)];
        }
        let span = at.saturating_duration_since(self.last);
        self.last = at;
        self.ideal += self.scaled(span);
        let goal = self.goal + self.scaled(span);
        self.goal = goal.min(self.reached + self.scaled(LONGEST_LAG));
        self.goal
    }

    /// How far virtual time has gone.
    pub fn reached(&self) -> Nanos {
        self.reached
    }

    /// Records that virtual time has gone as far as `to`.
    pub fn reach(&mut self, to: Nanos) {
        self.reached = to;
    }

    /// True while virtual time has not reached the goal.
    pub fn is_behind(&self) -> bool {
        self.reached < self.goal
    }

    /// The instant from which virtual time may be at `due`.
    pub fn when(&self, due: Nanos) -> Instant {
        let ahead = due.saturating_sub(self.goal) as f64 / self.speed;
        self.last + Duration::from_nanos(ahead.ceil() as u64)
    }

    /// Speed that virtual time achieved in the last one or two seconds, as a multiple of the clock's.
    pub fn achieved(&self) -> f64 {
        let [(begun, from), _] = self.marks;
        let span = self.last.saturating_duration_since(begun).as_nanos();
        if span == 0 { self.speed } else { self.reached.saturating_sub(from) as f64 / span as f64 }
    }

    /// The lag of virtual time if it is to be reported: when it reaches one second of the clock, and each time it has
    /// doubled since the last report.
    pub fn lag(&mut self) -> Option<Nanos> {
        let lag = self.ideal.saturating_sub(self.reached);
        if lag < self.scaled(self.next_report) {
            return None;
        }
        while lag >= self.scaled(self.next_report) {
            self.next_report *= 2;
        }
        Some(lag)
    }

    /// The span of virtual time that belongs to a span of the clock.
    fn scaled(&self, span: Duration) -> Nanos {
        (span.as_nanos() as f64 * self.speed).round() as Nanos
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Lets virtual time go to its goal at the instant `at`, and returns the goal.
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
        // When the computer is fast enough again, no more than the longest lag is made up for.
        assert!(go(&mut pacer, start + 1001 * MS) <= 500_000_000 + 40_000_000);
        assert!(!pacer.is_behind());
    }

    #[test]
    fn a_lag_is_reported_each_time_it_has_doubled() {
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
        // In 10 ms of the clock virtual time should go 20 ms and goes 5 ms, so the lag grows by 15 ms.
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
