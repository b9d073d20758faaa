//! Turns that may be left out. A device that is calm does nothing in a turn but to take the same readings again.
//! Whoever simulates it may let any number of such turns pass at once, if nothing reaches the device meanwhile.

use super::{Circuit, Device, Piece, Shared, controller_of};
use crate::motion::{Calm, Foreseeable, MotionController};
use crate::units::Micros;

/// Number of axes on a motion controller, which take turns in its readings.
const fn axes_of_one<T: Circuit, const AXES: usize>() -> u32 {
    let most = Shared::<T>::AXES;
    (if AXES < most { AXES } else { most }) as u32
}

impl<T: Circuit<Hardware: Foreseeable>, const AXES: usize> Device<T, AXES> {
    /// Number of turns after which the same readings come again; in so many turns each comes at least once.
    pub const ROTATION: u32 = axes_of_one::<T, AXES>() * T::Hardware::ROTATION as u32;
    /// Number of turns after which nothing that is known of a motor that turns is older than they are.
    pub const FRESH: u32 = axes_of_one::<T, AXES>() * T::Hardware::FRESH as u32;

    /// The prospects of each axis, as in [`Axis::calm`](crate::motion::Axis::calm). `None` if the next turn may do more
    /// than to take readings, or if the turn under way is not over.
    pub fn calm(&self) -> Option<[Calm; AXES]> {
        let steady = self.next_piece() == Piece::Beginning
            && self.restart.is_none()
            && !self.is_locked()
            && self.interpolations.members == 0
            && self.controllers.as_ref().iter().all(|controller| controller.unanswered == 0);
        let mut calm = [Calm { until: Micros(u64::MAX), room: 0 }; AXES];
        for (number, (axis, calm)) in self.axes.iter().zip(&mut calm).enumerate() {
            let controller = self.controllers.as_ref().get(controller_of::<T>(number)).filter(|_| steady)?;
            *calm = axis.calm(&controller.shared, self.turn())?;
        }
        Some(calm)
    }

    /// Lets whole rotations of turns pass that change nothing, as [`Device::calm`] has told: it is in the same place of
    /// the rotation then.
    pub fn pass(&mut self, rotations: u32) {
        let span = Micros::from_millis(u64::from(rotations).wrapping_mul(Self::ROTATION.into()));
        self.next = self.next.after(span);
    }
}
