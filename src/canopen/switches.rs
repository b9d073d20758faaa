//! The limit switches and the home switch (2005h): which of them are in use, and what the levels at their inputs mean.
//!
//! The motion controller has one polarity for both limit switches. Where theirs differ it has that of the left one, and
//! the axis itself watches the right one, once in each turn.

use super::live::Live;
use crate::device::{Circuit, Device, Inversion};
use crate::param::AxisParameter as P;

/// Bits of 2005h: the switch is not in use.
const LEFT_OFF: u32 = 1 << 0;
const RIGHT_OFF: u32 = 1 << 1;
const HOME_OFF: u32 = 1 << 4;
/// Bits of 2005h: the switch is closed while its input is low, not high.
const LEFT_INVERTED: u32 = 1 << 2;
const RIGHT_INVERTED: u32 = 1 << 3;
const HOME_INVERTED: u32 = 1 << 5;

/// The settings of the switches, as 2005h has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Switches(u32);

impl Switches {
    /// The switches with this value of 2005h.
    pub(super) const fn of(settings: u32) -> Self {
        Switches(settings)
    }

    /// The limit switches that are in use, left and right.
    pub(super) const fn limits(self) -> [bool; 2] {
        [!self.has(LEFT_OFF), !self.has(RIGHT_OFF)]
    }

    /// True if the home switch is in use.
    pub(super) const fn home(self) -> bool {
        !self.has(HOME_OFF)
    }

    /// True if the home switch is closed while its input is low.
    pub(super) const fn home_inverted(self) -> bool {
        self.has(HOME_INVERTED)
    }

    /// The inversion in the motion controller: that of its switches, if those that it watches are closed while their
    /// inputs are low.
    pub(super) const fn inversion(self) -> Inversion {
        let inverted = match self.limits() {
            [true, _] => self.has(LEFT_INVERTED),
            [false, true] => self.has(RIGHT_INVERTED),
            [false, false] => false,
        };
        Inversion { switches: inverted as u8, shafts: 0 }
    }

    /// The level at the input of the right limit switch while that is closed, if the axis has to watch it.
    const fn watched(self) -> Option<bool> {
        let inverted = self.has(RIGHT_INVERTED);
        match self.limits() {
            [true, true] if inverted != self.has(LEFT_INVERTED) => Some(!inverted),
            _ => None,
        }
    }

    /// Tells the axis which switches it has, without telling its chips. What the motion controller is to invert is
    /// returned.
    pub(super) fn preset<T: Circuit>(self, device: &mut Device<T, 1>) -> Inversion {
        if let Some(mut axis) = device.axis(0) {
            let [left, right] = self.limits();
            axis.state_mut().watch_right_switch(self.watched());
            axis.state_mut().preset_setting(P::LeftSwitchDisable, (!left).into());
            axis.state_mut().preset_setting(P::RightSwitchDisable, (!right).into());
        }
        self.inversion()
    }

    /// Tells the axis and its motion controller that 2005h has changed. The motor stands; which switches stop it is
    /// written with the next motion command.
    pub(super) fn tell<T: Circuit>(self, device: &mut Device<T, 1>) {
        let inversion = self.preset(device);
        // What a motion controller that is silent has not taken is told when the device starts again.
        let _ = device.invert(inversion);
    }

    /// The switches as 60FDh has them: left in bit 0, right in bit 1, home in bit 2; closed is 1, not in use is 0.
    pub(super) fn shown(self, live: &Live) -> u32 {
        let ([left, right, home], [has_left, has_right]) = (live.switches, self.limits());
        let home = self.home() && home != self.home_inverted();
        u32::from(left && has_left) | u32::from(right && has_right) << 1 | u32::from(home) << 2
    }

    const fn has(self, bit: u32) -> bool {
        self.0 & bit != 0
    }
}
