//! Position compare, step outputs, power-down, cover datagrams.

use super::*;

#[test]
fn position_compare() {
    let mut rig = Rig::with(HOLD, 3, 7, 1000);
    assert!(rig.chip.position_compare_pin());
    rig.write(POS_COMP, 10);
    rig.write(POS_COMP_INT, 0x100);
    assert!(!rig.chip.position_compare_pin());
    rig.write(V_ACTUAL, 1024);
    // A step each 32 us.
    rig.run(10 * 32 * MICROSECOND);
    assert!(rig.chip.position_compare_pin() && rig.chip.interrupt_pin());
    rig.run(32 * MICROSECOND);
    assert!(!rig.chip.position_compare_pin());
    assert_eq!((rig.read(POS_COMP_INT), rig.status() & 0x80), (0x101, 0x80));
    rig.write(POS_COMP_INT, 0x101);
    assert_eq!((rig.read(POS_COMP_INT), rig.status() & 0x80), (0x100, 0));
    // Another motor.
    rig.write(IF_CONF, STEP_DIR | 1 << 6);
    rig.write(POS_COMP, 0);
    assert!(rig.chip.position_compare_pin());
}

#[test]
fn step_outputs() {
    // SPI mode: no pulses, but the counter runs.
    let mut rig = Rig::with(HOLD, 3, 7, 1000);
    rig.write(IF_CONF, 0);
    rig.write(V_ACTUAL, 1024);
    assert_eq!(rig.steps_in(320 * MICROSECOND), 0);
    assert_eq!(rig.chip.position(0), 10);
    // inv_dir.
    rig.write(IF_CONF, STEP_DIR | 0x10);
    assert_eq!(rig.steps_in(320 * MICROSECOND), 10);
    assert!(rig.stage.steps.iter().all(|(_, motor, up)| *motor == 0 && !up));
    // USTEP_COUNT: 64 for each full step (USRS = 0).
    assert_eq!(rig.read(USTEP), 20 * 64 % 256);
    rig.write(V_ACTUAL, 0);
    // Pulses of 16 us at v = 2047, PULSE_DIV = 1, i.e. a step each 4 us: one in four gets out.
    rig.write(MODE, NO_STOPS);
    rig.write(V_MAX, 0);
    rig.write(DIVIDERS, 0x1007);
    rig.write(MODE, NO_STOPS | HOLD);
    rig.write(GLOBAL, 0x0F00);
    rig.write(V_ACTUAL, 2047);
    let (steps, counted) = (rig.steps_in(SECOND), rig.chip.position(0) - 20);
    assert!(counted.abs_diff(249_878) <= 1);
    assert!(steps.abs_diff(249_878 / 4) < 300, "{steps}");
    // With step_half each edge is a step.
    rig.write(IF_CONF, STEP_DIR | 4);
    assert!(rig.steps_in(SECOND).abs_diff(249_878) <= 1);
}

#[test]
fn pulse_div_change_outside_ramp_mode_steps() {
    for (mode, stray) in [(HOLD, 1), (VELOCITY, 1), (RAMP, 0)] {
        let mut rig = Rig::with(HOLD, 0, 0, 0);
        rig.write(X_TARGET, 0);
        // Three quarters of a step.
        rig.write(V_ACTUAL, 512);
        rig.run(3 * TICK);
        rig.write(V_ACTUAL, 0);
        rig.write(V_MAX, 0);
        rig.write(MODE, NO_STOPS | mode);
        rig.write(DIVIDERS, 3 << 12);
        rig.run(SECOND);
        assert_eq!(rig.chip.position(0), stray);
        assert_eq!(rig.chip.next_event(), None);
    }
}

#[test]
fn power_down() {
    let mut rig = Rig::with(HOLD, 3, 7, 1000);
    rig.write(V_ACTUAL, 1024);
    rig.run(340 * MICROSECOND);
    rig.write(POWER_DOWN, 0);
    assert_eq!(rig.chip.next_event(), None);
    assert_eq!(rig.steps_in(SECOND + 7), 0);
    // nSCS_C falls: it goes on where it was, the next step 12 us later.
    assert_eq!(rig.status() & 1, 0);
    assert_eq!(rig.chip.next_event(), Some(rig.now + 12 * MICROSECOND));
    rig.run(12 * MICROSECOND);
    assert_eq!(rig.chip.position(0), 11);
}

#[test]
fn cover_datagram() {
    // SPI mode: sent at once; 36 bits for three drivers, 2 * 16 * (1 + 3 * 13 + 1) CLK = 82 us (8.2.5.3).
    let mut rig = Rig { chip: Tmc429::new(HZ), stage: Stage::default(), now: 0 };
    rig.write(GLOBAL, 0x0F02);
    rig.write(COVER, 0x123);
    assert_eq!((rig.status(), rig.read(COVER_POS)), (0x55, 0x80_0000));
    assert_eq!(rig.chip.next_event(), Some(82 * MICROSECOND));
    rig.run(82 * MICROSECOND);
    assert_eq!((rig.status(), rig.read(COVER_POS), rig.read(COVER)), (0x15, 0, 0x123));
    // A write to the words waits for a datagram, which a step needs.
    rig.write(0x60, 0);
    assert_eq!((rig.status(), rig.chip.next_event()), (0x55, None));
    rig.write(MODE, NO_STOPS | HOLD);
    rig.write(V_ACTUAL, 2047);
    rig.run(100 * MICROSECOND);
    assert_eq!(rig.status() & 0x40, 0);
    // In step/direction mode no datagram is ever sent.
    rig.write(IF_CONF, STEP_DIR);
    rig.write(COVER, 1);
    rig.run(SECOND);
    assert_eq!(rig.status() & 0x40, 0x40);
}
