//! The safe state, and the LED that tells of it. These functions use only registers, so that they can be called at any
//! time, also by a firmware that has failed.

use crate::board::boards::chosen::{ENN, TROUBLE};

/// The safe state: no current flows in a motor, whatever the chips do.
pub(super) extern "C" fn drivers_off() {
    ENN.drive(true);
}

/// Switches LED2 on or off.
pub(super) fn show_trouble(on: bool) {
    TROUBLE.drive(on);
}
