//! Inputs, outputs and readings.

use crate::rig::Rig;

#[test]
fn inputs() {
    let mut rig = Rig::new();
    for pin in 0..4 {
        rig.control(&format!("input {pin} 1"));
        rig.wait(1);
        assert_eq!(rig.read(0x2702, 0), 1 << (16 + pin));
        assert_eq!(rig.read(0x60FD, 0) >> 16, 1 << pin);
        rig.control(&format!("input {pin} 0"));
    }
    rig.wait(1);
    assert_eq!(rig.read(0x2702, 0), 0);
    for value in [0, 1, 2000, 4095] {
        rig.control(&format!("analog 0 {value}"));
        rig.wait(1);
        assert_eq!(rig.read(0x270E, 1), value);
    }
}

/// The switches of 60FDh follow their pins, inverted and switched off as 2005h says.
#[test]
fn switches() {
    let mut rig = Rig::new();
    for (name, bit, off, inverted) in [("left", 1, 1, 4), ("right", 2, 2, 8), ("home", 4, 16, 32)] {
        let seen = |rig: &mut Rig, settings| {
            rig.set(0x2005, 0, settings);
            rig.wait(20);
            rig.read(0x60FD, 0) & 7
        };
        for closed in [false, true] {
            rig.control(&format!("{} {name}", if closed { "press" } else { "release" }));
            let active = if closed { bit } else { 0 };
            assert_eq!(seen(&mut rig, 0), active, "{name}");
            assert_eq!(seen(&mut rig, inverted), active ^ bit, "{name}");
            assert_eq!(seen(&mut rig, off), 0, "{name}");
            assert_eq!(seen(&mut rig, off | inverted), 0, "{name}");
        }
        rig.control(&format!("release {name}"));
    }
}

#[test]
fn outputs() {
    let mut rig = Rig::new();
    let seen = |rig: &mut Rig| {
        rig.wait(1);
        rig.board.borrow().world().outputs().digital
    };
    // Without the mask nothing is switched.
    rig.set(0x2703, 1, 0x0003_0000);
    assert_eq!(seen(&mut rig), 0);
    for (mask, value, expected) in [(1, 3, 1), (2, 0, 1), (2, 2, 3), (3, 2, 2), (1, 3, 3), (3, 0, 0), (0, 3, 0)] {
        rig.set(0x2703, 2, mask << 16);
        rig.set(0x2703, 1, value << 16);
        assert_eq!(seen(&mut rig), expected, "{mask} {value}");
    }
    // OUT0 is the brake's while a current is set for it.
    rig.set(0x2703, 2, 0x0003_0000);
    rig.set(0x2703, 1, 0);
    rig.set(0x200C, 2, 1);
    rig.set(0x2703, 1, 0x0003_0000);
    assert_eq!(seen(&mut rig), 2);
    rig.set(0x200C, 2, 0);
    assert_eq!(seen(&mut rig), 3);
    rig.command(0x81);
    rig.wait(20);
    assert_eq!(seen(&mut rig), 0);
    // Another start of the same node.
    rig.set(0x2703, 2, 0x0003_0000);
    rig.set(0x2703, 1, 0x0003_0000);
    assert_eq!(seen(&mut rig), 3);
    let now = rig.now();
    rig.node.start(now, |_| ());
    assert_eq!((seen(&mut rig), rig.read(0x2703, 1)), (0, 0));
}

#[test]
fn pull_ups_are_off_at_first() {
    let mut rig = Rig::new();
    let pulled = |rig: &mut Rig| {
        rig.wait(1);
        rig.board.borrow().world().outputs().pull_ups != 0
    };
    assert!(!pulled(&mut rig));
    rig.set(0x2710, 0, 1);
    assert!(pulled(&mut rig));
    assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
    rig.set(0x2710, 0, 0);
    assert!(!pulled(&mut rig));
    rig.power_cycle();
    assert!(pulled(&mut rig));
}

/// The drivers stay off, and the statusword says so; the bit of the supply follows it, and a supply that is too low is
/// a fault.
#[test]
fn the_drive_is_off() {
    let mut rig = Rig::operational();
    rig.wait(100);
    assert_eq!((rig.read(0x6041, 0), rig.board.borrow().tmc262(0).current()), (0x0250, 0));
    rig.control("supply 7");
    rig.wait(10);
    assert_eq!((rig.read(0x6041, 0), rig.read(0x2102, 0)), (0x0208, 0x20));
    rig.control("supply 24");
    rig.wait(10);
    assert_eq!((rig.read(0x6041, 0), rig.read(0x2102, 0)), (0x0218, 0));
    rig.set(0x6040, 0, 0x80);
    assert_eq!(rig.read(0x6041, 0), 0x0250);
    rig.command(0x80);
    assert_eq!(rig.read(0x6041, 0), 0x0050);
}

/// Objects that follow another object.
#[test]
fn objects_that_follow_others() {
    let mut rig = Rig::new();
    for (from, to, value) in [
        ((0x6083, 0), (0x6084, 0), 555),
        ((0x6048, 1), (0x6049, 1), 666),
        ((0x6060, 0), (0x6061, 0), 6),
        ((0x6042, 0), (0x6043, 0), 777),
        ((0x2000, 0), (0x2107, 0), 4),
    ] {
        rig.set(from.0, from.1, value);
        assert_eq!(rig.read(to.0, to.1), value, "{:04X}h", to.0);
    }
}

/// The dimension of velocities and what hangs on it.
#[test]
fn dimensions() {
    let mut rig = Rig::new();
    let read = |rig: &mut Rig| [0x208E, 0x2087, 0x2088].map(|index| rig.read(index, 0));
    assert_eq!(rig.write(0x2087, 0, 2046), Err(0x0609_0030));
    assert_eq!(rig.write(0x2088, 0, 2048), Err(0x0609_0030));
    assert_eq!((rig.write(0x2087, 0, 2047), rig.write(0x2088, 0, 2047)), (Ok(()), Ok(())));
    for (dimension, expected) in
        [(181, [179, 499_755, 976_085_662]), (164, [177, 585, 1_143_850]), (0, [0, 2047, 2047])]
    {
        rig.set(0x208C, 0, dimension);
        assert_eq!(read(&mut rig), expected);
        assert_eq!(rig.read(0x6046, 2), expected[1]);
        for index in [0x2087, 0x2088] {
            let largest = rig.read(index, 0);
            if dimension != 0 {
                assert_eq!(rig.write(index, 0, largest + 1), Err(0x0609_0031));
                assert_eq!(rig.write(index, 0, 0), Err(0x0609_0032));
                assert_eq!(rig.write(index, 0, 100), Ok(()));
            }
        }
        let result = rig.write(0x6042, 0, 2048);
        assert_eq!(result, if dimension == 0 { Err(0x0609_0031) } else { Ok(()) });
        // The same dimension again changes nothing.
        let before = read(&mut rig);
        rig.set(0x208C, 0, dimension);
        assert_eq!(read(&mut rig), before);
    }
}
