//! The switches as 2005h has them.

use super::*;

/// Where each switch may be closed while its input is low. Of two limit switches with polarities of their own the
/// motion controller watches the left one, and the node the right one, a millisecond late.
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

/// The settings in 2005h hold from the start on when they were saved. In another mode the node stops the motor at the
/// right switch that it watches, tells it, and lets it go back.
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
    let over = (0, 0);
    for (speed, place, switch, before) in
        [(400, 6000, 3, vec![]), (-400, -5000, 4, vec![over]), (1000, 6000, 3, vec![over])]
    {
        rig.frames();
        rig.set(0x60FF, 0, speed as u32);
        rig.wait(1500);
        let stands = rotor(&rig);
        assert!((stands - place).abs() <= 31, "at {speed}: {stands}");
        // The switch that the motor leaves is told to be over.
        let told = [before, vec![(0xFF01, switch)]].concat();
        assert_eq!((emergencies(&mut rig), bits(&mut rig, LIMIT)), (told, LIMIT));
        rig.wait(100);
        assert_eq!(rotor(&rig), stands);
    }
}
