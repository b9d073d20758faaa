//! The pace of one motion, where it is not that of the parameters.

/// The speed and the acceleration of one motion, where they differ from parameters 4 and 5; in the units of these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace<S> {
    /// The speed at which the motor goes to a position; `None` for that of parameter 4.
    pub speed: Option<i32>,
    /// The acceleration of the motor's ramps, up and down; `None` for that of parameter 5.
    pub acceleration: Option<i32>,
    /// The shape of the ramps, where the ramp generator has more; `None` for that of the parameters.
    pub shape: Option<S>,
}

impl<S> Default for Pace<S> {
    fn default() -> Self {
        Pace { speed: None, acceleration: None, shape: None }
    }
}
