//! Reference switches: stops, tolerance, latch, interrupts (datasheet sections 8.1.11 to 8.1.15).

use super::*;

/// Runs at v = 1000 (PULSE_DIV 3, RAMP_DIV 7, A_MAX 1000) to the right, with a right switch at 5000.
fn towards_a_switch(ref_conf: u32) -> Rig {
    let mut rig = Rig::with(VELOCITY, 3, 7, 1000);
    rig.write(MODE, ref_conf | VELOCITY);
    rig.write(INTERRUPTS, 0xFF00);
    rig.stage.right = Some((5000, 9000));
    rig.write(V_TARGET, 1000);
    rig
}

#[test]
fn hard_stop() {
    let mut rig = towards_a_switch(0);
    rig.run(SECOND);
    assert_eq!((rig.chip.position(0), rig.chip.velocity(0)), (5000, 0));
    // int_stop and int_stop_right_high.
    assert_eq!(rig.read(INTERRUPTS), 0xFF88);
    assert_eq!(rig.chip.next_event(), None);
    // The other direction is free, and so is the first when the switch opens.
    rig.write(V_TARGET, 0xFFF & 1000_u32.wrapping_neg());
    rig.run(10 * MILLISECOND);
    assert!(rig.chip.position(0) < 5000);
    rig.write(V_TARGET, 1000);
    rig.run(SECOND);
    assert_eq!((rig.chip.position(0), rig.chip.velocity(0)), (5000, 0));
    rig.stage.right = None;
    rig.pins();
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(0), 1000);
}

#[test]
fn hard_stop_resumes_a_positioning() {
    let mut rig = towards_a_switch(0);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(X_TARGET, 10_000);
    rig.write(MODE, RAMP);
    rig.run(SECOND);
    assert_eq!((rig.chip.position(0), rig.status() & 1), (5000, 0));
    rig.stage.right = None;
    rig.pins();
    rig.settle();
    assert_eq!((rig.chip.position(0), rig.status() & 1), (10_000, 1));
}

#[test]
fn left_switch_stops_only_to_the_left() {
    let mut rig = Rig::with(VELOCITY, 3, 7, 1000);
    rig.write(MODE, VELOCITY);
    rig.stage.left = Some((-9000, 6000));
    rig.pins();
    rig.run(TICK);
    rig.write(V_TARGET, 1000);
    rig.run(100 * MILLISECOND);
    assert_eq!(rig.chip.velocity(0), 1000);
    rig.run(300 * MILLISECOND);
    rig.write(V_TARGET, 0xFFF & 1000_u32.wrapping_neg());
    rig.run(SECOND);
    assert_eq!((rig.chip.position(0), rig.chip.velocity(0)), (6000, 0));
}

#[test]
fn soft_stop() {
    let mut rig = towards_a_switch(SOFT_STOP);
    rig.run(SECOND);
    // v^2 * 2^(RAMP_DIV - PULSE_DIV) / (16 * A_MAX) = 1000 steps of ramp.
    assert!(rig.chip.position(0).abs_diff(6000) <= 5, "{}", rig.chip.position(0));
    assert_eq!(rig.chip.velocity(0), 0);
    assert_eq!(rig.read(INTERRUPTS), 0xFF88);
}

#[test]
fn disabled_stops_do_not_stop() {
    let mut rig = towards_a_switch(0x200);
    rig.run(SECOND);
    assert_eq!(rig.chip.velocity(0), 1000);
    // int_stop_right_high and _low.
    assert_eq!(rig.read(INTERRUPTS), 0xFFA0);
}

#[test]
fn tolerance_lets_the_motor_pass_near_the_origin() {
    for (tolerance, rest) in [(0, 0), (99, 100), (200, 201)] {
        let mut rig = Rig::with(VELOCITY, 3, 7, 1000);
        rig.write(MODE, VELOCITY);
        rig.write(TOLERANCE, tolerance);
        rig.stage.left = Some((-1000, 0));
        rig.write(X_ACTUAL, 2000);
        rig.stage.position = 2000;
        rig.write(V_TARGET, 0xFFF & 500_u32.wrapping_neg());
        rig.run(SECOND);
        assert_eq!(rig.chip.position(0), -rest, "tolerance {tolerance}");
    }
}

#[test]
fn inactive_switch_inputs() {
    // en_refr = 0: right switches read inactive, whatever inv_ref says (8.2.4.5).
    let mut rig = Rig::new();
    rig.chip.set_reference_pins(0x3F);
    assert_eq!((rig.read(SWITCHES), rig.status()), (0x3F, 0x3F));
    rig.write(IF_CONF, STEP_DIR & !0x100);
    assert_eq!(rig.read(SWITCHES), 0x2A);
    rig.write(IF_CONF, STEP_DIR & !0x100 | 1);
    assert_eq!((rig.read(SWITCHES), rig.status()), (0, 0x15));
    rig.chip.set_reference_pins(0);
    assert_eq!(rig.read(SWITCHES), 0x2A);
    rig.write(IF_CONF, STEP_DIR | 1);
    assert_eq!(rig.read(SWITCHES), 0x3F);
    // mot1r: REF3 is the right switch of motor 1, motor 3 has none (9.1).
    rig.write(IF_CONF, 0x22);
    rig.write(GLOBAL, 1 << 21);
    rig.chip.set_reference_pins(0x20);
    assert_eq!(rig.read(SWITCHES), 0x01);
}

#[test]
fn latch() {
    let mut rig = towards_a_switch(NO_STOPS | RIGHT_NOT_LEFT);
    rig.stage.left = Some((2000, 2500));
    rig.write(LATCHED, 0);
    assert_eq!(rig.read(MODE) >> 16, 1);
    rig.run(250 * MILLISECOND);
    assert_eq!((rig.read(MODE) >> 16, rig.read(LATCHED)), (0, 5000));
    // The next edge is the end of the switch, at the first position beyond.
    rig.write(LATCHED, 0);
    rig.run(SECOND);
    assert_eq!((rig.read(MODE) >> 16, rig.read(LATCHED)), (0, 9001));
    // At rest nothing is latched.
    rig.write(V_TARGET, 0);
    rig.settle();
    rig.write(LATCHED, 0);
    rig.stage.right = Some((0, i32::MAX));
    rig.pins();
    rig.run(MILLISECOND);
    assert_eq!((rig.read(MODE) >> 16, rig.read(LATCHED)), (1, 9001));
}

#[test]
fn latch_with_a_stop() {
    let mut rig = towards_a_switch(RIGHT_NOT_LEFT);
    rig.write(LATCHED, 0);
    rig.run(SECOND);
    assert_eq!((rig.read(LATCHED), rig.chip.position(0)), (5000, 5000));
}

#[test]
fn interrupts() {
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(INTERRUPTS, 0x0100);
    assert!(!rig.chip.interrupt_pin());
    rig.write(X_TARGET, 100);
    rig.settle();
    assert_eq!((rig.read(INTERRUPTS), rig.status()), (0x0101, 0x95));
    assert!(rig.chip.interrupt_pin());
    // A 0 leaves the flag, a 1 clears it; the condition has to come again.
    rig.write(INTERRUPTS, 0x0100);
    assert_eq!(rig.read(INTERRUPTS), 0x0101);
    rig.write(INTERRUPTS, 0x0101);
    assert_eq!((rig.read(INTERRUPTS), rig.status()), (0x0100, 0x15));
    rig.run(SECOND);
    assert_eq!(rig.read(INTERRUPTS), 0x0100);
    // Without its mask a flag is 0.
    rig.write(X_TARGET, 0);
    rig.settle();
    assert_eq!(rig.read(INTERRUPTS), 0x0101);
    rig.write(INTERRUPTS, 0x0200);
    assert_eq!((rig.read(INTERRUPTS), rig.chip.interrupt_pin()), (0x0200, false));
}

#[test]
fn reference_interrupts() {
    let mut rig = Rig::with(VELOCITY, 3, 7, 1000);
    rig.write(TOLERANCE, 50);
    rig.write(INTERRUPTS, 0x0600);
    // The switch is closed from -40 to 40: neither wrong nor missed.
    rig.stage.left = Some((-40, 40));
    rig.write(X_ACTUAL, 0xFF_FF00);
    rig.stage.position = -256;
    rig.write(V_TARGET, 200);
    rig.run(SECOND);
    assert_eq!(rig.read(INTERRUPTS), 0x0600);
    // Closed up to 60: wrong when the position is 51.
    rig.stage.left = Some((-40, 60));
    rig.write(V_TARGET, 0xFFF & 200_u32.wrapping_neg());
    rig.run(2 * SECOND);
    assert_eq!(rig.read(INTERRUPTS), 0x0602);
    // Never closed: missed at 0.
    rig.stage.left = None;
    rig.write(INTERRUPTS, 0x0606);
    rig.write(V_TARGET, 200);
    rig.run(2 * SECOND);
    assert_eq!(rig.read(INTERRUPTS), 0x0604);
}

#[test]
fn switch_edges_interrupt() {
    let mut rig = Rig::new();
    rig.write(0x40 | INTERRUPTS, 0xF000);
    for (pins, flags) in [(0x20, 0x40), (0x30, 0x80), (0x10, 0x10), (0, 0x20)] {
        rig.chip.set_reference_pins(pins);
        assert_eq!(rig.chip.next_event(), Some(rig.now + TICK));
        rig.run(TICK);
        assert_eq!(rig.read(0x40 | INTERRUPTS), 0xF000 | flags);
        rig.write(0x40 | INTERRUPTS, 0xF0FF);
    }
    assert_eq!(rig.chip.next_event(), None);
}

#[test]
fn multiplexed_interrupt_pin() {
    let mut rig = Rig::new();
    rig.write(IF_CONF, 0x20);
    rig.write(INTERRUPTS, 0x0100);
    rig.write(X_TARGET, 5);
    rig.write(X_TARGET, 0);
    assert!(rig.chip.interrupt_pin());
    rig.chip.select(0);
    assert!(!rig.chip.interrupt_pin());
    rig.chip.deselect(0);
    rig.write(IF_CONF, 0x22);
    rig.chip.select(0);
    assert!(rig.chip.interrupt_pin());
}
