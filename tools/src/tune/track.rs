//! The track on which the motor goes to and fro while it is measured.

use std::time::Duration;

use tmcm_sim::WorldConfig;

/// Room that is left free at each end, in full steps: a stage that is blocked there must not be touched.
const MARGIN: f64 = 4.0;
/// Units of position of a world in a full step.
const WORLD_STEP: f64 = 256.0;

/// The needs of a measurement for its track, in microsteps and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Need {
    /// The highest speed, in microsteps per second.
    pub(super) speed: f64,
    /// The acceleration, in microsteps per second, per second.
    pub(super) acceleration: f64,
    /// The way at constant speed that it wants, in microsteps.
    pub(super) constant: f64,
    /// The way at constant speed with which it can do.
    pub(super) enough: f64,
}

impl Need {
    /// The way on which the motor reaches a speed, and that on which it stops, together.
    pub(super) fn ramps(&self, speed: f64) -> f64 {
        speed * speed / self.acceleration.max(1.0)
    }

    /// The way that a measurement wants.
    pub(super) fn wanted(&self) -> f64 {
        self.ramps(self.speed) + self.constant
    }

    /// The way with which it can do.
    pub(super) fn least(&self) -> f64 {
        self.ramps(self.speed) + self.enough
    }

    /// The part of the time in which the motor has a constant speed on a way.
    pub(super) fn share(&self, speed: f64, way: f64) -> f64 {
        let constant = (way - self.ramps(speed)).max(0.0) / speed.max(1.0);
        let ramps = 2.0 * speed / self.acceleration.max(1.0);
        constant / (constant + ramps).max(f64::MIN_POSITIVE)
    }
}

/// The ends of a track, in microsteps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Track {
    /// The lower end.
    pub(super) low: i32,
    /// The upper end.
    pub(super) high: i32,
    /// Where the motor was at the start, and comes back to in the end.
    pub(super) home: i32,
}

/// The room that a motor has on both sides of where it is, in microsteps; `None` is as much as one likes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Room {
    /// Towards lower positions.
    pub(super) left: Option<f64>,
    /// Towards higher positions.
    pub(super) right: Option<f64>,
}

impl Room {
    /// The room that a user has named: so many microsteps to the right, or to the left if it is below 0.
    pub(super) fn named(microsteps: i32) -> Self {
        let way = f64::from(microsteps).abs();
        if microsteps < 0 {
            Room { left: Some(way), right: Some(0.0) }
        } else {
            Room { left: Some(0.0), right: Some(way) }
        }
    }

    /// The room that a fresh motor has in a world: up to hard ends and stop switches. A full step has so many
    /// microsteps.
    pub(super) fn of_world(world: &WorldConfig, axis: usize, microsteps: f64) -> Self {
        let axis = world.axis(axis);
        let (stage, start) = (&axis.stage, axis.motor.start);
        if stage.circle.is_some() {
            return Room::default();
        }
        let way = |ends: [Option<i64>; 2]| {
            let nearest = ends.into_iter().flatten().map(|end| (end - start).abs()).min()?;
            Some((nearest as f64 / WORLD_STEP - MARGIN).max(0.0) * microsteps)
        };
        Room { left: way([stage.hard_left, stage.left]), right: way([stage.hard_right, stage.right]) }
    }

    /// A track for a motor at `home`: to the right of it if there is room, else to the left, else on both sides.
    pub(super) fn track(self, home: i32, need: &Need) -> Track {
        let wanted = need.wanted();
        let within = |room: Option<f64>| room.map_or(wanted, |room| room.min(wanted));
        let (left, right) = match (within(self.left), within(self.right)) {
            (_, right) if right >= wanted => (0.0, right),
            (left, _) if left >= wanted => (left, 0.0),
            both => both,
        };
        Track { low: home.saturating_sub(left as i32), high: home.saturating_add(right as i32), home }
    }
}

impl Track {
    /// The way from end to end, in microsteps.
    pub(super) fn way(&self) -> f64 {
        f64::from(self.high) - f64::from(self.low)
    }

    /// Whether it is as long as a measurement needs at least.
    pub(super) fn is_enough(&self, need: &Need) -> bool {
        self.way() >= need.least()
    }

    /// The end that is farther away from a position.
    pub(super) fn farther(&self, position: i32) -> i32 {
        let (to_low, to_high) = (i64::from(position) - i64::from(self.low), i64::from(self.high) - i64::from(position));
        if to_high >= to_low { self.high } else { self.low }
    }
}

/// A time in words that nobody takes for exact.
pub(super) fn about(time: Duration) -> String {
    match time.as_secs() {
        0..10 => "less than 10 s".into(),
        seconds @ 10..90 => format!("about {} s", seconds.div_ceil(10) * 10),
        seconds => format!("about {} min", seconds.div_ceil(60)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1000 microsteps/s with 500 microsteps/s2: v^2 / 2a = 1000 for each ramp, in 2 s each.
    const NEED: Need = Need { speed: 1000.0, acceleration: 500.0, constant: 4000.0, enough: 1000.0 };

    #[test]
    fn what_a_measurement_needs() {
        assert_eq!((NEED.wanted(), NEED.least()), (6000.0, 3000.0));
        assert_eq!(NEED.share(1000.0, 6000.0), 0.5);
        assert_eq!(NEED.share(1000.0, 1500.0), 0.0);
        assert_eq!(NEED.share(1000.0, 3000.0), 0.2);
        let track = |high| Track { low: -1000, high, home: 0 };
        assert_eq!([1999, 2000, 2001].map(|high| track(high).is_enough(&NEED)), [false, true, true]);
    }

    /// A speed below one microstep per second, or an acceleration below one microstep per second squared, is taken for
    /// that. Half a microstep per second has ramps of a quarter of a microstep and of half a second each. One microstep
    /// beside them takes a second.
    #[test]
    fn the_slowest_motor() {
        let need = Need { speed: 0.5, acceleration: 0.0, constant: 1.0, enough: 1.0 };
        assert_eq!((need.ramps(0.5), need.share(0.5, 1.25)), (0.25, 0.5));
        assert_eq!(need.share(0.0, 0.0), 0.0);
    }

    #[test]
    fn a_track_is_where_there_is_room() {
        let track = |left, right| {
            let Track { low, high, home } = Room { left, right }.track(100, &NEED);
            assert_eq!(home, 100);
            (low, high)
        };
        assert_eq!(track(None, None), (100, 6100));
        assert_eq!(track(Some(0.0), Some(7000.0)), (100, 6100));
        assert_eq!(track(None, Some(5999.0)), (-5900, 100));
        assert_eq!(track(Some(2000.0), Some(3000.0)), (-1900, 3100));
        assert_eq!(track(Some(7000.0), Some(6000.0)), (100, 6100));
        assert_eq!(track(Some(6000.0), Some(5999.0)), (-5900, 100));
        assert_eq!(Room::named(-50), Room { left: Some(50.0), right: Some(0.0) });
        assert_eq!(Room::named(50), Room { left: Some(0.0), right: Some(50.0) });
        let farther = |position| Track { low: -10, high: 30, home: 0 }.farther(position);
        assert_eq!([-10, 9, 10, 11, 30].map(farther), [30, 30, 30, -10, -10]);
        assert_eq!(Track { low: i32::MIN, high: i32::MAX, home: 0 }.way(), 4_294_967_295.0);
    }

    /// 4 of 100 full steps are kept free; with 16 microsteps per full step there are 96 x 16 of them.
    #[test]
    fn a_world_ends_at_its_hard_ends_and_switches() {
        let room = |text: &str| Room::of_world(&WorldConfig::parse(text).unwrap(), 0, 16.0);
        assert_eq!(room(""), Room::default());
        assert_eq!(room("[stage]\nhard_left = -25600"), Room { left: Some(1536.0), right: None });
        assert_eq!(room("[motor]\nstart = 1000\n[stage]\nhard_right = 90000\nright = 26600").right, Some(1536.0));
        assert_eq!(room("[stage]\nhard_left = -100").left, Some(0.0));
        let nearest = "[motor]\nstart = -1000\n[stage]\nhard_left = -90000\nleft = -26600\nright = 24600";
        assert_eq!(room(nearest), Room { left: Some(1536.0), right: Some(1536.0) });
        // Round and round there is no end, whatever else the stage has.
        assert_eq!(room("[stage]\ncircle = 51200\nleft = -25600\nleft_width = 256"), Room::default());
    }

    #[test]
    fn times_are_rounded_up() {
        let about = |seconds| about(Duration::from_secs(seconds));
        assert_eq!(
            [3, 9, 10, 31, 89, 90, 121].map(about),
            [
                "less than 10 s",
                "less than 10 s",
                "about 10 s",
                "about 40 s",
                "about 90 s",
                "about 2 min",
                "about 3 min"
            ]
        );
    }
}
