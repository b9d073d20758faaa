//! Homing: where each method ends, what a master sees of it, and what is refused. Positions are those of the world's
//! rotor.

mod course;
mod encoder;
mod places;
mod switches;

use crate::rig::Rig;

/// Bits of the statusword in homing mode: the homing has ended; the home position is found; a limit is active.
const ENDED: u32 = 1 << 10;
const FOUND: u32 = 1 << 12;
const LIMIT: u32 = 1 << 11;
/// Slow homing speed in internal units: 6104 microsteps in a second.
const SLOW: i64 = 200;
/// The way of a millisecond at that speed, in microsteps, rounded up.
const WAY: i64 = SLOW * 16_000_000 / (2048 * 32 * 8) / 1000 + 1;
/// Microsteps in a count of the encoder.
const COUNT: i64 = 50;
/// How exactly a stop switch is found that the motion controller watches.
const LATCHED: i64 = 8;

/// A node in homing mode that is to obey, in a world that the text describes.
fn ready(world: &str, settings: &[(u16, u8, u32)]) -> Rig {
    let mut rig = Rig::in_world(world);
    rig.command(1);
    for (index, sub, value) in [(0x6099, 1, 1000), (0x6099, 2, SLOW as u32), (0x609A, 0, 1500)] {
        rig.set(index, sub, value);
    }
    for (index, sub, value) in settings {
        rig.set(*index, *sub, *value);
    }
    rig.set(0x6060, 0, 6);
    for word in [6, 7, 15] {
        rig.set(0x6040, 0, word);
    }
    rig.wait(5);
    assert_eq!(bits(&mut rig, 0x6F), 0x27, "OPERATION ENABLED");
    assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED, "idle");
    rig.frames();
    rig
}

fn bits(rig: &mut Rig, mask: u32) -> u32 {
    rig.read(0x6041, 0) & mask
}

fn rotor(rig: &Rig) -> i64 {
    rig.board.borrow().world().axis(0).motor().rotor()
}

/// The codes and manufacturer's bytes of the emergencies since the last look.
fn emergencies(rig: &mut Rig) -> Vec<(u16, u8)> {
    rig.of(0x81).iter().map(|data| (u16::from_le_bytes([data[0], data[1]]), data[3])).collect()
}

/// Begins a homing by the edge of bit 4, and waits for its end; tells whether it has found the home position.
fn home(rig: &mut Rig) -> bool {
    rig.set(0x6040, 0, 15);
    rig.set(0x6040, 0, 31);
    assert_eq!(bits(rig, ENDED | FOUND), 0, "both are clear from the start");
    for _ in 0..100_000 {
        rig.wait(1);
        match bits(rig, ENDED | FOUND) {
            0 => {}
            FOUND => panic!("bit 12 without bit 10"),
            ended => return ended & FOUND != 0,
        }
    }
    panic!("the homing does not end");
}

/// Homes by a method, and compares where the motor stands with where the world has the home position.
fn homes(world: &str, switches: u32, method: u32, place: i64, within: i64) {
    homes_with(world, &[(0x2005, 0, switches)], method, place, within);
}

fn homes_with(world: &str, more: &[(u16, u8, u32)], method: u32, place: i64, within: i64) {
    for offset in [0, 12_345, -70_000] {
        let case = format!("{world}{more:X?}, method {method}, offset {offset}");
        let settings = [&[(0x6098, 0, method), (0x607C, 0, offset as u32)], more].concat();
        let mut rig = ready(world, &settings);
        assert!(home(&mut rig), "{case}");
        let found = rotor(&rig);
        assert!((found - place).abs() <= within, "{case}: {found}, not {place}");
        for index in [0x6062, 0x6063, 0x6064] {
            assert_eq!(rig.read(index, 0) as i32, -offset, "{case}: {index:X}h");
        }
        assert_eq!(rig.read(0x2100, 0) as i32, offset, "{case}");
        rig.wait(100);
        assert_eq!((rotor(&rig), emergencies(&mut rig)), (found, vec![]), "{case}: it stands");
    }
}

/// The stage: switches at its ends, the home switch somewhere between, and an index at 3000 and each 51 200 microsteps
/// from there.
fn stage(home: [i64; 2], start: i64) -> String {
    format!(
        "[stage]\nleft = -30000\nright = 40000\nhome = {home:?}\n[encoder]\noffset = 3000\n[motor]\nstart = {start}\n"
    )
}

const HOME: [i64; 2] = [-9000, 9000];
/// Beside the home switch on either side, on it, and on both stop switches.
const STARTS: [i64; 5] = [-20_000, 0, 20_000, -31_000, 41_000];
