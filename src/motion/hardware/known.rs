//! The state of a ramp generator that is known without a datagram.

/// The ramp mode of an axis, by the numbers of parameter 138.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum RampMode {
    /// The motor goes to a position, with a trapezoidal ramp.
    #[default]
    Ramp = 0,
    /// The motor goes to a position, with an exponential approach.
    Soft = 1,
    /// The motor turns at a speed.
    Velocity = 2,
    /// The motor is being stopped at once. The mode lasts until the hardware has taken the whole stop; then the motor
    /// is in velocity mode at speed 0.
    Hold = 3,
}

impl RampMode {
    /// True in the two modes in which the motor goes to a position.
    pub const fn positions(self) -> bool {
        matches!(self, RampMode::Ramp | RampMode::Soft)
    }
}

/// The state of a ramp generator that is known without a datagram: what it was told last, and what was read last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Known {
    /// The mode that the ramp generator was told last.
    pub mode: RampMode,
    /// The speed at which the motor was last told to turn, right if positive.
    pub target_speed: i32,
    /// The position to which the motor was last sent, in microsteps.
    pub target: i32,
    /// The actual position as read last, in microsteps.
    pub position: i32,
    /// The actual speed as read last, right if positive.
    pub speed: i32,
}

impl Known {
    /// The direction in which the motor is to turn: only the sign counts, right is positive, and 0 is nowhere.
    pub const fn ahead(&self) -> i32 {
        if self.mode.positions() { self.target.wrapping_sub(self.position) } else { self.target_speed }
    }

    /// The number of microsteps that the motor makes before it is at a position, if it turns on as it was seen last;
    /// the positions wrap at 32 bits. `None` while it stands, or turns away from its goal.
    pub fn steps_before(&self, position: i32) -> Option<u32> {
        let on_its_way = self.speed.signum() == self.ahead().signum() && self.speed != 0;
        let way = position.wrapping_sub(self.position);
        let ahead = if self.speed > 0 { way } else { way.wrapping_neg() };
        on_its_way.then_some(ahead.cast_unsigned().wrapping_sub(1))
    }
}
