//! TMCL mode (2700h, 1023h): the device is in the hands of the executor of the TMCL firmware, which the master gives one
//! command after the other. Only a reset of the node (81h) leads back.
//!
//! The executor has no program memory, and the EEPROM stays the node's: what would be stored is refused. Network
//! management, SDO, error control, emergencies and transmitted PDOs go on as before. The drive stays SWITCH ON DISABLED,
//! although the bridges are on; what would be a fault of the drive stops the motor.

use core::marker::PhantomData;
use core::ops::{Deref, DerefMut};

use super::Node;
use super::abort::Abort;
use super::store::Tmcm1140;
use crate::can::StandardId;
use crate::device::{Board, Device, Inputs, Parts};
use crate::module::{Module, Platform, Product, Spec, TMCM_1140};
use crate::tmcl::{Command, Reply, Status, can};
use crate::units::Micros;

/// What the executor knows of the module; the version is that of the node.
static SPEC: Spec = Spec { major: 3, minor: 20, commands: 0, guest: true, ..TMCM_1140 };

impl Product for Tmcm1140 {
    const SPEC: &'static Spec = &SPEC;
}

/// The board of a node, as a platform of the executor.
#[derive(Debug)]
pub(super) struct Lent<T>(PhantomData<T>);

impl<T: Board> Board for Lent<T> {
    type Product = T::Product;
    type Hardware = T::Hardware;
    type Controllers = T::Controllers;
    type Enable = T::Enable;
    type Store = T::Store;
}

impl<T: Board<Product = Tmcm1140>> Platform for Lent<T> {
    type Hooks = ();
}

/// 1023h.2 after a command that was executed.
const DONE: u8 = 1;
/// 1023h.2 after a command that was refused.
const REFUSED: u8 = 3;

/// The device of a node, inside the executor of TMCL: so it never has to be moved. The executor does nothing before TMCL
/// mode.
pub(super) struct Tunnel<T: Board<Product = Tmcm1140>> {
    module: Module<Lent<T>, 1>,
    /// The device is in TMCL mode.
    open: bool,
    /// What became of the last command, as 1023h.2 has it; 0 before the first one.
    pub(super) status: u8,
    /// The reply to the last command, as 1023h.3 has it.
    pub(super) reply: [u8; Command::SIZE],
}

impl<T: Board<Product = Tmcm1140>> Deref for Tunnel<T> {
    type Target = Device<Lent<T>, 1>;

    #[inline(always)]
    fn deref(&self) -> &Self::Target {
        self.module.device()
    }
}

impl<T: Board<Product = Tmcm1140>> DerefMut for Tunnel<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut Self::Target {
        self.module.device_mut()
    }
}

impl<T: Board<Product = Tmcm1140>> Tunnel<T> {
    /// A device before its start, and not in TMCL mode.
    #[inline(always)]
    pub(super) fn new(parts: Parts<T, 1>) -> Self {
        let Parts { controllers, axes, enable, store } = parts;
        let module = Module::new(Parts { controllers, axes, enable, store }, (), 0);
        Tunnel { module, open: false, status: 0, reply: [0; _] }
    }

    /// True in TMCL mode.
    pub(super) const fn in_tmcl_mode(&self) -> bool {
        self.open
    }

    /// In TMCL mode: does the next piece of the turn of each millisecond.
    pub(super) fn take_turn(&mut self, now: Micros, inputs: &Inputs<1>) {
        self.module.take_turn(now, inputs);
    }
}

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Enters TMCL mode; in TMCL mode nothing changes.
    pub(super) fn enter_tmcl_mode(&mut self) {
        if !self.device.open {
            self.device.open = true;
            let inversion = self.switch_settings().inversion();
            self.device.module.take_over(self.now, inversion);
            self.yield_motor();
            self.watch_over_motor();
        }
    }

    /// In TMCL mode, once in each turn: goes on with releasing the brake. Until it is released, and while there is the
    /// cause of a fault, the executor starts no motion.
    pub(super) fn watch_over_motor(&mut self) {
        self.progress();
        let barred = !self.drive.is_lasting() || self.errors.holds_fault();
        self.device.module.bar(barred);
    }

    /// Executes a command of the master.
    ///
    /// # Errors
    /// [`Abort::State`] outside TMCL mode.
    pub(super) fn execute(&mut self, command: [u8; Command::SIZE]) -> Result<(), Abort> {
        if !self.device.open {
            return Err(Abort::State);
        }
        let reply = self.device.module.answer(self.now, Command::from_bytes(command));
        let refused = matches!(reply, Reply::Plain { status, .. } if status != Status::Ok);
        self.device.status = if refused { REFUSED } else { DONE };
        let id = StandardId::new(self.node.into()).unwrap_or(StandardId::ZERO);
        if let Some(bytes) = can::encode_reply(id, Command::SIZE, &reply).first_chunk() {
            self.device.reply = *bytes;
        }
        Ok(())
    }
}
