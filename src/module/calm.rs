//! Turns of the TMCL firmware that may be left out by whoever simulates a module: those in which it does nothing but to take
//! the same readings again.

use super::{Module, Platform};
use crate::device::{Device, Outputs};
use crate::motion::Calm;
use crate::param::GlobalParameter as G;
use crate::units::Micros;

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Number of turns after which the same readings come again, as [`Device::ROTATION`].
    pub const ROTATION: u32 = Device::<T, AXES>::ROTATION;
    /// Number of turns after which nothing that is known of a motor that turns is older than they are, as [`Device::FRESH`].
    pub const FRESH: u32 = Device::<T, AXES>::FRESH;

    /// What the module is going to do until a request comes, if its inputs and its chips stay as they are: the time before
    /// which a turn only takes readings, and by axis how far motors may turn meanwhile, as in [`Calm`]. `None` if the next
    /// turn may do more, or if the turn under way is not over. The status LED does not count.
    pub fn calm(&self) -> Option<(Micros, [u32; AXES])> {
        let idle = !self.link_settings_stale
            && !self.changed
            && !self.starts
            && self.waiting.is_empty()
            && self.replies.is_empty()
            && !self.arrivals.wait()
            && (self.fuel == 0 || !self.machine.busy());
        if !idle {
            return None;
        }
        let program = self.machine.calm_until()?;
        let hosts = self.supervision.calm_until(self.global(G::SerialHeartbeat), self.global(G::CanHeartbeat));
        let axes = self.device.calm().filter(|_| self.device.store().is_idle())?;
        let until = axes.iter().fold(program.min(hosts), |until, axis| until.min(axis.until));
        Some((until, axes.map(|Calm { room, .. }| room)))
    }

    /// Lets whole rotations of turns pass that change nothing, as [`Module::calm`] has told. Returns the outputs as they are
    /// to be set after the last of them.
    pub fn pass(&mut self, rotations: u32) -> Outputs {
        self.device.pass(rotations);
        self.blink(self.device.turn());
        *self.device.outputs()
    }
}
