//! TMCL mode (2700h, 1023h): the device is in the hands of the executor of the TMCL firmware, which the master gives one
//! command after the other. Only a reset of the node (81h) leads back.
//!
//! The executor has no program memory, and the EEPROM stays the node's: what would be stored is refused. Network
//! management, SDO, error control, emergencies and transmitted PDOs go on as before. The drive stays SWITCH ON DISABLED,
//! although the bridges are on; what would be a fault of the drive stops the motor.

use super::Node;
use super::abort::Abort;
use super::store::Tmcm1140;
use crate::device::{Board, Device, Inputs, Inversion, Piece};
use crate::executor::{Answered, LENGTH, Product, Solo, Spec, TMCM_1140};
use crate::units::Micros;

/// What the executor knows of the module; the version is that of the node.
static SPEC: Spec = Spec { major: 3, minor: 20, commands: 0, slots: None, ..TMCM_1140 };

impl Product for Tmcm1140 {
    const SPEC: &'static Spec = &SPEC;
}

/// 1023h.2 after a command that was executed.
const DONE: u8 = 1;
/// 1023h.2 after a command that was refused.
const REFUSED: u8 = 3;

/// The executor of TMCL, which does nothing before TMCL mode.
pub(super) struct Tunnel {
    executor: Solo,
    /// The device is in TMCL mode.
    open: bool,
    /// What became of the last command, as 1023h.2 has it; 0 before the first one.
    pub(super) status: u8,
    /// The reply to the last command, as 1023h.3 has it.
    pub(super) reply: [u8; LENGTH],
}

impl Tunnel {
    /// A tunnel that is not in TMCL mode.
    #[inline(always)]
    pub(super) fn new() -> Self {
        Tunnel { executor: Solo::new::<Tmcm1140>(), open: false, status: 0, reply: [0; _] }
    }

    /// True in TMCL mode.
    pub(super) const fn in_tmcl_mode(&self) -> bool {
        self.open
    }

    /// Enters TMCL mode, with the signals of the device inverted as they are.
    fn enter(&mut self, now: Micros, inversion: Inversion) {
        self.open = true;
        self.executor.begin(now, inversion);
    }

    /// In TMCL mode: does the next piece of the turn of each millisecond.
    pub(super) fn take_turn<T: Board>(&mut self, device: &mut Device<T, 1>, now: Micros, inputs: &Inputs<1>) {
        match device.next_piece() {
            // One axis goes on no line.
            Piece::Lines => return,
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

    /// Executes a command. While it is `barred`, no motor is started. `node` is the node ID.
    fn execute<T: Board<Product = Tmcm1140>>(
        &mut self,
        device: &mut Device<T, 1>,
        now: Micros,
        barred: bool,
        node: u8,
        command: [u8; LENGTH],
    ) {
        let Answered { reply, executed } = self.executor.answer(device, now, barred, node, command);
        self.status = if executed { DONE } else { REFUSED };
        self.reply = reply;
    }
}

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Enters TMCL mode; in TMCL mode nothing changes.
    pub(super) fn enter_tmcl_mode(&mut self) {
        if !self.tunnel.in_tmcl_mode() {
            let inversion = self.switch_settings().inversion();
            self.tunnel.enter(self.now, inversion);
            self.yield_motor();
            self.progress();
        }
    }

    /// Executes a command of the master. Until the brake is released, and while there is the cause of a fault, it starts no
    /// motor.
    ///
    /// # Errors
    /// [`Abort::State`] outside TMCL mode.
    pub(super) fn execute(&mut self, command: [u8; LENGTH]) -> Result<(), Abort> {
        if !self.tunnel.in_tmcl_mode() {
            return Err(Abort::State);
        }
        let barred = !self.drive.is_lasting() || self.errors.holds_fault();
        self.tunnel.execute(&mut self.device, self.now, barred, self.node, command);
        Ok(())
    }
}
