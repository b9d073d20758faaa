//! Random commands to the drive: whatever they are, the rotor moves only where the drive may move it, and stays within
//! the software limits but for the ramp.

use crate::driving::{ENABLE, FAULT_REACTION_ACTIVE, OPERATION_ENABLED, PV, QUICK_STOP_ACTIVE, STATE};
use crate::rig::Rig;
use common::random::Random;
use tmcm::canopen::Nmt;

/// Number of sequences, and of commands in each.
const SEQUENCES: u64 = 100_000;
const COMMANDS: u64 = 8;
/// Number of sequences after which the node is a new one.
const BATCH: u64 = 1_000;

/// Objects that a sequence writes, with values of which each is tried: the smallest, the largest, and ordinary ones.
const OBJECTS: [(u16, u8, &[u32]); 22] = [
    (0x6060, 0, &[0, 1, 1, 2, 3, 3, 6]),
    (0x607A, 0, &[0, 5_000, 0xFFFF_E000, 0x7FFF_FFFF, 0x8000_0000, 100]),
    (0x60FF, 0, &[0, 300, 0xFFFF_FE00, 0x7FFF_FFFF, 0x8000_0000]),
    (0x6042, 0, &[0, 300, 0xFE00, 2047]),
    (0x6081, 0, &[0, 1000, 2047, 0xFFFF_FFFF]),
    (0x6083, 0, &[0, 1, 500, 2047, 0xFFFF_FFFF]),
    (0x6085, 0, &[0, 300, 51_200, 0xFFFF_FFFF]),
    (0x6048, 1, &[1, 500, 0xFFFF_FFFF]),
    (0x609A, 0, &[0, 1000]),
    (0x6098, 0, &[0, 1, 17, 18, 19, 33, 35]),
    (0x6099, 1, &[0, 500]),
    (0x6099, 2, &[0, 100]),
    (0x605A, 0, &[1, 2, 5, 6]),
    (0x607C, 0, &[0, 1_000, 0x8000_0000]),
    (0x607D, 1, &[0x8000_0000, 0, 0xFFFF_F000, 0x7FFF_FFFF]),
    (0x607D, 2, &[0x7FFF_FFFF, 0, 4_000, 0x8000_0000]),
    (0x6065, 0, &[0, 0, 100, 50_000]),
    (0x6067, 0, &[0, 0xFFFF_FFFF, 100]),
    (0x2005, 0, &[0, 3, 3, 7, 11, 0x43]),
    (0x208C, 0, &[0, 164, 181]),
    (0x2002, 1, &[0, 0, 5]),
    (0x200A, 0, &[0, 0, 5]),
];

/// Carries out a random command; what it has been, for the message of a failure.
fn disturb(rig: &mut Rig, random: &mut Random) -> String {
    match random.below(16) {
        0..=2 => {
            let word = random.pick(&[6, 7, 15, 31, 0x10F, 0x5F, 2, 0, 0x80, 0x0F]);
            if rig.node.state() == Nmt::Stopped {
                rig.send(0x201, &[word as u8, (word >> 8) as u8]);
            } else {
                rig.word(word);
            }
            format!("controlword {word:X}h")
        }
        3 => {
            let word = random.next() as u16;
            rig.send(0x201, &word.to_le_bytes());
            format!("RPDO1 {word:04X}h")
        }
        // The way to OPERATION ENABLED, so that most sequences come to move something.
        4..=6 => {
            for word in [0x80_u8, 6, 7, 15] {
                rig.send(0x201, &[word, 0]);
            }
            "enable".into()
        }
        7 => {
            let (target, word) = (random.pick(&[3_000_i32, -3_000, i32::MAX, 0]), random.pick(&[15_u8, 31, 0x5F]));
            let [a, b, c, d] = target.to_le_bytes();
            rig.send(0x401, &[word, 0, a, b, c, d]);
            format!("RPDO3 {word:X}h, {target}")
        }
        8 => {
            let (velocity, word) = (random.pick(&[400_i32, -400, i32::MIN, 0]), random.pick(&[15_u8, 7, 2]));
            let [a, b, c, d] = velocity.to_le_bytes();
            rig.send(0x501, &[word, 0, a, b, c, d]);
            format!("RPDO4 {word:X}h, {velocity}")
        }
        9 if random.one_in(4) => {
            let command = random.pick(&[1, 1, 2, 0x80, 0x82]);
            rig.command(command);
            format!("NMT {command:X}h")
        }
        10 if random.one_in(4) => {
            let line = random.pick(&["supply 7", "supply 24", "input 0 0", "input 0 1", "press left", "release left"]);
            rig.control(line);
            line.into()
        }
        _ => {
            let (index, sub, values) = OBJECTS[random.below(OBJECTS.len() as u64) as usize];
            let value = random.pick(values);
            if rig.node.state() != Nmt::Stopped {
                let _ = rig.write(index, sub, value);
            }
            format!("{index:04X}h:{sub} = {value:X}h")
        }
    }
}

/// Whether the drive is in a state in which the motor may move; `None` while the node does not answer.
fn may_move(rig: &mut Rig) -> Option<bool> {
    if rig.node.state() == Nmt::Stopped {
        return None;
    }
    let state = rig.status() & STATE;
    Some(matches!(state, OPERATION_ENABLED | QUICK_STOP_ACTIVE | FAULT_REACTION_ACTIVE))
}

/// Where the rotor is, and where the driver's field wants it: steps that come while the bridges are off turn only that.
fn places(rig: &Rig) -> (i64, i64) {
    (rig.rotor(), rig.board.borrow().world().axis(0).motor().field())
}

#[test]
fn the_rotor_moves_only_where_it_may() {
    let mut random = Random(402);
    let (mut moved, mut stood) = (0_u64, 0_u64);
    for batch in 0..SEQUENCES / BATCH {
        let mut rig = Rig::operational();
        rig.set(0x2005, 0, 3);
        for sequence in 0..BATCH {
            let mut done = Vec::new();
            for _ in 0..COMMANDS {
                done.push(disturb(&mut rig, &mut random));
                let (from, before) = (places(&rig), may_move(&mut rig));
                let speed = rig.speed();
                rig.wait(random.below(4));
                let after = may_move(&mut rig);
                // A node that is stopped moves its motor to a stand alone.
                let slows = after.is_some() || before.is_some() || rig.speed().abs() <= speed.abs();
                assert!(slows, "batch {batch}, sequence {sequence}: {done:?}");
                if before == Some(false) && after == Some(false) {
                    stood += 1;
                    assert_eq!(places(&rig), from, "batch {batch}, sequence {sequence}: {done:?}");
                } else {
                    moved += u64::from(places(&rig) != from);
                }
            }
            // A node that is stopped, or faulty, is set free again.
            if random.one_in(8) {
                rig.control("supply 24");
                rig.control("input 0 1");
                rig.command(1);
            }
            rig.frames();
        }
    }
    assert!(moved > SEQUENCES / 10 && stood > SEQUENCES / 10, "moved {moved}, stood {stood}");
}

/// The motor turns at random velocities between software limits. In internal units a velocity v is v * 16 MHz / 2^19
/// microsteps a second and an acceleration a is a * (16 MHz)^2 / 2^39.
#[test]
fn the_rotor_stays_within_the_software_limits_but_for_the_ramp() {
    let mut random = Random(607);
    let mut hits = 0;
    for _ in 0..300 {
        let mut rig = Rig::enabled(PV);
        let acceleration = random.pick(&[50_u32, 200, 1000, 2047]);
        let (low, high) = (-(random.below(6_000) as i64) - 1, random.below(6_000) as i64 + 1);
        rig.set(0x6083, 0, acceleration);
        rig.set(0x607D, 1, low as u32);
        rig.set(0x607D, 2, high as u32);
        let mut fastest = 0.0_f64;
        for _ in 0..20 {
            let velocity = random.below(4_000) as i32 - 2_000;
            rig.set(0x60FF, 0, velocity as u32);
            rig.word(ENABLE);
            fastest = fastest.max(f64::from(velocity.abs()) * 16e6 / f64::from(1 << 19));
            rig.wait(random.below(200));
            let ramp = fastest * fastest / (2.0 * f64::from(acceleration) * 16e6 * 16e6 / (1_u64 << 39) as f64);
            // The limit is noticed within two milliseconds.
            let slack = (ramp * 1.01 + fastest * 0.002) as i64 + 1;
            let rotor = rig.rotor();
            assert!((low - slack..=high + slack).contains(&rotor), "{rotor}: {low} to {high} and {slack}");
            hits += u32::from(!(low..=high).contains(&rotor));
        }
    }
    assert!(hits > 300, "{hits}");
}
