//! The built-in encoder, on a board that has one and on a board that has none.

use super::*;

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

/// Where no encoder is connected, what needs one is refused, and counts as its default where it was saved on a board
/// that has one.
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

/// After a homing the encoder has the same position as the motor, and goes on with it, whatever the microsteps of a
/// turn.
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
