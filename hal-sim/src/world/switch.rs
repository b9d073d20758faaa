//! The cams of a stage, which say at which positions a switch is closed. Positions are in 1/256 full steps.

use super::config::StageConfig;
use super::pin::Pin;

/// The positions around the present one at which all levels are the same, so that most steps need no evaluation; both
/// ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub(super) lowest: i64,
    pub(super) highest: i64,
}

impl Window {
    /// All positions.
    pub(super) const ALL: Self = Self { lowest: i64::MIN, highest: i64::MAX };

    #[inline]
    pub(super) fn contains(self, at: i64) -> bool {
        at >= self.lowest && at <= self.highest
    }

    /// The positions that are in both windows.
    pub(super) fn and(self, other: Self) -> Self {
        Self { lowest: self.lowest.max(other.lowest), highest: self.highest.min(other.highest) }
    }
}

/// A cam: it closes its switch from the first position to the last, both included; on a rotary stage once in each
/// circle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cam {
    first: i64,
    last: i64,
    /// Length of the circle on a rotary stage.
    circle: Option<i64>,
    /// How far beyond the ends of the cam the switch opens again.
    hysteresis: i64,
}

impl Cam {
    /// The cams of a stage and the pins their switches are connected to.
    pub(super) fn all(stage: &StageConfig) -> Vec<(Pin, Self)> {
        let cam = |first, last| Self { first, last, circle: stage.circle, hysteresis: stage.hysteresis };
        let (low, high) = stage.ends();
        let low = low.map(|end| {
            let first = end.width.map_or(i64::MIN, |width| end.at.saturating_sub(width - 1));
            (end.pin, cam(first, end.at))
        });
        let high = high.map(|end| {
            let last = end.width.map_or(i64::MAX, |width| end.at.saturating_add(width - 1));
            (end.pin, cam(end.at, last))
        });
        let home = stage.home.map(|[first, last]| (Pin::Home, cam(first, last)));
        [low, high, home].into_iter().flatten().collect()
    }

    /// Whether the switch is closed at position `at`, if it was `closed` before, and the positions around `at` for
    /// which the answer is the same.
    pub(super) fn sense(&self, at: i64, closed: bool) -> (bool, Window) {
        let Some(circle) = self.circle.filter(|circle| *circle > 0) else {
            return self.sense_one(at, closed);
        };
        // `here` is the last cam that begins at or below `at`. The next one begins above `at`, but its hysteresis may
        // reach down to `at`.
        let here = self.shifted((at - self.first).div_euclid(circle) * circle);
        let next = here.shifted(circle);
        match (here.sense_one(at, closed), next.sense_one(at, closed)) {
            (now @ (true, _), _) | (_, now @ (true, _)) => now,
            ((_, above), (_, below)) => (false, above.and(below)),
        }
    }

    fn shifted(self, by: i64) -> Self {
        Self { first: self.first + by, last: self.last + by, ..self }
    }

    /// As [`Cam::sense`], for this cam alone, without those of other circles.
    fn sense_one(&self, at: i64, closed: bool) -> (bool, Window) {
        let closes = Window { lowest: self.first, highest: self.last };
        let opens = Window {
            lowest: self.first.saturating_sub(self.hysteresis),
            highest: self.last.saturating_add(self.hysteresis),
        };
        if closes.contains(at) || closed && opens.contains(at) {
            (true, opens)
        } else if at < self.first {
            (false, Window { highest: self.first - 1, ..Window::ALL })
        } else {
            (false, Window { lowest: self.last + 1, ..Window::ALL })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The positions at which the level changes, on the way from the lower end to the upper and back, and the new
    /// levels.
    fn edges(cam: Cam, from: i64, to: i64) -> Vec<(i64, bool)> {
        let mut closed = cam.sense(from, false).0;
        let mut edges = Vec::new();
        for at in (from..=to).chain((from..=to).rev()) {
            let (now, window) = cam.sense(at, closed);
            assert!(window.contains(at), "at {at}");
            // At both ends of the window the level is what the window promises.
            assert_eq!(cam.sense(window.lowest.max(from), now).0, now, "at {at}");
            assert_eq!(cam.sense(window.highest.min(to), now).0, now, "at {at}");
            if now != closed {
                edges.push((at, now));
                closed = now;
            }
        }
        edges
    }

    #[test]
    fn a_cam_opens_its_hysteresis_later_than_it_closes() {
        let cam = Cam { first: -5, last: 5, circle: None, hysteresis: 0 };
        assert_eq!(edges(cam, -20, 20), [(-5, true), (6, false), (5, true), (-6, false)]);
        let cam = Cam { hysteresis: 3, ..cam };
        assert_eq!(edges(cam, -20, 20), [(-5, true), (9, false), (5, true), (-9, false)]);
        assert!(!cam.sense(7, false).0, "it has not been closed yet");
    }

    #[test]
    fn on_a_circle_cams_come_again() {
        let cam = Cam { first: 95, last: 102, circle: Some(100), hysteresis: 2 };
        assert_eq!(
            edges(cam, -80, 120),
            [(-5, true), (5, false), (95, true), (105, false), (102, true), (92, false), (2, true), (-8, false)]
        );
    }
}
