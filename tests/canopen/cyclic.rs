//! A cyclic master, as the CiA 402 drivers of ROS are. Every 10 ms it sends all it has to say in PDOs, then the SYNC,
//! and takes what the node answers. It sets halt whenever it has no target, and bit 5 with each set-point.

use crate::driving::{
    FAULT, HM, MODE_SPECIFIC, OPERATION_ENABLED, PP, PV, READY_TO_SWITCH_ON, STATE, SWITCH_ON_DISABLED, SWITCHED_ON,
    TARGET_REACHED,
};
use crate::rig::Rig;
use hal_sim::clock::MILLISECOND;

const HALT: u16 = 1 << 8;
const START: u16 = 1 << 4;
const IMMEDIATELY: u16 = 1 << 5;
const FAULT_RESET: u16 = 1 << 7;

/// The master, with what it wants and what it has heard.
struct Master {
    rig: Rig,
    mode: u32,
    /// The target of profile position mode.
    target: Option<i32>,
    /// The target that has been given last.
    given: Option<i32>,
    velocity: Option<i32>,
    /// A homing is to run.
    homing: bool,
    word: u16,
    status: u32,
    shown: u32,
    position: i32,
    cycles: u32,
}

impl Master {
    /// A master whose node receives three PDOs and sends three, all by SYNC.
    fn new(mut rig: Rig) -> Self {
        for n in 0..4 {
            rig.set(0x1400 + n, 2, 0);
            rig.set(0x1800 + n, 2, 1);
        }
        rig.command(1);
        rig.frames();
        Master {
            rig,
            mode: 0,
            target: None,
            given: None,
            velocity: None,
            homing: false,
            word: 0,
            status: 0,
            shown: 0,
            position: 0,
            cycles: 0,
        }
    }

    /// The bits of the controlword that lead from the state to OPERATION ENABLED.
    fn command(&self) -> u16 {
        match self.status & STATE {
            SWITCH_ON_DISABLED => 0x06,
            READY_TO_SWITCH_ON => 0x07,
            SWITCHED_ON | OPERATION_ENABLED => 0x0F,
            FAULT if self.cycles.is_multiple_of(2) => FAULT_RESET,
            _ => 0,
        }
    }

    /// Carries out one cycle of 10 ms.
    fn cycle(&mut self) {
        self.word = self.command() | self.word & START;
        let has_target = self.status & STATE == OPERATION_ENABLED && self.shown == self.mode && self.ask();
        if !has_target {
            self.word |= HALT;
        }
        let [low, high] = self.word.to_le_bytes();
        let [a, b, c, d] = self.given.unwrap_or(0).to_le_bytes();
        let [e, f, g, h] = self.velocity.unwrap_or(0).to_le_bytes();
        // Each PDO of the defaults has the controlword in front.
        self.rig.send(0x301, &[low, high, self.mode as u8]);
        self.rig.send(0x401, &[low, high, a, b, c, d]);
        self.rig.send(0x501, &[low, high, e, f, g, h]);
        self.rig.send(0x80, &[]);
        self.rig.run(10 * MILLISECOND);
        self.cycles += 1;
        let frames = self.rig.frames();
        let answers: Vec<_> = frames.iter().filter(|(id, _)| (0x181..0x500).contains(id)).collect();
        assert_eq!(answers.len(), 4, "{frames:X?}");
        for (id, data) in answers {
            self.status = u16::from_le_bytes([data[0], data[1]]).into();
            match id {
                0x281 => self.shown = data[2].into(),
                0x381 => self.position = i32::from_le_bytes(data[2..6].try_into().unwrap()),
                _ => {}
            }
        }
        assert!(frames.iter().all(|(id, _)| *id != 0x81), "{frames:X?}");
    }

    /// Sets the bits of the mode; false if there is no target.
    fn ask(&mut self) -> bool {
        let acknowledged = self.status & MODE_SPECIFIC != 0;
        match self.mode {
            PP => {
                let Some(target) = self.target else { return false };
                self.word |= IMMEDIATELY;
                if acknowledged || self.word & START != 0 {
                    self.word &= !START;
                } else if self.given != Some(target) {
                    self.given = Some(target);
                    self.word |= START;
                }
                true
            }
            PV => {
                self.word &= !START;
                self.velocity.is_some()
            }
            HM => {
                self.word = if self.homing { self.word | START } else { self.word & !START };
                self.homing
            }
            _ => false,
        }
    }

    /// Goes on until this is so, for so many cycles at most.
    fn until(&mut self, what: &str, cycles: u32, is: impl Fn(&Self) -> bool) {
        for _ in 0..cycles {
            if is(self) {
                return;
            }
            self.cycle();
        }
        panic!(
            "{what}: statusword {:04X}h, mode {}, at {}, given {:?}",
            self.status, self.shown, self.position, self.given
        );
    }

    /// Changes the mode, which has to show within five seconds.
    fn select(&mut self, mode: u32) {
        self.mode = mode;
        self.until("mode", 500, |master| master.shown == mode && master.status & STATE == OPERATION_ENABLED);
    }

    /// Homes, with the waits of ros2_canopen.
    fn home(&mut self) {
        const BITS: u32 = TARGET_REACHED | MODE_SPECIFIC;
        self.select(HM);
        self.until("prepare", 100, |master| master.status & TARGET_REACHED != 0);
        self.homing = true;
        self.until("start", 100, |master| master.status & BITS != TARGET_REACHED);
        self.until("attain", 1_000, |master| master.status & MODE_SPECIFIC != 0);
        self.until("stop", 1_000, |master| master.status & TARGET_REACHED != 0);
        self.homing = false;
        self.cycle();
    }

    /// Goes to a position.
    fn go(&mut self, target: i32) {
        self.target = Some(target);
        self.until("acknowledge", 100, |master| master.status & MODE_SPECIFIC != 0);
        self.until("reach", 1_000, |master| {
            master.status & TARGET_REACHED != 0 && master.status & MODE_SPECIFIC == 0 && master.position == target
        });
    }
}

#[test]
fn homing_and_positions() {
    for (method, home) in [(17, -20_000), (18, 20_000), (19, 8_000), (21, 9_000), (35, 0)] {
        let rig = Rig::in_world("[stage]\nleft = -20000\nright = 20000\nhome = [8000, 9000]\n");
        let mut master = Master::new(rig);
        master.rig.set(0x6098, 0, method);
        master.until("enable", 100, |master| master.status & STATE == OPERATION_ENABLED);
        master.home();
        let found = master.rig.rotor();
        assert!((found - home).abs() < 40, "{method}: {found}");
        master.select(PP);
        // Away from the right limit switch.
        let away = if method == 18 { -1 } else { 1 };
        for target in [3_000, 0, 0, 1_500].map(|target| target * away) {
            // A target that has been given is not given again.
            if master.given != Some(target) {
                master.go(target);
            }
            assert!((master.rig.rotor() - found - i64::from(target)).abs() < 40, "{method}");
        }
        assert_eq!(master.rig.rotor() - found, i64::from(1_500 * away));
        // Without a target the master halts the motor, and it stands.
        master.target = None;
        for _ in 0..20 {
            master.cycle();
        }
        assert_eq!(master.rig.rotor() - found, i64::from(1_500 * away));
        // Still homed.
        master.select(HM);
        master.cycle();
        assert!(master.status & MODE_SPECIFIC != 0);
    }
}

#[test]
fn velocities_and_faults() {
    let mut master = Master::new(Rig::operational());
    master.rig.command(0x80);
    master.rig.set(0x2005, 0, 3);
    master.rig.command(1);
    master.until("enable", 100, |master| master.status & STATE == OPERATION_ENABLED);
    master.select(PV);
    master.velocity = Some(500);
    master.until("turn", 100, |master| master.position > 10_000);
    master.velocity = None;
    for _ in 0..50 {
        master.cycle();
    }
    let here = master.rig.rotor();
    master.cycle();
    assert_eq!(master.rig.rotor(), here);
    master.velocity = Some(-500);
    master.until("turn back", 200, |master| master.position < -10_000);
    // A fault of the supply is reset by the cycles themselves.
    master.rig.control("supply 7");
    master.rig.wait(20);
    master.rig.control("supply 24");
    master.rig.wait(20);
    master.rig.frames();
    for _ in 0..10 {
        master.word = 0;
        master.rig.send(0x301, &[if master.cycles.is_multiple_of(2) { 0x80 } else { 0 }, 0, PV as u8]);
        master.rig.send(0x80, &[]);
        master.rig.wait(10);
        master.cycles += 1;
    }
    master.rig.frames();
    master.status = master.rig.status();
    master.until("enable again", 100, |master| master.status & STATE == OPERATION_ENABLED);
    let here = master.rig.rotor();
    for _ in 0..10 {
        master.cycle();
    }
    assert!(master.rig.rotor() < here);
}
