//! The motor: a rotor that follows the field of the coils, quasi-statically, as long as the torque lasts.
//!
//! Torques are fractions of what the motor has at full current ([`FULL_TORQUE`]). What the current gives is
//! available; load, friction and, while the speed changes, inertia demand. While more is available than demanded
//! the rotor is where the field is (the load angle is reported, but not taken off the position). Otherwise,
//! or when it meets a hard end, the rotor stays where it is and the field runs away. It falls in again once
//! the torque suffices and the field moves no faster than the pull-in speed, or stands: at the nearest position
//! that looks the same to the rotor, a multiple of four full steps away. With the bridges off friction holds the
//! rotor.

use crate::chip::tmc262::{FULL_LOAD, LoadRatio};
use crate::clock::{Nanos, SECOND};

/// Units of position in a full step.
pub const FULL_STEP: i64 = 256;
/// Units of position in an electrical period of four full steps; positions that far apart look the same to
/// the rotor.
pub const PERIOD: i64 = 4 * FULL_STEP;
/// The torque at full current (and the load that stalls the motor there).
pub const FULL_TORQUE: u32 = 65_536;

/// A field that takes longer than this for an electrical period counts as resting, as far as inertia goes.
const REST: Nanos = SECOND / 10;

/// What kind of motor it is. The default has neither friction nor inertia and never loses a step by itself.
#[derive(Clone, Debug)]
pub struct MotorConfig {
    /// Torque that friction demands at any speed, in 1/65536 of the torque at full current.
    pub friction: u32,
    /// Torque that an acceleration of 1000 full steps/s^2 demands, in 1/65536 of the torque at full current.
    pub inertia: u32,
    /// Speed in full steps per second up to which a rotor that lost the field can fall in again; at least 1.
    pub pull_in: u32,
    /// The lowest position the rotor can reach (mechanical hard end).
    pub lowest: i64,
    /// The highest position the rotor can reach.
    pub highest: i64,
}

impl Default for MotorConfig {
    fn default() -> Self {
        Self { friction: 0, inertia: 0, pull_in: 200, lowest: i64::MIN, highest: i64::MAX }
    }
}

/// Speed of the field, for the torque that acceleration takes.
#[derive(Clone, Debug, Default)]
struct Acceleration {
    since: Nanos,
    moved: i64,
    /// Over the last electrical period: signed, in 1/1000 full step per second, and how long it took.
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
    /// What the offset is as long as no step is lost.
    origin: i64,
    following: bool,
    /// A rotor that does not follow has not yet had its chance to fall in since the field last moved.
    unsettled: bool,
    available: u32,
    load: u32,
    demand: u32,
    /// None while the field has not moved since the driver was reset.
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

    /// Absolute position of the rotor.
    #[inline]
    pub fn rotor(&self) -> i64 {
        self.rotor
    }

    /// Absolute position the rotor would have if it had followed every step.
    #[inline]
    pub fn field(&self) -> i64 {
        self.field + self.origin
    }

    /// How many full steps the rotor is behind the field since the driver was powered, negative when it is
    /// ahead. Before the bridges are switched on for the first time it can be up to two off the field.
    pub fn lost_steps(&self) -> i64 {
        (self.field() - self.rotor) / FULL_STEP
    }

    /// Whether the rotor is held or carried along by the field.
    pub fn is_following(&self) -> bool {
        self.following && self.has_torque()
    }

    /// Torque available from the present current, in 1/65536.
    pub fn available(&self) -> u32 {
        self.available
    }

    /// Torque demanded, in 1/65536.
    pub fn demand(&self) -> u32 {
        self.demand
    }

    /// How far the load turns the rotor back against the field, in 1/256 full steps: 0..=256, where 256
    /// (90 degrees electrical) is the angle at which it stalls.
    pub fn load_angle(&self) -> i64 {
        let ratio = f64::from(self.load_ratio()) / f64::from(FULL_LOAD);
        (ratio.asin() / core::f64::consts::FRAC_PI_2 * FULL_STEP as f64).round() as i64
    }

    /// Demanded to available torque, [`FULL_LOAD`] at the stall and beyond.
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

    /// External load in 1/65536.
    pub fn load(&self) -> u32 {
        self.load
    }

    /// The driver's torque current in 1/32; 0 is bridges off.
    #[inline]
    pub fn set_current(&mut self, current: u32) {
        let available = current * (FULL_TORQUE / 32);
        if available != self.available {
            self.available = available;
            self.unsettled = !self.following;
        }
    }

    /// The field has been moved by a step at `at` to `field`, on the driver's scale.
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

    /// The field has been set to `field` at `at` other than by a step (coil currents given by SPI).
    pub fn turn_field(&mut self, at: Nanos, field: i64) {
        if field != self.field {
            self.follow(at, field);
        }
    }

    /// Time has passed until `now` without further steps: lets a rotor that lost a standing field fall in.
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

    /// When a rotor that has lost the field falls in again if the field stands still until then.
    #[inline]
    pub fn next_event(&self) -> Option<Nanos> {
        if !self.unsettled || !self.has_torque() {
            return None;
        }
        let full_step = SECOND / u64::from(self.config.pull_in.max(1));
        Some(self.last_step.map_or(0, |last| last + full_step))
    }

    /// A blow moves the rotor by `full_steps` against field and counter. Multiples of four stay; with the
    /// bridges on, others are drawn to the nearest multiple of four, two up to the next higher. Hard ends
    /// limit it.
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

    /// The driver was reset and its field now stands at `field`: the count of lost steps begins anew and
    /// the rotor is drawn to the nearest position that fits when the bridges are switched on.
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

    /// A step of `delta` comes to a rotor that does not follow.
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

    /// The offset that puts the rotor at the nearest position which looks like the field's.
    fn nearest_offset(&self) -> i64 {
        let apart = self.rotor - self.field;
        (apart + PERIOD / 2).div_euclid(PERIOD) * PERIOD
    }

    fn fall_in(&mut self) {
        self.offset = self.nearest_offset();
        self.following = true;
        self.unsettled = false;
    }

    /// Falls in, or stays pressed against a hard end if that is nearest.
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

    /// Measures the speed over electrical periods, and the acceleration from one to the next: the change of
    /// the mean speeds over the time between the middles of the two. The first period after a
    /// rest only gives a speed to start from.
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

    /// A motor at full current that has caught the field.
    fn energised(config: MotorConfig) -> Motor {
        let mut motor = Motor::new(config, 0);
        motor.set_current(32);
        motor.settle(SECOND);
        assert!(motor.is_following());
        motor
    }

    /// Moves the field to `to` in steps of `size` every `interval`, returns the time.
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
        // 1/256 full step in 10 us is 390 full steps/s, above the pull-in speed of 200.
        let now = run(&mut motor, SECOND, 10 * MICROSECOND, 1, 10_000);
        motor.set_load(0);
        let now = run(&mut motor, now, 10 * MICROSECOND, 1, 40);
        assert_eq!(motor.rotor(), 0);
        // 256 units at 200 full steps/s: 5 ms after the last step it falls in by itself.
        assert_eq!(motor.next_event(), Some(now + 5 * MILLISECOND));
        assert!(!motor.settle(now + 5 * MILLISECOND - 1));
        assert!(motor.settle(now + 5 * MILLISECOND));
        // The field is at 10 040, the nearest equal position to 0 is 10 040 - 10 x 1024 = -200.
        assert_eq!((motor.rotor(), motor.lost_steps()), (-200, 40));
        assert_eq!(motor.next_event(), None);
    }

    #[test]
    fn a_rotor_that_had_time_to_fall_in_follows_a_fast_start() {
        let mut motor = energised(MotorConfig::default());
        motor.set_current(0);
        let now = run(&mut motor, SECOND, 10 * MICROSECOND, 1, 1_000);
        motor.set_current(32);
        // Nobody looked for 10 ms; the next step is a whole full step.
        motor.follow(now + 10 * MILLISECOND, 1_256);
        assert_eq!((motor.rotor(), motor.lost_steps()), (232, 4));
    }

    #[test]
    fn a_slow_field_catches_the_rotor_while_it_moves() {
        let mut motor = energised(MotorConfig::default());
        motor.set_current(0);
        let now = run(&mut motor, SECOND, 10 * MICROSECOND, 1, 1_024);
        motor.set_current(32);
        // 1/256 full step in 20 us is 195 full steps/s.
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
        // Half a period ahead of the rotor (1000 + 513) the next equal position back is 489.
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
            // Whole full steps at the times t = sqrt(2 s / a).
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
        // 500 full steps/s for two electrical periods, then twice as many: within 6 ms, which takes 41 times the torque.
        let now = run(&mut motor, 0, 2 * MILLISECOND, FULL_STEP, 8);
        let now = run(&mut motor, now, MILLISECOND / 4, FULL_STEP, 40);
        assert!(!motor.is_following());
        assert_eq!(motor.demand(), 0, "one that is left behind is not accelerated");
        assert!(motor.lost_steps() >= 20, "{}", motor.lost_steps());
        // All that is over in less than the 100 ms after which a field would count as resting.
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
