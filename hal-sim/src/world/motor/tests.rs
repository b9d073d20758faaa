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
/// accelerated anew. A field that then goes on at its speed demands nothing.
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
