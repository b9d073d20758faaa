//! Steps that a master of a drive takes again and again.

use crate::rig::Rig;
use hal_sim::clock::MILLISECOND;

/// Controlwords.
pub(crate) const SHUTDOWN: u16 = 0x06;
pub(crate) const SWITCH_ON: u16 = 0x07;
pub(crate) const ENABLE: u16 = 0x0F;
pub(crate) const START: u16 = 0x1F;
pub(crate) const HALT: u16 = 0x10F;
pub(crate) const QUICK_STOP: u16 = 0x02;
pub(crate) const DISABLE_VOLTAGE: u16 = 0x00;
pub(crate) const FAULT_RESET: u16 = 0x80;

/// The bits of the statusword that encode the state.
pub(crate) const STATE: u32 = 0x6F;
/// States, as those bits.
pub(crate) const SWITCH_ON_DISABLED: u32 = 0x40;
pub(crate) const READY_TO_SWITCH_ON: u32 = 0x21;
pub(crate) const SWITCHED_ON: u32 = 0x23;
pub(crate) const OPERATION_ENABLED: u32 = 0x27;
pub(crate) const QUICK_STOP_ACTIVE: u32 = 0x07;
pub(crate) const FAULT_REACTION_ACTIVE: u32 = 0x0F;
pub(crate) const FAULT: u32 = 0x08;

/// Bits of the statusword.
pub(crate) const TARGET_REACHED: u32 = 1 << 10;
pub(crate) const INTERNAL_LIMIT: u32 = 1 << 11;
pub(crate) const MODE_SPECIFIC: u32 = 1 << 12;
pub(crate) const MOVES: u32 = 1 << 14;
pub(crate) const NEGATIVE: u32 = 1 << 15;

/// Modes of operation.
pub(crate) const PP: u32 = 1;
pub(crate) const VL: u32 = 2;
pub(crate) const PV: u32 = 3;
pub(crate) const HM: u32 = 6;

/// The states that last, and the controlwords that lead there from the start.
pub(crate) const LASTING: [(u32, &[u16]); 6] = [
    (SWITCH_ON_DISABLED, &[]),
    (READY_TO_SWITCH_ON, &[SHUTDOWN]),
    (SWITCHED_ON, &[SHUTDOWN, SWITCH_ON]),
    (OPERATION_ENABLED, &[SHUTDOWN, SWITCH_ON, ENABLE]),
    (QUICK_STOP_ACTIVE, &[SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP]),
    (FAULT, &[]),
];

impl Rig {
    /// A node in a state; 605Ah is 6, so that QUICK STOP ACTIVE lasts.
    pub(crate) fn in_state(state: u32, words: &[u16]) -> Self {
        let mut rig = Self::operational();
        rig.set(0x605A, 0, 6);
        rig.set(0x2005, 0, 0b11);
        if state == FAULT {
            rig.control("supply 7");
            rig.wait(20);
            rig.control("supply 24");
            rig.wait(20);
        }
        for word in words {
            rig.word(*word);
            rig.wait(20);
        }
        assert_eq!(rig.drive_state(), state);
        rig.frames();
        rig
    }

    /// An operational node whose limit switches are off, in OPERATION ENABLED and this mode.
    pub(crate) fn enabled(mode: u32) -> Self {
        let mut rig = Self::operational();
        rig.set(0x2005, 0, 0b11);
        rig.set(0x6060, 0, mode);
        rig.enable();
        rig
    }

    /// Leads the drive to OPERATION ENABLED.
    pub(crate) fn enable(&mut self) {
        for word in [SHUTDOWN, SWITCH_ON, ENABLE] {
            self.word(word);
        }
        assert_eq!(self.drive_state(), OPERATION_ENABLED);
    }

    /// Writes the controlword.
    pub(crate) fn word(&mut self, word: u16) {
        self.set(0x6040, 0, word.into());
    }

    /// The statusword.
    pub(crate) fn status(&mut self) -> u32 {
        self.read(0x6041, 0)
    }

    /// The state of the drive.
    pub(crate) fn drive_state(&mut self) -> u32 {
        self.status() & STATE
    }

    /// A signed number.
    pub(crate) fn signed(&mut self, index: u16) -> i32 {
        self.read(index, 0) as i32
    }

    /// Gives a set-point of profile position mode.
    pub(crate) fn go(&mut self, target: i32) {
        self.set(0x607A, 0, target as u32);
        self.word(START);
        self.word(ENABLE);
    }

    /// The position of the rotor in 1/256 full steps.
    pub(crate) fn rotor(&self) -> i64 {
        self.board.borrow().world().axis(0).motor().rotor()
    }

    /// The speed of the motion controller, in internal units.
    pub(crate) fn speed(&self) -> i32 {
        self.board.borrow().tmc429(0).velocity(0)
    }

    /// Whether the bridges of the driver are on.
    pub(crate) fn is_energised(&self) -> bool {
        self.board.borrow().tmc262(0).bridges_on()
    }

    /// Waits until the statusword has all bits of `set`, for at most so many milliseconds.
    pub(crate) fn until(&mut self, set: u32, milliseconds: u64) {
        for _ in 0..milliseconds {
            if self.status() & set == set {
                return;
            }
            self.run(MILLISECOND);
        }
        panic!("the statusword is {:04X}h after {milliseconds} ms", self.status());
    }

    /// The emergency messages since the last look: code and the two bytes of the manufacturer's field.
    pub(crate) fn emergencies(&mut self) -> Vec<(u16, [u8; 2])> {
        let id = 0x80 + u16::from(self.node.node_id());
        let told = |data: Vec<u8>| (u16::from_le_bytes([data[0], data[1]]), [data[3], data[4]]);
        self.of(id).into_iter().map(told).collect()
    }
}
