//! The motor: a rotor that follows the field of the coils, without dynamics, as long as the torque lasts.
//!
//! Torques are in fractions of the torque at full current ([`FULL_TORQUE`]). The current makes a torque available;
//! load, friction and, while the speed changes, inertia demand one. While more torque is available than demanded, the
//! rotor is where the field is (the load angle is reported, but not subtracted from the position). Otherwise, or when
//! the rotor meets a hard end, the rotor stays where it is and the field runs away. The rotor falls in again once the
//! torque suffices and the field moves no faster than the pull-in speed, or stands: at the nearest position that looks
//! the same to the rotor, a multiple of four full steps away. With the bridges off friction holds the rotor.

use crate::chip::load::{FULL_LOAD, LoadRatio};
use crate::clock::{Nanos, SECOND};

/// Number of units of position in a full step.
pub const FULL_STEP: i64 = 256;
/// Number of units of position in an electrical period, of four full steps. Positions that far apart look the same to
/// the rotor.
pub const PERIOD: i64 = 4 * FULL_STEP;
/// The torque at full current, which is also the load that stalls the motor there.
pub const FULL_TORQUE: u32 = 65_536;

/// A field that takes longer than this for an electrical period counts as resting in the measurement of acceleration.
const REST: Nanos = SECOND / 10;

/// The properties of a motor. The default has neither friction nor inertia and never loses a step by itself.
#[derive(Clone, Debug)]
pub struct MotorConfig {
    /// Torque that friction demands at any speed, in 1/65536 of the torque at full current.
    pub friction: u32,
    /// Torque that an acceleration of 1000 full steps/s^2 demands, in 1/65536 of the torque at full current.
    pub inertia: u32,
    /// Speed in full steps per second up to which a rotor that lost the field can fall in again; at least 1.
    pub pull_in: u32,
    /// The lowest position that the rotor can reach, a mechanical hard end, in 1/256 full steps.
    pub lowest: i64,
    /// The highest position that the rotor can reach.
    pub highest: i64,
}

impl Default for MotorConfig {
    fn default() -> Self {
        Self { friction: 0, inertia: 0, pull_in: 200, lowest: i64::MIN, highest: i64::MAX }
    }
}

/// The measurement of the field's acceleration, for the torque that inertia demands.
#[derive(Clone, Debug, Default)]
struct Acceleration {
    /// The time at which the present electrical period began.
    since: Nanos,
    /// How far the field has moved since then.
    moved: i64,
    /// The mean speed over the last electrical period, with its sign, in 1/1000 full step per second, and the duration
    /// of that period in nanoseconds.
    speed: Option<(i64, i64)>,
    demand: u32,
}

/// The motor. Positions are in 1/256 full steps.
#[derive(Clone, Debug)]
pub struct Motor {
    config: MotorConfig,
    rotor: i64,
    field: i64,
    /// Rotor minus field while the rotor follows: a multiple of [`PERIOD`].
    offset: i64,
    /// The value that the offset has as long as no step is lost.
    origin: i64,
    /// The rotor follows the field.
    following: bool,
    /// The rotor does not follow, and the field has not stood long enough since its last step for the rotor to fall in.
    unsettled: bool,
    available: u32,
    load: u32,
    demand: u32,
    /// The time of the last step; `None` if the field has not moved since the driver was reset.
    last_step: Option<Nanos>,
    acceleration: Acceleration,
}

impl Motor {
    /// A motor with its rotor at `start`, bridges off, and a field at 0.
    pub fn new(config: MotorConfig, start: i64) -> Self {
        let rotor = start.clamp(config.lowest, config.highest);
        let mut motor = Self {
            config,
            rotor,
            field: 0,
            offset: 0,
            origin: 0,
            following: false,
            unsettled: true,
            available: 0,
            load: 0,
            demand: 0,
            last_step: None,
            acceleration: Acceleration::default(),
        };
        motor.restart(0);
        motor.weigh();
        motor
    }

    /// The absolute position of the rotor, in 1/256 full steps.
    #[inline]
    pub fn rotor(&self) -> i64 {
        self.rotor
    }

    /// The absolute position that the rotor would have if it had followed every step, in 1/256 full steps.
    #[inline]
    pub fn field(&self) -> i64 {
        self.field + self.origin
    }

    /// How many full steps the rotor is behind the field since the driver was powered; negative if it is ahead. Before
    /// the bridges are switched on for the first time the rotor can be up to two full steps off the field.
    pub fn lost_steps(&self) -> i64 {
        (self.field() - self.rotor) / FULL_STEP
    }

    /// Whether the rotor is held or carried along by the field.
    pub fn is_following(&self) -> bool {
        self.following && self.has_torque()
    }

    /// The torque that the present current makes available, in 1/65536 of the torque at full current.
    pub fn available(&self) -> u32 {
        self.available
    }

    /// The torque that load, friction and inertia demand, in 1/65536 of the torque at full current.
    pub fn demand(&self) -> u32 {
        self.demand
    }

    /// The angle by which the load turns the rotor back against the field, in 1/256 full steps: 0..=256, where 256 (90
    /// degrees electrical) is the angle at which the rotor stalls.
    pub fn load_angle(&self) -> i64 {
        let ratio = f64::from(self.load_ratio()) / f64::from(FULL_LOAD);
        (ratio.asin() / core::f64::consts::FRAC_PI_2 * FULL_STEP as f64).round() as i64
    }

    /// The ratio of the demanded to the available torque; [`FULL_LOAD`] for a motor that stalls or does not follow.
    pub fn load_ratio(&self) -> LoadRatio {
        if !self.following || !self.has_torque() {
            return FULL_LOAD;
        }
        (u64::from(self.demand) * u64::from(FULL_LOAD) / u64::from(self.available)) as LoadRatio
    }

    /// Sets the external load in 1/65536 of the torque at full current.
    pub fn set_load(&mut self, load: u32) {
        self.load = load;
        self.weigh();
        self.unsettled = !self.following;
    }

    /// The external load in 1/65536 of the torque at full current.
    pub fn load(&self) -> u32 {
        self.load
    }

    /// Sets the current that makes torque, in 1/32 of the full current; 0 is bridges off.
    #[inline]
    pub fn set_current(&mut self, current: u32) {
        let available = current * (FULL_TORQUE / 32);
        if available != self.available {
            self.available = available;
            self.unsettled = !self.following;
        }
    }

    /// Moves the motor after a step at `at` has moved the field to `field`, on the driver's scale in 1/256 full steps.
    #[inline]
    pub fn follow(&mut self, at: Nanos, field: i64) {
        if self.unsettled {
            self.settle(at);
        }
        let delta = field - self.field;
        self.field = field;
        if !self.following {
            self.try_to_fall_in(at, delta);
        } else if self.config.inertia != 0 {
            self.accelerate(at, delta);
        }
        self.last_step = Some(at);
        if self.following {
            let rotor = self.field + self.offset;
            let free = rotor >= self.config.lowest && rotor <= self.config.highest;
            if self.has_torque() && free {
                self.rotor = rotor;
            } else {
                self.lose(rotor);
            }
        }
    }

    /// Moves the motor after the field was set to `field` at `at` other than by a step, for example by coil currents
    /// given over SPI.
    pub fn turn_field(&mut self, at: Nanos, field: i64) {
        if field != self.field {
            self.follow(at, field);
        }
    }

    /// Moves the motor on to `now` after time without steps: a rotor that has lost a standing field may fall in.
    /// Returns whether the rotor moved.
    #[inline]
    pub fn settle(&mut self, now: Nanos) -> bool {
        if self.next_event().is_none_or(|due| due > now) {
            return false;
        }
        let before = self.rotor;
        self.fall_in_at_rest();
        before != self.rotor
    }

    /// The time at which a rotor that has lost the field falls in, if the field stands until then; `None` if it will
    /// not fall in by itself.
    #[inline]
    pub fn next_event(&self) -> Option<Nanos> {
        if !self.unsettled || !self.has_torque() {
            return None;
        }
        let full_step = SECOND / u64::from(self.config.pull_in.max(1));
        Some(self.last_step.map_or(0, |last| last + full_step))
    }

    /// Moves the rotor by `full_steps` against the field, as a blow does. A multiple of four full steps lasts; with the
    /// bridges on the rotor is drawn from any other position to the nearest multiple of four, from two full steps to
    /// the next higher. Hard ends limit the way.
    pub fn slip(&mut self, full_steps: i64) {
        let target = self.rotor.saturating_add(full_steps.saturating_mul(FULL_STEP));
        self.rotor = target.clamp(self.config.lowest, self.config.highest);
        if self.has_torque() && self.following {
            self.fall_in_at_rest();
        } else {
            self.following = false;
            self.unsettled = true;
        }
    }

    /// Notes that the driver was reset and its field now stands at `field`. The count of lost steps begins anew, and
    /// when the bridges are switched on the rotor is drawn to the nearest position that looks like the field's.
    pub fn restart(&mut self, field: i64) {
        self.field = field;
        self.last_step = None;
        self.following = false;
        self.unsettled = true;
        self.origin = self.nearest_offset();
    }

    #[inline]
    fn has_torque(&self) -> bool {
        self.available > self.demand
    }

    fn weigh(&mut self) {
        let demand = u64::from(self.load) + u64::from(self.config.friction) + u64::from(self.acceleration.demand);
        self.demand = demand.min(u64::from(u32::MAX)) as u32;
    }

    fn lose(&mut self, would_be: i64) {
        if would_be < self.config.lowest {
            self.rotor = self.config.lowest;
        } else if would_be > self.config.highest {
            self.rotor = self.config.highest;
        }
        self.following = false;
        self.unsettled = true;
        self.acceleration = Acceleration::default();
        self.weigh();
    }

    /// Lets a rotor that does not follow fall in, if the step of `delta` at `at` is slow enough.
    #[cold]
    fn try_to_fall_in(&mut self, at: Nanos, delta: i64) {
        self.unsettled = true;
        let took = self.last_step.map_or(SECOND, |last| at.saturating_sub(last));
        let fastest = u128::from(self.config.pull_in) * FULL_STEP as u128;
        let slow = u128::from(delta.unsigned_abs()) * u128::from(SECOND) <= fastest * u128::from(took);
        if slow && self.has_torque() {
            self.fall_in();
            self.acceleration.since = at;
        }
    }

    /// The offset that puts the rotor at the nearest position that looks like the field's.
    fn nearest_offset(&self) -> i64 {
        let apart = self.rotor - self.field;
        (apart + PERIOD / 2).div_euclid(PERIOD) * PERIOD
    }

    fn fall_in(&mut self) {
        self.offset = self.nearest_offset();
        self.following = true;
        self.unsettled = false;
    }

    /// Lets the rotor fall in at a standing field, or leaves it pressed against a hard end if the nearest position is
    /// beyond.
    fn fall_in_at_rest(&mut self) {
        self.fall_in();
        let rotor = self.field + self.offset;
        if rotor < self.config.lowest || rotor > self.config.highest {
            self.lose(rotor);
            self.unsettled = false;
        } else {
            self.rotor = rotor;
        }
    }

    /// Measures the speed of the field over electrical periods, and its acceleration from one period to the next: the
    /// change of the mean speeds over the time between the middles of the two periods. The first period after a rest
    /// only gives a speed to start from.
    #[cold]
    fn accelerate(&mut self, at: Nanos, delta: i64) {
        let measured = &mut self.acceleration;
        measured.moved += delta;
        let took = at.saturating_sub(measured.since);
        if took > REST {
            *measured = Acceleration { since: at, ..Acceleration::default() };
        } else if measured.moved.abs() >= PERIOD && took > 0 {
            let (second, took) = (SECOND as i64, took as i64);
            let speed = measured.moved * second / FULL_STEP * 1000 / took;
            measured.demand = measured.speed.map_or(0, |(before, took_before)| {
                let change = (speed - before).unsigned_abs(); // 1/1000 full step/s
                let between = (took + took_before).unsigned_abs() / 2;
                let demand = u128::from(change) * u128::from(SECOND) / u128::from(between)
                    * u128::from(self.config.inertia)
                    / 1_000_000;
                demand.min(u128::from(u32::MAX)) as u32
            });
            measured.speed = Some((speed, took));
            measured.since = at;
            measured.moved = 0;
        } else {
            return;
        }
        self.weigh();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::{MICROSECOND, MILLISECOND};

    /// A motor at full current whose rotor has fallen in.
    fn energised(config: MotorConfig) -> Motor {
        let mut motor = Motor::new(config, 0);
        motor.set_current(32);
        motor.settle(SECOND);
        assert!(motor.is_following());
        motor
    }

    /// Moves the field by `steps` steps of `size` units, one each `interval`, and returns the time of the last step.
    fn run(motor: &mut Motor, from: Nanos, interval: Nanos, size: i64, steps: i64) -> Nanos {
        let start = motor.field;
        let mut now = from;
        for step in 1..=steps {
            now += interval;
            motor.follow(now, start + step * size);
        }
        now
    }

    #[test]
    fn the_rotor_follows_while_the_torque_lasts() {
        let mut motor = energised(MotorConfig::default());
        motor.set_load(FULL_TORQUE - 1);
        run(&mut motor, SECOND, 10 * MICROSECOND, 1, 5_000);
        assert_eq!((motor.rotor(), motor.lost_steps()), (5_000, 0));
        motor.set_current(16);
        run(&mut motor, 2 * SECOND, 10 * MICROSECOND, 1, 2_560);
        assert_eq!((motor.rotor(), motor.lost_steps()), (5_000, 10));
        assert_eq!(motor.load_ratio(), FULL_LOAD);
    }

    #[test]
    fn a_load_of_one_stalls_at_full_current() {
        let mut motor = energised(MotorConfig::default());
        motor.set_load(FULL_TORQUE);
        run(&mut motor, SECOND, 10 * MICROSECOND, 1, 100);
        assert_eq!((motor.rotor(), motor.field()), (0, 100));
        assert!(!motor.is_following());
    }

    #[test]
    fn a_stalled_rotor_falls_in_four_full_steps_apart_and_only_when_the_field_is_slow() {
        let mut motor = energised(MotorConfig::default());
        motor.set_load(FULL_TORQUE);
        // A step of 1/256 full step in 10 us is 390 full steps/s, above the pull-in speed of 200.
        let now = run(&mut motor, SECOND, 10 * MICROSECOND, 1, 10_000);
        motor.set_load(0);
        let now = run(&mut motor, now, 10 * MICROSECOND, 1, 40);
        assert_eq!(motor.rotor(), 0);
        // 256 units at 200 full steps/s take 5 ms: so long after the last step the rotor falls in by itself.
        assert_eq!(motor.next_event(), Some(now + 5 * MILLISECOND));
        assert!(!motor.settle(now + 5 * MILLISECOND - 1));
        assert!(motor.settle(now + 5 * MILLISECOND));
        // The field is at 10 040; the nearest position to 0 that looks the same is 10 040 - 10 x 1024 = -200.
        assert_eq!((motor.rotor(), motor.lost_steps()), (-200, 40));
        assert_eq!(motor.next_event(), None);
    }

    #[test]
    fn a_rotor_that_had_time_to_fall_in_follows_a_fast_start() {
        let mut motor = energised(MotorConfig::default());
        motor.set_current(0);
        let now = run(&mut motor, SECOND, 10 * MICROSECOND, 1, 1_000);
        motor.set_current(32);
        // The motor was not brought up to date for 10 ms; the next step is a whole full step.
        motor.follow(now + 10 * MILLISECOND, 1_256);
        assert_eq!((motor.rotor(), motor.lost_steps()), (232, 4));
    }

    #[test]
    fn a_slow_field_catches_the_rotor_while_it_moves() {
        let mut motor = energised(MotorConfig::default());
        motor.set_current(0);
        let now = run(&mut motor, SECOND, 10 * MICROSECOND, 1, 1_024);
        motor.set_current(32);
        // A step of 1/256 full step in 20 us is 195 full steps/s.
        run(&mut motor, now, 20 * MICROSECOND, 1, 10);
        assert_eq!((motor.rotor(), motor.lost_steps()), (10, 4));
    }

    #[test]
    fn with_the_bridges_off_the_rotor_stays_and_snaps_when_they_come_on() {
        let mut motor = Motor::new(MotorConfig::default(), 700);
        motor.settle(SECOND);
        assert_eq!(motor.rotor(), 700);
        motor.set_current(1);
        assert!(motor.settle(SECOND));
        // 700 is nearer to 1024 than to 0.
        assert_eq!((motor.rotor(), motor.lost_steps()), (1_024, 0));
    }

    #[test]
    fn a_blow_keeps_multiples_of_four_full_steps() {
        let mut motor = energised(MotorConfig::default());
        motor.slip(-8);
        assert_eq!((motor.rotor(), motor.lost_steps()), (-2_048, 8));
        motor.slip(1);
        assert_eq!(motor.rotor(), -2_048);
        motor.slip(3);
        assert_eq!(motor.rotor(), -1_024);
        run(&mut motor, SECOND, 10 * MICROSECOND, 1, 24);
        assert_eq!((motor.rotor(), motor.lost_steps()), (-1_000, 4));
        motor.set_current(0);
        motor.slip(1);
        assert_eq!(motor.rotor(), -744);
    }

    #[test]
    fn a_hard_end_stops_the_rotor_and_throws_it_back() {
        let config = MotorConfig { highest: 1_000, ..MotorConfig::default() };
        let mut motor = energised(config);
        let now = run(&mut motor, SECOND, 100 * MICROSECOND, 1, 1_400);
        assert_eq!((motor.rotor(), motor.lost_steps()), (1_000, 1));
        // Turning back before the field is half a period ahead loses nothing.
        let now = run(&mut motor, now, 100 * MICROSECOND, -1, 500);
        assert_eq!((motor.rotor(), motor.lost_steps()), (900, 0));
        // With the field half a period ahead of the rotor (1000 + 513) the next position back that looks the same is
        // 489.
        run(&mut motor, now, 100 * MICROSECOND, 1, 613);
        assert_eq!((motor.rotor(), motor.lost_steps()), (489, 4));
    }

    #[test]
    fn pressed_against_a_hard_end_at_rest_there_is_nothing_to_wait_for() {
        let config = MotorConfig { lowest: -100, ..MotorConfig::default() };
        let mut motor = energised(config);
        let now = run(&mut motor, SECOND, MICROSECOND, -1, 300);
        let due = now + 5 * MILLISECOND;
        assert_eq!(motor.next_event(), Some(due));
        assert!(!motor.settle(due));
        assert_eq!((motor.rotor(), motor.next_event()), (-100, None));
    }

    #[test]
    fn inertia_limits_the_acceleration() {
        // Full torque accelerates by 100 000 full steps/s^2.
        let config = MotorConfig { inertia: FULL_TORQUE / 100, ..MotorConfig::default() };
        let ramp = |acceleration: f64| {
            let mut motor = energised(config.clone());
            // The times of whole full steps are t = sqrt(2 s / a).
            for step in 1..=200_i64 {
                let seconds = (2.0 * step as f64 / acceleration).sqrt();
                motor.follow(SECOND + (seconds * 1e9) as Nanos, step * FULL_STEP);
            }
            motor.lost_steps()
        };
        assert_eq!(ramp(60_000.0), 0);
        assert!(ramp(200_000.0) > 100);
    }

    /// A rotor that has lost the field to its own inertia falls in when the field is slow again, and begins to be
    /// accelerated anew: a field that then goes on at its speed demands nothing.
    #[test]
    fn inertia_counts_anew_after_a_loss() {
        let config = MotorConfig { inertia: FULL_TORQUE / 2, pull_in: 2_000, ..MotorConfig::default() };
        let mut motor = Motor::new(config, 0);
        motor.set_current(32);
        motor.settle(0);
        // 500 full steps/s for two electrical periods, and then 4000: the change demands far more than the torque of
        // the motor.
        let now = run(&mut motor, 0, 2 * MILLISECOND, FULL_STEP, 8);
        let now = run(&mut motor, now, MILLISECOND / 4, FULL_STEP, 40);
        assert!(!motor.is_following());
        assert_eq!(motor.demand(), 0, "one that is left behind is not accelerated");
        assert!(motor.lost_steps() >= 20, "{}", motor.lost_steps());
        // All of this takes less than the 100 ms after which a field counts as resting.
        let now = run(&mut motor, now, MILLISECOND / 8, FULL_STEP / 16, 16);
        assert!(motor.is_following());
        let mut now = now;
        for _ in 0..1_000 {
            now = run(&mut motor, now, MILLISECOND / 8, FULL_STEP / 16, 1);
            assert!(motor.is_following() && motor.demand() == 0, "after {now} ns");
        }
    }

    #[test]
    fn the_load_angle_is_a_full_step_at_the_stall() {
        let mut motor = energised(MotorConfig::default());
        assert_eq!(motor.load_angle(), 0);
        // asin(0.5) = 30 degrees of 90: 256 / 3 = 85.
        motor.set_load(FULL_TORQUE / 2);
        assert_eq!((motor.load_angle(), motor.load_ratio()), (85, FULL_LOAD / 2));
        motor.set_load(FULL_TORQUE);
        assert_eq!(motor.load_angle(), 256);
    }
}
