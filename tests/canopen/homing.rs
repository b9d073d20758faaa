//! Homing: where each method ends, what a master sees of it, and what is refused. Positions are those of the world's rotor.

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

#[test]
fn a_limit_switch_is_found_where_it_opens() {
    for start in STARTS {
        homes(&stage(HOME, start), 0, 17, -29_999, LATCHED);
        homes(&stage(HOME, start), 0, 18, 39_999, LATCHED);
    }
}

#[test]
fn the_index_beside_a_limit_switch_is_found() {
    let world = |start| {
        format!("[stage]\nleft = -30000\nright = 40000\n[encoder]\noffset = -10000\n[motor]\nstart = {start}\n")
    };
    for start in STARTS {
        homes(&world(start), 0, 1, -10_000, COUNT + WAY);
        homes(&world(start), 0, 2, -10_000, COUNT + WAY);
    }
}

/// The home switch is wide, or so short that the fast motor runs over it.
#[test]
fn an_edge_of_the_home_switch_is_found() {
    for start in STARTS {
        for switch in [HOME, [-200, 100]] {
            homes(&stage(switch, start), 0, 19, switch[0], WAY);
            homes(&stage(switch, start), 0, 21, switch[1], WAY);
        }
    }
}

/// At a slow speed that is not slow the motor runs over a short home switch on its way back as well, and over the index
/// behind the switch.
#[test]
fn a_slow_leg_may_run_over_the_home_switch() {
    let fast = [(0x6099, 2, 900), (0x609A, 0, 700)];
    let way = WAY * 9 / 2;
    for start in STARTS {
        homes_with(&stage([-200, 100], start), &fast, 19, -200, way);
        homes_with(&stage([-200, 100], start), &fast, 21, 100, way);
        homes_with(&stage([2_400, 2_900], start), &fast, 5, 3_000, COUNT + way);
        homes_with(&stage([3_200, 3_400], start), &fast, 3, 3_000, COUNT + way);
    }
}

/// The home switch closes for two milliseconds where it is not, while the motor has turned round and runs fast.
#[test]
fn a_glitch_is_not_taken_for_the_home_switch() {
    for after in [900, 1200, 1500, 1800] {
        let mut rig = ready(&stage([-200, 100], 20_000), &[(0x6098, 0, 19)]);
        rig.set(0x6040, 0, 31);
        rig.wait(after);
        let at = rotor(&rig);
        rig.control("press home");
        rig.wait(2);
        rig.control("release home");
        rig.wait(6000);
        assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED | FOUND, "glitch at {at}");
        assert!((rotor(&rig) + 200).abs() <= WAY, "glitch at {at}: {}", rotor(&rig));
    }
}

#[test]
fn the_index_beside_the_home_switch_is_found() {
    let world = |home: [i64; 2], start| {
        format!(
            "[stage]\nleft = -80000\nright = 80000\nhome = {home:?}\n[encoder]\noffset = 3000\n[motor]\nstart = {start}\n"
        )
    };
    for start in [-60_000, 0, 60_000] {
        homes(&world(HOME, start), 0, 3, 3_000 - 51_200, COUNT + WAY);
        homes(&world(HOME, start), 0, 5, 3_000 + 51_200, COUNT + WAY);
    }
    // The index is so close to the edge that the motor passes it while it comes to a stand.
    homes(&world([3_060, 9_000], 0), 0, 3, 3_000, COUNT + WAY);
    homes(&world([-9_000, 2_940], 5_000), 0, 5, 3_000, COUNT + WAY);
}

#[test]
fn the_next_index_is_found() {
    for (start, left, right) in [(0, -48_200, 3_000), (2_000, -48_200, 3_000), (4_000, 3_000, 54_200)] {
        let world = format!("[encoder]\noffset = 3000\n[motor]\nstart = {start}\n");
        homes(&world, 3, 33, left, COUNT + WAY);
        homes(&world, 3, 34, right, COUNT + WAY);
    }
}

/// Where each switch may be closed while its input is low. Of two limit switches with polarities of their own the motion
/// controller watches the left one, and the node the right one, a millisecond late.
#[test]
fn switches_have_polarities_of_their_own() {
    const LEFT: u32 = 1 << 2;
    const RIGHT: u32 = 1 << 3;
    const HOME_LOW: u32 = 1 << 5;
    for (closed, settings, within) in [
        ("\"left\", \"right\"", LEFT | RIGHT, LATCHED),
        ("\"right\"", RIGHT, WAY),
        ("\"left\"", LEFT, WAY),
        ("\"left\", \"right\", \"home\"", LEFT | RIGHT | HOME_LOW, LATCHED),
        ("\"right\", \"home\"", RIGHT | HOME_LOW, WAY),
    ] {
        for start in STARTS {
            let world = stage(HOME, start).replace("[encoder]", &format!("normally_closed = [{closed}]\n[encoder]"));
            homes(&world, settings, 17, -29_999, LATCHED);
            homes(&world, settings, 18, 39_999, within);
            if (settings & HOME_LOW != 0) == closed.contains("home") {
                homes(&world, settings, 19, HOME[0], WAY);
                homes(&world, settings, 21, HOME[1], WAY);
            }
        }
    }
    // A single limit switch has the motion controller's polarity to itself.
    let world = stage(HOME, 0).replace("[encoder]", "normally_closed = [\"right\"]\n[encoder]");
    homes(&world, 1 | RIGHT, 18, 39_999, LATCHED);
    let world = stage(HOME, 0).replace("[encoder]", "normally_closed = [\"left\"]\n[encoder]");
    homes(&world, 2 | LEFT, 17, -29_999, LATCHED);
}

/// 60FDh has the switches as 2005h says, in each combination of their levels; a switch that is off is 0.
#[test]
fn the_digital_inputs_show_switches_as_they_count() {
    let mut rig = Rig::operational();
    let names = ["left", "right", "home"];
    for settings in 0..64_u32 {
        rig.set(0x2005, 0, settings);
        let (off, inverted) = (settings & 3 | settings >> 2 & 4, settings >> 2 & 3 | settings >> 3 & 4);
        for pressed in 0..8_u32 {
            for (bit, name) in names.iter().enumerate() {
                rig.control(&format!("{} {name}", if pressed >> bit & 1 != 0 { "press" } else { "release" }));
            }
            rig.wait(12);
            let seen = rig.read(0x60FD, 0);
            assert_eq!(seen & 7, (pressed ^ inverted) & !off, "2005h {settings:X}h, pressed {pressed:03b}");
            assert_eq!(seen >> 17 & 7, pressed, "the pins are as they are");
        }
    }
}

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

/// A limit switch that a method does not look for ends it: the motor stops there, an emergency tells which switch, and bit
/// 11 is set until the motor leaves it. The homing counts as ended, but not as found.
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
            // Another method leads out of the switch.
            rig.set(0x6098, 0, if switch == 3 { 18 } else { 17 });
            assert!(home(&mut rig), "{case}");
            assert_eq!(bits(&mut rig, LIMIT), 0, "{case}");
        }
    }
}

/// A limit switch that is off stops no homing.
#[test]
fn a_limit_switch_that_is_off_is_run_over() {
    let world = "[stage]\nleft = -5000\nright = 6000\nhome = [9000, 12000]\n";
    homes(world, 2, 19, 9000, WAY);
    homes(&world.replace("[9000, 12000]", "[-12000, -9000]"), 1, 21, -9000, WAY);
}

/// Bit 4 cleared, or a mode or state left, ends a homing at any moment: the motor stops along the ramp, bit 10 is set and
/// bit 12 is not, nothing is told, and the position stays what it is.
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

/// Bit 12 stays until the next start: through the end of bit 4, other modes, in which it means something else, and other
/// states. A start that is refused clears it too.
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

/// Method 0 is over at once, and neither motor nor position change.
#[test]
fn no_homing_is_over_at_once() {
    let mut rig = ready(&stage(HOME, 0), &[(0x6098, 0, 0), (0x607C, 0, 44)]);
    let position = rig.read(0x6064, 0);
    rig.set(0x6040, 0, 31);
    assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED | FOUND);
    rig.wait(50);
    assert_eq!((rig.read(0x6064, 0), rig.read(0x2100, 0), rotor(&rig)), (position, 44, 0));
}

/// Method 35 makes the position zero in any state, whatever the home offset, and the motor does not move.
#[test]
fn the_present_position_becomes_zero_in_any_state() {
    for words in [&[][..], &[6], &[6, 7], &[6, 7, 15]] {
        for sensor in [0, 0xFFFF] {
            let mut rig = Rig::in_world("[encoder]\noffset = -7000\n[motor]\nstart = 1024\n");
            rig.set(0x6098, 0, 35);
            rig.set(0x607C, 0, 4321);
            rig.set(0x606A, 0, sensor);
            rig.set(0x6060, 0, 6);
            for word in words {
                rig.set(0x6040, 0, *word);
            }
            rig.wait(5);
            assert_ne!(rig.read(0x6064, 0), 0);
            let (state, last) = (bits(&mut rig, 0x6F), words.last().copied().unwrap_or_default());
            rig.set(0x6040, 0, last | 16);
            let positions = [0x6062, 0x6063, 0x6064].map(|index| rig.read(index, 0));
            assert_eq!(positions, [0; 3], "{words:?}, sensor {sensor:X}h");
            assert_eq!(bits(&mut rig, 0x6F | ENDED | FOUND), state | ENDED | FOUND);
            rig.wait(50);
            assert_eq!((rig.read(0x6064, 0), rotor(&rig), rig.read(0x2100, 0)), (0, 1024, 4321));
            assert_eq!(emergencies(&mut rig), []);
        }
    }
}

/// 200Bh.3: at the start the position is that of the encoder within the turn, or 0.
#[test]
fn the_position_begins_at_the_encoder() {
    let world = |start| format!("[encoder]\noffset = -7000\n[motor]\nstart = {start}\n");
    for (start, expected) in [(900, 7900), (-7001, 51_199), (45_000, 800), (0, 7000)] {
        for sensor in [0, 0xFFFF] {
            let mut rig = Rig::in_world(&world(start));
            rig.set(0x606A, 0, sensor);
            for index in [0x6062, 0x6063, 0x6064] {
                let difference = expected - i64::from(rig.read(index, 0) as i32);
                assert!((0..COUNT).contains(&difference), "from {start}: {index:X}h is {difference} below");
            }
            rig.set(0x200B, 3, 0);
            rig.sign(0x1010, 1, b"save").unwrap();
            rig.power_cycle();
            assert_eq!([0x6062, 0x6063, 0x6064].map(|index| rig.read(index, 0)), [0; 3]);
        }
    }
    // With another resolution a turn has other microsteps.
    let mut rig = Rig::in_world(&world(5800));
    rig.set(0x2000, 0, 4);
    rig.sign(0x1010, 1, b"save").unwrap();
    rig.power_cycle();
    assert_eq!(rig.read(0x6064, 0), 12_800 / 16);
}

/// Where no encoder is connected, what needs one is refused, and counts as its default where it was saved on a board that
/// has one.
#[test]
fn without_an_encoder_what_needs_one_is_refused() {
    const STATE: u32 = 0x0800_0022;
    let mut rig = Rig::new();
    for (index, value) in [(0x6098, 34), (0x606A, 0), (0x6065, 1000)] {
        rig.set(index, 0, value);
    }
    rig.sign(0x1010, 1, b"save").unwrap();
    let saved = rig.eeprom();
    rig.power_cycle();
    assert_eq!([0x6098, 0x606A, 0x6065].map(|index| rig.read(index, 0)), [34, 0, 1000]);
    let mut rig = Rig::without_encoder(&saved);
    rig.wait(2);
    assert_eq!([0x6098, 0x606A, 0x6065].map(|index| rig.read(index, 0)), [0, 0xFFFF, 0]);
    assert_eq!([0x6062, 0x6063, 0x6064].map(|index| rig.read(index, 0)), [0; 3]);
    for method in [1, 2, 3, 5, 33, 34] {
        assert_eq!(rig.write(0x6098, 0, method), Err(STATE), "method {method}");
    }
    for method in [0, 17, 18, 19, 21, 35] {
        rig.set(0x6098, 0, method);
    }
    assert_eq!((rig.write(0x606A, 0, 0), rig.write(0x6065, 0, 1)), (Err(STATE), Err(STATE)));
    rig.set(0x606A, 0, 0xFFFF);
    rig.set(0x6065, 0, 0);
    assert_eq!(rig.write(0x6098, 0, 4), Err(0x0609_0030), "what nobody has is refused otherwise");
}

/// What 2005h says holds from the start on when it was saved; and in another mode the node stops the motor at the right
/// switch that it watches, tells it, and lets it go back.
#[test]
fn saved_switches_are_in_force_from_the_start() {
    let world = "[stage]\nleft = -5000\nright = 6000\nnormally_closed = [\"right\"]\n";
    let mut rig = Rig::in_world(world);
    rig.set(0x2005, 0, 8);
    rig.sign(0x1010, 1, b"save").unwrap();
    rig.power_cycle();
    rig.command(1);
    rig.wait(20);
    assert_eq!(rig.read(0x60FD, 0) & 7, 0);
    rig.set(0x6060, 0, 3);
    for word in [6, 7, 15] {
        rig.set(0x6040, 0, word);
    }
    for (speed, place, switch) in [(400, 6000, 3), (-400, -5000, 4), (1000, 6000, 3)] {
        rig.frames();
        rig.set(0x60FF, 0, speed as u32);
        rig.wait(1500);
        let stands = rotor(&rig);
        assert!((stands - place).abs() <= 31, "at {speed}: {stands}");
        assert_eq!((emergencies(&mut rig), bits(&mut rig, LIMIT)), (vec![(0xFF01, switch)], LIMIT));
        rig.wait(100);
        assert_eq!(rotor(&rig), stands);
    }
}

/// After a homing the encoder has the same position as the motor, and goes on with it, whatever the microsteps of a turn.
#[test]
fn the_encoder_goes_on_from_the_home_position() {
    for (resolution, full_steps) in [(8, 200), (4, 200), (6, 200)] {
        let world = "[stage]\nleft = -5000\n[encoder]\noffset = 3000\n";
        let settings = [(0x2000, 0, resolution), (0x2001, 0, full_steps), (0x6098, 0, 17), (0x607C, 0, 1000)];
        let mut rig = ready(world, &settings);
        assert!(home(&mut rig));
        let positions = |rig: &mut Rig| {
            [0, 0xFFFF].map(|sensor| {
                rig.set(0x606A, 0, sensor);
                rig.read(0x6064, 0) as i32
            })
        };
        assert_eq!(positions(&mut rig), [-1000; 2]);
        // After some turns of the motor they still agree.
        rig.set(0x6060, 0, 3);
        rig.set(0x60FF, 0, 800);
        rig.wait(5000);
        rig.set(0x60FF, 0, 0);
        rig.wait(500);
        let [encoder, motor] = positions(&mut rig);
        let count = (full_steps << resolution) / 1024 + 1;
        assert!(motor > 100_000 && motor.abs_diff(encoder) <= count, "resolution {resolution}: {encoder}, {motor}");
    }
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
    rig.wait(500);
    assert_eq!(rotor(&rig), stands);
}
