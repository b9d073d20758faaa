//! The pace of virtual time, measured against a clock, whose moments are spans since a beginning of its own.

use std::time::Duration;

use hal_sim::clock::Nanos;
use tmcm_sim::protocol::Speed;

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
    /// Wanted speed.
    speed: Speed,
    /// When the goal was last moved.
    last: Duration,
    /// How far virtual time may go.
    goal: Nanos,
    /// How far virtual time has gone.
    reached: Nanos,
    /// Where the previous and the present measurement of the achieved speed began.
    marks: [(Duration, Nanos); 2],
    /// How far virtual time would have gone without any lag.
    ideal: Nanos,
    /// The lag to be reported next, measured on the clock.
    next_report: Duration,
}

impl Pacer {
    /// A pacer for virtual time that is at `now` at the moment `at`, and is to go at this speed.
    pub fn new(speed: Speed, at: Duration, now: Nanos) -> Self {
        let marks = [(at, now); 2];
        Pacer { speed, last: at, goal: now, reached: now, marks, ideal: now, next_report: SHORTEST_REPORT }
    }

    /// Wanted speed of virtual time.
    pub fn wanted(&self) -> Speed {
        self.speed
    }

    /// Changes the wanted speed. What virtual time lags behind is forgotten.
    pub fn set_speed(&mut self, speed: Speed, at: Duration) {
        *self = Pacer::new(speed, at, self.reached);
    }

    /// Moves the goal to how far virtual time may go by the moment `at`, and returns the goal.
    pub fn advance(&mut self, at: Duration) -> Nanos {
        let span = self.measure(at);
        if let Some(gained) = self.scaled(span) {
            self.ideal += gained;
            let longest = self.scaled(LONGEST_LAG).unwrap_or_default();
            self.goal = (self.goal + gained).min(self.reached + longest);
        } else {
            self.ideal = self.reached;
            self.goal = Nanos::MAX;
        }
        self.goal
    }

    /// Notes that virtual time has not gone by the clock up to the moment `at`, but that somebody has taken it as far
    /// as `now`. So there is nothing to be made up for.
    pub fn rest(&mut self, at: Duration, now: Nanos) {
        self.measure(at);
        self.reached = now;
        self.goal = now;
        self.ideal = now;
    }

    /// The span of the clock since the last call, for the measurement of the achieved speed.
    fn measure(&mut self, at: Duration) -> Duration {
        let [_, present] = self.marks;
        if self.last.saturating_sub(present.0) >= WINDOW {
            self.marks = [present, (self.last, self.reached)];
        }
        let span = at.saturating_sub(self.last);
        self.last = at;
        span
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

    /// The moment from which virtual time may be at `due`.
    pub fn when(&self, due: Nanos) -> Duration {
        match self.speed {
            Speed::Factor(factor) => {
                let ahead = due.saturating_sub(self.goal) as f64 / factor;
                self.last + Duration::from_nanos(ahead.ceil() as u64)
            }
            Speed::Max => self.last,
        }
    }

    /// Speed that virtual time achieved in the last one or two seconds, as a multiple of the clock's.
    pub fn achieved(&self) -> f64 {
        let [(begun, from), _] = self.marks;
        let span = self.last.saturating_sub(begun).as_nanos();
        if span == 0 { 0.0 } else { self.reached.saturating_sub(from) as f64 / span as f64 }
    }

    /// How far virtual time is behind where it would be without any lag, since it last went otherwise than by the
    /// clock.
    pub fn behind(&self) -> Nanos {
        self.ideal.saturating_sub(self.reached)
    }

    /// The lag of virtual time if it is to be reported: when it reaches one second of the clock, and each time it has
    /// doubled since the last report.
    pub fn lag(&mut self) -> Option<Nanos> {
        let lag = self.behind();
        let reported = |report| self.scaled(report).is_some_and(|least| lag >= least);
        let mut next = self.next_report;
        while reported(next) {
            next *= 2;
        }
        (std::mem::replace(&mut self.next_report, next) != next).then_some(lag)
    }

    /// The span of virtual time that belongs to a span of the clock; `None` if time goes as fast as it can.
    fn scaled(&self, span: Duration) -> Option<Nanos> {
        match self.speed {
            Speed::Factor(factor) => Some((span.as_nanos() as f64 * factor).round() as Nanos),
            Speed::Max => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Lets virtual time go to its goal at the moment `at`, and returns the goal.
    fn go(pacer: &mut Pacer, at: Duration) -> Nanos {
        let goal = pacer.advance(at);
        pacer.reach(goal);
        goal
    }

    #[test]
    fn time_goes_by_the_factor() {
        let start = Duration::ZERO;
        let mut pacer = Pacer::new(Speed::Factor(2.5), start, 0);
        assert_eq!(go(&mut pacer, start + 4 * MS), 10_000_000);
        assert_eq!(pacer.when(15_000_000), start + 6 * MS);
        assert_eq!(pacer.when(5_000_000), start + 4 * MS);
        assert_eq!(pacer.achieved(), 2.5);
    }

    #[test]
    fn a_long_pause_is_not_made_up_for() {
        let start = Duration::ZERO;
        let mut pacer = Pacer::new(Speed::Factor(1.0), start, 0);
        assert_eq!(go(&mut pacer, start + 500 * MS), 20_000_000);
        assert_eq!(go(&mut pacer, start + 510 * MS), 30_000_000);
        assert!(pacer.achieved() < 0.1);
    }

    #[test]
    fn where_the_computer_is_too_slow_time_lags() {
        let start = Duration::ZERO;
        let mut pacer = Pacer::new(Speed::Factor(2.0), start, 0);
        for n in 1..=100 {
            pacer.advance(start + n * 10 * MS);
            pacer.reach(pacer.reached() + 5_000_000);
            assert!(pacer.is_behind());
        }
        assert_eq!(pacer.achieved(), 0.5);
        // When the computer is fast enough again, no more than the longest lag is made up for.
        assert_eq!(pacer.behind(), 1_500_000_000);
        assert!(go(&mut pacer, start + 1001 * MS) <= 500_000_000 + 40_000_000);
        assert!(!pacer.is_behind());
    }

    #[test]
    fn a_lag_is_reported_each_time_it_has_doubled() {
        let start = Duration::ZERO;
        let mut pacer = Pacer::new(Speed::Factor(2.0), start, 7_000_000);
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
    fn as_fast_as_it_can_time_has_no_goal_and_never_lags() {
        let start = Duration::ZERO;
        let mut pacer = Pacer::new(Speed::Max, start, 5);
        assert_eq!(pacer.advance(start + 10_000 * MS), Nanos::MAX);
        assert!(pacer.is_behind() && pacer.lag().is_none());
        pacer.reach(40_000_000_005);
        assert_eq!((pacer.achieved(), pacer.when(90_000_000_000)), (4.0, start + 10_000 * MS));
        pacer.set_speed(Speed::Factor(2.0), start + 10_000 * MS);
        assert_eq!(pacer.advance(start + 10_004 * MS), 40_008_000_005);
    }

    #[test]
    fn what_passes_without_the_clock_is_not_made_up_for() {
        let start = Duration::ZERO;
        let mut pacer = Pacer::new(Speed::Factor(1.0), start, 0);
        pacer.advance(start + 10 * MS);
        pacer.rest(start + 500 * MS, 2_000_000_000);
        assert!(!pacer.is_behind() && pacer.lag().is_none());
        assert_eq!((pacer.reached(), pacer.achieved()), (2_000_000_000, 4.0));
        assert_eq!(pacer.advance(start + 510 * MS), 2_010_000_000);
    }

    #[test]
    fn the_achieved_speed_forgets_the_past() {
        let start = Duration::ZERO;
        let mut pacer = Pacer::new(Speed::Factor(1.0), start, 0);
        go(&mut pacer, start + 1000 * MS);
        for n in 1..=200 {
            go(&mut pacer, start + (1000 + 10 * n) * MS);
        }
        assert!(pacer.achieved() > 0.99);
    }
}
