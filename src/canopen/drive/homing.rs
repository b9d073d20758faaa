//! Homing (manual chapter 9).

use crate::canopen::Node;
use crate::canopen::emcy::Emergency;
use crate::canopen::store::Tmcm1140;
use crate::device::Board;
use crate::motion::Events;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Bit 4 of the controlword was set in homing mode.
    pub(super) fn start_homing(&mut self) {
        self.raise(Emergency::Refused);
    }

    /// Bit 4 of the controlword was cleared: a homing that is under way ends, and the motor stops along the ramp.
    pub(super) fn stop_homing(&mut self) {
        if self.drive.homing.running {
            self.slow_down(self.ramp());
            self.abort_homing();
        }
    }

    /// A homing that is under way has ended before its end. The motor has been, or will be, stopped.
    pub(super) fn abort_homing(&mut self) {
        self.drive.homing.running = false;
    }

    /// Follows a homing, once in each turn.
    pub(super) fn follow_homing(&mut self, _: Events) {}
}
