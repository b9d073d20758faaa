//! The course of a homing: its beginning, its speeds, and its end before the home position.

use super::*;

/// A speed of 0, or a switch that is off: the master is told, nothing moves, and the homing does not begin.
#[test]
fn a_homing_is_refused() {
    let no_speeds = [(0x6099, 1, 0), (0x6099, 2, 0)];
    for (method, off) in [(1, 1), (17, 1), (2, 2), (18, 2), (3, 16), (5, 16), (19, 16), (21, 16)] {
        for setting in [(0x2005, 0, off), no_speeds[0], no_speeds[1]] {
            let mut rig = ready(&stage(HOME, 0), &[(0x6098, 0, method), setting]);
            rig.set(0x6040, 0, 31);
            assert_eq!(emergencies(&mut rig), [(0x6320, 0)], "method {method}, {setting:X?}");
            for _ in 0..50 {
                rig.wait(1);
                assert_eq!((bits(&mut rig, 0x6F | ENDED | FOUND), rotor(&rig)), (0x27 | ENDED, 0));
            }
            // A switch that a method does not look for may be off.
            rig.set(0x6098, 0, 34);
            if setting.0 != 0x2005 {
                rig.set(setting.0, setting.1, 300);
            }
            assert!(home(&mut rig), "method {method}, {setting:X?}");
        }
    }
}

/// A limit switch that a method does not look for ends the homing. The motor stops there, an emergency tells which
/// switch, and bit 11 is set until the motor leaves it. The homing counts as ended, but not as found.
#[test]
fn a_limit_switch_in_the_way_ends_a_homing() {
    let no_home = "[stage]\nleft = -5000\nright = 6000\n[encoder]\noffset = 20000\n";
    for (settings, closed) in [(0, ""), (8, "\"right\"")] {
        let world = no_home.replace("[encoder]", &format!("normally_closed = [{closed}]\n[encoder]"));
        for (method, end, switch) in [
            (33, -5000, 4),
            (34, 6000, 3),
            (1, 6000, 3),
            (2, -5000, 4),
            // These have turned round at the other one.
            (19, -5000, 4),
            (21, 6000, 3),
            (3, -5000, 4),
            (5, 6000, 3),
        ] {
            let case = format!("method {method}, 2005h {settings}");
            let mut rig = ready(&world, &[(0x2005, 0, settings), (0x6098, 0, method), (0x607C, 0, 77)]);
            assert!(!home(&mut rig), "{case}");
            let place = rotor(&rig);
            assert!((place - end).abs() <= 40, "{case}: {place}");
            assert_eq!((emergencies(&mut rig), bits(&mut rig, LIMIT)), (vec![(0xFF01, switch)], LIMIT), "{case}");
            assert_eq!(rig.read(0x2100, 0), 0, "{case}");
            rig.wait(100);
            assert_eq!((rotor(&rig), emergencies(&mut rig)), (place, vec![]), "{case}");
            // The same method ends there once more, and that is told once more.
            assert!(!home(&mut rig), "{case}");
            assert_eq!((emergencies(&mut rig), bits(&mut rig, LIMIT)), (vec![(0xFF01, switch)], LIMIT), "{case}");
            // Another method leads out of the switch.
            rig.set(0x6098, 0, if switch == 3 { 18 } else { 17 });
            assert!(home(&mut rig), "{case}");
            assert_eq!(bits(&mut rig, LIMIT), 0, "{case}");
        }
    }
}

/// Bit 4 cleared, or a mode or state left, ends a homing at any moment. The motor stops along the ramp, bit 10 is set
/// and bit 12 is not, nothing is told, and the position stays what it is.
#[test]
fn a_homing_is_ended_before_its_end() {
    for (object, value) in [(0x6040, 15), (0x6060, 3), (0x6040, 11), (0x6040, 7)] {
        for after in [1, 10, 150, 400, 900, 1000, 1030, 1060] {
            let mut rig = ready(&stage(HOME, 0), &[(0x6098, 0, 17), (0x607C, 0, 500)]);
            let difference = rotor(&rig) - i64::from(rig.read(0x6064, 0) as i32);
            rig.set(0x6040, 0, 31);
            rig.wait(after);
            assert_eq!(bits(&mut rig, ENDED | FOUND), 0, "after {after} ms");
            rig.set(object, 0, value);
            let was = rotor(&rig);
            rig.wait(1000);
            let stands = rotor(&rig);
            assert!((stands - was).abs() <= 700, "{object:X}h = {value} after {after} ms: from {was} to {stands}");
            if object == 0x6060 {
                rig.set(object, 0, 6);
                rig.wait(5);
            }
            let case = format!("{object:X}h = {value} after {after} ms");
            assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED, "{case}");
            assert_eq!((emergencies(&mut rig), rig.read(0x2100, 0)), (vec![], 0), "{case}");
            assert_eq!(stands - i64::from(rig.read(0x6064, 0) as i32), difference, "{case}");
            rig.wait(200);
            assert_eq!(rotor(&rig), stands, "{case}");
        }
    }
}

/// Method 35 waits until the motor stands. If it is ended before, by bit 4, another mode or another state, the motor
/// keeps its position when it stands. It brakes from 500 with an acceleration of 100, which takes a third of a second.
#[test]
fn a_homing_to_where_the_motor_is_is_ended_before_its_end() {
    for (object, value) in [(0x6040, 31), (0x6040, 15), (0x6060, 3), (0x6040, 11), (0x6040, 7)] {
        let settings = [(0x6098, 0, 35), (0x6083, 0, 100), (0x609A, 0, 100), (0x6085, 0, 100)];
        let mut rig = ready(&stage(HOME, 0), &settings);
        let difference = rotor(&rig) - i64::from(rig.read(0x6064, 0));
        rig.set(0x60FF, 0, 500);
        rig.set(0x6060, 0, 3);
        rig.wait(500);
        rig.set(0x6060, 0, 6);
        rig.set(0x60FF, 0, 0);
        rig.wait(50);
        rig.set(0x6040, 0, 31);
        assert_eq!(bits(&mut rig, ENDED | FOUND), 0);
        rig.wait(50);
        rig.set(object, 0, value);
        rig.wait(1000);
        rig.set(0x6060, 0, 6);
        rig.wait(5);
        let case = format!("{object:X}h = {value}");
        if value == 31 {
            assert_eq!((bits(&mut rig, ENDED | FOUND), rig.read(0x6064, 0)), (ENDED | FOUND, 0), "{case}");
        } else {
            assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED, "{case}");
            let differs = rotor(&rig) - i64::from(rig.read(0x6064, 0)) - difference;
            assert!(rotor(&rig) > 1000 && differs.abs() <= COUNT, "{case}: {} and {differs}", rotor(&rig));
        }
    }
}

/// Bit 12 stays until the next start: through the end of bit 4, other modes, in which it means something else, and
/// other states. A start that is refused clears it too.
#[test]
fn the_home_position_stays_found() {
    let mut rig = ready(&stage(HOME, 0), &[(0x6098, 0, 17)]);
    assert!(home(&mut rig));
    rig.set(0x6040, 0, 15);
    assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED | FOUND);
    for mode in [1, 3, 2, 0] {
        rig.set(0x6060, 0, mode);
        rig.wait(5);
        assert_eq!(bits(&mut rig, FOUND), 0, "mode {mode}");
        rig.set(0x6060, 0, 6);
        rig.wait(5);
        assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED | FOUND, "after mode {mode}");
    }
    for word in [7, 15, 6, 7, 15] {
        rig.set(0x6040, 0, word);
        rig.wait(20);
        assert_eq!(bits(&mut rig, FOUND), FOUND);
    }
    rig.set(0x6099, 1, 0);
    rig.set(0x6040, 0, 31);
    assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED);
}

/// A stall ends a homing: an emergency, bit 11, and bit 10 without bit 12.
#[test]
fn a_stall_ends_a_homing() {
    let mut rig = ready(&stage(HOME, 0), &[(0x6098, 0, 17), (0x20A4, 0, 300)]);
    rig.set(0x6040, 0, 31);
    rig.wait(500);
    rig.control("load 1");
    rig.wait(200);
    let stands = rotor(&rig);
    assert_eq!(bits(&mut rig, ENDED | FOUND | LIMIT), ENDED | LIMIT);
    assert_eq!(emergencies(&mut rig), [(0x3230, 0)]);
    rig.control("load 0");
    rig.wait(100);
    // The rotor falls in again: half an electrical period away at most, two full steps.
    let (fallen, position) = (rotor(&rig), rig.read(0x6064, 0));
    assert!(fallen.abs_diff(stands) <= 512, "{fallen} and {stands}");
    rig.wait(500);
    assert_eq!((rotor(&rig), rig.read(0x6064, 0)), (fallen, position));
}

/// The fast leg goes at 6099h.1, the slow ones at 6099h.2, and both have the acceleration of 609Ah. At divisors 7 and 3
/// an acceleration of 1000 changes the speed by 15.26 in a millisecond.
#[test]
fn a_homing_has_its_speeds_and_its_acceleration() {
    // From within the switch there is no fast leg.
    for (start, fast, slow, acceleration, reached) in
        [(0, 1000, 200, 1500, -1000), (0, 600, 80, 300, -600), (-36_000, 1000, 300, 500, 300)]
    {
        let settings = [(0x6098, 0, 17), (0x6099, 1, fast as u32), (0x6099, 2, slow as u32), (0x609A, 0, acceleration)];
        let mut rig = ready(&stage(HOME, start), &settings);
        let speed = |rig: &Rig| rig.board.borrow().tmc429(0).velocity(0);
        rig.set(0x6040, 0, 31);
        let mut speeds = Vec::new();
        while bits(&mut rig, ENDED) == 0 {
            rig.wait(1);
            speeds.push(speed(&rig));
        }
        let fastest = speeds.iter().copied().max_by_key(|speed: &i32| speed.abs());
        assert_eq!(fastest, Some(reached), "from {start}");
        let begun = speeds.iter().position(|speed| *speed != 0).unwrap();
        let ramp = speeds.iter().position(|speed| *speed == reached).unwrap() - begun;
        let expected = f64::from(reached.abs()) / (15.26 * f64::from(acceleration) / 1000.0);
        assert!((ramp as f64 - expected).abs() <= 4.0, "{ramp} ms, not {expected}");
    }
}
