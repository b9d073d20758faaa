//! Causes that stop all motors of a device, whatever its firmware wants. They are a supply that is too low (manual
//! section 12.1, firmware 1.35), and a motion controller that does not answer. A controller that cannot be reached
//! cannot be told to stop, so all drivers are switched off until the device is started anew.

use super::{Circuit, Device};
use crate::motion::{Error, Joined, MotionController};
use crate::units::Micros;

/// Supply voltage in 0.1 V below which the motors are stopped and locked.
pub const LOCK: u16 = 85;
/// Supply voltage in 0.1 V above which locked motors are released.
pub const RELEASE: u16 = 95;

/// Number of turns in a row, one in a millisecond, in which a motion controller does not answer before it is given up,
/// and number of attempts to start it. A disturbance of the bus is shorter.
pub(super) const PATIENCE: u8 = 3;

/// The change that the latest reading of the supply has brought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Supply {
    /// The supply has changed nothing.
    #[default]
    Steady,
    /// The supply has become too low: all motors have been stopped at once and are locked.
    Lost,
    /// The supply is back: the motors are released, and their drivers have been set up anew.
    Restored,
}

/// The changes that the supervision at the beginning of a turn has brought.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supervised {
    /// The change of the supply.
    pub supply: Supply,
    /// A motion controller has been given up in this turn: all motors have been stopped, and their drivers are off.
    pub silent: bool,
    /// Motion controllers that had been given up have been set up again in this turn, with their motors where they were
    /// last known to be. Their drivers may be switched on.
    pub resumed: bool,
    /// The axes that were on a positioning move, axis n in bit n, if moves have been ended in this turn; else `None`.
    pub ended: Option<u32>,
}

/// The reasons for which no motor may move.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Safety {
    /// The supply is too low.
    pub(super) locked: bool,
    /// A motion controller has been given up.
    pub(super) given_up: bool,
}

impl Safety {
    /// Takes the supply voltage in units of 0.1 V; `None`, on a board that does not measure it, changes nothing.
    fn look(&mut self, voltage: Option<u16>) -> Supply {
        match voltage {
            Some(..LOCK) if !self.locked => {
                self.locked = true;
                Supply::Lost
            }
            Some(voltage) if self.locked && voltage > RELEASE => {
                self.locked = false;
                Supply::Restored
            }
            _ => Supply::Steady,
        }
    }
}

impl<T: Circuit, const AXES: usize> Device<T, AXES> {
    /// True while the motors must not move: the supply is too low, or a motion controller is given up.
    pub const fn is_locked(&self) -> bool {
        self.safety.locked || self.safety.given_up
    }

    /// True while the supply is too low.
    pub const fn lacks_supply(&self) -> bool {
        self.safety.locked
    }

    /// True if a motion controller has been given up since the last start.
    pub const fn is_given_up(&self) -> bool {
        self.safety.given_up
    }

    /// Checks the motion controllers and the supply, and stops the motors if one of them demands it.
    pub(super) fn supervise(&mut self, now: Micros) -> Supervised {
        let silent = self.listen();
        if silent {
            self.give_up();
        }
        let supply = self.safety.look(self.inputs.supply);
        let mut ended = None;
        if silent || supply == Supply::Lost {
            ended = Some(self.end_moves(|axis| axis.hard_stop()));
        }
        let restored = supply == Supply::Restored;
        let resumed = self.safety.given_up && !self.safety.locked && (restored || self.have_returned());
        if resumed {
            self.resume(now);
        }
        if restored {
            ended = Some(ended.unwrap_or_default() | self.end_moves(|axis| axis.restart_driver()));
        }
        Supervised { supply, silent, resumed, ended }
    }

    /// True if all motion controllers answer, and one of them tells that it had lost its supply.
    fn have_returned(&mut self) -> bool {
        let answer = self.controllers.as_ref().iter().all(|controller| controller.unanswered == 0);
        answer && (0..AXES).any(|number| self.axis(number).is_some_and(|axis| axis.readings().is_lost))
    }

    /// Sets motion controllers that were given up going again: they may have been silent because they had no supply.
    fn resume(&mut self, now: Micros) {
        self.safety.given_up = false;
        self.outputs.trouble = false;
        if self.set_up(now, self.inversion, |axis| axis.last_position()).is_err() {
            self.give_up();
        }
    }

    /// Counts for how many turns each motion controller has been silent. True if one is to be given up now and none was
    /// before. While the supply is too low, for a controller that lives on it as well, this is no reason to give it up.
    fn listen(&mut self) -> bool {
        let mut silent = false;
        for controller in self.controllers.as_mut() {
            // A controller that was given up is asked as well: if it is back, it gets the stop that each of its axes
            // still has to do.
            let answers = controller.shared.is_there();
            let counts = !(answers || self.safety.locked);
            controller.unanswered = if counts { controller.unanswered.saturating_add(1) } else { 0 };
            silent |= controller.unanswered >= PATIENCE;
        }
        silent && !self.safety.given_up
    }

    /// Calls `act`, which ends moves, for all axes. An axis whose chips do not take that is stopped hard as soon as
    /// they answer. Returns the axes that were on a positioning move, axis n in bit n.
    pub fn end_moves(&mut self, act: impl Fn(&mut Joined<'_, T::Hardware>) -> Result<(), Error>) -> u32 {
        let mut ended = 0;
        for number in 0..AXES {
            let Some(mut axis) = self.axis(number) else { continue };
            if axis.state().travelling() {
                ended |= 1_u32.unbounded_shl(number as u32);
            }
            if act(&mut axis).is_err() {
                let _ = axis.hard_stop();
            }
        }
        ended
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lock_has_a_hysteresis_of_one_volt() {
        let mut safety = Safety::default();
        let mut look = |tenths: u16| safety.look(Some(tenths));
        assert_eq!(look(85), Supply::Steady);
        assert_eq!(look(84), Supply::Lost);
        assert_eq!(look(84), Supply::Steady);
        assert_eq!(look(95), Supply::Steady);
        assert_eq!(look(96), Supply::Restored);
        assert_eq!(safety.look(None), Supply::Steady);
        assert!(!safety.locked);
    }
}
