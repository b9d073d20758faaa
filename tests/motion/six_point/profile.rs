//! The positions on a ramp of six points, worked out from the formulas of the TMC5160 datasheet (sections 12.1 and
//! 12.2). These are v = v_chip f / 2^24 and a = a_chip f^2 / 2^41, with a clock of 16 MHz. What is set in pps and pps
//! per second is rounded to the chip's units first.

const CLOCK: f64 = 16e6;

/// A speed in pps as the chip makes it.
pub(crate) fn speed(pps: i32) -> f64 {
    (f64::from(pps) * 2_f64.powi(24) / CLOCK).round() * CLOCK / 2_f64.powi(24)
}

/// An acceleration in pps per second as the chip makes it.
pub(crate) fn acceleration(pps2: i32) -> f64 {
    (f64::from(pps2) * 2_f64.powi(41) / (CLOCK * CLOCK)).round() * CLOCK * CLOCK / 2_f64.powi(41)
}

/// The settings of a ramp, in pps and pps per second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    pub(crate) start: i32,
    pub(crate) a1: i32,
    pub(crate) v1: i32,
    pub(crate) a_max: i32,
    pub(crate) v_max: i32,
    pub(crate) d_max: i32,
    pub(crate) d1: i32,
    pub(crate) stop: i32,
}

/// A part of a ramp: for how long the motor has what acceleration.
#[derive(Clone, Copy, Debug)]
struct Part {
    from: f64,
    to: f64,
    seconds: f64,
}

/// A move from rest to rest.
#[derive(Debug)]
pub(crate) struct Profile(Vec<Part>);

impl Settings {
    /// The commands that set them on an axis.
    pub(crate) fn commands(&self, axis: u8) -> Vec<String> {
        let Settings { start, a1, v1, a_max, v_max, d_max, d1, stop } = *self;
        let values = [(19, start), (15, a1), (16, v1), (5, a_max), (4, v_max), (17, d_max), (18, d1), (20, stop)];
        values.map(|(number, value)| format!("SAP {number}, {axis}, {value}")).to_vec()
    }

    /// The move over a way, in microsteps, on which the motor comes to its top speed.
    pub(crate) fn profile(&self, way: i32) -> Profile {
        let unit = CLOCK / 2_f64.powi(24);
        let [start, stop] = [self.start, self.stop].map(|pps| speed(pps).max(unit));
        let (stop, v1, top) = (stop.max(start), speed(self.v1), speed(self.v_max));
        let [a1, a_max, d_max, d1] = [self.a1, self.a_max, self.d_max, self.d1].map(acceleration);
        let part = |from: f64, to: f64, a: f64| (to > from).then(|| Part { from, to, seconds: (to - from) / a });
        let knee = |from: f64| v1.min(top).max(from);
        let up = [part(start, knee(start), a1), part(knee(start), top, a_max)];
        let down = [part(knee(stop), top, d_max), part(stop, knee(stop), d1)];
        let mirror = |part: Part| Part { from: part.to, to: part.from, ..part };
        let ramps: Vec<Part> = up.into_iter().flatten().chain(down.into_iter().flatten().map(mirror)).collect();
        let in_ramps: f64 = ramps.iter().map(Part::way).sum();
        let cruise = f64::from(way) - in_ramps;
        assert!(cruise >= 0.0, "the motor does not come to its top speed");
        let place = ramps.iter().position(|part| part.to < part.from).unwrap();
        let mut parts = ramps;
        parts.insert(place, Part { from: top, to: top, seconds: cruise / top });
        Profile(parts)
    }
}

impl Part {
    fn way(&self) -> f64 {
        (self.from + self.to) / 2.0 * self.seconds
    }
}

impl Profile {
    /// How long the move takes, in seconds.
    pub(crate) fn seconds(&self) -> f64 {
        self.0.iter().map(|part| part.seconds).sum()
    }

    /// The position after a time in seconds.
    pub(crate) fn position(&self, mut time: f64) -> f64 {
        let mut position = 0.0;
        for part in &self.0 {
            let spent = time.min(part.seconds);
            let end = part.from + (part.to - part.from) * if part.seconds > 0.0 { spent / part.seconds } else { 0.0 };
            position += (part.from + end) / 2.0 * spent;
            time -= spent;
        }
        position
    }
}
