//! TMCL mode (2700h, 1023h): the device is in the hands of an executor of TMCL, which the master gives one command
//! after the other. Only a reset of the node (81h) leads back.
//!
//! The executor has no program memory, and the EEPROM stays the node's: what would be stored is refused. Network
//! management, SDO, error control, emergencies and transmitted PDOs go on as before. The drive stays SWITCH ON
//! DISABLED, although the bridges are on; what would be a fault of the drive stops the motor.

use super::cia301::abort::Abort;
use crate::device::{Circuit, Device, Inputs, Inversion, Piece};
use crate::executor::{Answered, LENGTH, Product, Solo};
use crate::units::Micros;

/// Number of bytes of a command, and of a reply.
pub(super) const COMMAND: usize = LENGTH;

/// 1023h.2 after a command that was executed.
const DONE: u8 = 1;
/// 1023h.2 after a command that was refused.
const REFUSED: u8 = 3;

/// TMCL mode, and the executor, which does nothing before.
pub(super) struct Tunnel {
    executor: Solo,
    /// The device is in TMCL mode.
    open: bool,
    /// The outcome of the last command, as 1023h.2 has it; 0 before the first one.
    status: u8,
    /// The reply to the last command, as 1023h.3 has it.
    reply: [u8; COMMAND],
}

impl Tunnel {
    /// A device of a product that is not in TMCL mode.
    #[inline(always)]
    pub(super) fn new<P: Product>() -> Self {
        Tunnel { executor: Solo::new::<P>(), open: false, status: 0, reply: [0; _] }
    }

    /// True in TMCL mode.
    pub(super) const fn is_open(&self) -> bool {
        self.open
    }

    /// The outcome of the last command (1023h.2).
    pub(super) const fn status(&self) -> u8 {
        self.status
    }

    /// The reply to the last command (1023h.3).
    pub(super) const fn reply(&self) -> [u8; COMMAND] {
        self.reply
    }

    /// Enters TMCL mode, with the signals of the device inverted as they are.
    pub(super) fn open(&mut self, now: Micros, inversion: Inversion) {
        self.open = true;
        self.executor.begin(now, inversion);
    }

    /// In TMCL mode: does the next piece of the turn of each millisecond.
    pub(super) fn take_turn<T: Circuit>(&mut self, now: Micros, device: &mut Device<T, 1>, inputs: &Inputs<1>) {
        match device.next_piece() {
            // One axis goes on no line.
            Piece::Interpolations => return,
            Piece::Reading => return device.next_reading(),
            Piece::Axis => {}
            Piece::Beginning => {
                let supervised = device.begin(now, inputs);
                self.executor.heed(&supervised);
                if supervised.resumed {
                    device.enable_drivers(true);
                }
            }
        }
        let (_, events) = device.next_axis(now);
        if events.at_switch
            && let Some(mut axis) = device.axis(0)
        {
            axis.end_at_switch();
        }
    }

    /// Executes a command of the master; one that is `barred` starts no motion. `node` is the node ID.
    ///
    /// # Errors
    /// [`Abort::State`] outside TMCL mode.
    pub(super) fn execute<T: Circuit<Product: Product>>(
        &mut self,
        now: Micros,
        device: &mut Device<T, 1>,
        (node, barred): (u8, bool),
        command: [u8; COMMAND],
    ) -> Result<(), Abort> {
        if !self.open {
            return Err(Abort::State);
        }
        let Answered { reply, executed } = self.executor.answer(device, now, barred, node, command);
        self.status = if executed { DONE } else { REFUSED };
        self.reply = reply;
        Ok(())
    }
}
