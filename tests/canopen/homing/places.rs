//! Where each method ends.

use super::*;

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

/// A limit switch that is off stops no homing.
#[test]
fn a_limit_switch_that_is_off_is_run_over() {
    let world = "[stage]\nleft = -5000\nright = 6000\nhome = [9000, 12000]\n";
    homes(world, 2, 19, 9000, WAY);
    homes(&world.replace("[9000, 12000]", "[-12000, -9000]"), 1, 21, -9000, WAY);
}

/// Method 0 is over at once, neither motor nor position change, and no home position has been found (manual table 278).
#[test]
fn no_homing_is_over_at_once() {
    let mut rig = ready(&stage(HOME, 0), &[(0x6098, 0, 0), (0x607C, 0, 44)]);
    let position = rig.read(0x6064, 0);
    rig.set(0x6040, 0, 31);
    assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED);
    rig.wait(50);
    assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED);
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

/// A motor that still moves has no present position: method 35 takes that where the motor comes to a stand.
#[test]
fn the_present_position_is_that_of_a_motor_that_stands() {
    let mut rig = ready("", &[(0x6098, 0, 35), (0x6060, 0, 3), (0x6083, 0, 200), (0x609A, 0, 200), (0x60FF, 0, 1000)]);
    rig.wait(500);
    rig.set(0x6060, 0, 6);
    rig.set(0x6040, 0, 31);
    for _ in 0..1_000 {
        let status = bits(&mut rig, 1 << 14 | ENDED | FOUND);
        assert!(status == 1 << 14 || status & 1 << 14 == 0, "{status:04X}h");
        rig.wait(1);
    }
    assert_eq!((bits(&mut rig, ENDED | FOUND), rig.read(0x6064, 0)), (ENDED | FOUND, 0));
    // Bit 4 cleared before the motor stands ends it.
    rig.set(0x6040, 0, 15);
    rig.set(0x6060, 0, 3);
    rig.wait(500);
    rig.set(0x6060, 0, 6);
    rig.set(0x6040, 0, 31);
    assert_eq!(bits(&mut rig, ENDED | FOUND), 0);
    rig.set(0x6040, 0, 15);
    rig.wait(1_000);
    assert_eq!(bits(&mut rig, ENDED | FOUND), ENDED);
}

/// A limit switch that is off does not stop a motor on its way to an index either.
#[test]
fn an_index_beyond_a_limit_switch_that_is_off_is_found() {
    let world = "[stage]\nleft = -5000\nright = 1000\n[encoder]\noffset = 3000\n";
    homes(world, 1, 33, 3_000 - 51_200, COUNT + WAY);
    homes(world, 2, 34, 3_000, COUNT + WAY);
}

/// The step counter (210Bh) has the motor's way in both directions, to which the new number of the home position adds
/// nothing.
#[test]
fn the_step_counter_counts_the_way_alone() {
    let mut rig = ready(&stage(HOME, 0), &[(0x6098, 0, 17), (0x607C, 0, 5_000_000)]);
    let before = rig.read(0x210B, 1);
    assert!(home(&mut rig));
    rig.wait(10);
    let way = rig.read(0x210B, 1) - before;
    assert!((30_000..=31_500).contains(&way), "{way}");
    rig.set(0x6098, 0, 35);
    for word in [15, 31] {
        rig.set(0x6040, 0, word);
    }
    rig.wait(10);
    assert_eq!((rig.read(0x6064, 0), rig.read(0x210B, 1) - before), (0, way));
}

/// The home offset of a homing is that of its beginning. 2100h shows it, and the position is less than zero by it,
/// though the object has another value when the home position is found.
#[test]
fn an_offset_that_is_written_meanwhile_is_for_the_next_homing() {
    for method in [17, 19] {
        let mut rig = ready(&stage(HOME, 0), &[(0x6098, 0, method), (0x607C, 0, 44)]);
        rig.set(0x6040, 0, 31);
        rig.wait(50);
        assert_eq!((bits(&mut rig, ENDED | FOUND), rig.read(0x2100, 0)), (0, 0), "method {method}");
        rig.set(0x607C, 0, 99);
        while bits(&mut rig, ENDED) == 0 {
            rig.wait(10);
        }
        assert_eq!((rig.read(0x6064, 0) as i32, rig.read(0x2100, 0)), (-44, 44), "method {method}");
        assert!(home(&mut rig));
        assert_eq!((rig.read(0x6064, 0) as i32, rig.read(0x2100, 0)), (-99, 99), "method {method}");
    }
}
