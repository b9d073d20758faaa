//! The turn of the drive in each millisecond.

use crate::canopen::Node;
use crate::canopen::store::Tmcm1140;
use crate::device::Board;
use crate::motion::Events;

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// The turn of the drive, once in each millisecond, after what is measured has been read. `events` are those of the
    /// axis since the turn before.
    pub(in crate::canopen) fn drive(&mut self, events: Events) {
        self.look_for_faults();
        if self.tunnel.in_tmcl_mode() {
            self.look_at_statusword();
            return self.progress();
        }
        self.follow_homing(events);
        self.look_at_limits(events);
        self.progress();
        let asked = self.asked();
        self.steer_to(asked);
        self.look_at_target(asked);
        self.look_at_statusword();
    }

    /// Looks whether the statusword is another than in the turn before.
    fn look_at_statusword(&mut self) {
        let word = self.statusword();
        self.touched |= core::mem::replace(&mut self.drive.shown, word) != word;
    }
}
